// A curve's formula in double.
#include "ops/curve/curve_value.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/curve/curve_constants.h"

namespace tessera::ops {
namespace {

// scale v + offset, in which 0 times infinity is 0.
double Line(double scale, double v, double offset) { return scale == 0 ? offset : scale * v + offset; }

}  // namespace

double ValueOf(const CurveFormula& f, double x) {
  using Kind = CurveFormula::Kind;
  const double light = std::max(x, 0.0);
  switch (f.kind) {
    case Kind::kPq: {
      if (std::isinf(light)) return std::pow(kPqC2 / kPqC3, kPqM2);
      const double u = std::pow(light, kPqM1);
      return std::pow((kPqC1 + kPqC2 * u) / (1 + kPqC3 * u), kPqM2);
    }
    case Kind::kPqInverse: {
      const double u = std::pow(light, 1 / kPqM2), below = kPqC2 - kPqC3 * u;
      if (!(below > 0)) return std::numeric_limits<double>::infinity();
      return std::pow(std::max(u - kPqC1, 0.0) / below, 1 / kPqM1);
    }
    case Kind::kHlg:
      return light < 1.0 / 12 ? std::sqrt(3 * light) : kHlgA * std::log(12 * light - kHlgB) + kHlgC;
    case Kind::kHlgInverse:
      return x < 0.5 ? x * x / 3 : (std::exp((x - kHlgC) / kHlgA) + kHlgB) / 12;
    default:
      break;
  }
  if (f.kind == Kind::kLinear || x < f.join) return Line(f.slope, x, f.offset);
  const double v = Line(f.in_scale, x, f.in_offset);
  double w = 0;
  if (f.kind == Kind::kPower) {
    w = v > 0 ? std::pow(v, f.exponent) : 0;
  } else if (f.kind == Kind::kLog) {
    w = std::log2(std::max(v, f.floor));
  } else {
    w = std::exp2(v);
  }
  return Line(f.out_scale, w, f.out_offset);
}

}  // namespace tessera::ops
