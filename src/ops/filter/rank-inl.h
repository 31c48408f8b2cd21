// What the kernels of order statistics share.
#if defined(TESSERA_OPS_FILTER_RANK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_RANK_INL_H_
#undef TESSERA_OPS_FILTER_RANK_INL_H_
#else
#define TESSERA_OPS_FILTER_RANK_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;

// Memory is slower than everything else here, and windows go down columns where the processor does not see
// them coming: rows are asked for two rows before they are needed.
HWY_INLINE void AskFor(const float* p, int i) {
  if (i % 16 == 0) hwy::Prefetch(p + i);
}

// f(i) for the vectors of a row of results, the last one part of a vector.
template <class F>
HWY_INLINE void StoreRow(const F& f, float* out, int count, bool stream) {
  int i = 0;
  if (stream && reinterpret_cast<uintptr_t>(out) % (4 * kLanes) == 0) {
    for (; i + kLanes <= count; i += kLanes) s::StoreOrStream(f(i), D(), out + i, true);
  } else {
    for (; i + kLanes <= count; i += kLanes) hn::StoreU(f(i), D(), out + i);
  }
  if (i == count) return;
  HWY_ALIGN float lanes[kLanes];
  hn::Store(f(i), D(), lanes);
  std::copy_n(lanes, count - i, out + i);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
