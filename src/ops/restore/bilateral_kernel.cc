// The bilateral filter's mean, pixel by pixel, a vector of them at a time.
#include "ops/restore/restore_ops.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/restore/bilateral_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/restore/weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Planes 0 to kColors - 1 where `kOwn`, and plane `other` where kOther. Rows are summed apart: fewer
// roundings one after the other.
template <int kColors, bool kOwn, bool kOther>
HWY_NOINLINE void Weighed(const BilateralSetup& setup, const WeighedTile& tile, int other) {
  const s::D d;
  const int r = setup.radius;
  const s::V range = hn::Set(d, setup.range), zero = hn::Zero(d);
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; x += s::kLanes) {
      const ptrdiff_t at = y * tile.stride + x;
      s::V centre[kColors], sum[kColors];
      for (int c = 0; c < kColors; ++c) centre[c] = hn::LoadU(d, tile.in[c] + at), sum[c] = zero;
      const s::V other_centre = kOther ? hn::LoadU(d, tile.in[other] + at) : zero;
      s::V other_sum = zero, weight = zero;
      const float* space = setup.space.data();
      for (int j = -r; j <= r; ++j) {
        s::V row_sum[kColors], row_other = zero, row_weight = zero;
        for (int c = 0; c < kColors; ++c) row_sum[c] = zero;
        for (int i = -r; i <= r; ++i) {
          const ptrdiff_t there = at + j * tile.stride + i;
          s::V apart[kColors];
          for (int c = 0; c < kColors; ++c) apart[c] = hn::Sub(hn::LoadU(d, tile.in[c] + there), centre[c]);
          s::V square = hn::Mul(apart[0], apart[0]);
          for (int c = 1; c < kColors; ++c) square = hn::MulAdd(apart[c], apart[c], square);
          const s::V e = hn::MulAdd(square, range, hn::Set(d, *space++));
          const Mask counts = Counts(e);
          const s::V w = WeightOf(e, counts);
          row_weight = hn::Add(row_weight, w);
          for (int c = 0; c < kColors && kOwn; ++c)
            row_sum[c] = hn::MulAdd(w, hn::IfThenElseZero(counts, apart[c]), row_sum[c]);
          if constexpr (kOther) {
            const s::V difference = hn::Sub(hn::LoadU(d, tile.in[other] + there), other_centre);
            row_other = hn::MulAdd(w, hn::IfThenElseZero(counts, difference), row_other);
          }
        }
        weight = hn::Add(weight, row_weight);
        for (int c = 0; c < kColors && kOwn; ++c) sum[c] = hn::Add(sum[c], row_sum[c]);
        if constexpr (kOther) other_sum = hn::Add(other_sum, row_other);
      }
      const ptrdiff_t to = y * tile.out_stride + x;
      for (int c = 0; c < kColors && kOwn; ++c)
        hn::StoreU(Moved(centre[c], sum[c], weight), d, tile.out[c] + to);
      if constexpr (kOther) hn::StoreU(Moved(other_centre, other_sum, weight), d, tile.out[other] + to);
    }
  }
}

template <int kColors>
void OfColors(const BilateralSetup& setup, const WeighedTile& tile) {
  if (tile.planes == kColors) return Weighed<kColors, true, false>(setup, tile, 0);
  Weighed<kColors, true, true>(setup, tile, kColors);
  for (int other = kColors + 1; other < tile.planes; ++other)
    Weighed<kColors, false, true>(setup, tile, other);
}

void RunBilateral(const BilateralSetup& setup, const WeighedTile& tile) {
  if (tile.compared == 1) return OfColors<1>(setup, tile);
  if (tile.compared == 2) return OfColors<2>(setup, tile);
  OfColors<3>(setup, tile);
}
BilateralFunction BilateralOfTarget() { return RunBilateral; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(BilateralOfTarget);
BilateralFunction ChooseBilateral() { return HWY_DYNAMIC_DISPATCH(BilateralOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
