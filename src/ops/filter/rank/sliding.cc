// Medians of large windows. The samples of a block are ranked once, by sorting; a window is then a set of
// ranks, one bit each, that changes by a column where the window moves by one, and its median is found from
// the last one's by counting bits (T. S. Huang et al., "A fast two-dimensional median filtering algorithm",
// 1979, with ranks in place of a histogram's levels).
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "ops/filter/rank/rank.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/rank/sliding.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef TESSERA_OPS_FILTER_RANK_SLIDING_CC_
#define TESSERA_OPS_FILTER_RANK_SLIDING_CC_
namespace tessera::ops {

// The samples of one channel that a block of results sees, column by column, as ranks, and what they are.
template <class T, class Rank>
struct RankedBlock {
  const Rank* ranks;  // `rows` a column
  const T* values;    // by rank
  uint8_t* flags;     // of all ranks and 64 more, none of them set
  RankView view;
  T* out;  // samples at `step`
  ptrdiff_t step, out_stride;
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_RANK_SLIDING_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

// Flags of 64 ranks as bits.
HWY_INLINE uint64_t BitsOf(const uint8_t* flags) {
  uint64_t bits = 0;
  const hn::CappedTag<uint8_t, 64> d;
  constexpr size_t kBytes = hn::MaxLanes(d);
  uint8_t parts[sizeof bits];
  for (size_t k = 0; k < 64; k += kBytes) {
    hn::StoreMaskBits(d, hn::MaskFromVec(hn::LoadU(d, flags + k)), parts + k / 8);
  }
  std::memcpy(&bits, parts, sizeof bits);
  return bits;
}

// A set of ranks and the place of its member number `target`. Bytes are only written where a rank comes or
// goes: bits would wait for the bits before them in the same word.
struct RankSet {
  uint8_t* flags;
  int64_t place = 0, below = 0;  // a multiple of 64, and the members before it

  template <bool kEnter, class Rank>
  HWY_INLINE void Change(const Rank* ranks, int count, ptrdiff_t stride) {
    int change = 0;
    const auto limit = static_cast<uint32_t>(place);
#pragma GCC unroll 4
    for (int i = 0; i < count; ++i) {
      const uint32_t rank = ranks[i * stride];
      flags[rank] = kEnter ? 255 : 0;
      change += rank < limit;
    }
    below += kEnter ? change : -change;
  }
  HWY_INLINE int64_t Find(int64_t target) {
    uint64_t bits;
    while (below > target) place -= 64, below -= std::popcount(BitsOf(flags + place));
    for (int64_t here; bits = BitsOf(flags + place), below + (here = std::popcount(bits)) <= target;
         place += 64) {
      below += here;
    }
    for (int64_t k = below; k < target; ++k) bits &= bits - 1;
    return place + std::countr_zero(bits);
  }
};

template <class T, class Rank>
void Slide(const RankedBlock<T, Rank>& b) {
  RankSet set{b.flags};
  const RankView& v = b.view;
  const auto column_of = [&](int c) { return b.ranks + ptrdiff_t{c} * v.rows; };
  int x = 0, step = 1;
  for (int y = 0; y < v.down; ++y, step = -step) {
    const int row = v.FirstRow(y), rows = v.LastRow(y) - row;
    if (y == 0) {
      for (int c = v.FirstColumn(0); c < v.LastColumn(0); ++c) {
        set.template Change<true>(column_of(c) + row, rows, 1);
      }
    } else {
      const int columns = v.LastColumn(x) - v.FirstColumn(x);
      const Rank* const ranks = column_of(v.FirstColumn(x));
      const int leaves = y - 1 + v.top, enters = leaves + v.height;
      if (leaves >= 0) set.template Change<false>(ranks + leaves, columns, v.rows);
      if (enters < v.rows) set.template Change<true>(ranks + enters, columns, v.rows);
    }
    T* const out = b.out + y * b.out_stride;
    for (int k = 0; k < v.across; ++k) {
      if (k > 0) {
        const int before = x + v.left, after = before + v.width;
        const int leaves = step > 0 ? before : after - 1, enters = step > 0 ? after : before - 1;
        if (leaves >= 0 && leaves < v.columns) set.template Change<false>(column_of(leaves) + row, rows, 1);
        if (enters >= 0 && enters < v.columns) set.template Change<true>(column_of(enters) + row, rows, 1);
        x += step;
      }
      const int columns = v.LastColumn(x) - v.FirstColumn(x);
      out[x * b.step] = b.values[set.Find(int64_t{columns} * rows / 2)];
    }
  }
}

void SlideFloats16(const RankedBlock<float, uint16_t>& b) { Slide(b); }
void SlideFloats32(const RankedBlock<float, uint32_t>& b) { Slide(b); }
void SlideWords16(const RankedBlock<uint16_t, uint16_t>& b) { Slide(b); }
void SlideWords32(const RankedBlock<uint16_t, uint32_t>& b) { Slide(b); }
void SlideBytes16(const RankedBlock<uint8_t, uint16_t>& b) { Slide(b); }
void SlideBytes32(const RankedBlock<uint8_t, uint32_t>& b) { Slide(b); }
RankFunctions::Slides SlidesOfTarget() {
  return {SlideFloats16, SlideFloats32, SlideWords16, SlideWords32, SlideBytes16, SlideBytes32};
}

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(SlidesOfTarget);

// Unsigned integers in the order of the samples, NaN last, and back.
uint32_t KeyOf(float v) {
  if (std::isnan(v)) return std::numeric_limits<uint32_t>::max();
  const auto bits = std::bit_cast<uint32_t>(v);
  return bits >> 31 ? ~bits : bits | 0x80000000u;
}
uint32_t KeyOf(uint16_t v) { return v; }
uint32_t KeyOf(uint8_t v) { return v; }
template <class T>
T ValueOf(uint32_t key) {
  if constexpr (!std::is_same_v<T, float>) {
    return static_cast<T>(key);
  } else {
    if (key == std::numeric_limits<uint32_t>::max()) return std::numeric_limits<float>::quiet_NaN();
    return std::bit_cast<float>(key >> 31 ? key & 0x7FFFFFFFu : ~key);
  }
}

// Sorts by the upper halves, bytes of `Key`, digit by digit; returns which of the two holds the result.
template <class Key>
const uint64_t* SortByKey(uint64_t* from, uint64_t* to, size_t count) {
  constexpr int kBits = 8 * sizeof(Key), kDigit = kBits > 16 ? 11 : 8,
                kPasses = (kBits + kDigit - 1) / kDigit;
  constexpr size_t kDigits = size_t{1} << kDigit;
  const auto digit = [](uint64_t v, int pass) { return (v >> (32 + pass * kDigit)) % kDigits; };
  uint32_t begin[kPasses][kDigits] = {};
  for (size_t i = 0; i < count; ++i) {
    for (int p = 0; p < kPasses; ++p) ++begin[p][digit(from[i], p)];
  }
  for (int p = 0; p < kPasses; ++p) {
    uint32_t sum = 0;
    for (uint32_t& b : begin[p]) sum += std::exchange(b, sum);
    for (size_t i = 0; i < count; ++i) to[begin[p][digit(from[i], p)]++] = from[i];
    std::swap(from, to);
  }
  return from;
}

// Block after block of one tile.
template <class T, class Rank>
class SlidingMedian {
 public:
  SlidingMedian(const RankFunctions& functions, const RankTile<T>& tile, int across, int down,
                base::Arena& scratch)
      : slide_(std::get<RankFunctions::Slide<T, Rank>>(functions.slides)),
        t_(tile),
        across_(across),
        down_(down) {
    const auto most =
        static_cast<size_t>(across + tile.width - 1) * static_cast<size_t>(down + tile.height - 1);
    keys_ = scratch.Allocate<uint64_t>(most);
    moved_ = scratch.Allocate<uint64_t>(most);
    ranks_ = scratch.Allocate<Rank>(most);
    values_ = scratch.Allocate<T>(most);
    flags_ = scratch.Allocate<uint8_t>(most + 64);
  }

  void Run() {
    const int pixels = t_.samples / t_.channels;
    for (int y = 0; y < t_.rows; y += down_) {
      for (int x = 0; x < pixels; x += across_) {
        for (int c = 0; c < t_.channels; ++c) {
          RunBlock(x, y, std::min(across_, pixels - x), std::min(down_, t_.rows - y), c);
        }
      }
    }
  }

 private:
  void RunBlock(int x, int y, int across, int down, int channel) {
    const RankView view = t_.View(x, y, across, down);
    const T* const first = t_.First(view, x, y, channel);
    size_t n = 0;
    for (int j = 0; j < view.rows; ++j) {
      const T* const in = first + j * t_.in_stride;
      for (int i = 0; i < view.columns; ++i, ++n) {
        const auto place =
            static_cast<uint64_t>(i) * static_cast<uint64_t>(view.rows) + static_cast<uint64_t>(j);
        keys_[n] = uint64_t{KeyOf(in[ptrdiff_t{i} * t_.channels])} << 32 | place;
      }
    }
    const uint64_t* const sorted = SortByKey<T>(keys_, moved_, n);
    for (size_t k = 0; k < n; ++k) {
      ranks_[sorted[k] & 0xFFFFFFFFu] = static_cast<Rank>(k);
      values_[k] = ValueOf<T>(static_cast<uint32_t>(sorted[k] >> 32));
    }
    std::fill_n(flags_, n + 64, 0);
    slide_(RankedBlock<T, Rank>{.ranks = ranks_,
                                .values = values_,
                                .flags = flags_,
                                .view = view,
                                .out = t_.out + y * t_.out_stride + ptrdiff_t{x} * t_.channels + channel,
                                .step = t_.channels,
                                .out_stride = t_.out_stride});
  }

  const RankFunctions::Slide<T, Rank> slide_;
  const RankTile<T>& t_;
  const int across_, down_;  // results of a block
  uint64_t *keys_, *moved_;  // and places
  Rank* ranks_;
  T* values_;
  uint8_t* flags_;
};

}  // namespace

RankFunctions::Slides ChooseSlides() { return HWY_DYNAMIC_DISPATCH(SlidesOfTarget)(); }

template <class T>
void RunSlidingMedian(const RankFunctions& functions, const RankTile<T>& tile, base::Arena& scratch) {
  // Small blocks sort the same margins again and again, in large ones neighbouring members are far apart; up
  // to 256 x 256 samples a rank takes 16 bits.
  const auto side = [](int window, int all) {
    const int results = std::clamp(257 - window, window, 4 * window);
    return std::min(all, std::max(16, results));
  };
  const int across = side(tile.width, tile.samples / tile.channels), down = side(tile.height, tile.rows);
  if (int64_t{across + tile.width - 1} * (down + tile.height - 1) <= (1 << 16)) {
    SlidingMedian<T, uint16_t>(functions, tile, across, down, scratch).Run();
  } else {
    SlidingMedian<T, uint32_t>(functions, tile, across, down, scratch).Run();
  }
}
template void RunSlidingMedian(const RankFunctions&, const RankTile<float>&, base::Arena&);
template void RunSlidingMedian(const RankFunctions&, const RankTile<uint16_t>&, base::Arena&);
template void RunSlidingMedian(const RankFunctions&, const RankTile<uint8_t>&, base::Arena&);

}  // namespace tessera::ops
#endif  // HWY_ONCE
