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
#include "ops/lookup/squares-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// A picture of this size is in no cache.
inline constexpr int64_t kCacheBytes = int64_t{1} << 25;
// Up to this one, a copy of twice the size would still be in one.
inline constexpr int64_t kMidBytes = int64_t{6} << 20;

// Coordinates of a block of pixels, two of `channels` (2 to 4) adjacent floats each.
struct BlockCoordinates {
  const float* from;
  BlockRows rows;
  int channels;
  int axis[2];

  bool Paired() const { return channels == 2 && axis[0] == 0 && axis[1] == 1; }

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

// What the first pass leaves for the second: squares, or for cubic look-ups first entries and weights.
struct Taps : Squares {
  alignas(64) float weight[8][kChunk];   // four for each axis
  alignas(64) int32_t shift[2][kChunk];  // how far the taps would lie outside of what is stored
};
static_assert(kChunk == kSquares);

// Asks for the rows of a block's squares, and where kEnds for the lines that the rows end in. unit: floats
// from place to place. No lambda: g++ takes a function that only asks for memory for one without effects, and
// drops calls that it has not inlined yet.
template <int kRows, bool kEnds>
HWY_INLINE void PrefetchEach(const Grid& grid, const Taps& taps, int unit, int count) {
  const ptrdiff_t stride = ptrdiff_t{grid.axis(1).stride} * grid.texel(),
                  end = kRows * ptrdiff_t{grid.texel()} - 1;
  for (int i = 0; i < count; ++i) {
    const float* p = grid.data() + int64_t{taps.base[i]} * unit;
    for (int row = 0; row < kRows; ++row, p += stride) {
      hwy::Prefetch(p);
      if constexpr (kEnds) hwy::Prefetch(p + end);
    }
  }
}
// In a picture that no cache holds. Where squares lie apart, no neighbour brings the rest of a row that is in
// two lines.
template <int kRows>
HWY_INLINE void PrefetchRows(const Grid& grid, const Taps& taps, int unit, int count) {
  if (grid.bytes() < kCacheBytes) return;
  const int64_t step = (int64_t{taps.base[1]} - taps.base[0]) * unit,
                apart = 4 * int64_t{grid.axis(1).stride} * grid.texel();
  if (step > apart || -step > apart) {
    PrefetchEach<kRows, true>(grid, taps, unit, count);
  } else {
    PrefetchEach<kRows, false>(grid, taps, unit, count);
  }
}

// First passes: true when some coordinate may be no number. The taps are in memory whatever it is.

// An axis of each of two neighbouring lanes.
struct AxisPair {
  V scale, offset, last, end;

  HWY_INLINE explicit AxisPair(const Grid& grid) {
    const GridAxis &x = grid.axis(0), &y = grid.axis(1);
    scale = InPairs(x.scale, y.scale), offset = InPairs(x.offset, y.offset);
    last = InPairs(static_cast<float>(x.last), static_cast<float>(y.last));
    end = hn::Add(last, hn::Set(s::D(), 1.0f));
  }
};
// Cells and distances from the nearer entries on axes that are clamped to their edges.
HWY_INLINE V ExactCells(const AxisPair& axis, V at, V& distance) {
  const s::D d;
  // Products are exact, so this has one rounding on every target.
  const V position = hn::MulAdd(at, axis.scale, axis.offset);
  const V inside = s::ClampHigh(s::ClampLow(position, hn::Zero(d)), axis.end);
  const V cell = hn::Min(hn::Floor(inside), axis.last);
  distance = FromNearer(hn::Sub(inside, cell));
  return cell;
}
HWY_INLINE V RoundedCells(const AxisPair& axis, V at, V& distance) {
  const V x = Reduce<Wrap::kClamp>(at);
  return CellFromNearest<Want::kNearer>(x, axis.scale, axis.offset, hn::Zero(s::D()), axis.last, distance);
}

// Which of the axes have exact products.
enum class Exact : uint8_t { kBoth, kNone, kOne };

// The coordinates of a block in pairs, x and y.
HWY_NOINLINE inline void PairCoordinates(const BlockCoordinates& block, int count, float* pairs) {
  for (int i = 0; i < count; i += s::kLanes) {
    V x, y;
    block.Load(i, x, y);
    hn::StoreInterleaved2(x, y, s::D(), pairs + 2 * i);
  }
}

template <Exact exact, int kTexel>
inline bool LocateSquares(const Grid& grid, const BlockCoordinates& block, int count, Taps& taps) {
  const s::D d;
  const s::DI di;
  const int width = std::min(count, 1 << block.rows.log_width);
  const float* from = block.from;
  ptrdiff_t row = block.rows.stride;
  alignas(64) float pairs[2 * kChunk];
  if (!block.Paired()) {
    PairCoordinates(block, count, pairs);
    from = pairs, row = 2 * width;
  }
  const AxisPair axes(grid);
  const auto is_exact =
      hn::Eq(InPairs(grid.axis(0).exact ? 1.0f : 0.0f, grid.axis(1).exact ? 1.0f : 0.0f), hn::Set(d, 1.0f));
  const auto cells = [&](V at, V& distance) HWY_ATTR {
    if constexpr (exact == Exact::kBoth) return ExactCells(axes, at, distance);
    const V rounded = RoundedCells(axes, at, distance);
    if constexpr (exact == Exact::kNone) return rounded;
    V other;
    const V cell = ExactCells(axes, at, other);
    distance = hn::IfThenElse(is_exact, other, distance);
    return hn::IfThenElse(is_exact, cell, rounded);
  };
  const PairPlaces<kTexel> places(grid.axis(1).stride);
  V sum = hn::Zero(d);
  for (int first = 0; first < count; first += width, from += row) {
    for (int k = 0; k < width; k += s::kLanes) {
      const V low = hn::LoadU(d, from + 2 * k), high = hn::LoadU(d, from + 2 * k + s::kLanes);
      sum = hn::MulAdd(low, hn::Zero(d), sum), sum = hn::MulAdd(high, hn::Zero(d), sum);
      V low_distance, high_distance;
      const V low_cells = cells(low, low_distance), high_cells = cells(high, high_distance);
      hn::Store(low_distance, d, taps.distance + 2 * (first + k));
      hn::Store(high_distance, d, taps.distance + 2 * (first + k) + s::kLanes);
      hn::Store(places(low_cells, high_cells), di, taps.base + first + k);
    }
  }
  PrefetchRows<2>(grid, taps, kTexel / kUnit<kTexel>, count);
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
  const GridAxis axes[2] = {grid.axis(0), grid.axis(1)};  // copies, which no store of a weight can change
  V sum = hn::Zero(d);
  for (int i = 0; i < count; i += s::kLanes) {
    V at[2];
    block.Load(i, at[0], at[1]);
    VI base = hn::Zero(di), any = hn::Zero(di);
    for (int a = 0; a < 2; ++a) {
      const GridAxis& axis = axes[a];
      sum = hn::MulAdd(at[a], hn::Zero(d), sum);
      V fraction, w[4];
      const VI first =
          hn::Sub(hn::ConvertTo(di, Cell<Want::kFraction>(axis, Reduce<Wrap::kClamp>(at[a]), fraction)),
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
  PrefetchRows<4>(grid, taps, grid.texel(), count);
  return !hn::AllTrue(d, hn::Eq(sum, hn::Zero(d)));
}

// Second passes: true when some result may be infinite or no number. Vectors go to memory as they are.

// Squares blended along y, by rows(first pixel, distances) for half a vector of pixels, then along x.
template <class Rows>
HWY_INLINE bool BlendSquares(const Taps& taps, int count, const BlockResults& results, const Rows& rows) {
  const s::D d;
  const int width = std::min(count, 1 << results.rows.log_width);
  Sink sink(results);
  float* to = results.to;
  const ptrdiff_t row = results.rows.stride;
  for (int first = 0; first < count; first += width, to += row) {
    for (int k = 0; k < width; k += s::kLanes) {
      const int i = first + k;
      const V low = hn::Load(d, taps.distance + 2 * i), high = hn::Load(d, taps.distance + 2 * i + s::kLanes);
      V left, right;
      s::SplitInBlocks(rows(i, low), rows(i + s::kLanes / 2, high), left, right);
      sink.Store(s::LanesOfBlocks(s::LerpFromNearer(left, right, s::EvenInBlocks(low, high))), to + k);
    }
  }
  return sink.Suspicious();
}

// Two pixels' pairs of neighbours are joined in 128 bits: along y first, as they lie.
inline bool GatherSquares1(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  const float* const below = grid.data();
  const float* const above = below + grid.axis(1).stride;
  return BlendSquares(taps, count, results, [&](int pixel, V distance) HWY_ATTR {
    const int32_t* const place = taps.base + pixel;
    const auto pairs = [&](const float* row) HWY_ATTR {
      return s::VectorOfQuads(
          [&](int j)
              HWY_ATTR { return s::JoinPairs(At<1>(row, place[j / 2]), At<1>(row, place[j / 2 + 1])); },
          0);
    };
    return s::LerpFromNearer(pairs(below), pairs(above), hn::DupOdd(distance));
  });
}
inline bool GatherSquares4(const Grid& grid, const Taps& taps, int count, const BlockResults& results) {
  return BlendSquares4(grid.data(), static_cast<ptrdiff_t>(grid.axis(1).stride) * 4, taps, count, results);
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
    sink.Store(sum, results.to + results.rows.Offset(i, 1));
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
    const auto weight = [&](int k) HWY_ATTR { return EachFourTimes<1>(taps.weight[k] + i); };
    V sum = hn::Mul(column([](const s::Row& r) HWY_ATTR { return s::Lower(s::Lower(r)); }), weight(0));
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Upper(s::Lower(r)); }), weight(1), sum);
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Lower(s::Upper(r)); }), weight(2), sum);
    sum = hn::MulAdd(column([](const s::Row& r) HWY_ATTR { return s::Upper(s::Upper(r)); }), weight(3), sum);
    sink.Store(sum, results.to + results.rows.Offset(i, 4));
  }
  return sink.Suspicious();
}

struct PictureMethod {
  bool (*locate)(const Grid&, const BlockCoordinates&, int count, Taps&) = nullptr;
  bool (*gather)(const Grid&, const Taps&, int count, const BlockResults& results) = nullptr;
};

template <int kTexel>
PictureMethod SquaresMethod(const Grid& grid) {
  const bool x = grid.axis(0).exact, y = grid.axis(1).exact;
  return {x && y   ? LocateSquares<Exact::kBoth, kTexel>
          : x || y ? LocateSquares<Exact::kOne, kTexel>
                   : LocateSquares<Exact::kNone, kTexel>,
          kTexel == 1 ? GatherSquares1 : GatherSquares4};
}

// The method for a grid of two axes that are clamped to their edges; none for others.
inline PictureMethod PictureMethodOf(const Grid& grid) {
  if (grid.dims() != 2) return {};
  for (int a = 0; a < 2; ++a) {
    if (grid.axis(a).wrap != Wrap::kClamp) return {};
  }
  const bool one = grid.texel() == 1;
  if (grid.params().filter == TableFilter::kCubic)
    return {LocateCubic, one ? GatherCubicSquares1 : GatherCubicSquares4};
  if (grid.params().filter != TableFilter::kLinear || !grid.edges()) return {};
  return one ? SquaresMethod<1>(grid) : SquaresMethod<4>(grid);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
