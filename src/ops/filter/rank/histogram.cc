// Medians of bytes in large windows at a cost that does not depend on the window: histograms of columns move
// down with the window, the window's own moves along them (S. Perreault and P. Hebert, "Median filtering in
// constant time", 2007). Levels are counted twice, one by one and by sixteens; what is counted one by one is
// brought up to date only where the median falls.
#include <algorithm>
#include <cstdint>

#include "ops/filter/rank/rank.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/rank/histogram.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef TESSERA_OPS_FILTER_RANK_HISTOGRAM_CC_
#define TESSERA_OPS_FILTER_RANK_HISTOGRAM_CC_
namespace tessera::ops {

// Counts of a column's levels; windows of 255 x 255 fit in 16 bits. Slot 0 has the sixteens, slot 1 + s the
// levels from 16 s on.
constexpr int kSlots = 17;
struct Histogram {
  alignas(32) uint16_t count[kSlots][16];
};

// Some columns of results, of all rows and one channel.
struct HistogramStrip {
  RankView view;
  const uint8_t* in;  // the first sample that exists, at `step`
  uint8_t* out;       // at `step`
  ptrdiff_t in_stride, out_stride, step;
  Histogram* histogram;  // of every column
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_RANK_HISTOGRAM_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

using D16 = hn::CappedTag<uint16_t, 16>;
constexpr int kLanesOf16 = static_cast<int>(hn::MaxLanes(D16()));

// Sixteen counts.
HWY_INLINE void Add(const uint16_t* x, uint16_t* to) {
  const D16 d;
  for (int i = 0; i < 16; i += kLanesOf16)
    hn::Store(hn::Add(hn::Load(d, to + i), hn::Load(d, x + i)), d, to + i);
}
HWY_INLINE void Subtract(const uint16_t* x, uint16_t* to) {
  const D16 d;
  for (int i = 0; i < 16; i += kLanesOf16)
    hn::Store(hn::Sub(hn::Load(d, to + i), hn::Load(d, x + i)), d, to + i);
}

// The slot entry that member `target` falls in, which becomes its number there.
HWY_INLINE int Find(const uint16_t* counts, int& target) {
  int i = 0;
  for (int sum = counts[0]; sum <= target; sum = counts[i]) target -= sum, ++i;
  return i;
}

class Window {
 public:
  explicit Window(const HistogramStrip& strip) : s_(strip), v_(strip.view) {}

  void Run() {
    for (int c = 0; c < v_.columns; ++c) s_.histogram[c] = {};
    for (int j = 0; j < v_.LastRow(0); ++j) CountRow(j, 1);
    for (int y = 0; y < v_.down; ++y) {
      if (y > 0) {
        const int leaves = y - 1 + v_.top, enters = leaves + v_.height;
        if (leaves >= 0) CountRow(leaves, -1);
        if (enters < v_.rows) CountRow(enters, 1);
      }
      Row(v_.LastRow(y) - v_.FirstRow(y), s_.out + y * s_.out_stride);
    }
  }

 private:
  void CountRow(int row, int change) {
    const uint8_t* const in = s_.in + row * s_.in_stride;
    for (int c = 0; c < v_.columns; ++c) {
      const int level = in[c * s_.step];
      Histogram& h = s_.histogram[c];
      h.count[0][level >> 4] = static_cast<uint16_t>(h.count[0][level >> 4] + change);
      uint16_t& count = h.count[1 + (level >> 4)][level & 15];
      count = static_cast<uint16_t>(count + change);
    }
  }

  // Brings a slot of the window from result `at` to result x.
  HWY_INLINE void Move(int slot, int at, int x) {
    uint16_t* const counts = window_.count[slot];
    if (x - at >= v_.width) {
      std::fill_n(counts, 16, uint16_t{0});
      for (int c = v_.FirstColumn(x); c < v_.LastColumn(x); ++c) Add(s_.histogram[c].count[slot], counts);
      return;
    }
    for (int c = v_.LastColumn(at); c < v_.LastColumn(x); ++c) Add(s_.histogram[c].count[slot], counts);
    for (int c = v_.FirstColumn(at); c < v_.FirstColumn(x); ++c)
      Subtract(s_.histogram[c].count[slot], counts);
  }

  void Row(int rows, uint8_t* out) {
    std::fill_n(at_, kSlots, -v_.width);  // nothing counted yet
    for (int x = 0; x < v_.across; ++x) {
      Move(0, at_[0], x);
      at_[0] = x;
      int target = (v_.LastColumn(x) - v_.FirstColumn(x)) * rows / 2;
      const int sixteen = Find(window_.count[0], target), slot = 1 + sixteen;
      Move(slot, at_[slot], x);
      at_[slot] = x;
      out[x * s_.step] = static_cast<uint8_t>(16 * sixteen + Find(window_.count[slot], target));
    }
  }

  const HistogramStrip s_;
  const RankView v_;
  Histogram window_;
  int at_[kSlots];  // the result that each slot of the window is of
};

void RunStrip(const HistogramStrip& strip) { Window(strip).Run(); }

RankFunctions::Histograms HistogramsOfTarget() { return RunStrip; }

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {
HWY_EXPORT(HistogramsOfTarget);
}

RankFunctions::Histograms ChooseHistograms() { return HWY_DYNAMIC_DISPATCH(HistogramsOfTarget)(); }

void RunHistogramMedian(const RankFunctions& functions, const RankTile<uint8_t>& t, base::Arena& scratch) {
  constexpr int kAcross = 256;  // columns whose histograms share the second cache with the rows
  const int pixels = t.samples / t.channels, most = std::min(pixels, kAcross) + t.width - 1;
  auto* const histogram = scratch.Allocate<Histogram>(static_cast<size_t>(most));
  for (int x = 0; x < pixels; x += kAcross) {
    const RankView view = t.View(x, 0, std::min(kAcross, pixels - x), t.rows);
    for (int c = 0; c < t.channels; ++c) {
      functions.histograms({.view = view,
                            .in = t.First(view, x, 0, c),
                            .out = t.out + ptrdiff_t{x} * t.channels + c,
                            .in_stride = t.in_stride,
                            .out_stride = t.out_stride,
                            .step = t.channels,
                            .histogram = histogram});
    }
  }
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
