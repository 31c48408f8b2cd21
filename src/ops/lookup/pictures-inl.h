// Lookups in a picture that is clamped to its edges, the commonest use of a coordinate image: both passes
// from coordinates to results as they lie in memory, without planes between them.
#if defined(TESSERA_OPS_LOOKUP_PICTURES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_PICTURES_INL_H_
#undef TESSERA_OPS_LOOKUP_PICTURES_INL_H_
#else
#define TESSERA_OPS_LOOKUP_PICTURES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "ops/lookup/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// A picture of this size is in no cache.
inline constexpr int64_t kCacheBytes = int64_t{1} << 25;

// Where the kChunk or fewer pixels of a block lie in memory: pixel i in row i >> log_width.
struct BlockRows {
  int log_width;
  ptrdiff_t stride;  // floats from row to row

  HWY_INLINE ptrdiff_t Offset(int pixel, int channels) const {
    return (pixel >> log_width) * stride + (pixel & ((1 << log_width) - 1)) * channels;
  }
};

// Coordinates of a block of pixels, two of `channels` (2 to 4) adjacent floats each.
struct BlockCoordinates {
  const float* from;
  BlockRows rows;
  int channels;
  int axis[2];

  HWY_INLINE void Load(int i, V& x, V& y) const {
    const s::D d;
    const float* const p = from + rows.Offset(i, channels);
    V v[4];
    if (channels == 2) {
      hn::LoadInterleaved2(d, p, v[0], v[1]);
    } else if (channels == 3) {
      hn::LoadInterleaved3(d, p, v[0], v[1], v[2]);
    } else {
      hn::LoadInterleaved4(d, p, v[0], v[1], v[2], v[3]);
    }
    x = v[axis[0]], y = v[axis[1]];
  }
};
struct BlockResults {
  float* to;
  BlockRows rows;
  bool stream;
};

// What the first pass leaves for the second.
struct Taps {
  alignas(64) int32_t base[kChunk];      // first entry
  alignas(64) float weight[8][kChunk];   // linear: two distances; cubic: four for each axis
  alignas(64) int32_t shift[2][kChunk];  // cubic: how far the taps would lie outside of what is stored
};

#if HWY_TARGET != HWY_SCALAR
// Asks for the rows of a block's squares in a picture that no cache holds, where they lie close together;
// apart from each other they are better asked for one by one.
template <int kRows>
HWY_INLINE void AskForRows(const Grid& grid, const Taps& taps, int count) {
  if (grid.bytes() < kCacheBytes) return;
  const int64_t stride = grid.axis(1).stride;
  const int64_t step = int64_t{taps.base[1]} - taps.base[0];
  if (step > 4 * stride || -step > 4 * stride) return;
  for (int i = 0; i < count; ++i) {
    const float* p = grid.data() + static_cast<ptrdiff_t>(taps.base[i]) * grid.texel();
    for (int row = 0; row < kRows; ++row, p += stride * grid.texel()) hwy::Prefetch(p);
  }
}

// --- First passes: true when some coordinate may be no number. The taps are in memory whatever it is. ---

template <bool kExact>
HWY_INLINE bool LocateSquares(const Grid& grid, const BlockCoordinates& block, int count, Taps& taps) {
  const s::D d;
  const s::DI di;
  V sum = hn::Zero(d);
  for (int i = 0; i < count; i += s::kLanes) {
    V at[2];
    block.Load(i, at[0], at[1]);
    VI base = hn::Zero(di);
    for (int a = 0; a < 2; ++a) {
      const GridAxis& axis = grid.axis(a);
      sum = hn::MulAdd(at[a], hn::Zero(d), sum);
      V place;
      const VI index = SmallInteger(EdgeCell<kExact, Want::kNearer>(axis, at[a], place));
      hn::Store(place, d, taps.weight[a] + i);
      base = a == 0 ? index : hn::Add(base, hn::Mul(index, hn::Set(di, axis.stride)));
    }
    hn::Store(base, di, taps.base + i);
  }
  AskForRows<2>(grid, taps, count);
  return !hn::AllTrue(d, hn::Eq(sum, hn::Zero(d)));
}

// An edge entry has the weights of all taps that would lie beyond it.
inline void FoldWeights(int32_t shift, float* weights) {
  float folded[4] = {};
  for (int k = 0; k < 4; ++k) folded[std::clamp(k + shift, 0, 3)] += weights[k * kChunk];
  for (int k = 0; k < 4; ++k) weights[k * kChunk] = folded[k];
}

inline bool LocateCubic(const Grid& grid, const BlockCoordinates& block, int count, Taps& taps) {
  const s::D d;
  const s::DI di;
  const CubicPolynomials kernel(grid.params().cubic);
  V sum = hn::Zero(d);
  for (int i = 0; i < count; i += s::kLanes) {
    V at[2];
    block.Load(i, at[0], at[1]);
    VI base = hn::Zero(di), any = hn::Zero(di);
    for (int a = 0; a < 2; ++a) {
      const GridAxis& axis = grid.axis(a);
      sum = hn::MulAdd(at[a], hn::Zero(d), sum);
      V fraction, w[4];
      const VI first = hn::Sub(
          hn::ConvertTo(di, Cell<Want::kFraction>(axis, Reduce<TableWrap::kClampEdge>(at[a]), fraction)),
          hn::Set(di, 1));
      kernel.Weights(fraction, w);
      for (int k = 0; k < 4; ++k) hn::Store(w[k], d, taps.weight[4 * a + k] + i);
      const VI stored =
                   hn::Min(hn::Max(first, hn::Set(di, axis.first_stored)), hn::Set(di, axis.last_stored - 3)),
               shift = hn::Sub(first, stored);
      hn::Store(shift, di, taps.shift[a] + i);
      any = hn::Or(any, shift);
      const VI part = hn::Mul(stored, hn::Set(di, axis.stride));
      base = a == 0 ? part : hn::Add(base, part);
    }
    hn::Store(base, di, taps.base + i);
    if (hn::AllTrue(di, hn::Eq(any, hn::Zero(di)))) continue;
    for (int k = i; k < i + s::kLanes; ++k) {
      for (int a = 0; a < 2; ++a) {
        if (taps.shift[a][k] != 0) FoldWeights(taps.shift[a][k], taps.weight[4 * a] + k);
      }
    }
  }
  AskForRows<4>(grid, taps, count);
  return !hn::AllTrue(d, hn::Eq(sum, hn::Zero(d)));
}

// --- Second passes: true when some result may be infinite or no number. Vectors go to memory as they are.
// ---

// Stores vectors and remembers whether they were finite.
class Sink {
 public:
  HWY_INLINE explicit Sink(const BlockResults& results) : results_(results), sum_(hn::Zero(s::D())) {}
  template <int kTexel>
  HWY_INLINE void Store(V v, int pixel) {
    sum_ = hn::MulAdd(v, hn::Zero(s::D()), sum_);
    s::StoreOrStream(v, s::D(), results_.to + results_.rows.Offset(pixel, kTexel), results_.stream);
  }
  HWY_INLINE bool Suspicious() const { return !hn::AllTrue(s::D(), hn::Eq(sum_, hn::Zero(s::D()))); }

 private:
  const BlockResults& results_;
  V sum_;
};

// kQuarter floats, each four times.
HWY_INLINE V EachFourTimes(const float* p) {
  const s::D d;
  if constexpr (s::kLanes <= 4) {
    return hn::Set(d, *p);
  } else {
    alignas(64) static constexpr int32_t kLane[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
    return hn::TableLookupLanes(hn::LoadU(d, p), hn::SetTableIndices(d, kLane));
  }
}

// The pixels' rows are joined for two pixels in 128 bits: along y first, as they lie, then along x.
inline bool GatherSquares1(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  const s::D d;
  const float* const low = grid.data();
  const float* const high = low + grid.axis(1).stride;
  Sink sink(results);
  for (int i = 0; i < count; i += s::kLanes) {
    const int32_t* const base = taps.base + i;
    const V x = hn::Load(d, taps.weight[0] + i), y = hn::Load(d, taps.weight[1] + i);
    sink.Store<1>(LerpSquares(low, high, base, x, y), i);
  }
  return sink.Suspicious();
}
// Pairs of neighbours of kQuarter pixels along y first, as they lie, then all pixels of a vector along x.
inline bool GatherSquares4(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  const ptrdiff_t up = static_cast<ptrdiff_t>(grid.axis(1).stride) * 4;
  Sink sink(results);
  for (int i = 0; i < count; i += s::kQuarter) {
    s::Pair rows[s::kQuarter];
    for (int k = 0; k < s::kQuarter; ++k) {
      const float* const p = grid.data() + static_cast<ptrdiff_t>(taps.base[i + k]) * 4;
      rows[k] =
          s::LerpFromNearer(s::Pair::Load(p), s::Pair::Load(p + up), s::Pair::Set(taps.weight[1][i + k]));
    }
    V low, high;
    s::SplitPairs(rows, low, high);
    sink.Store<4>(s::LerpFromNearer(low, high, EachFourTimes(taps.weight[0] + i)), i);
  }
  return sink.Suspicious();
}
// Cubic: rows of four entries along y first, four pixels' rows side by side.
template <int kQuadOf>
HWY_INLINE V CubicRows(const float* const* row, const int32_t* base, const V* weight) {
  const auto load = [&](int k) HWY_ATTR {
    return s::LoadQuads([&](int pixel) HWY_ATTR { return row[k] + base[pixel]; }, kQuadOf);
  };
  V sum = hn::Mul(load(0), hn::Broadcast<kQuadOf>(weight[0]));
  for (int k = 1; k < 4; ++k) sum = hn::MulAdd(load(k), hn::Broadcast<kQuadOf>(weight[k]), sum);
  return sum;
}
inline bool GatherCubicSquares1(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  const s::D d;
  const float* row[4];
  for (int k = 0; k < 4; ++k) row[k] = grid.data() + k * ptrdiff_t{grid.axis(1).stride};
  Sink sink(results);
  for (int i = 0; i < count; i += s::kLanes) {
    const int32_t* const base = taps.base + i;
    V w[4];
    for (int k = 0; k < 4; ++k) w[k] = hn::Load(d, taps.weight[4 + k] + i);
    V q[4] = {CubicRows<0>(row, base, w), CubicRows<1>(row, base, w), CubicRows<2>(row, base, w),
              CubicRows<3>(row, base, w)};
    s::Transpose4(q[0], q[1], q[2], q[3]);
    V sum = hn::Mul(q[0], hn::Load(d, taps.weight[0] + i));
    for (int k = 1; k < 4; ++k) sum = hn::MulAdd(q[k], hn::Load(d, taps.weight[k] + i), sum);
    sink.Store<1>(sum, i);
  }
  return sink.Suspicious();
}
inline bool GatherCubicSquares4(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  const ptrdiff_t up = static_cast<ptrdiff_t>(grid.axis(1).stride) * 4;
  Sink sink(results);
  for (int i = 0; i < count; i += s::kQuarter) {
    s::Row rows[s::kQuarter];
    for (int k = 0; k < s::kQuarter; ++k) {
      const float* p = grid.data() + static_cast<ptrdiff_t>(taps.base[i + k]) * 4;
      const auto weight = [&](int row) HWY_ATTR { return s::Row::Set(taps.weight[4 + row][i + k]); };
      rows[k] = s::Mul(s::Row::Load(p), weight(0));
      for (int row = 1; row < 4; ++row) rows[k] = s::MulAdd(s::Row::Load(p += up), weight(row), rows[k]);
    }
    const auto column = [&](auto quad) HWY_ATTR {
      return s::VectorOfQuads([&](int k) HWY_ATTR { return quad(rows[k / 4]).v[0]; }, 0);
    };
    const auto weight = [&](int k) HWY_ATTR { return EachFourTimes(taps.weight[k] + i); };
    V sum = hn::Mul(column([](const s::Row& r) HWY_ATTR { return s::Lower(s::Lower(r)); }), weight(0));
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Upper(s::Lower(r)); }), weight(1), sum);
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Lower(s::Upper(r)); }), weight(2), sum);
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Upper(s::Upper(r)); }), weight(3), sum);
    sink.Store<4>(sum, i);
  }
  return sink.Suspicious();
}

#endif

struct PictureMethod {
  bool (*locate)(const Grid&, const BlockCoordinates&, int count, Taps&) = nullptr;
  bool (*gather)(const Grid&, const Taps&, int count, const BlockResults& results) = nullptr;
};

// The method for a grid of two axes that are clamped to their edges; none for others, and with one lane.
inline PictureMethod PictureMethodOf(const Grid& grid) {
#if HWY_TARGET == HWY_SCALAR
  (void)grid;
  return {};
#else
  if (grid.dims() != 2) return {};
  for (int a = 0; a < 2; ++a) {
    if (grid.axis(a).wrap != TableWrap::kClampEdge) return {};
  }
  const bool one = grid.texel() == 1;
  if (grid.params().filter == TableFilter::kCubic)
    return {LocateCubic, one ? GatherCubicSquares1 : GatherCubicSquares4};
  if (grid.params().filter != TableFilter::kLinear || !grid.edges()) return {};
  const bool exact = grid.axis(0).exact && grid.axis(1).exact;
  return {exact ? LocateSquares<true> : LocateSquares<false>, one ? GatherSquares1 : GatherSquares4};
#endif
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
