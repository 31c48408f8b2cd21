// How a noise value enters a sum of octaves.
#if defined(TESSERA_OPS_NOISE_SHAPED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_NOISE_SHAPED_INL_H_
#undef TESSERA_OPS_NOISE_SHAPED_INL_H_
#else
#define TESSERA_OPS_NOISE_SHAPED_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/noise/kernels.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;

template <NoiseSum kSum>
HWY_INLINE V Shaped(V n) {
  const s::D d;
  if constexpr (kSum == NoiseSum::kFbm) return n;
  const V size = hn::Abs(n);
  if constexpr (kSum == NoiseSum::kTurbulence) return size;
  if constexpr (kSum == NoiseSum::kBillow) return hn::MulSub(hn::Set(d, 2.0f), size, hn::Set(d, 1.0f));
  const V rest = hn::Sub(hn::Set(d, 1.0f), size);
  return hn::Mul(rest, rest);
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
