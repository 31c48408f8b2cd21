// Vectors of three doubles per pixel, a part of a float vector's lanes at a time.
#if defined(TESSERA_OPS_ENVIRONMENT_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_ENVIRONMENT_VECTORS_INL_H_
#undef TESSERA_OPS_ENVIRONMENT_VECTORS_INL_H_
#else
#define TESSERA_OPS_ENVIRONMENT_VECTORS_INL_H_
#endif

#include <hwy/highway.h>

#include "simd/doubles-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::EachPart;
using s::Join;
using s::JoinIntegers;
using s::kParts;
using s::LengthOf;
using s::NumberOr;
using s::Part;
using s::RowTimes;
using s::SetD;
using s::V;
using s::VD;

struct Three {
  VD x, y, z;
};
HWY_INLINE VD DotOf(const Three& a, const Three& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE Three Plus(const Three& a, const Three& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Three CrossOf(const Three& a, const Three& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}
HWY_INLINE Three Times(const Three& a, VD f) { return {hn::Mul(a.x, f), hn::Mul(a.y, f), hn::Mul(a.z, f)}; }
HWY_INLINE Three Minus(const Three& a, const Three& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Three Constant(const double* v) { return {SetD(v[0]), SetD(v[1]), SetD(v[2])}; }
template <int kPart>
HWY_INLINE Three PartOf(const s::Pixels& p) {
  return {Part<kPart>(p.r), Part<kPart>(p.g), Part<kPart>(p.b)};
}
// A number above 0 and below infinity.
HWY_INLINE auto Positive(VD v) {
  const DD d;
  return hn::And(hn::Gt(v, hn::Zero(d)), hn::Lt(v, hn::Inf(d)));
}
// Unit length; a vector of length 0, NaN and infinite ones become 0.
HWY_INLINE Three UnitOf(const Three& v) {
  const VD square = DotOf(v, v);
  const auto usable = Positive(square);
  const VD over = hn::IfThenElseZero(usable, hn::Div(SetD(1.0), hn::Sqrt(square)));
  const auto part = [&](VD c) HWY_ATTR { return hn::IfThenElseZero(usable, hn::Mul(c, over)); };
  return {part(v.x), part(v.y), part(v.z)};
}
HWY_INLINE Three Choose(hn::Mask<DD> mask, const Three& a, const Three& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}
// One NaN for all.
HWY_INLINE V Clean(V v) { return hn::IfThenElse(hn::IsNaN(v), hn::NaN(s::D()), v); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
