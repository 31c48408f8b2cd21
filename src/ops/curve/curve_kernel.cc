// The kernel of curves by formula: each plane of a block by a loop made for its formula, in double.
#include "ops/curve/curve_kernel.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/curve/curve_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"
#include "simd/math-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::Precision;
using s::V;
using s::VD;
using Kind = CurveFormula::Kind;

HWY_INLINE VD Set(double v) { return hn::Set(s::DD(), v); }

// v^e of v >= 0 and e > 0, to the precision of a double where asked.
template <Precision kPrecision = Precision::kFloat>
HWY_INLINE VD PowerOf(VD v, double e) {
  const VD t = hn::Mul(s::Log2OfDouble<kPrecision>(v), Set(e));
  return hn::IfThenElseZero(hn::Gt(v, Set(0.0)), s::Exp2OfDouble<kPrecision>(s::ClampExponent(t)));
}

// SMPTE ST 2084.
constexpr double kM1 = 2610.0 / 16384, kM2 = 2523.0 / 4096 * 128, kC1 = 3424.0 / 4096,
                 kC2 = 2413.0 / 4096 * 32, kC3 = 2392.0 / 4096 * 32;
HWY_INLINE VD PqOfLight(VD x) {
  // Errors of u grow 30 times at most: 2^-29 of the result. Light of 0 counts as 2^-1000.
  const VD u = s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(hn::Max(x, Set(0x1p-1000))), Set(kM1)));
  const VD ratio = hn::Div(hn::MulAdd(u, Set(kC2), Set(kC1)), hn::MulAdd(u, Set(kC3), Set(1.0)));
  return s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(ratio), Set(kM2)));
}
HWY_INLINE VD LightOfPq(VD x) {
  const VD u = PowerOf<Precision::kDouble>(hn::Max(x, Set(0.0)), 1 / kM2);
  const VD above = hn::Max(hn::Sub(u, Set(kC1)), Set(0.0));
  const VD below = hn::NegMulAdd(u, Set(kC3), Set(kC2));
  // Beyond the formula's pole, at a signal near 2, light is infinite.
  return hn::IfThenElse(hn::Gt(below, Set(0.0)), PowerOf(hn::Div(above, below), 1 / kM1),
                        Set(std::numeric_limits<double>::infinity()));
}

// ARIB STD-B67.
constexpr double kHlgA = 0.17883277, kHlgB = 1 - 4 * kHlgA,
                 kHlgC = 0.55991072952956202016;  // 1/2 - a ln(4 a)
constexpr double kLn2 = 0.69314718055994530942;
HWY_INLINE VD HlgOfLight(VD x) {
  const VD root = hn::Sqrt(hn::Mul(hn::Max(x, Set(0.0)), Set(3.0)));
  const VD inside = hn::Max(hn::MulAdd(x, Set(12.0), Set(-kHlgB)), Set(0.1));
  const VD log = hn::MulAdd(s::Log2OfDouble(inside), Set(kHlgA * kLn2), Set(kHlgC));
  return hn::IfThenElse(hn::Lt(x, Set(1.0 / 12)), root, log);
}
HWY_INLINE VD LightOfHlg(VD x) {
  const VD square = hn::Mul(hn::Mul(x, x), Set(1.0 / 3));
  const VD t = hn::Mul(hn::Sub(x, Set(kHlgC)), Set(1 / (kHlgA * kLn2)));
  const VD above = hn::Mul(hn::Add(s::Exp2OfDouble(s::ClampExponent(t)), Set(kHlgB)), Set(1.0 / 12));
  return hn::IfThenElse(hn::Lt(x, Set(0.5)), square, above);
}

// How much of a formula a loop computes.
enum class Form : uint8_t {
  kGeneral,
  kSafePower,   // kPower whose argument is never negative where it counts, and whose exponent is moderate
  kPlainPower,  // the same without scales and offsets
};

// What a power's argument is raised to where it is 0: its power rounds to 0 in float, and no exponent leaves
// a double's.
constexpr double kLeastExponent = 0.17, kMostExponent = 6.6;
double LeastArgument(double exponent) { return exponent > 1 ? 0x1p-150 : 0x1p-1000; }

Form FormOf(const CurveFormula& f) {
  const bool moderate = f.exponent >= kLeastExponent && f.exponent <= kMostExponent;
  if (f.kind != Kind::kPower || !moderate || !(f.in_scale > 0)) return Form::kGeneral;
  const bool above_zero =
      f.in_offset >= 0 && (f.negatives == Negatives::kMirror || f.negatives == Negatives::kClamp);
  const bool above_join = std::isfinite(f.join) && f.in_scale * f.join + f.in_offset > 0;
  if (!above_zero && !above_join) return Form::kGeneral;
  const bool plain = f.in_scale == 1 && f.in_offset == 0 && f.out_scale == 1 && f.out_offset == 0;
  return plain ? Form::kPlainPower : Form::kSafePower;
}

// The formula from its join on, of doubles that stand for finite floats.
template <Kind kKind, Form kForm>
HWY_INLINE VD Evaluate(VD x, const CurveFormula& f) {
  if constexpr (kKind == Kind::kPq) return PqOfLight(x);
  if constexpr (kKind == Kind::kPqInverse) return LightOfPq(x);
  if constexpr (kKind == Kind::kHlg) return HlgOfLight(x);
  if constexpr (kKind == Kind::kHlgInverse) return LightOfHlg(x);
  if constexpr (kKind == Kind::kLinear) return hn::MulAdd(x, Set(f.slope), Set(f.offset));
  VD v = x;
  if constexpr (kForm != Form::kPlainPower) v = hn::MulAdd(x, Set(f.in_scale), Set(f.in_offset));
  VD w = v;
  if constexpr (kForm != Form::kGeneral) {
    w = s::Exp2OfDouble(hn::Mul(
        s::Log2OfDouble<Precision::kPower>(hn::Max(v, Set(LeastArgument(f.exponent)))), Set(f.exponent)));
  } else if constexpr (kKind == Kind::kPower) {
    w = PowerOf(v, f.exponent);
  } else if constexpr (kKind == Kind::kLog) {
    const VD positive = hn::Max(v, Set(std::max(f.floor, DBL_MIN)));
    w = s::Log2OfDouble(positive);
    if (f.floor <= 0)
      w = hn::IfThenElse(hn::Gt(v, Set(0.0)), w, Set(-std::numeric_limits<double>::infinity()));
  } else if constexpr (kKind == Kind::kExp) {
    w = s::Exp2OfDouble(s::ClampExponent(v));
  }
  if constexpr (kForm == Form::kPlainPower) return w;
  return hn::MulAdd(w, Set(f.out_scale), Set(f.out_offset));
}

// The least float that is not below the join.
float JoinOf(const CurveFormula& f) {
  const auto nearest = static_cast<float>(f.join);
  return nearest < f.join ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}

// One plane; `in` and `out` may be the same.
template <Kind kKind, Form kForm>
void RunPlane(const PlaneCurve& curve, const float* in, float* out, int count) {
  const s::D d;
  const CurveFormula f = curve.formula;
  const V zero = hn::Zero(d), sign = hn::Set(d, -0.0f);
  const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  const V top = hn::Set(d, curve.at_infinity), bottom = hn::Set(d, curve.at_minus_infinity);
  const V join = hn::Set(d, JoinOf(f));
  const bool mirror = f.negatives == Negatives::kMirror, keep = f.negatives == Negatives::kKeep;
  const auto formula = [&f](VD v) HWY_ATTR { return Evaluate<kKind, kForm>(v, f); };
  const auto line = [&f](VD v) HWY_ATTR { return hn::MulAdd(v, Set(f.slope), Set(f.offset)); };
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const V x = hn::LoadU(d, in + i);
    V v = x;
    if (mirror) v = hn::Abs(v);
    if (f.negatives == Negatives::kClamp) v = hn::IfThenElse(hn::Lt(v, zero), zero, v);
    V y = s::InDouble(formula, v);
    const auto below = hn::Lt(v, join);
    if (!hn::AllFalse(d, below)) y = hn::IfThenElse(below, s::InDouble(line, v), y);
    if (mirror) y = hn::Xor(y, hn::And(x, sign));
    if (keep) y = hn::IfThenElse(hn::Lt(x, zero), x, y);
    const auto finite = hn::Lt(hn::Abs(x), infinity);
    if (HWY_UNLIKELY(!hn::AllTrue(d, finite))) {
      y = hn::IfThenElse(finite, y, hn::IfThenElse(hn::Eq(x, infinity), top, bottom));
      y = hn::IfThenElse(hn::IsNaN(x), x, y);
    }
    hn::StoreU(y, d, out + i);
  }
}

using PlaneLoop = void (*)(const PlaneCurve&, const float*, float*, int);
PlaneLoop LoopOf(const CurveFormula& f) {
  switch (f.kind) {
    case Kind::kPower:
      switch (FormOf(f)) {
        case Form::kPlainPower:
          return RunPlane<Kind::kPower, Form::kPlainPower>;
        case Form::kSafePower:
          return RunPlane<Kind::kPower, Form::kSafePower>;
        case Form::kGeneral:
          break;
      }
      return RunPlane<Kind::kPower, Form::kGeneral>;
    case Kind::kLog:
      return RunPlane<Kind::kLog, Form::kGeneral>;
    case Kind::kExp:
      return RunPlane<Kind::kExp, Form::kGeneral>;
    case Kind::kPq:
      return RunPlane<Kind::kPq, Form::kGeneral>;
    case Kind::kPqInverse:
      return RunPlane<Kind::kPqInverse, Form::kGeneral>;
    case Kind::kHlg:
      return RunPlane<Kind::kHlg, Form::kGeneral>;
    case Kind::kHlgInverse:
      return RunPlane<Kind::kHlgInverse, Form::kGeneral>;
    case Kind::kLinear:
      break;
  }
  return RunPlane<Kind::kLinear, Form::kGeneral>;
}

void RunPowerPlane(const PlanePower& power, const float* in, float* out, int count) {
  const s::D d;
  const double e = power.exponent;
  // What the rules of C ask of the exponent, as a float: its sign, and whether it is whole, even or odd.
  const bool whole = std::trunc(e) == e, even = std::trunc(e / 2) == e / 2;
  const double kind = e == 0 ? 0 : !whole ? 0.5 : even ? 2 : 1;
  const V y = hn::Set(d, static_cast<float>(std::copysign(kind, e)));
  const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  // |e| of a moderate size cannot leave a double's exponents.
  const bool moderate = std::fabs(e) <= kMostExponent;
  const auto magnitude = [e, moderate](VD v) HWY_ATTR {
    const VD t = hn::Mul(s::Log2OfDouble<Precision::kPower>(v), Set(e));
    return s::Exp2OfDouble(moderate ? t : s::ClampExponent(t));
  };
  if (e == 2) {
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      const V x = hn::LoadU(d, in + i);
      hn::StoreU(hn::Mul(x, x), d, out + i);
    }
    return;
  }
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const V x = hn::LoadU(d, in + i);
    V r = s::InDouble(magnitude, hn::Abs(x));
    const auto ordinary = hn::And(hn::Gt(x, hn::Zero(d)), hn::Lt(x, infinity));
    if (HWY_UNLIKELY(!hn::AllTrue(d, ordinary)) || kind == 0) r = s::PowSpecial(x, y, r);
    hn::StoreU(r, d, out + i);
  }
}

// Runs loop(plane's curve)(curve, in, out, count) on the active planes, from and to planes or interleaved
// pixels.
template <class Plane, class LoopOfPlane>
class PlaneStage final : public graph::PointStage {
 public:
  PlaneStage(const Plane (&planes)[4], LoopOfPlane loop) : loop_(loop) {
    std::copy(std::begin(planes), std::end(planes), std::begin(planes_));
  }
  bool CanFuse(bool, PixelType) const override { return true; }
  void Run(const graph::PointArgs& args) const override {
    // Results may lie where other planes' samples do, so that all are read before any is written.
    alignas(64) float samples[4][kBlockPixels];
    float* const planes[4] = {samples[0], samples[1], samples[2], samples[3]};
    const s::D d;
    for (int first = 0; first < args.count; first += kBlockPixels) {
      const int count = std::min(kBlockPixels, args.count - first);
      s::LoadChunk(args, first, count, planes);
      for (int p = 0; p < 4; ++p) {
        if (planes_[p].active) loop_(planes_[p])(planes_[p], samples[p], samples[p], count);
      }
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR {
        return s::Pixels{hn::Load(d, samples[0] + i), hn::Load(d, samples[1] + i),
                         hn::Load(d, samples[2] + i), hn::Load(d, samples[3] + i)};
      });
    }
  }

 private:
  Plane planes_[4];
  LoopOfPlane loop_;
};

std::unique_ptr<graph::PointStage> NewCurveStage(const PlaneCurve (&planes)[4]) {
  const auto loop = [](const PlaneCurve& p) { return LoopOf(p.formula); };
  return std::make_unique<PlaneStage<PlaneCurve, decltype(loop)>>(planes, loop);
}
std::unique_ptr<graph::PointStage> NewPowerStage(const PlanePower (&planes)[4]) {
  const auto loop = [](const PlanePower&) { return &RunPowerPlane; };
  return std::make_unique<PlaneStage<PlanePower, decltype(loop)>>(planes, loop);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewCurveStage);
HWY_EXPORT(NewPowerStage);

std::unique_ptr<graph::PointStage> MakeCurveStage(const PlaneCurve (&planes)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewCurveStage)(planes);
}
std::unique_ptr<graph::PointStage> MakePowerStage(const PlanePower (&planes)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewPowerStage)(planes);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
