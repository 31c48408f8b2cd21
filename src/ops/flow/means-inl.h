// The means that lines of a smooth texture leave in pixels beside whose centres they pass.
#if defined(TESSERA_OPS_FLOW_MEANS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_MEANS_INL_H_
#undef TESSERA_OPS_FLOW_MEANS_INL_H_
#else
#define TESSERA_OPS_FLOW_MEANS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "ops/flow/field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

HWY_INLINE bool Masked(const Lines& lines, int x, int y) {
  return lines.mask != nullptr && lines.mask[ptrdiff_t{y} * lines.width + x] != 0;
}

// Values and places of a row of means from p on.
struct Means {
  V value, weight, x, y;
};
HWY_INLINE Means MeansAt(const float* p) {
  Means m;
  hn::LoadInterleaved4(D(), p, m.value, m.weight, m.x, m.y);
  return m;
}

// The means of a smooth texture, each moved to its pixel's centre along the slope of the means around it.
inline void Centre(const Lines& lines, const LineOutput& out, SharedScratch& scratch) {
  const D d;
  const Roi& roi = out.roi;
  const ptrdiff_t width = roi.width(), height = roi.height(), row = 4 * width;
  const V zero = hn::Zero(d);
  float* const sums = scratch.sums.data();
  // Those of kPacket more can be written.
  static_assert(kLanes <= kPacket);
  for (ptrdiff_t i = 0; i < width * height; i += kLanes) {
    const Means m = MeansAt(sums + 4 * i);
    const auto any = hn::Gt(m.weight, zero);
    const auto mean = [&](V v) HWY_ATTR { return hn::IfThenElseZero(any, hn::Div(v, m.weight)); };
    hn::StoreInterleaved4(mean(m.value), m.weight, mean(m.x), mean(m.y), d, sums + 4 * i);
  }
  alignas(64) float result[kLanes];
  for (ptrdiff_t y = 0; y < height; ++y) {
    float* const to = out.data + y * out.row;
    const ptrdiff_t up = y > 0 ? row : 0, down = y + 1 < height ? row : 0;
    const V rows = hn::Set(d, static_cast<float>((up + down) / std::max(row, ptrdiff_t{1})));
    for (ptrdiff_t x = 0; x < width;) {
      // The first and the last pixel have one neighbour.
      const bool first = x == 0, last = x + 1 >= width;
      const ptrdiff_t count = first || last ? 1 : std::min(width - 1 - x, ptrdiff_t{kLanes});
      const float* const p = sums + y * row + 4 * x;
      const Means here = MeansAt(p), left = MeansAt(first ? p : p - 4), right = MeansAt(last ? p : p + 4);
      const Means above = MeansAt(p - up), below = MeansAt(p + down);
      const V least = hn::Min(hn::Min(left.weight, right.weight), hn::Min(above.weight, below.weight));
      // Means are of places that are off by their own distances.
      const V columns = hn::Set(d, static_cast<float>(!first + !last));
      const V run_x = hn::Add(columns, hn::Sub(right.x, left.x)),
              run_y = hn::Add(rows, hn::Sub(below.y, above.y));
      const auto moved = [&](V v, V beside, V rise, V run) HWY_ATTR {
        const auto known = hn::And(hn::Gt(least, zero), hn::Gt(run, hn::Set(d, 0.5f)));
        return hn::Sub(v, hn::IfThenElseZero(known, hn::Div(hn::Mul(beside, rise), run)));
      };
      V v = moved(here.value, here.x, hn::Sub(right.value, left.value), run_x);
      v = moved(v, here.y, hn::Sub(below.value, above.value), run_y);
      hn::Store(hn::IfThenElseZero(hn::Gt(here.weight, zero), v), d, result);
      for (ptrdiff_t i = 0; i < count; ++i, ++x) {
        const bool masked = Masked(lines, static_cast<int>(x) + roi.x0, static_cast<int>(y) + roi.y0);
        to[x * out.step] = masked ? 0.0f : result[i];
      }
    }
  }
}

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
