// What the kernels of order statistics share.
#if defined(TESSERA_OPS_FILTER_RANK_RANK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_RANK_RANK_INL_H_
#undef TESSERA_OPS_FILTER_RANK_RANK_INL_H_
#else
#define TESSERA_OPS_FILTER_RANK_RANK_INL_H_
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

// Whole vectors of samples or keys of any type.
template <class T>
using DK = hn::CappedTag<T, 64 / sizeof(T)>;
template <class T>
using VK = hn::Vec<DK<T>>;
template <class T>
constexpr int kKeyLanes = static_cast<int>(hn::MaxLanes(DK<T>()));

// Memory is slower than everything else here, and windows go down columns where the processor does not see
// them coming: rows are asked for two rows before they are needed.
template <class T>
HWY_INLINE void PrefetchLine(const T* p, int i) {
  if (i % static_cast<int>(64 / sizeof(T)) == 0) hwy::Prefetch(p + i);
}

// Whether whole vectors may go around the cache to a row.
template <class T>
HWY_INLINE bool MayStream(const T* to) {
  return reinterpret_cast<uintptr_t>(to) % (sizeof(T) * kKeyLanes<T>) == 0;
}

// f(i) for the vectors of a row of results, the last one part of a vector.
template <class T, class F>
HWY_INLINE void StoreRow(const F& f, T* out, int count, bool stream) {
  int i = 0;
  if (stream && MayStream(out)) {
    for (; i + kKeyLanes<T> <= count; i += kKeyLanes<T>) s::StoreOrStream(f(i), DK<T>(), out + i, true);
  } else {
    for (; i + kKeyLanes<T> <= count; i += kKeyLanes<T>) hn::StoreU(f(i), DK<T>(), out + i);
  }
  if (i == count) return;
  HWY_ALIGN T lanes[kKeyLanes<T>];
  hn::Store(f(i), DK<T>(), lanes);
  std::copy_n(lanes, count - i, out + i);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
