// OpenColorIO's exponents and logarithms as formulas of curves, with the same pieces and the same limits.
#include "ocio/formulas.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace tessera::ocio {
namespace {

namespace lib = OCIO_NAMESPACE;
using Kind = CurveFormula::Kind;

Negatives NegativesOf(lib::NegativeStyle style) {
  switch (style) {
    case lib::NEGATIVE_CLAMP:
      return Negatives::kClamp;
    case lib::NEGATIVE_MIRROR:
      return Negatives::kMirror;
    case lib::NEGATIVE_PASS_THRU:
      return Negatives::kKeep;
    case lib::NEGATIVE_LINEAR:
      break;
  }
  return Negatives::kExtend;
}

CurveFormula PowerFormula(double exponent, Negatives negatives) {
  CurveFormula f;
  f.kind = exponent == 1 ? Kind::kLinear : Kind::kPower;  // a power of 1 keeps the bits
  f.exponent = exponent;
  f.negatives = negatives;
  return f;
}

// The "moncurve": ((x + offset) / (1 + offset))^gamma, and a line through the origin that touches it.
CurveFormula MonitorFormula(double gamma, double offset, Negatives negatives, bool inverse) {
  if (gamma == 1 && offset == 0) return PowerFormula(1, negatives);
  gamma = std::max(gamma, 1.000001);
  offset = std::max(offset, 1e-6);
  const double join = offset / (gamma - 1);
  const double signal_at_join = std::pow(offset * gamma / ((gamma - 1) * (1 + offset)), gamma);
  CurveFormula f;
  f.kind = Kind::kPower;
  f.negatives = negatives;
  if (inverse) {
    f.join = signal_at_join;
    f.slope = join / signal_at_join;
    f.exponent = 1 / gamma;
    f.out_scale = 1 + offset, f.out_offset = -offset;
  } else {
    f.join = join;
    f.slope = signal_at_join / join;
    f.exponent = gamma;
    f.in_scale = 1 / (1 + offset), f.in_offset = offset / (1 + offset);
  }
  return f;
}

// log_slope log_base(lin_slope x + lin_offset) + log_offset, or its inverse.
struct LogNumbers {
  double base = 2, log_slope = 1, log_offset = 0, lin_slope = 1, lin_offset = 0;
};
CurveFormula LogFormula(const LogNumbers& n, bool inverse) {
  CurveFormula f;
  const double per_octave = n.log_slope / std::log2(n.base);
  if (inverse) {
    f.kind = Kind::kExp;
    f.in_scale = 1 / per_octave, f.in_offset = -n.log_offset / per_octave;
    f.out_scale = 1 / n.lin_slope, f.out_offset = -n.lin_offset / n.lin_slope;
  } else {
    f.kind = Kind::kLog;
    f.in_scale = n.lin_slope, f.in_offset = n.lin_offset, f.floor = double{FLT_MIN};
    f.out_scale = per_octave, f.out_offset = n.log_offset;
  }
  return f;
}

bool IsInverse(const lib::Transform& t) { return t.getDirection() == lib::TRANSFORM_DIR_INVERSE; }

// The numbers that affine and camera logarithms share.
template <class T>
void LogSides(const T& t, LogNumbers (&n)[3]) {
  double log_slope[3], log_offset[3], lin_slope[3], lin_offset[3];
  t.getLogSideSlopeValue(log_slope), t.getLogSideOffsetValue(log_offset);
  t.getLinSideSlopeValue(lin_slope), t.getLinSideOffsetValue(lin_offset);
  for (int c = 0; c < 3; ++c) n[c] = {t.getBase(), log_slope[c], log_offset[c], lin_slope[c], lin_offset[c]};
}

}  // namespace

CurveParams FormulasOf(const lib::ExponentTransform& t) {
  double exponents[4];
  t.getValue(exponents);
  CurveParams params;
  for (const double e : exponents) {
    params.formulas.push_back(PowerFormula(IsInverse(t) ? 1 / e : e, NegativesOf(t.getNegativeStyle())));
  }
  return params;
}

CurveParams FormulasOf(const lib::ExponentWithLinearTransform& t) {
  double gamma[4], offset[4];
  t.getGamma(gamma), t.getOffset(offset);
  CurveParams params;
  for (int c = 0; c < 4; ++c) {
    params.formulas.push_back(
        MonitorFormula(gamma[c], offset[c], NegativesOf(t.getNegativeStyle()), IsInverse(t)));
  }
  return params;
}

CurveParams FormulasOf(const lib::LogTransform& t) {
  LogNumbers n;
  n.base = t.getBase();
  return {{LogFormula(n, IsInverse(t))}};
}

CurveParams FormulasOf(const lib::LogAffineTransform& t) {
  LogNumbers n[3];
  LogSides(t, n);
  CurveParams params;
  for (const LogNumbers& numbers : n) params.formulas.push_back(LogFormula(numbers, IsInverse(t)));
  return params;
}

CurveParams FormulasOf(const lib::LogCameraTransform& t) {
  LogNumbers n[3];
  LogSides(t, n);
  double join[3], slope[3];
  t.getLinSideBreakValue(join);
  const bool given = t.getLinearSlopeValue(slope);
  CurveParams params;
  for (int c = 0; c < 3; ++c) {
    const double argument = n[c].lin_slope * join[c] + n[c].lin_offset;
    const double per_octave = n[c].log_slope / std::log2(n[c].base);
    const double signal_at_join = per_octave * std::log2(argument) + n[c].log_offset;
    if (!given) slope[c] = per_octave / std::log(2.0) * n[c].lin_slope / argument;
    CurveFormula f = LogFormula(n[c], IsInverse(t));
    if (IsInverse(t)) {
      f.join = signal_at_join, f.slope = 1 / slope[c], f.offset = join[c] - signal_at_join / slope[c];
    } else {
      f.join = join[c], f.slope = slope[c], f.offset = signal_at_join - slope[c] * join[c];
    }
    params.formulas.push_back(f);
  }
  return params;
}

}  // namespace tessera::ocio
