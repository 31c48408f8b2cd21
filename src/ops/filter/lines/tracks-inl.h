// Lines of an image as line filters see them: kFlight vectors of samples that advance together, from columns
// or from rows of RGBA pixels.
#if defined(TESSERA_OPS_FILTER_LINES_TRACKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_LINES_TRACKS_INL_H_
#undef TESSERA_OPS_FILTER_LINES_TRACKS_INL_H_
#else
#define TESSERA_OPS_FILTER_LINES_TRACKS_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "ops/filter/lines/extend.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;
constexpr int kTracks = kTrackCount;
constexpr int kQuarter = s::kQuarter;
constexpr int kVectors = kTracks / kLanes;
// Vectors in flight: their states fit the registers.
constexpr int kFlight = kLanes == 16 ? 2 : 1;

// Samples of kFlight vectors at step n, wherever they are: columns of an image ...
struct ColumnsIo {
  const float* in;
  float* out;
  ptrdiff_t in_stride, out_stride;
  HWY_INLINE V Read(int n, int j) const { return hn::LoadU(D(), in + n * in_stride + j * kLanes); }
  HWY_INLINE void Write(V v, int n, int j) const { hn::StoreU(v, D(), out + n * out_stride + j * kLanes); }
  HWY_INLINE void Prefetch(int n) const {
    hwy::Prefetch(in + n * in_stride);
    hwy::Prefetch(in + n * in_stride + 16);
  }
};

// Pixels of four channels from `kPixels` rows as one vector, and back.
template <int kPixels, class DF>
HWY_INLINE hn::Vec<DF> ReadPixels(DF d, const float* p, ptrdiff_t stride) {
  const hn::CappedTag<float, 4> d4;
  if constexpr (kPixels == 4) {
    const hn::Half<DF> half;
    return hn::Combine(d, hn::Combine(half, hn::LoadU(d4, p + 3 * stride), hn::LoadU(d4, p + 2 * stride)),
                       hn::Combine(half, hn::LoadU(d4, p + stride), hn::LoadU(d4, p)));
  } else if constexpr (kPixels == 2) {
    return hn::Combine(d, hn::LoadU(d4, p + stride), hn::LoadU(d4, p));
  } else {
    return hn::LoadU(d, p);
  }
}
template <int kPixels, class DF>
HWY_INLINE void WritePixels(DF d, hn::Vec<DF> v, float* p, ptrdiff_t stride) {
  const hn::CappedTag<float, 4> d4;
  if constexpr (kPixels == 4) {
    const hn::Half<DF> half;
    const auto lower = hn::LowerHalf(half, v), upper = hn::UpperHalf(half, v);
    hn::StoreU(hn::LowerHalf(d4, lower), d4, p);
    hn::StoreU(hn::UpperHalf(d4, lower), d4, p + stride);
    hn::StoreU(hn::LowerHalf(d4, upper), d4, p + 2 * stride);
    hn::StoreU(hn::UpperHalf(d4, upper), d4, p + 3 * stride);
  } else if constexpr (kPixels == 2) {
    hn::StoreU(hn::LowerHalf(d4, v), d4, p);
    hn::StoreU(hn::UpperHalf(d4, v), d4, p + stride);
  } else {
    hn::StoreU(v, d, p);
  }
}

// ... or pixels of neighbouring rows.
struct RgbaRowsIo {
  const float* in;
  float* out;
  ptrdiff_t in_stride, out_stride;  // between rows
  HWY_INLINE V Read(int n, int j) const {
    return ReadPixels<kQuarter>(D(), in + j * kQuarter * in_stride + n * 4, in_stride);
  }
  HWY_INLINE void Write(V v, int n, int j) const {
    WritePixels<kQuarter>(D(), v, out + j * kQuarter * out_stride + n * 4, out_stride);
  }
  HWY_INLINE void Prefetch(int) const {}
};

// Runs f(io, length, border, scale, scratch) on every line of a block of kTracks tracks.
template <class F>
void ForLines(const F& f, const TrackBlock& b, bool rgba_rows, const AxisBorder& border, const float* scale,
              float* scratch) {
  if (!rgba_rows) {
    for (int j = 0; j < kVectors; j += kFlight) {
      f(ColumnsIo{b.in + j * kLanes, b.out + j * kLanes, b.in_stride, b.out_stride}, b.length, border, scale,
        scratch);
    }
    return;
  }
  for (int r = 0; r < kTracks / 4; r += kQuarter * kFlight) {
    f(RgbaRowsIo{b.in + r * b.in_stride, b.out + r * b.out_stride, b.in_stride, b.out_stride}, b.length,
      border, scale, scratch);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
