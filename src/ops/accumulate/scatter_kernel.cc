// A run of pixels is added once per step of the aperture, shifted by it; where a block begins, whole.
#include "ops/accumulate/scatter_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/accumulate/scatter_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class D>
HWY_INLINE void AddVector(D d, double weight, const float* values, double* cells) {
  const hn::Rebind<float, D> floats;
  const auto v = hn::PromoteTo(d, hn::LoadU(floats, values));
  hn::StoreU(hn::MulAdd(hn::Set(d, weight), v, hn::LoadU(d, cells)), d, cells);
}

// Every sample by the same instruction, in whole vectors or alone: the bits do not depend on where a run
// ends.
HWY_INLINE void AddScaled(double weight, const float* values, int count, double* cells) {
  const hn::CappedTag<double, 8> d;
  const hn::CappedTag<double, 1> one;
  const int step = static_cast<int>(hn::Lanes(d));
  int i = 0;
  for (; i + step <= count; i += step) AddVector(d, weight, values + i, cells + i);
  for (; i < count; ++i) AddVector(one, weight, values + i, cells + i);
}

// The first column from `x` on where a block begins.
int BlockFrom(int begin, int x) {
  return begin + (x - begin + kScatterBlock - 1) / kScatterBlock * kScatterBlock;
}

void Scatter(const ScatterRow& row, const ScatterRun& run) {
  const ApertureRow& weights = run.weights;
  const int samples = row.samples;
  const auto cell = [&](int x) { return row.cells + static_cast<ptrdiff_t>(x - row.begin) * samples; };
  const auto value = [&](int x) { return run.values + static_cast<ptrdiff_t>(x - run.x0) * samples; };
  // A run is no longer than a block: its shifted pixels lie on at most one column where a block begins.
  for (int k = 0; k < weights.count; ++k) {
    const int column = weights.column[k];
    const int x0 = std::max(run.x0, row.begin - column), x1 = std::min(run.x1, row.end - column);
    if (x0 >= x1) continue;
    const int start = BlockFrom(row.begin, x0 + column) - column;
    const int end = std::min(start, x1), next = std::min(start + 1, x1);
    AddScaled(weights.step[k], value(x0), (end - x0) * samples, cell(x0 + column));
    AddScaled(weights.step[k], value(next), (x1 - next) * samples, cell(next + column));
  }
  const int first = weights.column[0], last = weights.column[weights.count - 1];
  const int end = std::min(run.x1 + last - 1, row.end);
  for (int b = BlockFrom(row.begin, std::max(run.x0 + first, row.begin)); b < end; b += kScatterBlock) {
    for (int x = std::max(run.x0, b - last + 1); x < std::min(run.x1, b - first + 1); ++x)
      AddScaled(weights.At(b - x), value(x), samples, cell(b));
  }
}

ScatterFunction ScatterOfTarget() { return &Scatter; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(ScatterOfTarget);

ScatterFunction ChooseScatter() { return HWY_DYNAMIC_DISPATCH(ScatterOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
