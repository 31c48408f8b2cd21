// The kernel of curves by formula: each plane of a block by a loop made for its formula.
#include "ops/curve/curve_kernel.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>

#include "ops/curve/curve_constants.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/curve/curve_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/curve/curve_pieces-inl.h"
#include "ops/curve/fast_curve-inl.h"
#include "ops/curve/plane_stage-inl.h"
#include "simd/fused-inl.h"
#include "simd/gather-inl.h"
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

HWY_INLINE VD PqOfLight(VD x) {
  // Errors of u grow 30 times at most: 2^-29 of the result. Light of 0 counts as 2^-1000.
  const VD u = s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(hn::Max(x, Set(0x1p-1000))), Set(kPqM1)));
  const VD ratio = hn::Div(hn::MulAdd(u, Set(kPqC2), Set(kPqC1)), hn::MulAdd(u, Set(kPqC3), Set(1.0)));
  return s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(ratio), Set(kPqM2)));
}
HWY_INLINE VD LightOfPq(VD x) {
  const VD u = PowerOf<Precision::kDouble>(hn::Max(x, Set(0.0)), 1 / kPqM2);
  const VD above = hn::Max(hn::Sub(u, Set(kPqC1)), Set(0.0));
  const VD below = hn::NegMulAdd(u, Set(kPqC3), Set(kPqC2));
  // Beyond the formula's pole, at a signal near 2, light is infinite.
  return hn::IfThenElse(hn::Gt(below, Set(0.0)), PowerOf(hn::Div(above, below), 1 / kPqM1),
                        Set(std::numeric_limits<double>::infinity()));
}

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

// The formula from its join on, of doubles that stand for finite floats.
template <Kind kKind>
HWY_INLINE VD Evaluate(VD x, const CurveFormula& f) {
  if constexpr (kKind == Kind::kPq) return PqOfLight(x);
  if constexpr (kKind == Kind::kPqInverse) return LightOfPq(x);
  if constexpr (kKind == Kind::kHlg) return HlgOfLight(x);
  if constexpr (kKind == Kind::kHlgInverse) return LightOfHlg(x);
  if constexpr (kKind == Kind::kLinear) return hn::MulAdd(x, Set(f.slope), Set(f.offset));
  const VD v = hn::MulAdd(x, Set(f.in_scale), Set(f.in_offset));
  VD w = v;
  const bool sum = f.out_offset != 0;  // it may cancel
  if constexpr (kKind == Kind::kPower) {
    w = sum ? PowerOf<Precision::kDouble>(v, f.exponent) : PowerOf(v, f.exponent);
  } else if constexpr (kKind == Kind::kLog) {
    const VD positive = hn::Max(v, Set(std::max(f.floor, DBL_MIN)));
    w = sum ? s::Log2OfDouble<Precision::kDouble>(positive) : s::Log2OfDouble(positive);
    if (f.floor <= 0)
      w = hn::IfThenElse(hn::Gt(v, Set(0.0)), w, Set(-std::numeric_limits<double>::infinity()));
  } else if constexpr (kKind == Kind::kExp) {
    const VD t = s::ClampExponent(v);
    w = sum ? s::Exp2OfDouble<Precision::kDouble>(t) : s::Exp2OfDouble(t);
  }
  return hn::MulAdd(w, Set(f.out_scale), Set(f.out_offset));
}

// The least float that is not below the join.
float JoinOf(const CurveFormula& f) {
  const auto nearest = static_cast<float>(f.join);
  return nearest < f.join ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}

// How a loop that has no tables of pieces evaluates its formula: all in double, or most in double-float, with
// and without inner and outer scales.
enum class Way : uint8_t { kDouble, kFast, kFastInner, kFastOuter, kFastBoth };

constexpr int kMostSamples = 256;  // between the two passes of tables of pieces

// A plane's curve and the loop that was made for it.
struct CurveWork {
  using Loop = void (*)(const CurveWork&, const float*, float*, int);
  PlaneCurve curve;
  Loop loop = nullptr;
#if TESSERA_DOUBLE_FLOAT
  FastCurve fast;
  CurvePieces pieces;
#endif
  bool active() const { return curve.active; }
  bool quick() const { return curve.formula.kind == Kind::kLinear; }  // quicker than to look it up
  static CurveWork Of(const PlaneCurve& curve, Context& context);
  void operator()(const float* in, float* out, int count) const { loop(*this, in, out, count); }
};

// A vector in which some samples may be anything: below the join, negative, 0, infinite, NaN. `able` marks
// the samples whose formula has been computed: their results are in `y`.
template <Kind kKind>
HWY_NOINLINE V AnyValue(V x, V v, V y, hn::Mask<s::D> able, const PlaneCurve& curve) {
  const s::D d;
  const CurveFormula& f = curve.formula;
  const V zero = hn::Zero(d), infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  const auto below = hn::AndNot(able, hn::Lt(v, hn::Set(d, JoinOf(f))));
  const auto finite = hn::Lt(hn::Abs(x), infinity), at_zero = hn::AndNot(able, hn::Eq(v, zero));
  y = hn::IfThenElse(at_zero, hn::Set(d, curve.at_zero), y);
  const auto done = hn::Or(hn::Or(able, at_zero), hn::Or(below, hn::Not(finite)));
  if (!hn::AllTrue(d, done)) {
    const auto formula = [&f](VD w) HWY_ATTR { return Evaluate<kKind>(w, f); };
    y = hn::IfThenElse(done, y, s::InDouble(formula, v));
  }
  if (!hn::AllFalse(d, below)) {
    const auto line = [&f](VD w) HWY_ATTR { return hn::MulAdd(w, Set(f.slope), Set(f.offset)); };
    y = hn::IfThenElse(below, s::InDouble(line, v), y);
  }
  if (f.negatives == Negatives::kMirror) y = hn::Xor(y, hn::And(x, hn::Set(d, -0.0f)));
  if (f.negatives == Negatives::kKeep) y = hn::IfThenElse(hn::Lt(x, zero), x, y);
  if (!hn::AllTrue(d, finite)) {
    const V top = hn::Set(d, curve.at_infinity), bottom = hn::Set(d, curve.at_minus_infinity);
    y = hn::IfThenElse(finite, y, hn::IfThenElse(hn::Eq(x, infinity), top, bottom));
    y = hn::IfThenElse(hn::IsNaN(x), x, y);
  }
  return y;
}

// The formula of nearly all samples; `able` marks them.
template <Kind kKind, Way kWay>
HWY_INLINE V ValueOf(V v, const CurveWork& work, hn::Mask<s::D>& able) {
#if TESSERA_DOUBLE_FLOAT
  if constexpr (kWay != Way::kDouble) {
    constexpr bool kInner = kWay == Way::kFastInner || kWay == Way::kFastBoth;
    constexpr bool kOuter = kWay == Way::kFastOuter || kWay == Way::kFastBoth;
    return FastValue<kKind, kInner, kOuter>(v, work.fast, able);
  }
#endif
  const s::D d;
  able =
      hn::And(hn::Ne(v, hn::Zero(d)), hn::Lt(hn::Abs(v), hn::Set(d, std::numeric_limits<float>::infinity())));
  return s::InDouble([&work](VD x) HWY_ATTR { return Evaluate<kKind>(x, work.curve.formula); }, v);
}

// Whether a formula takes negative samples, of the sign that is left to it, as 0.
bool TakesNegativesAsZero(const CurveFormula& f) {
  return f.negatives == Negatives::kClamp || f.kind == Kind::kPq || f.kind == Kind::kPqInverse ||
         f.kind == Kind::kHlg;
}

// One plane; `in` and `out` may be the same.
template <Kind kKind, Way kWay>
void RunPlane(const CurveWork& work, const float* in, float* out, int count) {
  const s::D d;
  const CurveFormula& f = work.curve.formula;
  const bool keep = f.negatives == Negatives::kKeep, limit = TakesNegativesAsZero(f);
  const V zero = hn::Zero(d), sign = hn::Set(d, f.negatives == Negatives::kMirror ? -0.0f : 0.0f);
  const V join = hn::Set(d, keep ? std::max(JoinOf(f), 0.0f) : JoinOf(f));
  const V lowest = hn::Set(d, keep ? 0.0f : -std::numeric_limits<float>::max());
  const auto line = [&f](VD w) HWY_ATTR { return hn::MulAdd(w, Set(f.slope), Set(f.offset)); };
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const V x = hn::Add(hn::LoadU(d, in + i), zero);  // -0 is 0: a curve that is not 0 there is not mirrored
    V v = hn::AndNot(sign, x);
    if (limit) v = hn::IfThenElse(hn::Lt(v, zero), zero, v);
    hn::Mask<s::D> able;
    V y = ValueOf<kKind, kWay>(v, work, able);
    const auto below = hn::And(hn::Lt(v, join), hn::Ge(v, lowest));
    able = hn::And(able, hn::Ge(v, join));
    if (HWY_LIKELY(hn::AllTrue(d, hn::Or(able, below)))) {
      if (!hn::AllFalse(d, below)) y = hn::IfThenElse(below, s::InDouble(line, v), y);
      y = hn::Xor(y, hn::And(x, sign));
    } else {
      y = AnyValue<kKind>(x, v, y, able, work.curve);
    }
    hn::StoreU(y, d, out + i);
  }
}

#if TESSERA_DOUBLE_FLOAT
// A vector in which some samples have no piece: powers are computed, where they are moderate.
template <Kind kKind>
HWY_NOINLINE V BesidePieces(V x, V v, V y, hn::Mask<s::D> able, const CurveWork& work) {
  if constexpr (kKind == Kind::kPower || kKind == Kind::kHlgInverse) {
    if (work.fast.able) {
      hn::Mask<s::D> computed;
      const V power = FastValue<kKind, false, false>(v, work.fast, computed);
      computed = hn::AndNot(able, hn::And(computed, hn::Ge(v, s::SetF(JoinOf(work.curve.formula)))));
      y = hn::IfThenElse(computed, power, y);
      able = hn::Or(able, computed);
    }
  }
  return AnyValue<kKind>(x, v, y, able, work.curve);
}
// One plane by tables of pieces, which have the join and the linear part in them.
template <Kind kKind>
void RunPieces(const CurveWork& work, const float* in, float* out, int count) {
  const s::D d;
  const CurveFormula& f = work.curve.formula;
  const bool keep = f.negatives == Negatives::kKeep, limit = TakesNegativesAsZero(f);
  const V zero = hn::Zero(d), sign = hn::Set(d, f.negatives == Negatives::kMirror ? -0.0f : 0.0f);
  const auto argument = [&](V x) HWY_ATTR {
    const V v = hn::AndNot(sign, x);
    return limit ? hn::IfThenElse(hn::Lt(v, zero), zero, v) : v;
  };
  const Pieces pieces(work.pieces);
  constexpr bool kByBits = kKind == Kind::kPqInverse;
  // In two passes, so that neighbouring samples overlap on their way from index through memory to load.
  alignas(64) uint32_t at[kMostSamples];
  for (int first = 0; first < count; first += kMostSamples) {
    const int end = std::min(count, first + kMostSamples);
    for (int i = first; i < end; i += s::kLanes)
      pieces.Locate<kByBits>(argument(hn::LoadU(d, in + i)), at + (i - first));
    for (int i = first; i < end; i += s::kLanes) {
      const V x = hn::Add(hn::LoadU(d, in + i), zero), v = argument(x);  // -0 is 0, as above
      V y = pieces.At<kByBits>(v, at + (i - first));
      auto able = hn::Eq(y, y);
      if (keep) able = hn::And(able, hn::Ge(v, zero));
      if (HWY_LIKELY(hn::AllTrue(d, able))) {
        y = hn::Xor(y, hn::And(x, sign));
      } else {
        y = BesidePieces<kKind>(x, v, y, able, work);
      }
      hn::StoreU(y, d, out + i);
    }
  }
}

template <Kind kKind>
CurveWork::Loop LoopOfKind(const CurveWork& work) {
  const FastCurve& fast = work.fast;
  if (work.pieces.able) return RunPieces<kKind>;
  if constexpr (kKind == Kind::kExp) {
    if (fast.able && fast.inner && fast.outer) return RunPlane<kKind, Way::kFastBoth>;
    if (fast.able && fast.inner) return RunPlane<kKind, Way::kFastInner>;
  }
  if constexpr (kKind == Kind::kLog || kKind == Kind::kExp) {
    if (fast.able && fast.outer) return RunPlane<kKind, Way::kFastOuter>;
  }
  if constexpr (kKind != Kind::kPq && kKind != Kind::kPqInverse && kKind != Kind::kHlg) {
    if (fast.able) return RunPlane<kKind, Way::kFast>;
  }
  return RunPlane<kKind, Way::kDouble>;
}
#else
template <Kind kKind>
CurveWork::Loop LoopOfKind(const CurveWork&) {
  return RunPlane<kKind, Way::kDouble>;
}
#endif

CurveWork CurveWork::Of(const PlaneCurve& curve, [[maybe_unused]] Context& context) {
  CurveWork work;
  work.curve = curve;
#if TESSERA_DOUBLE_FLOAT
  work.pieces = PiecesOf(curve.formula, context);
  work.fast = FastCurveOf(curve.formula);
#endif
  switch (curve.formula.kind) {
    case Kind::kPower:
      work.loop = LoopOfKind<Kind::kPower>(work);
      break;
    case Kind::kLog:
      work.loop = LoopOfKind<Kind::kLog>(work);
      break;
    case Kind::kExp:
      work.loop = LoopOfKind<Kind::kExp>(work);
      break;
    case Kind::kPq:
      work.loop = LoopOfKind<Kind::kPq>(work);
      break;
    case Kind::kPqInverse:
      work.loop = LoopOfKind<Kind::kPqInverse>(work);
      break;
    case Kind::kHlg:
      work.loop = LoopOfKind<Kind::kHlg>(work);
      break;
    case Kind::kHlgInverse:
      work.loop = LoopOfKind<Kind::kHlgInverse>(work);
      break;
    case Kind::kLinear:
      work.loop = RunPlane<Kind::kLinear, Way::kDouble>;
      break;
  }
  return work;
}

// |x|^e in double.
V MagnitudeInDouble(V x, double e) {
  const auto magnitude = [e](VD v) HWY_ATTR {
    return s::Exp2OfDouble(s::ClampExponent(hn::Mul(s::Log2OfDouble<Precision::kPower>(v), Set(e))));
  };
  return s::InDouble(magnitude, hn::Abs(x));
}

// A plane's power by C's rules.
struct PowerWork {
  PlanePower power;
#if TESSERA_DOUBLE_FLOAT
  FastCurve fast;
  CurvePieces pieces;
#endif
  static PowerWork Of(const PlanePower& power, Context& context);
  bool active() const { return power.active; }
  bool quick() const { return power.exponent == 2; }

  // The first pass of two, over pieces.
  HWY_INLINE void Locate(const float* in, int count, uint32_t* at) const {
#if TESSERA_DOUBLE_FLOAT
    if (!pieces.able) return;
    const Pieces table(pieces);
    for (int i = 0; i < count; i += s::kLanes)
      table.Locate<false>(hn::Abs(hn::LoadU(s::D(), in + i)), at + i);
#else
    (void)in, (void)count, (void)at;
#endif
  }
  // |x|^e where x is neither 0 nor infinite nor NaN.
  HWY_INLINE V Magnitude(V x, const uint32_t* at) const {
    (void)at;
#if TESSERA_DOUBLE_FLOAT
    if (pieces.able) {
      const V y = Pieces(pieces).At<false>(hn::Abs(x), at);
      return HWY_LIKELY(hn::AllTrue(s::D(), hn::Eq(y, y))) ? y : BesidePieces(x, y);
    }
#endif
    return MagnitudeInDouble(x, power.exponent);
  }
#if TESSERA_DOUBLE_FLOAT
  // The samples whose y is NaN.
  HWY_NOINLINE V BesidePieces(V x, V y) const {
    const s::D d;
    const V size = hn::Abs(x);
    auto done = hn::Eq(y, y);
    if (fast.able) {
      hn::Mask<s::D> able;
      y = hn::IfThenElse(done, y, FastValue<Kind::kPower, false, false>(size, fast, able));
      done = hn::Or(done, able);
    }
    const auto special = hn::Not(
        hn::And(hn::Gt(size, hn::Zero(d)), hn::Lt(size, s::SetF(std::numeric_limits<float>::infinity()))));
    done = hn::Or(done, special);
    if (hn::AllTrue(d, done)) return y;
    return hn::IfThenElse(done, y, MagnitudeInDouble(x, power.exponent));
  }
#endif

  void operator()(const float* in, float* out, int count) const {
    const s::D d;
    const double e = power.exponent;
    if (e == 2) {
      for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
        const V x = hn::LoadU(d, in + i);
        hn::StoreU(hn::Mul(x, x), d, out + i);
      }
      return;
    }
    // What the rules of C ask of the exponent, as a float: its sign, and whether it is whole, even or odd.
    const bool whole = std::trunc(e) == e, even = std::trunc(e / 2) == e / 2;
    const double kind = e == 0 ? 0 : !whole ? 0.5 : even ? 2 : 1;
    const V y = hn::Set(d, static_cast<float>(std::copysign(kind, e)));
    const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    alignas(64) uint32_t at[kMostSamples];
    for (int first = 0; first < count; first += kMostSamples) {
      const int end = std::min(count, first + kMostSamples);
      Locate(in + first, end - first, at);
      for (int i = first; i < end; i += s::kLanes) {
        const V x = hn::LoadU(d, in + i);
        V r = Magnitude(x, at + (i - first));
        const auto ordinary = hn::And(hn::Gt(x, hn::Zero(d)), hn::Lt(x, infinity));
        if (HWY_UNLIKELY(!hn::AllTrue(d, ordinary)) || kind == 0) r = s::PowSpecial(x, y, r);
        hn::StoreU(r, d, out + i);
      }
    }
  }
};

PowerWork PowerWork::Of(const PlanePower& power, [[maybe_unused]] Context& context) {
  PowerWork work;
  work.power = power;
#if TESSERA_DOUBLE_FLOAT
  work.fast.able = IsModerateExponent(power.exponent);
  work.fast.exponent = s::SplitDouble(power.exponent);
  CurveFormula formula;
  formula.kind = Kind::kPower, formula.exponent = power.exponent;
  if (work.fast.able) work.pieces = PiecesOf(formula, context);
#endif
  return work;
}

std::unique_ptr<graph::PointStage> NewCurveStage(const PlaneCurve (&planes)[4], bool bytes,
                                                 Context& context) {
  return std::make_unique<PlaneStage<CurveWork>>(planes, bytes, context);
}
std::unique_ptr<graph::PointStage> NewPowerStage(const PlanePower (&planes)[4], bool bytes,
                                                 Context& context) {
  return std::make_unique<PlaneStage<PowerWork>>(planes, bytes, context);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewCurveStage);
HWY_EXPORT(NewPowerStage);

std::unique_ptr<graph::PointStage> MakeCurveStage(const PlaneCurve (&planes)[4], bool bytes,
                                                  Context& context) {
  return HWY_DYNAMIC_DISPATCH(NewCurveStage)(planes, bytes, context);
}
std::unique_ptr<graph::PointStage> MakePowerStage(const PlanePower (&planes)[4], bool bytes,
                                                  Context& context) {
  return HWY_DYNAMIC_DISPATCH(NewPowerStage)(planes, bytes, context);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
