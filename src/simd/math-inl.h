// Logarithms and exponentials in double, of which functions on float vectors are made (curves, powers), and
// the special values of powers.
//
// A vector of floats is computed as two vectors of doubles: polynomials without tables, whose relative error
// (2^-34 for exponentials, 2^-45 for logarithms) leaves little but the final rounding to float. Every float,
// subnormals included, is a normal double, so there are no special ranges. Targets with fused multiply-add
// give the same bits.
#if defined(TESSERA_SIMD_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_MATH_INL_H_
#undef TESSERA_SIMD_MATH_INL_H_
#else
#define TESSERA_SIMD_MATH_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <limits>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// Doubles: half of a float vector's lanes.
using DD = hn::Repartition<double, D>;
using VD = hn::Vec<DD>;

// f(doubles) -> doubles on both halves of the float vectors, rounded to float.
template <class F>
HWY_INLINE V InDouble(const F& f, V x) {
  const hn::Half<D> dh;
  const VD low = f(hn::PromoteTo(DD(), hn::LowerHalf(dh, x)));
  const VD high = f(hn::PromoteTo(DD(), hn::UpperHalf(dh, x)));
  return hn::Combine(D(), hn::DemoteTo(dh, high), hn::DemoteTo(dh, low));
}

// How much of a double is needed: the logarithm inside a power (relative error 2^-37), what is rounded to
// float next, or what is computed with further.
enum class Precision : uint8_t { kPower, kFloat, kDouble };

// c[0] + c[1] x + ... by Horner's rule: the fewest operations; independent vectors hide its latency.
template <size_t kCount>
HWY_INLINE VD Polynomial(VD x, const double (&c)[kCount]) {
  const DD d;
  VD sum = hn::Set(d, c[kCount - 1]);
  for (size_t i = kCount - 1; i-- > 0;) sum = hn::MulAdd(sum, x, hn::Set(d, c[i]));
  return sum;
}

// log2 of positive, finite, normal doubles: k + 2 atanh(s) / ln 2, s = (m - 1) / (m + 1), m in [sqrt(1/2),
// sqrt(2)). Relative error 2^-37 (kPower), 2^-45 (kFloat) or 2^-51.
template <Precision kPrecision = Precision::kFloat>
HWY_INLINE VD Log2OfDouble(VD x) {
  const DD d;
  const hn::RebindToUnsigned<DD> du;
  constexpr uint64_t kOne = 0x3ff0000000000000, kRootOfHalf = 0x3fe6a09e667f3bcd;
  const auto bits = hn::Add(hn::BitCast(du, x), hn::Set(du, kOne - kRootOfHalf));
  // The exponent becomes a double by way of the bits of 2^52 + exponent.
  const VD k =
      hn::Sub(hn::BitCast(d, hn::Or(hn::ShiftRight<52>(bits), hn::Set(du, uint64_t{0x4330000000000000}))),
              hn::Set(d, 0x1p52 + 1023));
  const VD m = hn::BitCast(
      d, hn::Add(hn::And(bits, hn::Set(du, uint64_t{0x000fffffffffffff})), hn::Set(du, kRootOfHalf)));
  const VD s = hn::Div(hn::Sub(m, hn::Set(d, 1.0)), hn::Add(m, hn::Set(d, 1.0)));
  const VD z = hn::Mul(s, s);
  if constexpr (kPrecision == Precision::kDouble) {
    return hn::MulAdd(s,
                      Polynomial(z, {2.8853900817779268115, 0.96179669392598973881, 0.57707801634551408177,
                                     0.41219858584229418696, 0.32059853476504814154, 0.26233436060329547249,
                                     0.22091286734180157085, 0.21366122502798327273}),
                      k);
  } else if constexpr (kPrecision == Precision::kFloat) {
    return hn::MulAdd(s,
                      Polynomial(z, {2.8853900817778505769, 0.96179669411235944842, 0.57707794263026179854,
                                     0.41220922733052444177, 0.31990666088914740081, 0.28288718263073563996}),
                      k);
  } else {
    return hn::MulAdd(s,
                      Polynomial(z, {2.8853900817899931572, 0.96179667344322825542, 0.577083567703489245,
                                     0.41167365840081596267, 0.34071413665191199365}),
                      k);
  }
}

// 2^t of doubles in [-1000, 1000]; integers give powers that are exact (in float). Relative error 2^-34
// (kFloat) or 2^-51.
template <Precision kPrecision = Precision::kFloat>
HWY_INLINE VD Exp2OfDouble(VD t) {
  const DD d;
  const hn::RebindToUnsigned<DD> du;
  const VD magic = hn::Set(d, 0x1.8p52);  // adding it rounds to an integer, held in the lowest bits
  const VD shifted = hn::Add(t, magic);
  const VD f = hn::Sub(t, hn::Sub(shifted, magic));
  VD p;
  if constexpr (kPrecision == Precision::kDouble) {
    p = Polynomial(f, {1.0, 0.69314718055994530925, 0.24022650695910159567, 0.055504108664821627039,
                       0.0096181291075872566681, 0.0013333558146406470697, 0.00015403530463724354209,
                       0.000015252733841556772589, 1.3215432535912376166e-6, 1.0178057087733941105e-7,
                       7.0741942972885210056e-9, 4.455817908336064493e-10});
  } else {
    p = Polynomial(f, {0.99999999995956175074, 0.69314718055683241353, 0.24022651213498092661,
                       0.055504109063258666119, 0.0096180256133180342494, 0.0013333478473685415281,
                       0.00015469729214118297093, 0.000015303700711365693939});
  }
  return hn::BitCast(d, hn::Add(hn::BitCast(du, p), hn::ShiftLeft<52>(hn::BitCast(du, shifted))));
}

// Exponents beyond these round to infinity and to 0 in float.
constexpr double kMaxExponent = 160;
HWY_INLINE VD ClampExponent(VD t) {
  const DD d;
  return hn::Max(hn::Min(t, hn::Set(d, kMaxExponent)), hn::Set(d, -kMaxExponent));
}

// What pow gives where its magnitude is not 2^(y log2 x) of ordinary numbers, or where a sign is needed: C's
// rules.
inline HWY_NOINLINE V PowSpecial(V x, V y, V magnitude) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  const V nan = hn::Set(d, std::numeric_limits<float>::quiet_NaN());
  const V size = hn::Abs(x);
  const auto x_zero = hn::Eq(x, zero), x_endless = hn::Eq(size, infinity),
             y_endless = hn::Eq(hn::Abs(y), infinity);
  // |x| = 0 or infinity: to 0 or infinity by the sign of y.
  V r = hn::IfThenElse(x_zero, hn::IfThenElse(hn::Lt(y, zero), infinity, zero), magnitude);
  r = hn::IfThenElse(x_endless, hn::IfThenElse(hn::Lt(y, zero), zero, infinity), r);
  // y infinite: by whether |x| is above or below 1; 1 at 1.
  const auto grows = hn::Xor(hn::VecFromMask(d, hn::Gt(size, one)), hn::VecFromMask(d, hn::Lt(y, zero)));
  r = hn::IfThenElse(y_endless, hn::IfThenElse(hn::MaskFromVec(grows), infinity, zero), r);
  r = hn::IfThenElse(hn::And(y_endless, hn::Eq(size, one)), one, r);
  // Integers and odd integers; every float of 2^24 and above is an even integer.
  const V whole = hn::Trunc(y), half = hn::Mul(y, hn::Set(d, 0.5f));
  const auto is_whole = hn::Eq(whole, y);
  const auto is_even = hn::Eq(hn::Trunc(half), half);
  const auto negative = hn::MaskFromVec(hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(DI(), x))));
  const auto odd = hn::AndNot(is_even, is_whole);
  r = hn::IfThenElse(hn::And(negative, odd), hn::Neg(r), r);
  const auto ordinary_negative = hn::AndNot(x_zero, hn::AndNot(x_endless, hn::Lt(x, zero)));
  r = hn::IfThenElse(hn::AndNot(is_whole, ordinary_negative), nan, r);
  r = hn::IfThenElse(hn::Or(hn::IsNaN(x), hn::IsNaN(y)), nan, r);
  return hn::IfThenElse(hn::Or(hn::Eq(x, one), hn::Eq(y, zero)), one, r);
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
