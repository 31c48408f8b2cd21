// Curves by formula on float vectors in double-float arithmetic: what nearly all samples take. The rest
// (tiny, huge, outside a formula's domain) is left to the formulas in double.
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

// The logarithm N of a PQ signal to base 2 runs from kPqLow (no light) to kPqHigh (infinite light), and is
// all but logistic in the logarithm of light l:
//   m1 log2(l) = log2((N - low) / (high - N)) + kPqShift + P(N - middle),  |P| < 0.0022
// with P odd, because both (c1 - u) and (c2 - c3 u) are expm1 of small numbers, whose logarithms are z/2 +
// z^2/24 beside log z. With v = 1 / (1 + l^m1 2^-kPqShift) that is N = high - (high - low) v + Q(v - 1/2), Q
// odd too.
constexpr double kPqLow = -20.38371229093457, kPqHigh = 0.9942611607038015, kPqShift = -4.3595734440063545;

// A formula's numbers as its loop wants them. The scale of a power or an exponential lies in its table.
struct FastCurve {
  bool able = false;                  // the formula is one that the fast way computes within its error
  bool inner = false, outer = false;  // in_scale and in_offset, out_scale and out_offset do something
  float least = 0;                    // results below it are sums that cancel too far
  s::SplitDouble exponent, in_scale, in_offset, out_scale, out_offset;
  s::Exp2Table powers, inner_powers;  // of the result; of PQ's light
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
  const auto moderate = [](double v) { return std::fabs(v) >= 0x1p-20 && std::fabs(v) <= 0x1p20; };
  c.able = moderate(in_scale) && moderate(out_scale);
  switch (f.kind) {
    case Kind::kLinear:
      c.able = false;
      return c;
    case Kind::kPower:
      c.able &= IsModerateExponent(f.exponent);
      c.exponent = s::SplitDouble(f.exponent);
      break;
    case Kind::kLog:
      c.able &= f.floor <= 0x1p-101;
      break;
    case Kind::kExp:
      break;
    case Kind::kHlg:
      in_scale = 12, in_offset = -kHlgB, out_scale = kHlgA * kLn2, out_offset = kHlgC;
      c.able = true;
      break;
    case Kind::kHlgInverse:
      in_scale = 1 / (kHlgA * kLn2), in_offset = -kHlgC / (kHlgA * kLn2);
      out_scale = 1.0 / 12, out_offset = kHlgB / 12;
      c.able = true;
      break;
    case Kind::kPq:
      in_scale = out_scale = 1, in_offset = out_offset = 0;
      c.exponent = s::SplitDouble(kPqM1);
      c.inner_powers = s::Exp2Table(std::exp2(-kPqShift));
      c.able = true;
      break;
    case Kind::kPqInverse:
      in_scale = out_scale = 1, in_offset = out_offset = 0;
      c.exponent = s::SplitDouble(1 / kPqM1);
      c.able = true;
      break;
  }
  c.in_scale = s::SplitDouble(in_scale), c.in_offset = s::SplitDouble(in_offset);
  c.out_scale = s::SplitDouble(out_scale), c.out_offset = s::SplitDouble(out_offset);
  // The error of a logarithm is 2^-35, that of a power 2^-29 of it.
  c.least = static_cast<float>(std::fabs(out_offset) * (f.kind == Kind::kLog ? 0x1p-8 : 0x1p-3));
  c.inner = in_scale != 1 || in_offset != 0;
  c.outer = out_offset != 0 || (f.kind == Kind::kLog && out_scale != 1);
  if (f.kind != Kind::kLog && f.kind != Kind::kHlg) c.powers = s::Exp2Table(out_scale);
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

HWY_INLINE s::V FastPq(s::V x, const FastCurve& c, hn::Mask<s::D>& able) {
  able = HasLog(x);
  const s::DoubleFloat l = s::Times(s::Log2Of<false>({x, x}), c.exponent);
  const s::DoubleFloat p = s::Exp2Of(l, c.inner_powers), r = s::FastTwoSum(p.hi, hn::Mul(p.hi, p.lo));
  s::DoubleFloat sum = s::TwoSum(s::SetF(1), r.hi);
  sum.lo = hn::Add(sum.lo, r.lo);
  const s::V v = hn::Div(s::SetF(1), sum.hi);
  const s::V rest = hn::NegMulAdd(v, sum.lo, hn::NegMulAdd(v, sum.hi, s::SetF(1)));
  const s::V d = hn::Sub(v, s::SetF(0.5f)), z = hn::Mul(d, d);
  s::V q = hn::MulAdd(z, s::SetF(2.10118381e-06f), s::SetF(0.000332707133f));
  q = hn::MulAdd(z, q, s::SetF(0.0628711491f));
  q = hn::Mul(hn::Mul(d, hn::Sub(s::SetF(0.25f), z)), q);
  s::DoubleFloat n = s::Times({v, hn::Mul(v, rest)}, s::SplitDouble(kPqLow - kPqHigh));
  n = s::Plus(n, s::SplitDouble(kPqHigh));
  n.lo = hn::Add(n.lo, q);
  return Power<false>(n, c, able);
}

HWY_INLINE s::V FastPqInverse(s::V x, const FastCurve& c, hn::Mask<s::D>& able) {
  const s::DoubleFloat l = s::Log2Of<false>({x, x}), n = s::FastTwoSum(l.hi, l.lo);
  const s::DoubleFloat above = s::Plus(n, s::SplitDouble(-kPqLow));
  s::DoubleFloat below = s::Plus(n, s::SplitDouble(-kPqHigh));
  below = {hn::Neg(below.hi), hn::Neg(below.lo)};
  able = hn::And(hn::Ge(x, s::SetF(0x1p-100f)),
                 hn::And(hn::Gt(above.hi, s::SetF(0.2f)), hn::Gt(below.hi, s::SetF(0.2f))));
  s::DoubleFloat t = s::Log2Of<true>(s::Quotient(above, below));
  const s::V y = hn::Sub(n.hi, s::SetF(static_cast<float>((kPqLow + kPqHigh) / 2)));
  const s::V p = hn::Mul(y, hn::MulAdd(hn::Mul(y, y), s::SetF(-2.55650037e-10f), s::SetF(0.000198615114f)));
  t = s::Plus(t, s::SplitDouble(kPqShift));
  t.lo = hn::Add(t.lo, p);
  return Power<false>(s::Times(t, c.exponent), c, able);
}

// Light below 1/12 gives a root, which is half the logarithm raised again.
HWY_INLINE s::V FastHlg(s::V x, const FastCurve& c, hn::Mask<s::D>& able) {
  const auto dark = hn::Lt(x, s::SetF(1.0f / 12));
  const s::DoubleFloat tripled = s::Times(x, s::SplitDouble(3)), inner = Inner<true>(x, c);
  const s::DoubleFloat a = {hn::IfThenElse(dark, tripled.hi, inner.hi),
                            hn::IfThenElse(dark, tripled.lo, inner.lo)};
  able = HasLog(a.hi);
  const s::DoubleFloat l = s::Log2Of<true>(a);
  s::V y = s::ToFloat(s::Plus(s::Times(l, c.out_scale), c.out_offset));
  if (!hn::AllFalse(s::D(), dark)) {
    const s::V half = s::SetF(0.5f);
    const s::DoubleFloat p = s::Exp2Of({hn::Mul(l.hi, half), hn::Mul(l.lo, half)}, c.powers);
    y = hn::IfThenElse(dark, hn::MulAdd(p.hi, p.lo, p.hi), y);
  }
  return y;
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
  if constexpr (kKind == Kind::kPq) {
    return FastPq(x, c, able);
  } else if constexpr (kKind == Kind::kPqInverse) {
    return FastPqInverse(x, c, able);
  } else if constexpr (kKind == Kind::kHlg) {
    return FastHlg(x, c, able);
  } else if constexpr (kKind == Kind::kHlgInverse) {
    return FastHlgInverse(x, c, able);
  } else if constexpr (kKind == Kind::kExp) {
    const s::DoubleFloat t = Inner<kInner>(x, c);
    able = HasPower(t.hi);
    return Power<kOuter>(t, c, able);
  } else {
    static_assert(kKind == Kind::kPower || kKind == Kind::kLog);
    const s::DoubleFloat v = Inner<kInner>(x, c);
    able = HasLog(v.hi);
    const s::DoubleFloat l = s::Log2Of<kInner>(v);
    if constexpr (kKind == Kind::kLog) {
      if constexpr (!kOuter) return s::ToFloat(l);
      const s::V y = s::ToFloat(s::Plus(s::Times(l, c.out_scale), c.out_offset));
      able = hn::And(able, hn::Ge(hn::Abs(y), s::SetF(c.least)));
      return y;
    } else {
      const s::DoubleFloat t = s::Times(l, c.exponent);
      able = hn::And(able, HasPower(t.hi));
      return Power<kOuter>(t, c, able);
    }
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
