// The lanes of a float vector in double, part by part: geometry whose rounding must not show in float
// results.
#if defined(TESSERA_SIMD_DOUBLES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_DOUBLES_INL_H_
#undef TESSERA_SIMD_DOUBLES_INL_H_
#else
#define TESSERA_SIMD_DOUBLES_INL_H_
#endif

#include <hwy/highway.h>

#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kParts = 2;

// Part `kPart` of a float vector's lanes.
template <int kPart>
HWY_INLINE VD Part(V v) {
  const hn::Half<D> dh;
  return hn::PromoteTo(DD(), kPart == 0 ? hn::LowerHalf(dh, v) : hn::UpperHalf(dh, v));
}
// Both parts rounded to float.
HWY_INLINE V Join(const VD (&parts)[kParts]) {
  const hn::Half<D> dh;
  return hn::Combine(D(), hn::DemoteTo(dh, parts[1]), hn::DemoteTo(dh, parts[0]));
}
// Both parts, whole numbers within int32, as integers.
HWY_INLINE VI JoinIntegers(const VD (&parts)[kParts]) {
  const hn::Half<DI> dh;
  return hn::Combine(DI(), hn::DemoteTo(dh, parts[1]), hn::DemoteTo(dh, parts[0]));
}
// The lowest 32 bits of both parts' doubles, as integers.
HWY_INLINE VI JoinLowBits(const VD (&parts)[kParts]) {
  return hn::ConcatEven(DI(), hn::BitCast(DI(), parts[1]), hn::BitCast(DI(), parts[0]));
}
// f.template operator()<part>() for every part.
template <class F>
HWY_INLINE void EachPart(const F& f) {
  f.template operator()<0>();
  if constexpr (kParts == 2) f.template operator()<1>();
}

HWY_INLINE VD SetD(double v) { return hn::Set(DD(), v); }
// row[0] x + row[1] y + row[2] z + row[3].
HWY_INLINE VD RowTimes(const double* row, VD x, VD y, VD z) {
  return hn::MulAdd(SetD(row[2]), z, hn::MulAdd(SetD(row[1]), y, hn::MulAdd(SetD(row[0]), x, SetD(row[3]))));
}
HWY_INLINE VD LengthOf(VD x, VD y, VD z) {
  return hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
}
// x where it is a number; else the other.
HWY_INLINE VD NumberOr(VD x, VD other) { return hn::IfThenElse(hn::Eq(x, x), x, other); }

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
