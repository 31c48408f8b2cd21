// Colours through a finite 3-D table that is clamped to its ends, the commonest lookup: both passes from
// vectors of pixels to vectors of pixels, without planes between them.
#if defined(TESSERA_OPS_LOOKUP_COLORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_COLORS_INL_H_
#undef TESSERA_OPS_LOOKUP_COLORS_INL_H_
#else
#define TESSERA_OPS_LOOKUP_COLORS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <type_traits>

#include "ops/lookup/gather-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::V;
using s::VI;

// What the first pass leaves for the second. Places are offsets in units of two floats, which is what an
// address can be scaled by; there are at most kMostPlaces, so that floats hold them exactly.
struct Cells {
  // Simplex: the first three of its entries. Linear: along the axes 1 and 2 the nearest, the ones further
  // along 1, along 2 and along both.
  alignas(64) int32_t place[4][kChunk];
  alignas(64) float weight[4][kChunk];  // simplex: of its four entries, the first's less 1; linear: distances
};
inline constexpr int kPlacesPerEntry = 2;
inline constexpr int64_t kMostPlaces = int64_t{1} << 23;
using Entries = EntriesByPlace<2>;

// Colours whose coordinates are within the table, NaN at its first entry.
HWY_INLINE s::Pixels Inside(const s::Pixels& p) { return {Unit(p.r), Unit(p.g), Unit(p.b), p.a}; }

// First pass for the pixels from i on, whose colours are in [0, 1].
template <bool kSimplex, bool kExact>
HWY_INLINE void LocateColors(const Grid& grid, const s::Pixels& p, Cells& cells, int i) {
  const s::D d;
  const s::DI di;
  const V x[3] = {p.r, p.g, p.b};
  V f[3], sum = hn::Set(d, kFirstPlace);
  VI step[3];
  for (int a = 0; a < 3; ++a) {
    const GridAxis& axis = grid.axis(a);
    const int32_t length = kPlacesPerEntry * axis.stride;
    step[a] = hn::Set(di, length);
    const V cell = CellInside < kExact,
            kSimplex ? Want::kFraction
                     : Want::kNearer >
                           (x[a], hn::Set(d, axis.scale), hn::Set(d, static_cast<float>(axis.last)), f[a]);
    sum = hn::MulAdd(cell, hn::Set(d, static_cast<float>(length)), sum);
  }
  const VI place = hn::BitCast(di, sum);
  if constexpr (!kSimplex) {
    VI near = place, along[3];
    for (int a = 1; a < 3; ++a) {
      const VI sign = hn::BitCast(di, f[a]);
      near = hn::Add(near, hn::IfNegativeThenElse(sign, step[a], hn::Zero(di)));
      along[a] = hn::IfNegativeThenElse(sign, hn::Neg(step[a]), step[a]);
    }
    const VI further = hn::Add(near, along[1]);
    hn::Store(near, di, cells.place[0] + i);
    hn::Store(further, di, cells.place[1] + i);
    hn::Store(hn::Add(near, along[2]), di, cells.place[2] + i);
    hn::Store(hn::Add(further, along[2]), di, cells.place[3] + i);
    hn::Store(f[0], d, cells.weight[0] + i);
    for (int a = 1; a < 3; ++a) hn::Store(hn::Abs(f[a]), d, cells.weight[a] + i);
  } else {
    hn::Store(place, di, cells.place[0] + i);
    // From the first corner to the last one along the axes in falling order of their fractions; the weights
    // are the differences of these.
    const auto ge01 = hn::Ge(f[0], f[1]), ge12 = hn::Ge(f[1], f[2]), ge02 = hn::Ge(f[0], f[2]);
    const auto pick = [&](auto mask, VI yes, VI no)
                          HWY_ATTR { return hn::IfThenElse(hn::RebindMask(di, mask), yes, no); };
    const VI first = pick(hn::And(ge01, ge02), step[0], pick(ge12, step[1], step[2]));
    // All but the last.
    const VI both = pick(hn::And(ge12, ge02), hn::Add(step[0], step[1]),
                         pick(ge01, hn::Add(step[0], step[2]), hn::Add(step[1], step[2])));
    hn::Store(hn::Add(place, first), di, cells.place[1] + i);
    hn::Store(hn::Add(place, both), di, cells.place[2] + i);
    const V high01 = hn::Max(f[0], f[1]), low01 = hn::Min(f[0], f[1]);
    const V high = hn::Max(high01, f[2]), low = hn::Min(low01, f[2]);
    const V middle = hn::Max(low01, hn::Min(high01, f[2]));
    hn::Store(hn::Neg(high), d, cells.weight[0] + i);
    hn::Store(hn::Sub(high, middle), d, cells.weight[1] + i);
    hn::Store(hn::Sub(middle, low), d, cells.weight[2] + i);
    hn::Store(low, d, cells.weight[3] + i);
  }
}

// Second pass: store(j, vector), j an integral constant, gets the quarters of the kLanes pixels from i on in
// turn: lanes j, j + 4... of the first pass, which is how pixels in plane order lie in memory.
template <int j, class Store>
HWY_INLINE void SimplexQuarter(const Entries& entries, const Entries& last, const Cells& cells, int i,
                               const V* w, const Store& store) {
  const auto entry = [&](int k) HWY_ATTR {
    const int32_t* const place = cells.place[k % 3] + i;
    return s::LoadQuads([&](int lane) HWY_ATTR { return (k == 3 ? last : entries)(place[lane]); }, j);
  };
  store(std::integral_constant<int, j>(),
        SimplexSum<3>(entry, [&](int k) HWY_ATTR { return hn::Broadcast<j>(w[k]); }));
}
template <class Store>
HWY_INLINE void GatherSimplexColors(const Entries& entries, const Entries& last, const Cells& cells, int i,
                                    const Store& store) {
  const s::D d;
  V w[4];
  for (int k = 0; k < 4; ++k) w[k] = hn::Load(d, cells.weight[k] + i);
  SimplexQuarter<0>(entries, last, cells, i, w, store);
  SimplexQuarter<1>(entries, last, cells, i, w, store);
  SimplexQuarter<2>(entries, last, cells, i, w, store);
  SimplexQuarter<3>(entries, last, cells, i, w, store);
}
// Linear: along axes 1 and 2 from the nearer entries, pairs of neighbours along axis 0 as they lie; along
// that all pixels of a vector.
template <class Store>
HWY_INLINE void GatherLinearColors(const Entries& entries, const Cells& cells, int i, const Store& store) {
  const auto pair = [&](int k) HWY_ATTR {
    const auto load = [&](int p) HWY_ATTR { return s::Pair::Load(entries(cells.place[p][k])); };
    const s::Pair h1 = s::Pair::Set(cells.weight[1][k]), h2 = s::Pair::Set(cells.weight[2][k]);
    return s::LerpFrom(s::LerpFrom(load(0), load(1), h1), s::LerpFrom(load(2), load(3), h1), h2);
  };
  const auto quarter = [&](auto j) HWY_ATTR {
    constexpr int kLane = decltype(j)::value;
    s::Pair pairs[s::kQuarter];
    for (int k = 0; k < s::kQuarter; ++k) pairs[k] = pair(i + kLane + 4 * k);
    V a, b;
    s::SplitPairs(pairs, a, b);
    store(j, s::LerpFromNearer(a, b, hn::Broadcast<kLane>(hn::Load(s::D(), cells.weight[0] + i))));
  };
  quarter(std::integral_constant<int, 0>()), quarter(std::integral_constant<int, 1>());
  quarter(std::integral_constant<int, 2>()), quarter(std::integral_constant<int, 3>());
}

// Both passes over a chunk's pixels, finite entries only. load(i) -> Pixels from i on, in [0, 1];
// store(i, j, vector): quarter j of the pixels from i on, three results and what the table's fourth sample
// is.
template <bool kSimplex, bool kExact, class Load, class Store>
HWY_INLINE void LookupColors(const Grid& grid, Cells& cells, int count, const Load& load,
                             const Store& store) {
  ptrdiff_t end = 0;
  for (int a = 0; a < 3; ++a) end += static_cast<ptrdiff_t>(grid.axis(a).stride) * 4;
  const Entries entries(grid.data()), last(grid.data() + end);
  for (int i = 0; i < count; i += s::kLanes) LocateColors<kSimplex, kExact>(grid, load(i), cells, i);
  for (int i = 0; i < count; i += s::kLanes) {
    const auto store_here = [&](auto j, V v) HWY_ATTR { store(i, j, v); };
    if constexpr (kSimplex) {
      GatherSimplexColors(entries, last, cells, i, store_here);
    } else {
      GatherLinearColors(entries, cells, i, store_here);
    }
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
