// Blocks of direct window sums, in the order of summation that all kernels keep.
#if defined(TESSERA_OPS_FILTER_FIR_DIRECT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_FIR_DIRECT_INL_H_
#undef TESSERA_OPS_FILTER_FIR_DIRECT_INL_H_
#else
#define TESSERA_OPS_FILTER_FIR_DIRECT_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/filter/fir/fir-inl.h"
#include "ops/filter/fir/fir.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// What differences are taken from: the samples of the centre's tap, as far as they are finite.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void LoadCentres(const DirectWindow& window, const float* in, ptrdiff_t stride, int channels,
                            V (&centre)[kR][kJ]) {
  for (int r = 0; r < kR; ++r) {
    for (int j = 0; j < kJ; ++j) {
      centre[r][j] = Nothing();
      if constexpr (kCentered) {
        const V c = Load(in + (r + window.center_y) * stride + window.center_x * channels + j * kLanes);
        centre[r][j] = hn::IfThenElseZero(hn::IsFinite(c), c);
      }
    }
  }
}

// kR rows of kJ vectors; `in` is the window's first tap of the first sample.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void DirectBlock(const DirectWindow& window, const float* in, ptrdiff_t stride, int channels,
                            V (&total)[kR][kJ]) {
  V centre[kR][kJ];
  LoadCentres<kCentered>(window, in, stride, channels, centre);
  for (auto& row : total) {
    for (V& v : row) v = Nothing();
  }
  for (const auto& group : window.runs) {
    if (group.empty()) continue;
    V acc[kR][kJ];
    for (auto& row : acc) {
      for (V& a : row) a = Nothing();
    }
    for (const DirectWindow::Run& run : group) {
      AddRun<kCentered>(acc, centre, in + run.dx * channels, stride, window.weights.data() + run.dx,
                        window.width, run.dy_begin, run.dy_end);
    }
    for (int r = 0; r < kR; ++r) {
      for (int j = 0; j < kJ; ++j) total[r][j] = hn::Add(total[r][j], acc[r][j]);
    }
  }
}

// Taps of weight 0 may add zeros or not, as is faster: the sign of a sum that is 0 does not tell.
template <int kR, int kJ>
HWY_INLINE void UnsignedZeros(V (&total)[kR][kJ]) {
  for (auto& row : total) {
    for (V& v : row) v = hn::Add(v, hn::Zero(D()));
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
