// Reference of the noise operations: exact positions in quadruple precision, sums of octaves in double.
#include "tessera/ops/noise.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <string>
#include <vector>

#include "model/gabor_lattice.h"
#include "reference/noise_lattice.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

#ifdef __SIZEOF_FLOAT128__
using Wide = __float128;
#else
using Wide = long double;
#endif

constexpr double kTwo32 = 4294967296.0;

uint32_t Scramble(uint32_t h) {
  h = (h ^ (h >> 16)) * 0x21f0aaadu;
  h = (h ^ (h >> 15)) * 0xd35a2d97u;
  return h ^ (h >> 15);
}
Wide Floor(Wide v) {
  constexpr double kWhole = 0x1p112;  // beyond, every number is whole
  if (!(v < kWhole && v > -kWhole)) return v;
  const Wide whole = static_cast<Wide>(static_cast<__int128>(v));
  return whole > v ? whole - 1 : whole;
}
Wide Modulo(Wide v, Wide m) { return v - Floor(v / m) * m; }

// Where noise is evaluated: coordinates before offsets and octaves.
struct Query {
  std::array<Wide, 4> position = {};
  int channel = 0;
  // Where floats may have gone instead: what is added to a domain warp's displacements, and which of two
  // points that are equally far is the nearer one (1, 2), or the other side of a fold (kOtherSide).
  std::array<double, 4> aside = {};
  int tie = 0;
};
constexpr int kOtherSide = 3;

double MeanSize(const NoiseParams& p) {
  const auto d = static_cast<size_t>(p.dims);
  switch (p.kind) {
    case NoiseKind::kWhite:
      return 0.5;
    case NoiseKind::kValue:
      return std::array{0.0, 0.443, 0.377, 0.330, 0.294}[d];
    case NoiseKind::kGradient:
      return std::array{0.0, 0.23, 0.255, 0.2094, 0.178}[d];
    case NoiseKind::kSimplex:
      return std::array{0.0, 0.0, 0.467, 0.314, 0.2225}[d];
    case NoiseKind::kCell:
      return std::array{0.0, 0.29, 0.43, 0.52, 0.59}[d];
    case NoiseKind::kGabor:
      return 0.26;
    default:
      return 0.25;
  }
}

NoiseValue Sum(const NoiseParams& p, const Query& q, bool on_grid, double step);

// The displacement of a domain warp along an axis.
double Warp(const NoiseParams& p, const Query& q, bool on_grid, double step, int axis) {
  NoiseParams inner = p;
  inner.warp = 0;
  inner.octaves = 1;
  inner.weights.clear();
  inner.kind = NoiseKind::kGradient;
  inner.lattice = NoiseLattice::kTessera;
  inner.fade = NoiseFade::kQuintic;
  inner.sum = NoiseSum::kFbm;
  inner.output = NoiseOutput::kValue;
  inner.is_signed = true;
  inner.antialias = false;
  inner.bias = inner.contrast = 0.5;
  inner.seed = OctaveSeed(p.seed, 1000 + axis, 0);
  return Sum(inner, {q.position}, on_grid, step).value;
}

// The sum of the octaves' sizes; 1 where there are none.
double WeightsOf(const NoiseParams& p) {
  double all = 0, weight = 1;
  for (int k = 0; k < p.octaves; ++k, weight *= p.gain) {
    const auto at = static_cast<size_t>(k);
    all += std::fabs(p.weights.empty() ? weight : at < p.weights.size() ? p.weights[at] : 0.0);
  }
  return all > 0 ? all : 1;
}

double Bend(double t, double bias, double contrast) {
  t = std::clamp(t, 0.0, 1.0);
  if (bias != 0.5) t = std::pow(t, std::log(bias) / std::log(0.5));
  if (contrast == 0.5) return t;
  const double exponent = std::log(1 - contrast) / std::log(0.5);
  return t < 0.5 ? std::pow(2 * t, exponent) / 2 : 1 - std::pow(2 - 2 * t, exponent) / 2;
}

NoiseValue Sum(const NoiseParams& p, const Query& q, bool on_grid, double step) {
  const bool published = p.lattice != NoiseLattice::kTessera;
  const bool color = p.output == NoiseOutput::kColor;
  std::array<double, 4> displacement = {};
  for (int a = 0; a < p.dims && p.warp != 0; ++a) {
    displacement[static_cast<size_t>(a)] =
        p.warp * Warp(p, q, on_grid, step, a) + q.aside[static_cast<size_t>(a)];
  }
  NoiseValue sum;
  sum.scale = 0;
  double scale = 1, weight = 1, steeper = 0;
  for (int k = 0; k < p.octaves; ++k) {
    double w = p.weights.empty()                           ? weight
               : static_cast<size_t>(k) < p.weights.size() ? p.weights[static_cast<size_t>(k)]
                                                           : 0;
    const auto shaped = [&](double n) {
      switch (p.sum) {
        case NoiseSum::kFbm:
          return n;
        case NoiseSum::kTurbulence:
          return std::fabs(n);
        case NoiseSum::kBillow:
          return 2 * std::fabs(n) - 1;
        default:
          return (1 - std::fabs(n)) * (1 - std::fabs(n));
      }
    };
    sum.scale += std::fabs(w);
    if (p.antialias && on_grid && p.kind != NoiseKind::kWhite) {
      const double share = std::clamp(2 - 2 * step * std::max(p.aspect, 1.0) * scale, 0.0, 1.0),
                   size = MeanSize(p);
      const bool zero_mean = p.sum == NoiseSum::kFbm && p.kind != NoiseKind::kCell;
      sum.value += w * (1 - share) * (zero_mean ? 0 : shaped(size));
      w *= share;
    }
    const uint32_t seed = OctaveSeed(p.seed, k, published ? 0 : color ? q.channel : 0);
    NoisePlace place;
    std::array<uint32_t, 4> period = {};
    for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
      double offset = p.offset[a];
      if (published && p.seed != 0)
        offset += Scramble(p.seed + 0x9e3779b9u * static_cast<uint32_t>(a)) & 0xffff;
      Wide base = q.position[a] + offset;
      double octave_period = p.period[a] * scale, per_unit = scale;
      if (p.kind == NoiseKind::kGabor) {
        const model::GaborCells cells = model::CellsOfGabor(p.bandwidth, p.period[a]);
        octave_period = cells.period * scale;
        per_unit = cells.per_wave * scale;
      }
      if (p.period[a] > 0) base = Modulo(base, p.period[a]);
      if (octave_period >= kTwo32) octave_period = 0;
      const double shift = k > 0 && !published ? OctaveSeed(seed, static_cast<int>(a), 1) / kTwo32 : 0;
      const Wide position = (base + displacement[a]) * per_unit + shift;
      const Wide whole = Floor(position);
      place.fraction[a] = static_cast<double>(position - whole);
      place.cell[a] = static_cast<uint32_t>(
          static_cast<double>(Modulo(whole, octave_period > 0 ? octave_period : kTwo32)));
      period[a] = static_cast<uint32_t>(octave_period);
    }
    const int channel = p.lattice == NoiseLattice::kOsl && color ? q.channel : -1;
    if (w != 0) {
      const NoiseValue n = EvaluateNoise(p, seed, period, channel, place, q.tie == kOtherSide ? 0 : q.tie);
      sum.value += w * shaped(n.value);
      const double shape_slope = p.sum == NoiseSum::kFbm || p.sum == NoiseSum::kTurbulence ? 1 : 2;
      sum.scale += std::fabs(w) * (n.scale - 1) * shape_slope;
      steeper += std::fabs(w) * std::max(0.0, n.slope_scale - n.scale) * shape_slope;
      sum.scale += std::fabs(w) * (shape_slope - 1 + 4 * std::fabs(p.warp) * scale);
      double sign = n.value > 0 ? 1 : n.value < 0 ? -1 : 0;
      // At a fold, within what a float's value is off by.
      if (q.tie == kOtherSide && std::fabs(n.value) < n.scale * 0x1p-20) sign = n.value > 0 ? -1 : 1;
      const double factor = p.sum == NoiseSum::kFbm          ? 1
                            : p.sum == NoiseSum::kTurbulence ? sign
                            : p.sum == NoiseSum::kBillow     ? 2 * sign
                                                             : -2 * sign * (1 - std::fabs(n.value));
      for (size_t a = 0; a < 4; ++a) sum.slope[a] += w * scale * factor * n.slope[a];
    }
    scale *= p.lacunarity;
    weight *= p.gain;
  }
  sum.slope_scale = sum.scale + steeper;
  const bool absolute = p.sum == NoiseSum::kBillow || p.sum == NoiseSum::kRidged;
  if (!p.is_signed && absolute) {
    // Shares of the weights, in [0, 1] and [-1, 1].
    const double all = WeightsOf(p);
    sum.value /= all;
    for (double& slope : sum.slope) slope /= all;
  }
  if (!p.is_signed &&
      (p.sum == NoiseSum::kBillow || (p.sum == NoiseSum::kFbm && p.kind != NoiseKind::kCell))) {
    sum.value = 0.5 + 0.5 * sum.value;
    for (double& slope : sum.slope) slope *= 0.5;
  }
  if (p.output != NoiseOutput::kGradient && p.output != NoiseOutput::kNormal &&
      (p.bias != 0.5 || p.contrast != 0.5)) {
    const auto bent = [&](double v) {
      return p.is_signed ? 2 * Bend(0.5 + 0.5 * v, p.bias, p.contrast) - 1 : Bend(v, p.bias, p.contrast);
    };
    // The bend is as steep as one likes near 0, 0.5 and 1: what it makes of the sum's own error, and a
    // rounding.
    const double error = (sum.scale + 1) * 0x1p-20, value = bent(sum.value);
    const double spread =
        std::max(std::fabs(bent(sum.value + error) - value), std::fabs(bent(sum.value - error) - value));
    sum.value = value;
    sum.scale = spread * 0x1p20 + 1;
  }
  return sum;
}

// What floats may have instead, where a value hangs on a decision: in which cell a displaced position lies,
// which of two points is the nearest, on which side of a fold a value is. `sum` gives the noise of a query.
template <typename SumOf>
std::vector<NoiseValue> Others(const NoiseParams& p, const Query& q, const SumOf& sum) {
  std::vector<NoiseValue> others;
  const bool slopes = p.output == NoiseOutput::kGradient || p.output == NoiseOutput::kNormal;
  if (slopes && p.sum != NoiseSum::kFbm) {
    Query aside = q;
    aside.tie = kOtherSide;
    others.push_back(sum(aside));
  }
  if (p.kind != NoiseKind::kWhite && p.kind != NoiseKind::kCell) return others;
  // A displacement is a noise within its own bound, times warp, added to a position in floats.
  const double off = std::fabs(p.warp) * 1e-6 + (1 + std::fabs(p.warp)) * 0x1p-23;
  for (int corner = 0; corner < 1 << p.dims && p.warp != 0; ++corner) {
    Query aside = q;
    for (int a = 0; a < p.dims; ++a)
      aside.aside[static_cast<size_t>(a)] = (corner >> a & 1) != 0 ? off : -off;
    others.push_back(sum(aside));
  }
  for (int tie = 1; tie <= 2 && slopes && p.kind == NoiseKind::kCell; ++tie) {
    Query aside = q;
    aside.tie = tie;
    others.push_back(sum(aside));
  }
  return others;
}

// The parameters of one channel's field.
NoiseParams ChannelParams(const NoiseParams& p, int c) {
  if (p.output != NoiseOutput::kOctaves) return p;
  NoiseParams one = p;
  one.octaves = c < p.octaves ? c + 1 : 0;
  one.weights.assign(static_cast<size_t>(one.octaves), 0.0);
  if (one.octaves > 0) one.weights.back() = 1;
  return one;
}
bool FieldPerChannel(const NoiseParams& p) {
  return p.output == NoiseOutput::kColor || p.output == NoiseOutput::kOctaves;
}

// value or slope of the channel of a result, with its error's scale.
std::pair<double, double> Channel(const NoiseParams& p, const NoiseValue& n, int c, int alpha) {
  // 0.5 is added in the unsigned forms.
  const double scale = std::max(n.scale, 1.0), slope_scale = std::max(n.slope_scale, 1.0);
  const bool normal = p.output == NoiseOutput::kNormal;
  if (p.output == NoiseOutput::kOctaves) return {n.value, scale};
  if (p.output != NoiseOutput::kGradient && !normal) {
    if (c == alpha) return {1.0, 1.0};
    return {n.value, scale};
  }
  if (c == (normal ? 3 : 0)) return {n.value, scale};
  if (c > (normal ? 3 : p.dims)) return {0.0, 0.0};
  double steepness = 0, frequency = 1, weight = 1;
  for (int k = 0; k < p.octaves; ++k, frequency *= p.lacunarity, weight *= p.gain)
    steepness += 8 * frequency * weight;
  if (!normal) return {n.slope[static_cast<size_t>(c - 1)], steepness * slope_scale};
  const auto axis = static_cast<size_t>(c);
  double square = 0;
  for (size_t a = 0; a < 3 && static_cast<int>(a) < p.dims; ++a) square += n.slope[a] * n.slope[a];
  const double length = std::sqrt(square), half = p.is_signed ? 1 : 0.5;
  const double direction = c < p.dims && length > 0 ? n.slope[axis] / length : 0;
  // Where the gradient vanishes its direction is anything.
  const double error = std::min(4 * steepness * slope_scale / std::max(length, 1e-30), 0x1p25);
  return {half * direction + (1 - half), 2 + error};
}

void EvaluateGrid(const Call& call) {
  const auto& p = std::any_cast<const NoiseParams&>(call.parameters);
  const double step = p.frequency > 0 ? p.frequency / std::max(p.frame.width(), 1) : 1;
  const int height = std::max(p.frame.height() / p.slices, 1);
  // Channels of a pixel share one noise, except in colour.
  NoiseValue kept;
  std::vector<NoiseValue> others;
  const auto decided = [&](int x, int y, int c) {
    const std::pair<double, double> here = Channel(p, kept, c, call.out_spec.alpha);
    for (const NoiseValue& other : others)
      call.Undecided(x, y, c, std::fabs(Channel(p, other, c, call.out_spec.alpha).first - here.first));
    return here;
  };
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    if (c > 0 && !FieldPerChannel(p)) return decided(x, y, c);
    int slice = 0, row = y - p.frame.y0;
    if (p.slices > 1) {
      slice = std::clamp(static_cast<int>(std::floor(static_cast<double>(row) / height)), 0, p.slices - 1);
      row -= slice * height;
    }
    Query q;
    q.position = {static_cast<Wide>(x - p.frame.x0 + 0.5) * (step * p.aspect),
                  static_cast<Wide>(row + 0.5) * step, static_cast<Wide>(slice) * step, 0};
    q.channel = c;
    const NoiseParams own = ChannelParams(p, c);
    const auto sum = [&](const Query& at) { return Sum(own, at, true, step); };
    kept = sum(q);
    if (call.undecided != nullptr) others = Others(own, q, sum);
    return decided(x, y, c);
  });
}

// A position's own period, from a picture.
int OwnPeriod(const NoiseParams& p, double v) {
  const double octaves = std::max(p.octaves - 1, 0);
  const double longest = p.kind == NoiseKind::kSimplex ? 0x1p20 / std::pow(p.lacunarity, octaves) : 0x1p24;
  const double whole = std::floor(v);
  return whole >= 1 && whole <= longest ? static_cast<int>(whole) : 0;
}

void EvaluateAt(const Call& call) {
  const auto& p = std::any_cast<const NoiseParams&>(call.parameters);
  const ImageD& in = call.in[0];
  const bool two_parts = p.low_parts;
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    Query q;
    bool finite = true;
    for (int a = 0; a < p.dims; ++a) {
      Wide position = in.at(x, y, a);
      finite = finite && std::fabs(in.at(x, y, a)) < 0x1p100;
      if (two_parts) {
        position += in.at(x, y, p.dims + a);
        finite = finite && std::fabs(in.at(x, y, p.dims + a)) < 0x1p100;
      }
      q.position[static_cast<size_t>(a)] =
          finite ? position * (a == 0 ? p.frequency * p.aspect : p.frequency) : 0;
    }
    q.channel = c;
    if (finite) {
      NoiseParams own = ChannelParams(p, c);
      for (int a = 0; a < p.dims && call.in.size() > 1; ++a) {
        const ImageD& periods = call.in[1];
        own.period[static_cast<size_t>(a)] = OwnPeriod(p, periods.at(x, y, periods.channels > 1 ? a : 0));
      }
      const auto sum = [&](const Query& at) { return Sum(own, at, false, p.frequency); };
      const NoiseValue n = sum(q);
      // A position that is no float, or that is off, has no bits that could be hashed alike; nor have further
      // octaves, which are moved apart by a fraction.
      bool hashed_alike = p.octaves == 1 || p.lattice != NoiseLattice::kTessera;
      for (int a = 0; a < p.dims && p.kind == NoiseKind::kHash; ++a) {
        const auto axis = static_cast<size_t>(a);
        const Wide position = q.position[axis] + p.offset[axis];
        hashed_alike = hashed_alike && position == static_cast<Wide>(static_cast<float>(position)) &&
                       call.Tolerance(0, x, y, a) == 0;
      }
      if (p.kind == NoiseKind::kHash && !hashed_alike) call.Undecided(x, y, c, kUnknownJump);
      const std::pair<double, double> result = Channel(p, n, c, call.out_spec.alpha);
      if (call.undecided != nullptr) {
        for (const NoiseValue& other : Others(own, q, sum))
          call.Undecided(x, y, c, std::fabs(Channel(p, other, c, call.out_spec.alpha).first - result.first));
      }
      double slope = 0, frequency = 1, weight = 1;
      for (int k = 0; k < p.octaves; ++k, frequency *= p.lacunarity, weight *= p.gain)
        slope += frequency * weight;
      return {result.first, 2 * result.second + slope};
    }
    // Noise 0 in every octave.
    const NoiseParams own = ChannelParams(p, c);
    NoiseParams none = own;
    none.octaves = 0;
    NoiseValue n = Sum(none, q, false, p.frequency);
    double weight = 1;
    for (int k = 0; k < own.octaves; ++k, weight *= p.gain) {
      const double w = own.weights.empty()                           ? weight
                       : static_cast<size_t>(k) < own.weights.size() ? own.weights[static_cast<size_t>(k)]
                                                                     : 0;
      const double share = p.is_signed ? w : w / WeightsOf(own);
      if (p.sum == NoiseSum::kBillow) n.value -= p.is_signed ? share : 0.5 * share;
      if (p.sum == NoiseSum::kRidged) n.value += share;
    }
    return Channel(p, n, c, call.out_spec.alpha);
  });
}

}  // namespace

uint32_t OctaveSeed(uint32_t seed, int octave, int channel) {
  return Scramble(Scramble(seed + 0x9e3779b9u * static_cast<uint32_t>(channel)) +
                  0x85ebca6bu * static_cast<uint32_t>(octave));
}

NoiseValue GridNoise(const NoiseParams& p, int x, int y, double right, double down) {
  const double width = std::max(p.frame.width(), 1), step = p.frequency > 0 ? p.frequency / width : 1;
  Query q;
  q.position = {static_cast<Wide>(x - p.frame.x0 + 0.5 + right * width) * (step * p.aspect),
                static_cast<Wide>(y - p.frame.y0 + 0.5 + down * width) * step, 0, 0};
  return Sum(p, q, true, step);
}

std::vector<Entry> NoiseEntries() {
  std::vector<Entry> entries;
  for (const char* name :
       {"white", "value", "perlin", "simplex", "cell", "sparse", "spot", "hash", "gabor"}) {
    entries.push_back({name, EvaluateGrid});
  }
  entries.push_back({"noiseat", EvaluateAt});
  return entries;
}

}  // namespace tessera::reference
