// Checks a noise's parameters and works them out.
#include "ops/noise/plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/number_text.h"
#include "base/turn.h"
#include "model/gabor_lattice.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr double kTwo32 = 4294967296.0;

uint32_t Scramble(uint32_t h) {
  h = (h ^ (h >> 16)) * 0x21f0aaadu;
  h = (h ^ (h >> 15)) * 0xd35a2d97u;
  return h ^ (h >> 15);
}

// The inverse of the largest sum of gradients in each number of dimensions, for the three fades.
constexpr double kGradientScale[3][5] = {{0, 2, 1.41421356237, 0.96492117, 0.65079493},
                                         {0, 2, 1.41421356237, 0.95702458, 0.64716532},
                                         {0, 2, 1.41421356237, 0.93911873, 0.63884970}};
constexpr double kOslScale[5] = {0, 0.25, 0.6616, 0.982, 0.8344};
constexpr double kSimplexScale[5] = {0, 3.1604938, 99.204, 76.88, 62.777};
constexpr double kOslSimplexScale[5] = {0, 0.36, 64, 68, 54};

// Integral of the squared kernel over space, (1 - r^2)^(2 * power), in each number of dimensions.
double KernelEnergy(int dims, int power) {
  const double sphere[] = {0, 2, 2 * std::numbers::pi, 4 * std::numbers::pi,
                           2 * std::numbers::pi * std::numbers::pi};
  // integral of r^(dims-1) (1-r^2)^(2 power) dr = Beta(dims/2, 2 power + 1) / 2.
  const double a = dims / 2.0, b = 2.0 * power + 1;
  return sphere[dims] * 0.5 * std::exp(std::lgamma(a) + std::lgamma(b) - std::lgamma(a + b));
}

NoiseShape ShapeOf(const NoiseParams& p) {
  NoiseShape shape;
  shape.fade = static_cast<int>(p.fade);
  shape.distance = p.distance;
  shape.jitter = static_cast<float>(p.jitter);
  double scale = 1;
  if (p.kind == NoiseKind::kGradient) {
    scale = p.lattice == NoiseLattice::kOsl ? kOslScale[p.dims] : kGradientScale[shape.fade][p.dims];
  } else if (p.kind == NoiseKind::kSimplex) {
    scale = p.lattice == NoiseLattice::kOsl ? kOslSimplexScale[p.dims] : kSimplexScale[p.dims];
  } else if (p.kind == NoiseKind::kSparse || p.kind == NoiseKind::kSpot) {
    const bool spot = p.kind == NoiseKind::kSpot;
    const double heights = spot ? 1 : 1.0 / 3;
    // A spot of length 1 and width 1 / stretch.
    const double area = KernelEnergy(p.dims, spot ? 2 : 3) / (spot && p.dims > 1 ? p.stretch : 1);
    scale = 1 / (3 * std::sqrt(p.density * heights * area));  // Campbell: variance = density * heights * area
    double probability = std::exp(-p.density), sum = probability;
    for (int m = 0; m < kMaxImpulses; ++m) {  // more than m impulses when the number reaches the sum so far
      shape.poisson[m] = static_cast<uint32_t>(std::min(sum * kTwo32, kTwo32 - 1));
      probability *= p.density / (m + 1);
      sum += probability;
    }
    shape.poisson[kMaxImpulses - 1] = 0xffffffffu;
    const base::Turn turn = base::TurnOf(p.angle);
    const double c = turn.cosine, s = -turn.sine;  // y is down
    shape.spot[0] = static_cast<float>(c * c + p.stretch * s * s);
    shape.spot[1] = static_cast<float>((1 - p.stretch) * c * s);
    shape.spot[2] = static_cast<float>(s * s + p.stretch * c * c);
  }
  if (p.kind == NoiseKind::kGabor) {
    shape.gabor = GaborShapeOf(p);
    scale = GaborHeight(p, shape.gabor);
  }
  shape.scale = static_cast<float>(scale);
  return shape;
}

void Require(bool valid, const std::string& op, const std::string& name, double found,
             const std::string& expected) {
  if (valid) return;
  throw Error(op + ":" + name, "found " + base::NumberText(found) + ", expected " + expected);
}

// The share of an octave that is left at `cells` per pixel.
double NyquistShare(double cells) { return std::clamp(2 - 2 * cells, 0.0, 1.0); }

}  // namespace

SimplexShear::SimplexShear(int dims, const uint32_t* period) {
  for (int a = 0; a < dims; ++a) {
    const int j = dims - 1 - a;  // the factor's column, from the last axis
    const double length = period[a] != 0 ? period[a] : kLongestSimplexPeriod;
    for (int row = 0; row <= a; ++row) {
      const double entry = dims == 1  ? 1
                           : row == a ? std::sqrt((j + 2.0) / (j + 1))
                                      : 1 / std::sqrt((j + 1.0) * (j + 2));
      const double whole = std::round(entry * length);
      steps[row][a] = static_cast<float>(whole);
      factor[row][a] = whole / length;
    }
  }
}

uint32_t OctaveSeed(uint32_t seed, int octave, int channel) {
  return Scramble(Scramble(seed + 0x9e3779b9u * static_cast<uint32_t>(channel)) +
                  0x85ebca6bu * static_cast<uint32_t>(octave));
}

double MeanSize(NoiseKind kind, int dims) {
  constexpr double kGradient[5] = {0, 0.23, 0.255, 0.2094, 0.178};
  constexpr double kValue[5] = {0, 0.443, 0.377, 0.330, 0.294};
  constexpr double kSimplex[5] = {0, 0.32, 0.467, 0.314, 0.2225};
  constexpr double kCell[5] = {0, 0.29, 0.43, 0.52, 0.59};
  switch (kind) {
    case NoiseKind::kWhite:
      return 0.5;
    case NoiseKind::kValue:
      return kValue[dims];
    case NoiseKind::kGradient:
      return kGradient[dims];
    case NoiseKind::kSimplex:
      return kSimplex[dims];
    case NoiseKind::kCell:
      return kCell[dims];
    case NoiseKind::kGabor:
      return 0.26;
    default:
      return 0.25;
  }
}

std::pair<double, double> ResultRange(const NoiseParams& p) {
  if (p.is_signed) return {1, 0};
  if (p.sum == NoiseSum::kFbm && p.kind != NoiseKind::kCell) return {0.5, 0.5};
  if (p.sum != NoiseSum::kBillow && p.sum != NoiseSum::kRidged) return {1, 0};
  double all = 0, weight = 1;
  for (int k = 0; k < p.octaves; ++k, weight *= p.gain) {
    const auto index = static_cast<size_t>(k);
    all += std::fabs(p.weights.empty() ? weight : index < p.weights.size() ? p.weights[index] : 0);
  }
  const double share = all > 0 ? 1 / all : 1;
  if (p.sum == NoiseSum::kRidged) return {share, 0};
  return {0.5 * share, 0.5};
}

bool HasFieldPerChannel(const NoiseParams& params) {
  return params.output == NoiseOutput::kColor || params.output == NoiseOutput::kOctaves;
}

NoiseParams FieldParams(const NoiseParams& params, int channel) {
  if (params.output != NoiseOutput::kOctaves) return params;
  NoiseParams one = params;  // the octave alone
  one.output = NoiseOutput::kValue;
  one.octaves = channel < params.octaves ? channel + 1 : 0;
  one.weights.assign(static_cast<size_t>(one.octaves), 0.0);
  if (one.octaves > 0) one.weights.back() = 1;
  return one;
}

void CheckNoise(const std::string& op, const NoiseParams& p) {
  Require(p.dims >= 1 && p.dims <= 4, op, "dims", p.dims, "1 to 4");
  Require(p.frequency >= 0 && p.frequency <= 0x1p40, op, "freq", p.frequency, "0 to 2^40 cells");
  Require(p.aspect >= 1e-3 && p.aspect <= 1e3, op, "aspect", p.aspect, "0.001 to 1000");
  for (double v : p.offset) Require(std::fabs(v) <= 0x1p40, op, "offset", v, "numbers within 2^40 cells");
  Require(p.octaves >= 0 && p.octaves <= 64, op, "octaves", p.octaves, "0 to 64");
  Require(p.lacunarity >= 1 && p.lacunarity <= 16, op, "lacunarity", p.lacunarity, "1 to 16");
  Require(p.gain >= 0 && p.gain <= 4, op, "gain", p.gain, "0 to 4");
  for (double w : p.weights) Require(std::fabs(w) <= 1e6, op, "weights", w, "numbers within 1e6");
  Require(std::fabs(p.warp) <= 1e4, op, "warp", p.warp, "-10000 to 10000 cells");
  Require(p.jitter >= 0 && p.jitter <= 1, op, "jitter", p.jitter, "0 to 1");
  Require(p.density > 0 && p.density <= 8, op, "density", p.density, "more than 0, at most 8");
  Require(p.stretch >= 1 && p.stretch <= 64, op, "stretch", p.stretch, "1 to 64");
  Require(std::fabs(p.angle) <= 1e9, op, "angle", p.angle, "degrees within 1e9");
  Require(p.bias > 0 && p.bias < 1, op, "bias", p.bias, "a number between 0 and 1");
  Require(p.contrast > 0 && p.contrast < 1, op, "contrast", p.contrast, "a number between 0 and 1");
  Require(p.slices >= 1, op, "slices", p.slices, "1 or more");
  Require(p.slices == 1 || p.dims >= 3, op, "slices", p.slices,
          "1 where dims is below 3: slices lie along the third coordinate");
  if (p.kind == NoiseKind::kGabor) CheckGabor(op, p);
  const bool published = p.lattice != NoiseLattice::kTessera;
  if (p.lattice == NoiseLattice::kPerlin && (p.kind != NoiseKind::kGradient || p.dims > 3)) {
    throw Error(op + ":lattice",
                "found perlin, which is published for gradient noise in 1 to 3 dimensions only");
  }
  if (p.lattice == NoiseLattice::kOsl && p.kind != NoiseKind::kGradient && p.kind != NoiseKind::kWhite &&
      p.kind != NoiseKind::kSimplex && p.kind != NoiseKind::kHash) {
    throw Error(
        op + ":lattice",
        "found osl, expected it with gradient (OSL's perlin), white (cellnoise), simplex or hash noise");
  }
  if (p.kind == NoiseKind::kHash && p.warp != 0) {
    throw Error(op + ":warp", "found a domain warp, expected none for hash noise, which has no smoothness");
  }
  if (published && p.fade != NoiseFade::kQuintic) {
    throw Error(op + ":fade", "found another fade than quintic, which is what the published lattices have");
  }
  for (int a = 0; a < 4; ++a) {
    const int period = p.period[static_cast<size_t>(a)];
    Require(period >= 0 && period <= 1 << 24, op, "period", period, "0 to 2^24 cells");
    if (period == 0) continue;
    if (p.kind == NoiseKind::kSimplex) {
      Require(!published, op, "period", period, "none for OSL's simplex noise, which has no periodic form");
      Require(period * std::pow(p.lacunarity, std::max(p.octaves - 1, 0)) <= kLongestSimplexPeriod, op,
              "period", period, "at most 2^20 cells in the highest octave of simplex noise");
    }
    Require(p.lattice != NoiseLattice::kPerlin, op, "period", period,
            "none for lattice perlin: it repeats after 256 cells");
    Require(p.octaves < 2 || p.lacunarity == std::floor(p.lacunarity), op, "lacunarity", p.lacunarity,
            "a whole number where there is a period, or octaves would not repeat with it");
  }
}

void CheckPacking(const std::string& op, const NoiseParams& p, int channels) {
  if (p.output != NoiseOutput::kOctaves || p.octaves >= channels) return;
  const std::string needed = std::to_string(channels);
  throw Error(op + ":pack", "found " + std::to_string(p.octaves) + " octaves for " + needed +
                                " channels, expected octaves=" + needed +
                                " or more: every channel holds one");
}

NoisePlan MakeNoisePlan(const NoiseParams& params, bool on_grid, int channel) {
  NoisePlan plan;
  plan.params = params;
  plan.shape = ShapeOf(params);
  const int width = params.frame.width();
  const double step = !on_grid               ? params.frequency
                      : params.frequency > 0 ? params.frequency / std::max(width, 1)
                                             : 1.0;
  for (int a = 0; a < 4; ++a) plan.step[a] = a == 0 ? step * params.aspect : step;
  const bool published = params.lattice != NoiseLattice::kTessera;
  if (published && params.output == NoiseOutput::kColor && channel > 0) plan.shape.channel = channel;
  if (params.lattice == NoiseLattice::kOsl && params.output == NoiseOutput::kColor)
    plan.shape.channel = channel;
  for (int a = 0; a < 4; ++a) {
    plan.shift[a] = params.offset[static_cast<size_t>(a)];
    if (published && params.seed != 0) {
      plan.shift[a] += Scramble(params.seed + 0x9e3779b9u * static_cast<uint32_t>(a)) & 0xffff;
    }
  }
  const auto [range, middle] = ResultRange(params);
  double scale = 1, weight = 1, bias = middle;
  const double size = MeanSize(params.kind, params.dims);
  const double means[] = {params.kind == NoiseKind::kCell ? size : 0, size, 2 * size - 1,
                          (1 - size) * (1 - size)};
  for (int k = 0; k < params.octaves; ++k) {
    NoiseOctave octave;
    octave.scale = scale;
    const auto index = static_cast<size_t>(k);
    double w = params.weights.empty() ? weight : index < params.weights.size() ? params.weights[index] : 0;
    if (params.antialias && on_grid && params.kind != NoiseKind::kWhite) {
      const double share = NyquistShare(std::max(plan.step[0], step) * scale);
      bias += range * w * (1 - share) * means[static_cast<int>(params.sum)];
      w *= share;
    }
    octave.weight = static_cast<float>(range * w);
    octave.seed = OctaveSeed(params.seed, k, published ? 0 : channel);
    for (int a = 0; a < 4; ++a) {
      if (k > 0 && !published) octave.shift[a] = OctaveSeed(octave.seed, a, 1) / kTwo32;
      double period = params.period[static_cast<size_t>(a)];
      octave.lattice[a] = scale;
      if (params.kind == NoiseKind::kGabor) {
        const model::GaborCells cells =
            model::CellsOfGabor(params.bandwidth, params.period[static_cast<size_t>(a)]);
        octave.lattice[a] = cells.per_wave * scale;
        period = cells.period;
      }
      period *= scale;
      octave.period[a] = period < kTwo32 ? static_cast<uint32_t>(period) : 0;
    }
    if (octave.weight != 0) plan.octaves.push_back(octave);
    scale *= params.lacunarity;
    weight *= params.gain;
  }
  plan.bias = static_cast<float>(bias);
  return plan;
}

int PixelsPerCell(const NoisePlan& plan, const NoiseOctave& octave) {
  const double pixels = 1 / (plan.step[0] * octave.scale), whole = std::round(pixels);
  const bool square = plan.step[0] == plan.step[1];
  return square && whole >= 1 && whole <= 65536 && std::fabs(pixels - whole) < 1e-6 ? static_cast<int>(whole)
                                                                                    : 0;
}

LatticePlace PlaceOf(const NoisePlan& plan, const NoiseOctave& octave, int axis, double units) {
  // units * step + shift as a sum of two doubles.
  double high = units * plan.step[axis], low = std::fma(units, plan.step[axis], -high);
  const auto add = [&](double value) {
    const double sum = high + value, back = sum - high;
    low += (high - (sum - back)) + (value - back);
    high = sum;
  };
  add(plan.shift[axis]);
  const int period = plan.params.period[static_cast<size_t>(axis)];
  if (period > 0) {
    high = std::fmod(high, period);
    if (high < 0) add(period);
  }
  const double scale = octave.lattice[axis], product = high * scale;
  low = std::fma(high, scale, -product) + low * scale;
  // Modulo the period of the lattice, or of its integers. Whole numbers of 62 bits are the common case.
  if (std::fabs(product) < 0x1p62) {
    const auto floor_of = [](double v) {
      const auto whole = static_cast<int64_t>(v);
      return static_cast<double>(whole) > v ? whole - 1 : whole;
    };
    const int64_t whole = floor_of(product);
    double fraction = (product - static_cast<double>(whole)) + low + octave.shift[axis];
    const int64_t carry = floor_of(fraction);
    fraction -= static_cast<double>(carry);
    const int64_t modulus = octave.period[axis];
    if (modulus == 0) return {static_cast<uint32_t>(whole + carry), fraction};
    const int64_t cell = (whole + carry) % modulus;
    return {static_cast<uint32_t>(cell < 0 ? cell + modulus : cell), fraction};
  }
  const double whole = std::floor(product);
  double fraction = (product - whole) + low + octave.shift[axis];
  const double carry = std::floor(fraction);
  fraction -= carry;
  const double modulus = octave.period[axis] != 0 ? octave.period[axis] : kTwo32;
  double cell = std::fmod(std::fmod(whole, modulus) + carry, modulus);
  if (cell < 0) cell += modulus;
  return {static_cast<uint32_t>(cell), fraction};
}

}  // namespace tessera::ops
