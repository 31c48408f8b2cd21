// What window sums share: loads, stores, and the sum over a run of taps down a column for several rows at
// once.
#if defined(TESSERA_OPS_FILTER_FIR_FIR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_FIR_FIR_INL_H_
#undef TESSERA_OPS_FILTER_FIR_FIR_INL_H_
#else
#define TESSERA_OPS_FILTER_FIR_FIR_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "simd/pixels-inl.h"
#include "simd/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;

HWY_INLINE V Load(const float* p) { return hn::LoadU(D(), p); }
// Minus zero is the neutral element of addition: it keeps the sign of a zero product.
HWY_INLINE V Nothing() { return hn::Set(D(), -0.0f); }
// Every NaN leaves as the same one: which of several a sum passes on depends on the compiler.
HWY_INLINE void Store(V v, float* p, bool stream) {
  v = hn::IfThenElse(hn::IsNaN(v), hn::NaN(D()), v);
  s::StoreOrStream(v, D(), p, stream && reinterpret_cast<uintptr_t>(p) % (4 * kLanes) == 0);
}
// Up to a whole vector.
HWY_INLINE void StorePart(V v, float* p, int count, bool stream) {
  if (count >= kLanes) return Store(v, p, stream);
  HWY_ALIGN float lanes[kLanes];
  Store(v, lanes, false);
  std::memcpy(p, lanes, static_cast<size_t>(count) * sizeof(float));
}

// acc += (sample - centre) * weight of one input row for output rows [first, last); `w` is the weight of
// output row 0. Both bounds are constants once the caller's loops are unrolled.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void AddRow(V (&acc)[kR][kJ], const V (&centre)[kR][kJ], const float* in, const float* w,
                       ptrdiff_t w_stride, int first, int last) {
  V v[kJ];
  for (int j = 0; j < kJ; ++j) v[j] = Load(in + j * kLanes);
  HWY_UNROLL(8)
  for (int r = 0; r < kR; ++r) {
    if (r < first || r >= last) continue;
    const V weight = hn::Set(D(), w[-r * w_stride]);
    for (int j = 0; j < kJ; ++j) {
      acc[r][j] = hn::MulAdd(kCentered ? hn::Sub(v[j], centre[r][j]) : v[j], weight, acc[r][j]);
    }
  }
}

// The same for every input row of a run of taps [begin, end). The rows that only some of the output rows
// reach are most of a short run: they are unrolled one by one.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void AddRun(V (&acc)[kR][kJ], const V (&centre)[kR][kJ], const float* in, ptrdiff_t stride,
                       const float* w, ptrdiff_t w_stride, int begin, int end) {
  const float* p = in + begin * stride;
  w += begin * w_stride;
  if (end - begin < kR) {
    for (int i = 0; i < end - begin + kR - 1; ++i, p += stride, w += w_stride) {
      AddRow<kCentered>(acc, centre, p, w, w_stride, std::max(0, i - (end - begin) + 1), std::min(kR, i + 1));
    }
    return;
  }
  HWY_UNROLL(8)
  for (int i = 0; i < kR - 1; ++i, p += stride, w += w_stride)
    AddRow<kCentered>(acc, centre, p, w, w_stride, 0, i + 1);
  for (int i = kR - 1; i < end - begin; ++i, p += stride, w += w_stride) {
    AddRow<kCentered>(acc, centre, p, w, w_stride, 0, kR);
  }
  HWY_UNROLL(8)
  for (int i = 1; i < kR; ++i, p += stride, w += w_stride)
    AddRow<kCentered>(acc, centre, p, w, w_stride, i, kR);
}

// One aligned load serves whole groups of RGBA taps where vectors hold four pixels.
constexpr bool kFourPixels = kLanes == 16;

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
