// Non-local means: displacement by displacement, squared differences of a tile, summed over patches.
#include <algorithm>

#include "base/arena.h"
#include "ops/restore/restore_ops.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/restore/patch_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/restore/weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Squared differences of `count` pixels from those `there` away, all compared planes together.
HWY_INLINE void SquaresOfRow(const WeighedTile& tile, ptrdiff_t at, ptrdiff_t there, int count, float* out) {
  const s::D d;
  for (int x = 0; x < count; x += s::kLanes) {
    s::V sum = hn::Zero(d);
    for (int c = 0; c < tile.compared; ++c) {
      const float* const p = tile.in[c] + at + x;
      const s::V apart = hn::Sub(hn::LoadU(d, p + there), hn::LoadU(d, p));
      sum = hn::MulAdd(apart, apart, sum);
    }
    hn::StoreU(sum, d, out + x);
  }
}

void RunPatches(const PatchSetup& setup, const WeighedTile& tile, base::Arena& scratch) {
  const s::D d;
  const int p = setup.patch, side = 2 * p + 1, wide = tile.width + 2 * p;
  const auto stride = static_cast<ptrdiff_t>((wide + 2 * s::kLanes) / s::kLanes * s::kLanes + s::kLanes);
  const auto rows = static_cast<size_t>(tile.height + 2 * p);
  auto* const squares = scratch.Allocate<float>(rows * static_cast<size_t>(stride));
  auto* const columns = scratch.Allocate<float>(static_cast<size_t>(stride));
  // Sums of the differences, plane by plane, and of the weights: all, and of one row of displacements, so
  // that fewer roundings come one after the other.
  const auto plane = static_cast<size_t>(tile.out_stride) * static_cast<size_t>(tile.height);
  const auto sums = static_cast<size_t>(tile.planes) + 1;
  auto* const all = scratch.Allocate<float>(plane * sums);
  auto* const row_sums = scratch.Allocate<float>(plane * sums);
  std::fill_n(all, plane * sums, 0.0f);
  const s::V factor = hn::Set(d, setup.factor), allowance = hn::Set(d, setup.allowance), zero = hn::Zero(d);
  for (int dy = -setup.search; dy <= setup.search; ++dy) {
    std::fill_n(row_sums, plane * sums, 0.0f);
    for (int dx = -setup.search; dx <= setup.search; ++dx) {
      const ptrdiff_t there = dy * tile.stride + dx;
      for (int j = 0; j < tile.height + 2 * p; ++j)
        SquaresOfRow(tile, (j - p) * tile.stride - p, there, wide, squares + j * stride);
      for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < wide; x += s::kLanes) {
          s::V sum = hn::LoadU(d, squares + y * stride + x);
          for (int j = 1; j < side; ++j) sum = hn::Add(sum, hn::LoadU(d, squares + (y + j) * stride + x));
          hn::StoreU(sum, d, columns + x);
        }
        for (int x = 0; x < tile.width; x += s::kLanes) {
          s::V sum = hn::LoadU(d, columns + x);
          for (int i = 1; i < side; ++i) sum = hn::Add(sum, hn::LoadU(d, columns + x + i));
          const s::V over = hn::MulSub(sum, factor, allowance);
          const s::V e = hn::IfThenElse(hn::Lt(over, zero), zero, over);  // a NaN stays one
          const Mask counts = Counts(e);
          if (hn::AllFalse(d, counts)) continue;
          const s::V w = WeightOf(e, counts);
          const ptrdiff_t at = y * tile.stride + x, to = y * tile.out_stride + x;
          for (int c = 0; c < tile.planes; ++c) {
            const s::V apart = hn::Sub(hn::LoadU(d, tile.in[c] + at + there), hn::LoadU(d, tile.in[c] + at));
            float* const sum_at = row_sums + static_cast<size_t>(c) * plane + to;
            hn::StoreU(hn::MulAdd(w, hn::IfThenElseZero(counts, apart), hn::LoadU(d, sum_at)), d, sum_at);
          }
          float* const weight_at = row_sums + (sums - 1) * plane + to;
          hn::StoreU(hn::Add(w, hn::LoadU(d, weight_at)), d, weight_at);
        }
      }
    }
    for (size_t i = 0; i < plane * sums; i += s::kLanes)
      hn::StoreU(hn::Add(hn::LoadU(d, all + i), hn::LoadU(d, row_sums + i)), d, all + i);
  }
  for (int c = 0; c < tile.planes; ++c) {
    for (int y = 0; y < tile.height; ++y) {
      for (int x = 0; x < tile.width; x += s::kLanes) {
        const ptrdiff_t to = y * tile.out_stride + x;
        const s::V sum = hn::LoadU(d, all + static_cast<size_t>(c) * plane + to),
                   weight = hn::LoadU(d, all + (sums - 1) * plane + to),
                   centre = hn::LoadU(d, tile.in[c] + y * tile.stride + x);
        hn::StoreU(Moved(centre, sum, weight), d, tile.out[c] + to);
      }
    }
  }
}
PatchFunction PatchesOfTarget() { return RunPatches; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(PatchesOfTarget);
PatchFunction ChoosePatches() { return HWY_DYNAMIC_DISPATCH(PatchesOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
