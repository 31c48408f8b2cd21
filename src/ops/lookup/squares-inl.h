// Squares of two by two neighbours in a picture: where they lie, and how they are blended. Look-ups and warps
// share this; what they do not share is how a pixel's position is found.
#if defined(TESSERA_OPS_LOOKUP_SQUARES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_SQUARES_INL_H_
#undef TESSERA_OPS_LOOKUP_SQUARES_INL_H_
#else
#define TESSERA_OPS_LOOKUP_SQUARES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "simd/shuffle-inl.h"
#include "simd/texels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::V;
using s::VI;

// Pixels between the two passes: the first finds squares and distances, the second blends.
inline constexpr int kSquares = 64;

// Where the kSquares or fewer pixels of a block lie in memory: pixel i in row i >> log_width.
struct BlockRows {
  int log_width;
  ptrdiff_t stride;  // floats from row to row

  HWY_INLINE ptrdiff_t Offset(int pixel, int channels) const {
    return (pixel >> log_width) * stride + (pixel & ((1 << log_width) - 1)) * channels;
  }
};

struct BlockResults {
  float* to;
  BlockRows rows;
  bool stream;
};

// What the first pass leaves for the second.
struct Squares {
  // First entry: its place, in units of kUnit<texel> floats, which an address can be scaled by.
  alignas(64) int32_t base[kSquares];
  // From the nearer entry, along x and y, adjacent (LerpFromNearer); vectors may be read from any.
  alignas(64) float distance[2 * kSquares + 16];
};

template <int kTexel>
inline constexpr int kUnit = kTexel == 4 ? 2 : 1;
template <int kTexel>
HWY_INLINE const float* At(const float* data, int32_t place) {
  return data + size_t{kUnit<kTexel>} * static_cast<uint32_t>(place);
}

// Coordinates and what becomes of them stay in pairs, x in the even lanes and y in the odd ones: they need no
// shuffles until their cells become places.
HWY_INLINE V InPairs(float x, float y) { return hn::OddEven(hn::Set(s::D(), y), hn::Set(s::D(), x)); }

// Places of cells that are whole numbers in [0, 2^23), in pairs, of a picture whose rows are `stride` entries
// apart.
template <int kTexel>
class PairPlaces {
 public:
  HWY_INLINE explicit PairPlaces(int32_t stride)
      : shift_(hn::Set(s::D(), 0x1p23f)),
        strides_(hn::Set(s::DI(), stride)),
        zeros_(hn::Set(s::DI(), static_cast<int32_t>(kZero + kZero * static_cast<uint32_t>(stride)))) {}
  HWY_INLINE VI operator()(V low_cells, V high_cells) const {
    const s::DI di;
    V x, y;
    s::SplitInBlocks(hn::Add(low_cells, shift_), hn::Add(high_cells, shift_), x, y);
    const VI entry = hn::Add(hn::Sub(hn::BitCast(di, x), zeros_), hn::Mul(hn::BitCast(di, y), strides_));
    return s::LanesOfBlocks(kUnit<kTexel> == 2 ? hn::Add(entry, entry) : entry);
  }

 private:
  // Whole numbers plus 2^23 are integers from this on in their bits.
  static constexpr uint32_t kZero = 0x4B000000u;
  V shift_;
  VI strides_, zeros_;
};

// Stores vectors and remembers whether they were finite.
class Sink {
 public:
  HWY_INLINE explicit Sink(const BlockResults& results) : stream_(results.stream), sum_(hn::Zero(s::D())) {}
  HWY_INLINE void Store(V v, float* to) {
    sum_ = hn::MulAdd(v, hn::Zero(s::D()), sum_);
    s::StoreOrStream(v, s::D(), to, stream_);
  }
  HWY_INLINE bool Suspicious() const { return !hn::AllTrue(s::D(), hn::Eq(sum_, hn::Zero(s::D()))); }

 private:
  const bool stream_;
  V sum_;
};

// kQuarter of the floats p[0], p[kStep], p[2 kStep]..., each four times.
template <int kStep>
HWY_INLINE V EachFourTimes(const float* p) {
  const s::D d;
  if constexpr (s::kLanes <= 4) {
    return hn::Set(d, *p);
  } else {
    alignas(64) static constexpr int32_t kLane[16] = {
        0,         0,         0,         0,         kStep,     kStep,     kStep,     kStep,
        2 * kStep, 2 * kStep, 2 * kStep, 2 * kStep, 3 * kStep, 3 * kStep, 3 * kStep, 3 * kStep};
    return hn::TableLookupLanes(hn::LoadU(d, p), hn::SetTableIndices(d, kLane));
  }
}

// The pairs of neighbours of kQuarter pixels, blended along y as they lie; then all of them along x.
template <class P>
HWY_INLINE V BlendSquares(const P& below, const P& above, const float* distance) {
  if constexpr (s::kLanes == 16) {
    // Two pairs fill a vector.
    const s::D d;
    const hn::Half<s::D> half;
    alignas(64) static constexpr int32_t kY[2][16] = {{1, 1, 1, 1, 1, 1, 1, 1, 3, 3, 3, 3, 3, 3, 3, 3},
                                                      {5, 5, 5, 5, 5, 5, 5, 5, 7, 7, 7, 7, 7, 7, 7, 7}};
    alignas(64) static constexpr int32_t kSide[2][16] = {
        {0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27},
        {4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31}};
    const V distances = hn::LoadU(d, distance);
    const auto rows = [&](int j) HWY_ATTR {
      const auto two = [&](const P& row) HWY_ATTR {
        return hn::Combine(d, hn::LoadU(half, row(2 * j + 1)), hn::LoadU(half, row(2 * j)));
      };
      return s::LerpFromNearer(two(below), two(above),
                               hn::TableLookupLanes(distances, hn::SetTableIndices(d, kY[j])));
    };
    const V a = rows(0), b = rows(1);
    return s::LerpFromNearer(s::OfBoth(a, b, kSide[0]), s::OfBoth(a, b, kSide[1]),
                             EachFourTimes<2>(distance));
  } else {
    s::Pair rows[s::kQuarter];
    for (int j = 0; j < s::kQuarter; ++j) {
      rows[j] = s::LerpFromNearer(s::Pair::Load(below(j)), s::Pair::Load(above(j)),
                                  s::Pair::Set(distance[2 * j + 1]));
    }
    V low, high;
    s::SplitPairs(rows, low, high);
    return s::LerpFromNearer(low, high, EachFourTimes<2>(distance));
  }
}

// Blends `count` squares of entries of four floats, from `below` on and rows `stride` floats apart; true when
// some result may be infinite or no number, and nothing is known of those then.
inline bool BlendSquares4(const float* below, ptrdiff_t stride, const Squares& squares, int count,
                          const BlockResults& results) {
  const float* const above = below + stride;
  const int width = std::min(count, 1 << results.rows.log_width);
  Sink sink(results);
  float* to = results.to;
  const ptrdiff_t row = results.rows.stride;
  for (int first = 0; first < count; first += width, to += row) {
    for (int k = 0; k < width; k += s::kQuarter) {
      const int32_t* const place = squares.base + first + k;
      const auto at = [&](const float* data)
                          HWY_ATTR { return [=](int j) HWY_ATTR { return At<4>(data, place[j]); }; };
      sink.Store(BlendSquares(at(below), at(above), squares.distance + 2 * (first + k)), to + 4 * k);
    }
  }
  return sink.Suspicious();
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
