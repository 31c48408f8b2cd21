// Noise of one octave in double precision.
#include "reference/noise_lattice.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/gabor_lattice.h"

namespace tessera::reference {
namespace {

using Cells = NoiseCells;
using Vector = NoiseVector;

uint32_t Mix(uint32_t h) {
  h *= 0x2c1b3c6du;
  h ^= h >> 15;
  return h * 0x297a2d39u;
}
uint32_t Next(uint32_t h, int k) { return Mix((h ^ (h >> 16)) + static_cast<uint32_t>(k) * 0x9e3779b9u); }
double SignedUnit(uint32_t h) { return std::ldexp(static_cast<int32_t>(h), -31); }
double Unit(uint32_t h) { return std::ldexp(h >> 8, -24); }

uint32_t Rotated(uint32_t v, int k) { return v << k | v >> (32 - k); }

}  // namespace

uint32_t LatticeHash(const Cells& cell, int dims, uint32_t seed) {
  constexpr uint32_t kAxis[4] = {0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du, 0x27d4eb2fu};
  uint32_t h = seed;
  for (int a = 0; a < dims; ++a) h ^= cell[static_cast<size_t>(a)] * kAxis[a];
  return Mix(h);
}
NoiseVector LatticeGradient(uint32_t h, int dims) {
  const auto sign = [h](int bit) { return (h >> bit & 1) != 0 ? -1.0 : 1.0; };
  if (dims == 1) return {SignedUnit(h)};
  if (dims == 2) {
    const double angle = (h >> 30) * std::numbers::pi / 2 + SignedUnit(h << 2) * std::numbers::pi / 4;
    return {std::cos(angle), std::sin(angle)};
  }
  if (dims == 3) {
    const uint32_t edge = (h >> 16) * 12 >> 16;
    const double s1 = (edge & 1) != 0 ? -1 : 1, s2 = (edge & 2) != 0 ? -1 : 1;
    if (edge < 4) return {0, s1, s2};
    if (edge < 8) return {s1, 0, s2};
    return {s1, s2, 0};
  }
  Vector g = {sign(29), sign(28), sign(27), sign(26)};
  g[h >> 30] = 0;
  return g;
}

uint32_t JenkinsFinal(uint32_t a, uint32_t b, uint32_t c) {
  c ^= b, c -= Rotated(b, 14);
  a ^= c, a -= Rotated(c, 11);
  b ^= a, b -= Rotated(a, 25);
  c ^= b, c -= Rotated(b, 16);
  a ^= c, a -= Rotated(c, 4);
  b ^= a, b -= Rotated(a, 14);
  c ^= b, c -= Rotated(b, 24);
  return c;
}

NoiseVector OslGradient(uint32_t h, int dims) {
  // A dot product with chosen coordinates, written as the vector it belongs to.
  Vector g = {};
  const double s1 = (h & 1) != 0 ? -1 : 1, s2 = (h & 2) != 0 ? -1 : 1, s3 = (h & 4) != 0 ? -1 : 1;
  if (dims == 1) {
    g[0] = (1.0 + (h & 7)) * ((h & 8) != 0 ? -1 : 1);
  } else if (dims == 2) {
    const uint32_t k = h & 7;
    g[k < 4 ? 0 : 1] += s1;
    g[k < 4 ? 1 : 0] += 2 * s2;
  } else if (dims == 3) {
    const uint32_t k = h & 15;
    g[k < 8 ? 0 : 1] += s1;
    g[k < 4 ? 1 : k == 12 || k == 14 ? 0 : 2] += s2;
  } else {
    const uint32_t k = h & 31;
    g[k < 24 ? 0 : 1] += s1;
    g[k < 16 ? 1 : 2] += s2;
    g[k < 8 ? 2 : 3] += s3;
  }
  return g;
}

namespace {

// Bob Jenkins' lookup3 on `words`, initial value 13.
uint32_t Jenkins(const std::vector<uint32_t>& words) {
  const auto rotate = Rotated;
  uint32_t a = 0xdeadbeefu + (static_cast<uint32_t>(words.size()) << 2) + 13, b = a, c = a;
  size_t i = 0;
  if (words.size() > 3) {
    a += words[0], b += words[1], c += words[2];
    a -= c, a ^= rotate(c, 4), c += b;
    b -= a, b ^= rotate(a, 6), a += c;
    c -= b, c ^= rotate(b, 8), b += a;
    a -= c, a ^= rotate(c, 16), c += b;
    b -= a, b ^= rotate(a, 19), a += c;
    c -= b, c ^= rotate(b, 4), b += a;
    i = 3;
  }
  if (i < words.size()) a += words[i];
  if (i + 1 < words.size()) b += words[i + 1];
  if (i + 2 < words.size()) c += words[i + 2];
  return JenkinsFinal(a, b, c);
}

// Perlin's permutation, built from the order in which it lists 0..255.
const std::array<int, 256>& PerlinPermutation() {
  static const std::array<int, 256> kTable = [] {
    const char* const hex =
        "97a0895b5a0f830dc95f6035c2e907e18c24671e458e086325f0150a17be0694f778ea4b001ac53e5efcdbcb75230b2039b12158ed953857ae147d88aba844af4aa547868b301ba64d929ee7536fe57a3cd385e6dc695c29372ef528f4668f3641193fa101d85049d14c84bbd05912a9c8c4878274bc9f56a4646dc6adba034034d9e2fa7c7b05ca2693767eff5255d4cfce3be32f103a11b6bd1c2adfb7aad577f898022c9aa346dd99659ba72bac09811627fd13626c6e4f71e0e8b2b97068daf661e4fb22f2c1eed2900cbfb3a2f1513391ebf90eef6b31c0d61fb5c76a9db854ccb07379322d7f0496fe8aeccd5dde72431d1848f38d80c34e42d73d9cb4";
    std::array<int, 256> table = {};
    size_t n = 0;
    int high = -1;
    for (const char* c = hex; *c != 0; ++c) {
      const int digit = *c <= '9' ? *c - '0' : *c - 'a' + 10;
      if (high < 0) {
        high = digit;
      } else {
        table.at(n++) = 16 * high + digit;
        high = -1;
      }
    }
    return table;
  }();
  return kTable;
}
Vector PerlinGradient(const Cells& cell) {
  const auto& p = PerlinPermutation();
  const auto at = [&](uint32_t i) { return static_cast<uint32_t>(p[i & 255]); };
  const uint32_t h = at(at(at(cell[0]) + cell[1]) + cell[2]) & 15;
  // The published grad(): u and v picked from x, y, z.
  Vector g = {};
  g[h < 8 ? 0 : 1] += (h & 1) == 0 ? 1 : -1;
  g[h < 4 ? 1 : h == 12 || h == 14 ? 0 : 2] += (h & 2) == 0 ? 1 : -1;
  return g;
}

double Fade(double t, NoiseFade kind) {
  if (kind == NoiseFade::kLinear) return t;
  if (kind == NoiseFade::kCubic) return t * t * (3 - 2 * t);
  return t * t * t * (t * (t * 6 - 15) + 10);
}
double FadeSlope(double t, NoiseFade kind) {
  if (kind == NoiseFade::kLinear) return 1;
  if (kind == NoiseFade::kCubic) return 6 * t * (1 - t);
  return 30 * t * t * (1 - t) * (1 - t);
}

double GradientScale(const NoiseParams& p) {
  constexpr double kOsl[5] = {0, 0.25, 0.6616, 0.982, 0.8344};
  constexpr double kOwn[3][5] = {{0, 2, 1.41421356237, 0.96492117, 0.65079493},
                                 {0, 2, 1.41421356237, 0.95702458, 0.64716532},
                                 {0, 2, 1.41421356237, 0.93911873, 0.63884970}};
  if (p.lattice == NoiseLattice::kPerlin) return 1;
  return p.lattice == NoiseLattice::kOsl ? kOsl[p.dims] : kOwn[static_cast<int>(p.fade)][p.dims];
}

NoiseValue Interpolated(const NoiseParams& p, uint32_t seed, const Cells& period, int channel,
                        const NoisePlace& place) {
  NoiseValue n;
  const bool perlin = p.lattice == NoiseLattice::kPerlin;
  const int dims = perlin ? 3 : p.dims;
  for (int c = 0; c < 1 << dims; ++c) {
    Cells cell = {};
    Vector r = {}, weight = {}, weight_slope = {};
    for (size_t a = 0; a < static_cast<size_t>(dims); ++a) {
      const bool upper = (c >> a & 1) != 0, used = static_cast<int>(a) < p.dims;
      const double f = used ? place.fraction[a] : 0;
      cell[a] = used ? place.cell[a] : 0;
      if (upper && ++cell[a] == period[a]) cell[a] = 0;
      r[a] = f - (upper ? 1 : 0);
      const double u = Fade(f, p.fade), du = FadeSlope(f, p.fade);
      weight[a] = upper ? u : 1 - u;
      weight_slope[a] = upper ? du : -du;
    }
    double value = 0;
    Vector g = {};
    if (p.kind == NoiseKind::kValue) {
      value = SignedUnit(LatticeHash(cell, dims, seed));
    } else {
      if (p.lattice == NoiseLattice::kTessera) {
        g = LatticeGradient(LatticeHash(cell, dims, seed), dims);
      } else if (perlin) {
        g = PerlinGradient(cell);
      } else {
        const uint32_t h = Jenkins(std::vector<uint32_t>(cell.begin(), cell.begin() + dims));
        g = OslGradient(channel > 0 ? h >> (8 * (channel % 4)) : h, dims);
      }
      for (size_t a = 0; a < 4; ++a) value += g[a] * r[a];
    }
    double product = 1;
    for (size_t a = 0; a < static_cast<size_t>(dims); ++a) product *= weight[a];
    n.value += product * value;
    for (size_t a = 0; a < static_cast<size_t>(dims); ++a) {
      double others = weight_slope[a];
      for (size_t b = 0; b < static_cast<size_t>(dims); ++b) others *= a == b ? 1 : weight[b];
      n.slope[a] += product * g[a] + others * value;
    }
  }
  const double scale = p.kind == NoiseKind::kValue ? 1 : GradientScale(p);
  n.value *= scale;
  for (double& slope : n.slope) slope *= scale;
  return n;
}

NoiseValue White(const NoiseParams& p, uint32_t seed, int channel, const NoisePlace& place) {
  NoiseValue n;
  if (p.lattice == NoiseLattice::kOsl) {
    std::vector<uint32_t> words(place.cell.begin(), place.cell.begin() + p.dims);
    if (channel >= 0) words.push_back(static_cast<uint32_t>(channel));
    n.value = 2 * (Jenkins(words) / 4294967295.0) - 1;
  } else {
    n.value = SignedUnit(Next(LatticeHash(place.cell, p.dims, seed), 1));
  }
  return n;
}

NoiseValue HashOfPosition(const NoiseParams& p, uint32_t seed, int channel, const NoisePlace& place) {
  NoiseValue n;
  std::vector<uint32_t> words;
  for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
    const double position = static_cast<int32_t>(place.cell[a]) + place.fraction[a];
    words.push_back(std::bit_cast<uint32_t>(static_cast<float>(position)));
  }
  if (p.lattice == NoiseLattice::kOsl) {
    if (channel >= 0) words.push_back(static_cast<uint32_t>(channel));
    n.value = 2 * (Jenkins(words) / 4294967295.0) - 1;
  } else {
    words.push_back(seed);
    n.value = SignedUnit(Jenkins(words));
  }
  return n;
}

// Calls visit(hash, corner - position) for the 3^dims cells around.
template <class Visit>
void ForNeighbours(const NoiseParams& p, uint32_t seed, const Cells& period, const NoisePlace& place,
                   Visit visit) {
  int count = 1;
  for (int a = 0; a < p.dims; ++a) count *= 3;
  for (int n = 0; n < count; ++n) {
    Cells cell = {};
    Vector offset = {};
    int rest = n;
    for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a, rest /= 3) {
      const int step = rest % 3 - 1;
      cell[a] = place.cell[a] + static_cast<uint32_t>(step);
      if (period[a] != 0) cell[a] = (place.cell[a] + period[a] + static_cast<uint32_t>(step)) % period[a];
      offset[a] = step - place.fraction[a];
    }
    visit(LatticeHash(cell, p.dims, seed), offset);
  }
}

NoiseValue CellNoise(const NoiseParams& p, uint32_t seed, const Cells& period, const NoisePlace& place,
                     int tie) {
  std::vector<std::pair<double, Vector>> points;
  ForNeighbours(p, seed, period, place, [&](uint32_t h, const Vector& offset) {
    Vector r = {};
    double square = 0;
    for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
      r[a] = offset[a] + 0.5 + p.jitter * (Unit(Next(h, static_cast<int>(a) + 1)) - 0.5);
      square += r[a] * r[a];
    }
    points.emplace_back(std::sqrt(square), r);
  });
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  // Squares of distances in floats, of two or three products each.
  const auto k = static_cast<size_t>(tie);
  if (tie > 0 && k < points.size() && points[k].first - points[k - 1].first < 0x1p-20)
    std::swap(points[k], points[k - 1]);
  NoiseValue n;
  n.scale = 2;
  const double w1 = p.distance == CellDistance::kF1 ? 1 : p.distance == CellDistance::kF2 ? 0 : -1;
  const double w2 = p.distance == CellDistance::kF1 ? 0 : 1;
  n.value = w1 * points[0].first + w2 * points[1].first;
  for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
    n.slope[a] = -w1 * points[0].second[a] / std::max(points[0].first, 1e-20) -
                 w2 * points[1].second[a] / std::max(points[1].first, 1e-20);
  }
  return n;
}

NoiseValue Impulses(const NoiseParams& p, uint32_t seed, const Cells& period, const NoisePlace& place) {
  constexpr int kMost = 24;
  const bool spot = p.kind == NoiseKind::kSpot;
  const int power = spot ? 2 : 3;
  // M turns the ellipse into the unit circle: 1 along the direction, stretch across it (y is down).
  const double angle = std::fmod(p.angle, 360.0) * std::numbers::pi / 180, c = std::cos(angle),
               s = -std::sin(angle);
  const double stretch = spot && p.dims > 1 ? p.stretch : 1;
  const double m[2][2] = {{c * c + stretch * s * s, (1 - stretch) * c * s},
                          {(1 - stretch) * c * s, s * s + stretch * c * c}};
  // The kernel's energy by Simpson's rule in radius, times the sphere's surface.
  const double surface[] = {0, 2, 2 * std::numbers::pi, 4 * std::numbers::pi,
                            2 * std::numbers::pi * std::numbers::pi};
  double energy = 0;
  constexpr int kSteps = 2000;
  for (int i = 0; i <= kSteps; ++i) {
    const double r = static_cast<double>(i) / kSteps;
    energy += (i == 0 || i == kSteps ? 1
               : i % 2 == 1          ? 4
                                     : 2) *
              std::pow(r, p.dims - 1) * std::pow(1 - r * r, 2 * power);
  }
  energy *= surface[p.dims] / (3.0 * kSteps) / stretch;
  const double scale = 1 / (3 * std::sqrt(p.density * (spot ? 1 : 1.0 / 3) * energy));
  NoiseValue n;
  n.scale = n.slope_scale = 1;
  ForNeighbours(p, seed, period, place, [&](uint32_t h, const Vector& offset) {
    const uint32_t number = Next(h, 1);
    uint32_t state = h;
    double probability = std::exp(-p.density), sum = probability;
    for (int k = 0; k < kMost - 1; ++k) {
      if (number < static_cast<uint32_t>(std::min(sum * 4294967296.0, 4294967295.0))) break;
      probability *= p.density / (k + 1);
      sum += probability;
      Vector r = offset, mr = {}, mm = {};
      for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
        state = Next(state, static_cast<int>(a) + 2);
        r[a] += Unit(state);
      }
      state = Next(state, p.dims + 2);
      const double height = spot ? (state >> 31 != 0 ? -1 : 1) : SignedUnit(state);
      const auto times_m = [&](const Vector& v) {
        if (!spot || p.dims < 2) return v;
        return Vector{m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1], v[2], v[3]};
      };
      mr = times_m(r);
      mm = times_m(mr);
      double square = 0;
      for (double v : mr) square += v * v;
      const double t = std::max(0.0, 1 - square);
      n.value += scale * height * std::pow(t, power);
      // The square of the distance is off by some u times the stretch, and t^power by power t^(power - 1)
      // that. Slopes have one power less; those of spots begin with a step, so they feel it from before the
      // rim.
      n.scale += scale * (power * stretch * std::pow(t, power - 1) + std::pow(t, power));
      n.slope_scale += scale * stretch;
      for (size_t a = 0; a < 4; ++a)
        n.slope[a] += scale * height * 2 * power * std::pow(t, power - 1) * mm[a];
    }
  });
  return n;
}

// Impulses in the cells around, each with as many; positions are counted in cells.
NoiseValue Gabor(const NoiseParams& p, uint32_t seed, const Cells& period, const NoisePlace& place) {
  Vector length = {1, 1, 1, 1};
  double cell = 1;
  for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
    length[a] = model::CellsOfGabor(p.bandwidth, p.period[a]).length;
    cell *= length[a];
  }
  const bool isotropic = p.orientation == GaborOrientation::kIsotropic && p.dims > 1;
  const bool turned = isotropic || (p.orientation == GaborOrientation::kHybrid && p.dims == 3);
  std::vector<GaborImpulse> impulses;
  ForNeighbours(p, seed, period, place, [&](uint32_t h, const Vector& offset) {
    uint32_t state = h;
    const int count = model::GaborImpulsesPerCell(p.impulses, p.bandwidth, p.dims, cell);
    for (int m = 0; m < count; ++m) {
      GaborImpulse impulse;
      for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) {
        state = Next(state, static_cast<int>(a) + 2);
        impulse.away[a] = (offset[a] + Unit(state)) * length[a];
      }
      state = Next(state, p.dims + 2);
      impulse.phase = Unit(state);
      if (turned) {
        state = Next(state, p.dims + 3);
        impulse.azimuth =
            (state >> 30) * std::numbers::pi / 2 + SignedUnit(state << 2) * std::numbers::pi / 4;
      }
      if (isotropic && p.dims == 3) {
        state = Next(state, p.dims + 4);
        impulse.height = SignedUnit(state);
      }
      impulses.push_back(impulse);
    }
  });
  return GaborNoise(p, impulses, cell);
}

}  // namespace

std::vector<LatticeSpot> LatticeSpots(int i, int j, uint32_t seed, double density) {
  const uint32_t h =
      LatticeHash({static_cast<uint32_t>(i), static_cast<uint32_t>(j), 0, 0}, 2, OctaveSeed(seed, 0, 0));
  const uint32_t number = Next(h, 1);
  uint32_t state = h;
  double probability = std::exp(-density), sum = probability;
  std::vector<LatticeSpot> spots;
  for (int k = 0; k < 23; ++k) {
    if (number < static_cast<uint32_t>(std::min(sum * 4294967296.0, 4294967295.0))) break;
    probability *= density / (k + 1);
    sum += probability;
    LatticeSpot spot;
    spot.x = Unit(state = Next(state, 2));
    spot.y = Unit(state = Next(state, 3));
    state = Next(state, 4);
    spot.sign = state >> 31 != 0 ? -1 : 1;
    spots.push_back(spot);
  }
  return spots;
}

NoiseValue EvaluateNoise(const NoiseParams& p, uint32_t seed, const Cells& period, int channel,
                         const NoisePlace& place, int tie) {
  switch (p.kind) {
    case NoiseKind::kWhite:
      return White(p, seed, channel, place);
    case NoiseKind::kValue:
    case NoiseKind::kGradient:
      return Interpolated(p, seed, period, channel, place);
    case NoiseKind::kSimplex:
      return SimplexNoise(p, seed, period, channel, place);
    case NoiseKind::kHash:
      return HashOfPosition(p, seed, channel, place);
    case NoiseKind::kCell:
      return CellNoise(p, seed, period, place, tie);
    case NoiseKind::kGabor:
      return Gabor(p, seed, period, place);
    default:
      return Impulses(p, seed, period, place);
  }
}

}  // namespace tessera::reference
