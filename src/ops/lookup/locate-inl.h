// First pass of a lookup over a few dozen pixels: where its entries are and with what weights, into L1.
#if defined(TESSERA_OPS_LOOKUP_LOCATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#undef TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#else
#define TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#endif

#include <hwy/highway.h>

#include <type_traits>

#include "ops/lookup/grid.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::V;
using s::VI;

inline constexpr int kChunk = 64;

// A chunk's pixels between the passes. Coordinates beyond the count are zeros.
struct Chunk {
  alignas(64) float coord[4][kChunk];
  alignas(64) float weight[16][kChunk];  // linear: fractions; simplex: D + 1 weights; cubic: four per axis
  alignas(64) int32_t step[3][kChunk];   // simplex: offsets of the entries between the first and the last
  alignas(64) int32_t base[kChunk];      // first entry
  alignas(64) int32_t flag[kChunk];  // set when a lookup says so: not 0 where the result comes from elsewhere
  alignas(64) float result[4 * kChunk];  // texel() per pixel
};
inline constexpr int32_t kNotANumber = 1, kSeam = 2;

// a b + c with one rounding, also where the processor has no such instruction.
HWY_INLINE V Fused(V a, V b, V c) {
#if HWY_TARGET <= HWY_AVX2
  return hn::MulAdd(a, b, c);
#else
  alignas(64) float x[s::kLanes], y[s::kLanes], z[s::kLanes];
  const s::D d;
  hn::Store(a, d, x), hn::Store(b, d, y), hn::Store(c, d, z);
  for (int i = 0; i < s::kLanes; ++i) x[i] = static_cast<float>(double{x[i]} * y[i] + z[i]);
  return hn::Load(d, x);
#endif
}

// a b - c with one rounding.
HWY_INLINE V FusedSub(V a, V b, V c) {
#if HWY_TARGET <= HWY_AVX2
  return hn::MulSub(a, b, c);
#else
  return Fused(a, b, hn::Neg(c));
#endif
}

// Whole numbers in [0, 2^23): half the instructions of a conversion that minds its limits.
HWY_INLINE VI SmallInteger(V whole) {
  const s::DI di;
  return hn::And(hn::BitCast(di, hn::Add(whole, hn::Set(s::D(), 0x1p23f))), hn::Set(di, 0x7fffff));
}

template <TableWrap wrap>
HWY_INLINE V Reduce(V x) {
  const s::D d;
  const V one = hn::Set(d, 1.0f);
  if constexpr (wrap == TableWrap::kRepeat) {
    return hn::Sub(x, hn::Floor(x));
  } else if constexpr (wrap == TableWrap::kMirror) {
    const V t = hn::NegMulAdd(hn::Set(d, 2.0f), hn::Floor(hn::Mul(x, hn::Set(d, 0.5f))), x);
    return hn::IfThenElse(hn::Gt(t, one), hn::Sub(hn::Set(d, 2.0f), t), t);
  } else if constexpr (wrap == TableWrap::kClamp) {
    return s::ClampHigh(s::ClampLow(x, hn::Zero(d)), one);
  } else {
    return s::ClampHigh(s::ClampLow(x, hn::Set(d, -4.0f)), hn::Set(d, 4.0f));
  }
}

// Where a coordinate lies on an axis: the first entry and, not for kNearest, the fraction to the next one.
template <bool kNearest>
HWY_INLINE V Cell(const GridAxis& axis, V x, V& fraction) {
  const s::D d;
  const V scale = hn::Set(d, axis.scale), offset = hn::Set(d, axis.offset), low = hn::Set(d, axis.low);
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), product = hn::Mul(x, scale);
  if constexpr (kNearest) {
    const V v = s::ClampHigh(s::ClampLow(hn::Floor(hn::Add(product, offset)), low), hn::Set(d, axis.high));
    // Rounding may have lifted the position to the next entry.
    const auto lifted = hn::Lt(Fused(x, scale, hn::Sub(offset, v)), zero);
    return s::ClampLow(hn::IfThenElse(lifted, hn::Sub(v, one), v), low);
  } else {
    const V last = hn::Set(d, static_cast<float>(axis.last));
    V cell, g;
    if (axis.exact) {
      // The product is exact, so is the subtraction wherever it matters.
      const V position = hn::Add(product, offset);
      cell = hn::Floor(position);
      g = hn::Sub(position, cell);
    } else {
      const V nearest = hn::Round(hn::Add(product, offset));
      // The distance from the nearest entry with one rounding. Where it is within the rounding of the
      // coordinate itself, the coordinate is the entry's.
      g = Fused(x, scale, hn::Sub(offset, nearest));
      g = hn::IfThenZeroElse(hn::Le(hn::Abs(g), hn::Abs(hn::Mul(product, hn::Set(d, 0x1p-24f)))), g);
      const auto below = hn::Lt(g, zero);
      cell = hn::Sub(nearest, hn::IfThenElseZero(below, one));
      g = hn::Add(g, hn::IfThenElseZero(below, one));
    }
    g = hn::IfThenZeroElse(hn::Lt(cell, low), g);
    fraction = hn::IfThenElse(hn::Gt(cell, last), one, g);
    return hn::Min(hn::Max(cell, low), last);
  }
}

// The same for a coordinate in [0,1] of a table whose last cell is chosen at its own end. kExact: the
// products are exact because the scale is a power of two, so there is nothing to round.
template <bool kExact>
HWY_INLINE V CellInside(V x, V scale, V last, V& fraction) {
  const s::D d;
  const V product = hn::Mul(x, scale);
  if constexpr (kExact) {
    const V cell = hn::Min(hn::Floor(product), last);
    fraction = hn::Sub(product, cell);
    return cell;
  } else {
    const V nearest = hn::Round(product), cell = hn::Min(hn::Floor(product), last);
    V g = FusedSub(x, scale, nearest);
    g = hn::IfThenZeroElse(hn::Le(hn::Abs(g), hn::Mul(product, hn::Set(d, 0x1p-24f))), g);
    // Just below an entry that it stands for, the coordinate is at the end of the cell before.
    fraction = hn::Add(g, hn::Sub(nearest, cell));
    return cell;
  }
}
HWY_INLINE V Unit(V x) { return s::ClampHigh(s::ClampLow(x, hn::Zero(s::D())), hn::Set(s::D(), 1.0f)); }

// First pass over all axes for coordinates that are clamped to [0,1], NaN to 0, in a table that is whole: no
// flags.
template <int kDims, bool kExact>
HWY_INLINE void LocateInside(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  const s::DI di;
  for (int i = 0; i < count; i += s::kLanes) {
    VI base = hn::Zero(di);
    for (int a = 0; a < kDims; ++a) {
      const GridAxis& axis = grid.axis(a);
      V fraction;
      const V cell = CellInside<kExact>(Unit(hn::Load(d, chunk.coord[a] + i)), hn::Set(d, axis.scale),
                                        hn::Set(d, static_cast<float>(axis.last)), fraction);
      hn::Store(fraction, d, chunk.weight[a] + i);
      const VI index = hn::ConvertTo(di, cell);
      base = a == 0 ? index : hn::Add(base, hn::Mul(index, hn::Set(di, axis.stride)));
    }
    hn::Store(base, di, chunk.base + i);
  }
}
template <int kDims, bool kNearest>
HWY_INLINE void LocateUnit(const Grid& grid, Chunk& chunk, int count) {
  if constexpr (!kNearest) {
    if (grid.ends_inside()) {
      return grid.exact() ? LocateInside<kDims, true>(grid, chunk, count)
                          : LocateInside<kDims, false>(grid, chunk, count);
    }
  }
  const s::D d;
  const s::DI di;
  for (int i = 0; i < count; i += s::kLanes) {
    VI base = hn::Zero(di);
    for (int a = 0; a < kDims; ++a) {
      const V x = Unit(hn::Load(d, chunk.coord[a] + i));
      V fraction = x;
      const VI index = hn::ConvertTo(di, Cell<kNearest>(grid.axis(a), x, fraction));
      base = hn::Add(base, hn::Mul(index, hn::Set(di, grid.axis(a).stride)));
      if constexpr (!kNearest) hn::Store(fraction, d, chunk.weight[a] + i);
    }
    hn::Store(base, di, chunk.base + i);
  }
}

// One axis of the first pass: adds to base, stores fractions; true when some pixel is to be flagged, which is
// done only when asked: hardly any chunk has one. kSeams: taps may lie outside of what is stored.
template <TableWrap wrap, bool kNearest, bool kSeams>
HWY_INLINE bool LocateAxis(const GridAxis& axis, const float* coord, float* fractions, Chunk& chunk,
                           int first_tap, int last_tap, bool start, bool flag, int count) {
  const s::D d;
  const s::DI di;
  const VI stride = hn::Set(di, axis.stride), from = hn::Set(di, axis.first_stored - first_tap),
           to = hn::Set(di, axis.last_stored - last_tap);
  VI any = hn::Zero(di);
  for (int i = 0; i < count; i += s::kLanes) {
    const V raw = hn::Load(d, coord + i);
    const V reduced = Reduce<wrap>(raw);
    // Infinity has no place in a period, a clamped coordinate is a number whatever it was.
    constexpr bool kPeriodic = wrap == TableWrap::kRepeat || wrap == TableWrap::kMirror;
    const auto lost = hn::IsNaN(kPeriodic ? reduced : raw);
    const V x = kPeriodic ? hn::IfThenElse(lost, hn::Zero(d), reduced) : reduced;
    V fraction = x;
    const VI index = hn::ConvertTo(di, Cell<kNearest>(axis, x, fraction));
    VI stored = index, flags = hn::IfThenElseZero(hn::RebindMask(di, lost), hn::Set(di, kNotANumber));
    if constexpr (kSeams) {
      stored = hn::Min(hn::Max(index, from), to);
      flags = hn::Or(flags, hn::IfThenElseZero(hn::Ne(index, stored), hn::Set(di, kSeam)));
    }
    any = hn::Or(any, flags);
    if (flag) {
      if (!start) flags = hn::Or(flags, hn::Load(di, chunk.flag + i));
      hn::Store(flags, di, chunk.flag + i);
    }
    const VI base =
        start ? hn::Mul(stored, stride) : hn::Add(hn::Mul(stored, stride), hn::Load(di, chunk.base + i));
    hn::Store(base, di, chunk.base + i);
    if constexpr (!kNearest) hn::Store(fraction, d, fractions + i);
  }
  return !hn::AllTrue(di, hn::Eq(any, hn::Zero(di)));
}

// First pass over all axes for any coordinates; fractions go to weight[axis]. A function of its own, called
// once for a chunk: every method would have a copy otherwise.
template <bool kNearest>
HWY_NOINLINE bool LocateAnywhere(const Grid& grid, Chunk& chunk, int count, int first_tap, int last_tap) {
  const auto all_axes = [&](bool flag) HWY_ATTR {
    bool flagged = false;
    for (int a = 0; a < grid.dims(); ++a) {
      const GridAxis& axis = grid.axis(a);
      const auto locate = [&](auto wrap, auto seams) HWY_ATTR {
        flagged |= LocateAxis<decltype(wrap)::value, kNearest, decltype(seams)::value>(
            axis, chunk.coord[a], chunk.weight[a], chunk, first_tap, last_tap, a == 0, flag, count);
      };
      using EdgeOrBorder = std::integral_constant<TableWrap, TableWrap::kClampEdge>;
      switch (axis.wrap) {
        case TableWrap::kClampEdge:
          if (grid.whole() || !axis.seams) {
            locate(EdgeOrBorder(), std::false_type());
            break;
          }
          [[fallthrough]];
        case TableWrap::kBorder:
          locate(EdgeOrBorder(), std::true_type());
          break;
        case TableWrap::kClamp:
          locate(std::integral_constant<TableWrap, TableWrap::kClamp>(), std::true_type());
          break;
        case TableWrap::kRepeat:
          locate(std::integral_constant<TableWrap, TableWrap::kRepeat>(), std::true_type());
          break;
        case TableWrap::kMirror:
          locate(std::integral_constant<TableWrap, TableWrap::kMirror>(), std::true_type());
          break;
      }
    }
    return flagged;
  };
  return all_axes(false) && all_axes(true);
}

// Where a coordinate lies on an axis that is clamped to its edge, both of its cells' entries in memory.
// kExact: as in CellInside.
template <bool kExact>
HWY_INLINE V EdgeCell(const GridAxis& axis, V x, V& fraction) {
  if constexpr (!kExact) {
    return Cell<false>(axis, Reduce<TableWrap::kClampEdge>(x), fraction);
  } else {
    const s::D d;
    const V last = hn::Set(d, static_cast<float>(axis.last)),
            end = hn::Set(d, static_cast<float>(axis.last + 1));
    const V position = hn::Add(hn::Mul(x, hn::Set(d, axis.scale)), hn::Set(d, axis.offset));
    const V inside = s::ClampHigh(s::ClampLow(position, hn::Zero(d)), end);
    const V cell = hn::Min(hn::Floor(inside), last);
    fraction = hn::Sub(inside, cell);
    return cell;
  }
}

// The same where every axis is clamped to its edge, all taps of two neighbours are in memory, and the
// coordinates are numbers: the commonest lookup of a picture. False when some are not; then nothing is said
// about the others.
template <int kDims>
HWY_NOINLINE bool LocateEdges(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  const s::DI di;
  auto lost = hn::FirstN(d, 0);
  for (int i = 0; i < count; i += s::kLanes) {
    VI base = hn::Zero(di);
    for (int a = 0; a < kDims; ++a) {
      const GridAxis& axis = grid.axis(a);
      const V x = hn::Load(d, chunk.coord[a] + i);
      lost = hn::Or(lost, hn::IsNaN(x));
      V fraction;
      const V cell = axis.exact ? EdgeCell<true>(axis, x, fraction) : EdgeCell<false>(axis, x, fraction);
      hn::Store(fraction, d, chunk.weight[a] + i);
      const VI index = SmallInteger(cell);
      base = a == 0 ? index : hn::Add(base, hn::Mul(index, hn::Set(di, axis.stride)));
    }
    hn::Store(base, di, chunk.base + i);
  }
  return hn::AllFalse(d, lost);
}

template <int kDims, bool kNearest, bool kUnit>
HWY_INLINE bool Locate(const Grid& grid, Chunk& chunk, int count, int first_tap, int last_tap) {
  if constexpr (kUnit) {
    LocateUnit<kDims, kNearest>(grid, chunk, count);
    return false;
  } else {
    if constexpr (!kNearest) {
      if (first_tap == 0 && grid.edges() && LocateEdges<kDims>(grid, chunk, count)) return false;
    }
    return LocateAnywhere<kNearest>(grid, chunk, count, first_tap, last_tap);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
