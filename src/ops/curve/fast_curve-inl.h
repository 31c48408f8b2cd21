// Plain powers, logarithms and exponentials on float vectors in double-float arithmetic, over nearly all
// floats. The rest (tiny, huge, outside a formula's domain) is left to the formulas in double.
#if defined(TESSERA_OPS_CURVE_FAST_CURVE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_CURVE_FAST_CURVE_INL_H_
#undef TESSERA_OPS_CURVE_FAST_CURVE_INL_H_
#else
#define TESSERA_OPS_CURVE_FAST_CURVE_INL_H_
#endif

#include <hwy/highway.h>

#include <cmath>

#include "ops/curve/curve_constants.h"
#include "simd/double_float-inl.h"
#include "tessera/ops/curve.h"

#if TESSERA_DOUBLE_FLOAT
HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// A formula's numbers as its loop wants them. The scale of a power or an exponential lies in its table.
struct FastCurve {
  bool able = false;                  // the formula is one that the fast way computes within its error
  bool inner = false, outer = false;  // in_scale and in_offset, out_scale and out_offset do something
  float least = 0;                    // results below it are sums that cancel too far
  s::SplitDouble exponent, in_scale, in_offset, out_scale, out_offset;
  s::Exp2Table powers;
};

// Exponents whose powers neither lose accuracy nor, for small ones, their monotony (neighbouring floats must
// give results that differ by more than twice the error).
constexpr double kLeastExponent = 0.1, kMostExponent = 64;
inline bool IsModerateExponent(double e) {
  return std::fabs(e) >= kLeastExponent && std::fabs(e) <= kMostExponent;
}

inline FastCurve FastCurveOf(const CurveFormula& f) {
  using Kind = CurveFormula::Kind;
  FastCurve c;
  double in_scale = f.in_scale, in_offset = f.in_offset, out_scale = f.out_scale, out_offset = f.out_offset;
  switch (f.kind) {
    case Kind::kPower:
      c.able = in_scale > 0 && in_offset == 0 && out_offset == 0 && IsModerateExponent(f.exponent);
      if (!c.able) return c;
      out_scale *= std::pow(in_scale, f.exponent), in_scale = 1;
      break;
    case Kind::kLog:
      c.able = in_scale > 0 && in_offset == 0 && f.floor <= 0x1p-101;
      if (!c.able) return c;
      out_offset += out_scale * std::log2(in_scale), in_scale = 1;
      break;
    case Kind::kExp:
      c.able = true;
      break;
    case Kind::kHlgInverse:
      in_scale = 1 / (kHlgA * kLn2), in_offset = -kHlgC / (kHlgA * kLn2);
      out_scale = 1.0 / 12, out_offset = kHlgB / 12;
      c.able = true;
      break;
    default:
      return c;
  }
  const auto moderate = [](double v) { return std::fabs(v) >= 0x1p-20 && std::fabs(v) <= 0x1p20; };
  c.able &= moderate(in_scale) && moderate(out_scale);
  c.exponent = s::SplitDouble(f.exponent);
  c.in_scale = s::SplitDouble(in_scale), c.in_offset = s::SplitDouble(in_offset);
  c.out_scale = s::SplitDouble(out_scale), c.out_offset = s::SplitDouble(out_offset);
  // The error of a logarithm is 2^-35, that of a power 2^-29 of it.
  c.least = static_cast<float>(std::fabs(out_offset) * (f.kind == Kind::kLog ? 0x1p-8 : 0x1p-3));
  c.inner = in_scale != 1 || in_offset != 0;
  c.outer = out_offset != 0 || (f.kind == Kind::kLog && out_scale != 1);
  if (f.kind != Kind::kLog) c.powers = s::Exp2Table(out_scale);
  return c;
}

// Arguments of a logarithm and powers of two that stay far from the ends of float.
HWY_INLINE hn::Mask<s::D> HasLog(s::V v) {
  return hn::And(hn::Ge(v, s::SetF(0x1p-100f)), hn::Lt(v, s::SetF(0x1p127f)));
}
HWY_INLINE hn::Mask<s::D> HasPower(s::V t) { return hn::Lt(hn::Abs(t), s::SetF(100)); }

template <bool kInner>
HWY_INLINE s::DoubleFloat Inner(s::V x, const FastCurve& c) {
  if constexpr (kInner) return s::Plus(s::Times(x, c.in_scale), c.in_offset);
  return {x, hn::Zero(s::D())};
}
// scale 2^t + out_offset. Where the sum cancels, the error of the power would show: such samples are not
// `able`.
template <bool kOuter>
HWY_INLINE s::V Power(const s::DoubleFloat& t, const FastCurve& c, hn::Mask<s::D>& able) {
  const s::DoubleFloat p = s::Exp2Of(t, c.powers);
  if constexpr (kOuter) {
    const s::V y = s::ToFloat(s::Plus({p.hi, hn::Mul(p.hi, p.lo)}, c.out_offset));
    able = hn::And(able, hn::Ge(hn::Abs(y), s::SetF(c.least)));
    return y;
  }
  return hn::MulAdd(p.hi, p.lo, p.hi);
}

HWY_INLINE s::V FastHlgInverse(s::V x, const FastCurve& c, hn::Mask<s::D>& able) {
  const s::DoubleFloat t = Inner<true>(x, c);
  const auto dark = hn::Lt(x, s::SetF(0.5f));
  able = HasPower(t.hi);
  s::V y = Power<true>(t, c, able);
  able = hn::Or(hn::And(dark, hn::Gt(hn::Abs(x), s::SetF(0x1p-40f))), hn::AndNot(dark, able));
  if (!hn::AllFalse(s::D(), dark)) {
    const s::V p = hn::Mul(x, x);
    const s::DoubleFloat square = {p, hn::MulSub(x, x, p)};
    y = hn::IfThenElse(dark, s::ToFloat(s::Times(square, s::SplitDouble(1.0 / 3))), y);
  }
  return y;
}

// The formula from its join on. Sets `able` where the result is right; elsewhere it is anything.
template <CurveFormula::Kind kKind, bool kInner, bool kOuter>
HWY_INLINE s::V FastValue(s::V x, const FastCurve& c, hn::Mask<s::D>& able) {
  using Kind = CurveFormula::Kind;
  if constexpr (kKind == Kind::kHlgInverse) {
    return FastHlgInverse(x, c, able);
  } else if constexpr (kKind == Kind::kExp) {
    const s::DoubleFloat t = Inner<kInner>(x, c);
    able = HasPower(t.hi);
    return Power<kOuter>(t, c, able);
  } else {
    static_assert(kKind == Kind::kPower || kKind == Kind::kLog);
    able = HasLog(x);
    const s::DoubleFloat l = s::Log2Of(x);
    if constexpr (kKind == Kind::kPower) {
      const s::DoubleFloat t = s::Times(l, c.exponent);
      able = hn::And(able, HasPower(t.hi));
      return Power<false>(t, c, able);
    } else if constexpr (kOuter) {
      const s::DoubleFloat scaled = s::Times(l, c.out_scale);
      if (c.out_offset.hi == 0) return s::ToFloat(scaled);
      const s::V y = s::ToFloat(s::Plus(scaled, c.out_offset));
      able = hn::And(able, hn::Ge(hn::Abs(y), s::SetF(c.least)));
      return y;
    } else {
      return s::ToFloat(l);
    }
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
