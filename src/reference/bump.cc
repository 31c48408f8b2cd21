// Reference of bump mapping: slopes and shifts by their definitions.
#include "tessera/ops/bump.h"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

// The first channel with what lies beyond its window.
struct Field {
  const ImageD& image;
  Roi window;
  Wrap wrap;
  double scale;
  int bits;

  double Stored(int x, int y) const {
    if (!Shown(x, window.x0, window.x1, wrap) || !Shown(y, window.y0, window.y1, wrap)) return 0;
    const double v = image.at(x, y, 0);
    if (bits == 0) return v;
    const double codes = std::ldexp(1.0, bits) - 1;
    return std::nearbyint(std::clamp(v, 0.0, 1.0) * codes) / codes;
  }
  // Relative to the pixel where differences are taken, so that large heights cancel.
  double Difference(int x, int y, double dx, double dy) const {
    const double i = std::floor(dx), j = std::floor(dy), fx = dx - i, fy = dy - j, here = Stored(x, y);
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const double w = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
      if (w != 0)
        sum += w * (Stored(x + static_cast<int>(i) + k % 2, y + static_cast<int>(j) + k / 2) - here);
    }
    return scale * sum;
  }
};

// f_x and f_y, y up.
std::pair<double, double> Slopes(const Field& f, Slope slope, int x, int y) {
  const auto d = [&](int dx, int dy) { return f.Difference(x, y, dx, dy); };
  switch (slope) {
    case Slope::kCentral:
      return {(d(1, 0) - d(-1, 0)) / 2, (d(0, -1) - d(0, 1)) / 2};
    case Slope::kForward:
      return {d(1, 0), d(0, -1)};
    case Slope::kSobel:
      return {(d(1, -1) + 2 * d(1, 0) + d(1, 1) - d(-1, -1) - 2 * d(-1, 0) - d(-1, 1)) / 8,
              (d(-1, -1) + 2 * d(0, -1) + d(1, -1) - d(-1, 1) - 2 * d(0, 1) - d(1, 1)) / 8};
    case Slope::kGaussian:
      break;
  }
  double fx = 0, fy = 0, ramp = 0;
  for (int j = -3; j <= 3; ++j) {
    for (int i = -3; i <= 3; ++i) {
      const double g = std::exp(-0.5 * (i * i + j * j));
      fx += g * i * d(i, j), fy -= g * j * d(i, j), ramp += g * i * i;
    }
  }
  return {fx / ramp, fy / ramp};
}

// How far slopes may be off where heights may be.
double SlopeOff(const Call& call, const Field& f, int x, int y) {
  double most = 0;
  for (int k = 0; k < 9 && !call.tolerances.empty(); ++k) {
    int i = x + k % 3 - 1, j = y + k / 3 - 1;
    if (!Shown(i, f.window.x0, f.window.x1, f.wrap) || !Shown(j, f.window.y0, f.window.y1, f.wrap)) continue;
    most = std::max(most, call.Tolerance(0, i, j, 0));
  }
  return 2 * std::fabs(f.scale) * most;
}

// Heights are subtracted and summed in double: where they cancel, the roundings of the largest of those
// around a pixel, and so far either side of it, leave something. As a multiple of 2^-24.
double Leftover(const Field& f, int x, int y, double dx = 0, double dy = 0) {
  constexpr int kReach = 3, kWidth = 2 * kReach + 1;
  double most = 0;
  for (const int side : {-1, 0, 1}) {
    const int i = x + static_cast<int>(std::lround(side * dx)),
              j = y + static_cast<int>(std::lround(side * dy));
    for (int k = 0; k < kWidth * kWidth; ++k) {
      const double v = f.Stored(i + k % kWidth - kReach, j + k / kWidth - kReach);
      if (std::isfinite(v)) most = std::max(most, std::fabs(v));
    }
  }
  return 0x1p-22 * std::fabs(f.scale) * most;
}

Field FieldOf(const Call& call, Wrap wrap, double scale, int bits) {
  return {call.in[0], call.in_specs[0].data_window, wrap, scale, bits};
}

void EvaluateNormalMap(const Call& call) {
  const auto& p = std::any_cast<const HeightNormalsParams&>(call.parameters);
  const Field f = FieldOf(call, p.wrap, p.scale, 0);
  ForEachSample(call, [&](int x, int y, int c) {
    const auto [fx, fy] = Slopes(f, p.slope, x, y);
    // Where errors are steeper than all else, it may be flat as well.
    const double cancelled = Leftover(f, x, y), off = SlopeOff(call, f, x, y) + 0x1p-24 * cancelled;
    if (off > 0.25 && std::max(std::fabs(fx), std::fabs(fy)) < 8 * off) call.Undecided(x, y, c, 2);
    const double over = 1 / std::sqrt(1 + fx * fx + fy * fy);
    const double n = (c == 0 ? -fx : c == 1 ? -fy : 1) * over;
    return std::pair{p.pack ? (n + 1) / 2 : n, 1 + cancelled * over};
  });
}

void EvaluateBump(const Call& call) {
  const auto& p = std::any_cast<const BumpParams&>(call.parameters);
  const Field f = FieldOf(call, p.wrap, p.scale, p.bits);
  Vector3 d = Normalized(p.light);
  if (p.output == BumpOutput::kSpecular) {
    d[2] += 1;
    d = Dot(d, d) > 1e-30 ? Normalized(d) : Vector3{};
  }
  const auto value = [&](int x, int y) {
    const auto [fx, fy] = Slopes(f, p.slope, x, y);
    double e;
    switch (p.method) {
      case BumpMethod::kForward:
        e = -f.Difference(x, y, p.shift * d[0], -p.shift * d[1]);
        break;
      case BumpMethod::kShift:
        e = f.Difference(x, y, -p.shift * d[0] / 2, p.shift * d[1] / 2) -
            f.Difference(x, y, p.shift * d[0] / 2, -p.shift * d[1] / 2);
        break;
      default:
        e = -p.shift * (d[0] * fx + d[1] * fy);
    }
    const double cancelled = Leftover(f, x, y, p.shift * d[0], p.shift * d[1]);
    const double scale = 1 + (std::fabs(e) + cancelled) / p.shift;
    if (p.output == BumpOutput::kEmboss) return std::pair{e + 0.5, 1 + std::fabs(e) + cancelled};
    const double product = (e / p.shift + d[2]) / (p.length ? std::sqrt(1 + fx * fx + fy * fy) : 1);
    const double lit = std::max(product, 0.0);
    if (p.output == BumpOutput::kDiffuse) return std::pair{lit, scale};
    const double power = lit > 0 ? std::pow(lit, p.exponent) : 0;
    return std::pair{power, std::max(scale, power) * (1 + p.exponent)};
  };
  const double codes = std::ldexp(1.0, p.bits) - 1;
  ForEachSample(call, [&](int x, int y, int c) {
    const auto [v, scale] = value(x, y);
    if (p.bits == 0) return std::pair{v, scale};
    // The framebuffer holds the result as well; next to the middle between two codes the last bits of doubles
    // decide.
    const double position = std::clamp(v, 0.0, 1.0) * codes;
    if (std::fabs(position - std::floor(position) - 0.5) < 1e-6) call.Undecided(x, y, c, 1 / codes);
    return std::pair{std::nearbyint(position) / codes, scale};
  });
}

Vector3 At(const ImageD& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}
// How far it may be off.
double VectorOff(const Call& call, int in, int x, int y) {
  double off = 0;
  for (int c = 0; c < 3; ++c) off += call.Tolerance(in, x, y, c);
  return off;
}
bool Usable(const Vector3& v) { return Dot(v, v) > 0 && Dot(v, v) < std::numeric_limits<double>::infinity(); }
Vector3 Unit(const Vector3& v) { return Usable(v) ? Normalized(v) : Vector3{}; }
Vector3 Sum(const Vector3& a, const Vector3& b, double times = 1) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}

// What of `v` is perpendicular to `n` (Gram and Schmidt). With more digits than double: what is left of a
// vector along n is the rounding of its parts.
Vector3 Flattened(const Vector3& v, const Vector3& n) {
  if (!Usable(v) || !Usable(n)) return {};
  using Long = std::array<long double, 3>;
  const auto dot = [](const Long& a, const Long& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const Long to = {n[0], n[1], n[2]};
  Long rest = {v[0], v[1], v[2]};
  for (int pass = 0; pass < 2; ++pass) {
    const long double along = dot(rest, to) / dot(to, to);
    for (size_t k = 0; k < 3; ++k) rest[k] -= along * to[k];
  }
  return {static_cast<double>(rest[0]), static_cast<double>(rest[1]), static_cast<double>(rest[2])};
}

void EvaluateTangentNormals(const Call& call) {
  const auto& p = std::any_cast<const TangentNormalsParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double own = call.in[0].at(x, y, c);
    if (c > 2) return std::pair{own, std::fabs(own)};
    Vector3 a = At(call.in[0], x, y);
    for (double& v : a) v = p.packed ? 2 * v - 1 : v;
    const Vector3 raw = At(call.in[1], x, y), n = Unit(raw);
    const Vector3 along = At(call.in[2], x, y), flat = Flattened(along, raw);
    const bool framed = Dot(flat, flat) > 1e-24 * Dot(along, along);
    const Vector3 t = framed ? Unit(flat) : Vector3{}, b = p.left_handed ? Cross(t, n) : Cross(n, t);
    const double length = std::sqrt(Dot(a, a));
    const auto k = static_cast<size_t>(c);
    // Directions of vectors that may as well be none.
    const double raw_length = std::sqrt(Dot(raw, raw)), normal_off = VectorOff(call, 1, x, y),
                 flat_off = VectorOff(call, 2, x, y) +
                            (normal_off > 0 ? std::sqrt(Dot(along, along)) * normal_off / raw_length : 0);
    if ((normal_off > 0 && !(raw_length > 2 * normal_off)) ||
        ((!p.inverse || c < 2) && flat_off > 0 && !(std::sqrt(Dot(flat, flat)) > 2 * flat_off))) {
      call.Undecided(x, y, c, p.inverse ? 2 * (length + VectorOff(call, 0, x, y)) : 2);
    }
    if (p.inverse) return std::pair{c == 0 ? Dot(a, t) : c == 1 ? Dot(a, b) : Dot(a, n), length};
    const Vector3 sum = {a[0] * t[0] + a[1] * b[0] + a[2] * n[0], a[0] * t[1] + a[1] * b[1] + a[2] * n[1],
                         a[0] * t[2] + a[1] * b[2] + a[2] * n[2]};
    return std::pair{framed && Usable(sum) ? Unit(sum)[k] : n[k], 1.0};
  });
}

void EvaluateSurfaceBump(const Call& call) {
  const auto& p = std::any_cast<const SurfaceBumpParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double own = call.in[0].at(x, y, c);
    if (c > 2) return std::pair{own, std::fabs(own)};
    Vector3 a = At(call.in[0], x, y);
    for (double& v : a) v = p.packed ? 2 * v - 1 : v;
    const Vector3 raw = At(call.in[1], x, y), n = Unit(raw), u = At(call.in[2], x, y),
                  v = At(call.in[3], x, y), area = Cross(u, v), v_by_n = Cross(v, raw),
                  n_by_u = Cross(raw, u);
    const double lengths = Dot(u, u) * Dot(v, v), square = Dot(area, area), size = std::sqrt(square);
    const auto k = static_cast<size_t>(c);
    if (!(lengths > 0 && std::isfinite(lengths) && square > 1e-24 * lengths && Usable(n)))
      return std::pair{n[k], 1.0};
    // Where the parameters run the other way round, so do their derivatives.
    const double above = Dot(area, n) + 1e-12 * size, over = 1 / std::sqrt(Dot(raw, raw));
    const double side = (above < 0 ? -p.scale : p.scale) * over;
    Vector3 sum = Sum(Vector3{}, n, a[2] * size);
    sum = Sum(sum, v_by_n, side * a[0]);
    sum = Sum(sum, n_by_u, side * a[1]);
    const double parts =
        std::fabs(a[2]) * size + std::fabs(side) * (std::fabs(a[0]) * std::sqrt(Dot(v_by_n, v_by_n)) +
                                                    std::fabs(a[1]) * std::sqrt(Dot(n_by_u, n_by_u)));
    const double length = std::sqrt(Dot(sum, sum));
    // Doubles that cancel leave their rounding, which has any direction.
    if (std::fabs(above) < 0x1p-50 * size || (length < 0x1p-50 * parts && length > 0))
      call.Undecided(x, y, c, 2);
    return std::pair{Usable(sum) ? Unit(sum)[k] : n[k], 1 + (length > 0 ? 0x1p-26 * parts / length : 0)};
  });
}

void EvaluateCombineNormals(const Call& call) {
  const auto& p = std::any_cast<const CombineNormalsParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double own = call.in[0].at(x, y, c);
    if (c > 2) return std::pair{own, std::fabs(own)};
    const Vector3 v = Unit(At(call.in[0], x, y)), raw = At(call.in[1], x, y);
    Vector3 sum;
    if (p.method == CombineMethod::kSum) {
      sum = Sum(Unit(raw), v, p.k);
    } else {
      sum = Sum(v, Flattened(raw, At(call.in[0], x, y)), -p.k);
    }
    const bool usable = Usable(v) && Usable(sum) && Dot(sum, sum) >= 1e-12;
    // How far the directions may be off, and with them their sum, which may be none.
    const auto turned = [&](int k) {
      const Vector3 v = At(call.in[static_cast<size_t>(k)], x, y);
      const double off = VectorOff(call, k, x, y);
      return off == 0 ? 0 : std::min(2.0, off / std::sqrt(Dot(v, v)));
    };
    const double off = (p.method == CombineMethod::kSum ? std::fabs(p.k) : 1) * turned(0) +
                       (p.method == CombineMethod::kSum ? 1 : std::fabs(p.k)) * turned(1);
    if (off > 0 && !(std::sqrt(Dot(sum, sum)) > 2 * off)) call.Undecided(x, y, c, 2);
    return std::pair{(usable ? Unit(sum) : v)[static_cast<size_t>(c)], 1.0};
  });
}

constexpr Roi kEverything{INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
Roi All(const std::any&, int, const Roi&) { return kEverything; }

}  // namespace

std::vector<Entry> BumpEntries() {
  return {{"normalmap", EvaluateNormalMap, All},
          {"bump", EvaluateBump, All},
          {"tangentnormals", EvaluateTangentNormals},
          {"surfacebump", EvaluateSurfaceBump},
          {"combinenormals", EvaluateCombineNormals}};
}

}  // namespace tessera::reference
