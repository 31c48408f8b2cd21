// Gathering of discs over one row, neighbour by neighbour, in the order of rows and columns.
#include "ops/accumulate/disc_kernel.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/accumulate/disc_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

// The neighbour at (dx, dy) of every pixel of the row; its disc reaches a pixel that is nearer than radius +
// 1/2. Whether any did.
HWY_INLINE bool GatherNeighbour(const DiscRow& row, int dx, int dy, double distance, float* sums) {
  const D d;
  const int step = static_cast<int>(hn::Lanes(d));
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), inner = hn::Set(d, static_cast<float>(distance - 0.5));
  const ptrdiff_t at = dy * row.stride + dx;
  bool any = false;
  for (int x = 0; x < row.width; x += step) {
    const V other = hn::LoadU(d, row.radius + at + x);
    if (hn::AllFalse(d, hn::Gt(other, inner))) continue;
    any = true;
    // A disc behind this pixel is drawn no larger than the pixel's own.
    const V own = hn::LoadU(d, row.radius + x);
    const auto behind = hn::Gt(hn::LoadU(d, row.depth + at + x), hn::LoadU(d, row.depth + x));
    const auto limited = hn::And(behind, hn::Lt(own, other));
    const V radius = hn::IfThenElse(limited, own, other);
    const V density =
        hn::IfThenElse(limited, hn::LoadU(d, row.density + x), hn::LoadU(d, row.density + at + x));
    const V coverage = hn::Min(hn::Max(hn::Sub(radius, inner), zero), one);
    const auto reaches = hn::And(hn::Gt(coverage, zero), hn::Gt(other, zero));
    const V weight = hn::IfThenElseZero(reaches, hn::Mul(coverage, density));
    float* sum = sums + x;
    for (const float* values : row.values) {
      // A value without weight is not touched: NaN stays where it is.
      const V value = hn::IfThenElseZero(reaches, hn::LoadU(d, values + at + x));
      hn::StoreU(hn::MulAdd(weight, value, hn::LoadU(d, sum)), d, sum);
      sum += row.padded;
    }
    hn::StoreU(hn::Add(weight, hn::LoadU(d, sum)), d, sum);
  }
  return any;
}

// The neighbours of one row are summed apart: tens of thousands of terms in one float lose too much.
void GatherDiscs(const DiscRow& row) {
  const D d;
  const int count = row.padded * (static_cast<int>(row.values.size()) + 1);
  const int step = static_cast<int>(hn::Lanes(d));
  std::fill_n(row.sums, count, 0.0f);
  std::fill_n(row.parts, count, 0.0f);
  for (int dy = -row.reach; dy <= row.reach; ++dy) {
    bool any = false;
    for (int dx = -row.reach; dx <= row.reach; ++dx) {
      const double distance = std::sqrt(static_cast<double>(dx * dx + dy * dy));
      const bool near = static_cast<float>(distance - 0.5) < row.largest;
      if (near) any |= GatherNeighbour(row, dx, dy, distance, row.parts);
    }
    if (!any) continue;
    for (int i = 0; i < count; i += step) {
      hn::StoreU(hn::Add(hn::LoadU(d, row.sums + i), hn::LoadU(d, row.parts + i)), d, row.sums + i);
      hn::StoreU(hn::Zero(d), d, row.parts + i);
    }
  }
}

DiscFunction GatherDiscsOfTarget() { return &GatherDiscs; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(GatherDiscsOfTarget);

DiscFunction ChooseGatherDiscs() { return HWY_DYNAMIC_DISPATCH(GatherDiscsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
