// Reference of the curves by formula and of powers by constant.
#include "tessera/ops/curve.h"

#include <any>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using Kind = CurveFormula::Kind;
using Sample = std::pair<double, double>;  // value, scale of its bound

// SMPTE ST 2084, equations 4.1 and 5.1, in long double: the inverse cancels near black.
double Pq(double light) {
  const long double m1 = 2610.0L / 16384, m2 = 2523.0L / 4096 * 128, c1 = 3424.0L / 4096,
                    c2 = 2413.0L / 4096 * 32, c3 = 2392.0L / 4096 * 32;
  if (std::isinf(light)) return static_cast<double>(std::pow(light > 0 ? c2 / c3 : c1, m2));
  const long double u = std::pow(std::fmax(static_cast<long double>(light), 0.0L), m1);
  return static_cast<double>(std::pow((c1 + c2 * u) / (1 + c3 * u), m2));
}
double PqInverse(double signal) {
  const long double m1 = 2610.0L / 16384, m2 = 2523.0L / 4096 * 128, c1 = 3424.0L / 4096,
                    c2 = 2413.0L / 4096 * 32, c3 = 2392.0L / 4096 * 32;
  const long double u = std::pow(std::fmax(static_cast<long double>(signal), 0.0L), 1 / m2);
  if (!(c2 - c3 * u > 0)) return std::numeric_limits<double>::infinity();
  return static_cast<double>(std::pow(std::fmax(u - c1, 0.0L) / (c2 - c3 * u), 1 / m1));
}

// ARIB STD-B67 / BT.2100 table 5.
double Hlg(double light) {
  const double a = 0.17883277, b = 1 - 4 * a, c = 0.5 - a * std::log(4 * a);
  if (light < 1.0 / 12) return std::sqrt(3 * std::fmax(light, 0));
  return a * std::log(12 * light - b) + c;
}
double HlgInverse(double signal) {
  const double a = 0.17883277, b = 1 - 4 * a, c = 0.5 - a * std::log(4 * a);
  return signal < 0.5 ? signal * signal / 3 : (std::exp((signal - c) / a) + b) / 12;
}

// a w + b, in which 0 times infinity is 0.
Sample Line(double a, double w, double b) {
  const double product = a == 0 ? 0 : a * w;
  return {product + b, std::fabs(product + b) + 0x1p-20 * (std::fabs(product) + std::fabs(b))};
}

Sample OfFormula(const CurveFormula& f, double x) {
  switch (f.kind) {
    case Kind::kPq:
      return Rounded(Pq(x));
    case Kind::kPqInverse:
      return Rounded(PqInverse(x));
    case Kind::kHlg:
      return Rounded(Hlg(x));
    case Kind::kHlgInverse:
      return Rounded(HlgInverse(x));
    case Kind::kLinear:
      return Line(f.slope, x, f.offset);
    default:
      break;
  }
  if (x < f.join) return Line(f.slope, x, f.offset);
  const double v = Line(f.in_scale, x, f.in_offset).first;
  if (f.kind == Kind::kPower) return Line(f.out_scale, std::pow(std::fmax(v, 0), f.exponent), f.out_offset);
  if (f.kind == Kind::kLog) return Line(f.out_scale, std::log2(std::fmax(v, f.floor)), f.out_offset);
  return Line(f.out_scale, std::exp2(v), f.out_offset);
}

Sample OfCurve(const CurveFormula& f, double x) {
  if (std::isnan(x)) return {x, 0};
  if (x >= 0 || f.negatives == Negatives::kExtend) return OfFormula(f, x);
  if (f.negatives == Negatives::kKeep) return Rounded(x);
  if (f.negatives == Negatives::kClamp) return OfFormula(f, 0);
  const Sample positive = OfFormula(f, -x);
  return {-positive.first, positive.second};
}

void EvaluateCurve(const Call& call) {
  const std::vector<CurveFormula>& formulas = std::any_cast<const CurveParams&>(call.parameters).formulas;
  const int alpha = call.in_specs[0].alpha, channels = call.out.channels;
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double v = call.in[0].at(x, y, c);
    size_t which = 0;
    if (c == alpha) {
      which = 3;
    } else if (channels >= 3 && c >= 3) {
      return Rounded(v);
    } else if (channels >= 3 && formulas.size() > 1) {
      which = static_cast<size_t>(c);
    }
    if (which >= formulas.size()) return Rounded(v);
    const CurveFormula& f = formulas[which];
    // On which side of 0 a sample lies: a curve that is not 0 there may jump.
    if ((f.negatives == Negatives::kMirror || f.negatives == Negatives::kKeep) &&
        std::fabs(v) <= call.Tolerance(0, x, y, c)) {
      call.Undecided(x, y, c, 2 * std::fabs(OfFormula(f, 0).first));
    }
    return OfCurve(f, v);
  });
}

void EvaluatePower(const Call& call) {
  const std::vector<double>& values = std::any_cast<const PowerConstants&>(call.parameters).values;
  ForEachSample(call, [&](int x, int y, int c) {
    const double v = call.in[0].at(x, y, c);
    if (values.size() == 1) return Rounded(std::pow(v, values[0]));
    if (static_cast<size_t>(c) >= values.size()) return Rounded(v);
    return Rounded(std::pow(v, values[static_cast<size_t>(c)]));
  });
}

}  // namespace

std::vector<Entry> CurveEntries() { return {{"curve", EvaluateCurve}, {"powc", EvaluatePower}}; }

}  // namespace tessera::reference
