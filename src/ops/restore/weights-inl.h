// Weights from exponents of two, for means whose weights are what they are by likeness.
#if defined(TESSERA_OPS_RESTORE_WEIGHTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_RESTORE_WEIGHTS_INL_H_
#undef TESSERA_OPS_RESTORE_WEIGHTS_INL_H_
#else
#define TESSERA_OPS_RESTORE_WEIGHTS_INL_H_
#endif

#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

using Mask = hn::Mask<s::D>;

// Whether 2^-e counts: false for NaN.
HWY_INLINE Mask Counts(s::V e) { return hn::Lt(e, hn::Set(s::D(), 100.0f)); }

// 2^-e where it counts, else 0. Relative error 4 u for e as it is.
HWY_INLINE s::V WeightOf(s::V e, Mask counts) {
  const s::D d;
  const s::V t = hn::Neg(hn::IfThenElseZero(counts, e));
  const s::V magic = hn::Set(d, 0x1.8p23f);  // adding it rounds to an integer, held in the lowest bits
  const s::V shifted = hn::Add(t, magic);
  const s::V f = hn::Sub(t, hn::Sub(shifted, magic));
  s::V p = hn::Set(d, 1.5469729e-4f);
  for (const float c : {1.3333478e-3f, 9.6180256e-3f, 5.5504109e-2f, 2.4022651e-1f, 6.9314718e-1f, 1.0f})
    p = hn::MulAdd(p, f, hn::Set(d, c));
  const s::DU du;
  const s::V w = hn::BitCast(d, hn::Add(hn::BitCast(du, p), hn::ShiftLeft<23>(hn::BitCast(du, shifted))));
  return hn::IfThenElseZero(counts, w);
}

// The centre and the mean difference from it. Without any weight, or where it is not finite, it stays.
HWY_INLINE s::V Moved(s::V centre, s::V sum, s::V weight) {
  const s::D d;
  const auto moves = hn::And(hn::Gt(weight, hn::Zero(d)), hn::IsFinite(centre));
  const s::V v = hn::IfThenElse(moves, hn::Add(centre, hn::Div(sum, weight)), centre);
  return hn::IfThenElse(hn::IsNaN(v), hn::NaN(d), v);  // every NaN leaves as the same one
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
