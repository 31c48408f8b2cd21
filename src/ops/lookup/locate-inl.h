// First pass of a lookup over a few dozen pixels: where its entries are and with what weights, into L1.
#if defined(TESSERA_OPS_LOOKUP_LOCATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#undef TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#else
#define TESSERA_OPS_LOOKUP_LOCATE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <type_traits>

#include "ops/lookup/grid.h"
#include "simd/texels-inl.h"

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
  alignas(64) float weight[16][kChunk];  // linear: distances; simplex: D + 1 weights; cubic: four per axis
  alignas(64) int32_t step[3][kChunk];   // simplex: offsets of the entries between the first and the last
  alignas(64) int32_t base[kChunk];      // first entry
  alignas(64) int32_t flag[kChunk];  // set when a lookup says so: not 0 where the result comes from elsewhere
  alignas(64) float result[4 * kChunk];  // texel() per pixel
};
inline constexpr int32_t kNotANumber = 1, kSeam = 2;

// a b - c with one rounding.
HWY_INLINE V FusedSub(V a, V b, V c) {
#if HWY_TARGET <= HWY_AVX2
  return hn::MulSub(a, b, c);
#else
  return s::Fused(a, b, hn::Neg(c));
#endif
}

// What the second pass wants to know about a coordinate on an axis.
enum class Want : uint8_t {
  kEntry,     // the nearest entry
  kFraction,  // the first entry of its cell, and its place between that and the next in [0, 1]
  kNearer,    // the same first entry, and the distance from the nearer one, in [-1/2, 1/2], its sign bit set
              // where that is the second
};
// kNearer's answer for kFraction's.
HWY_INLINE V FromNearer(V fraction) {
  const s::D d;
  const V back = hn::Neg(hn::Sub(hn::Set(d, 1.0f), fraction));  // -0 at 1
  return hn::IfThenElse(hn::Gt(fraction, hn::Set(d, 0.5f)), back, fraction);
}

// Whole numbers in [0, 2^23): half the instructions of a conversion that minds its limits.
HWY_INLINE VI SmallInteger(V whole) {
  const s::DI di;
  return hn::And(hn::BitCast(di, hn::Add(whole, hn::Set(s::D(), 0x1p23f))), hn::Set(di, 0x7fffff));
}

// Places in [0, 2^23) may stay as what kFirstPlace + place is in bits: entries `kUnit` floats from place to
// place, by these.
inline constexpr float kFirstPlace = 0x1p23f;
template <int kUnit>
class EntriesByPlace {
 public:
  HWY_INLINE explicit EntriesByPlace(const float* data)
      : origin_(reinterpret_cast<uintptr_t>(data) - kBytes * 0x4B000000u) {}
  HWY_INLINE const float* operator()(int32_t place) const {
    return reinterpret_cast<const float*>(origin_ + kBytes * static_cast<uint32_t>(place));
  }

 private:
  static constexpr uintptr_t kBytes = kUnit * sizeof(float);
  uintptr_t origin_;
};

template <Wrap wrap>
HWY_INLINE V Reduce(V x) {
  const s::D d;
  const V one = hn::Set(d, 1.0f);
  if constexpr (wrap == Wrap::kRepeat) {
    return hn::Sub(x, hn::Floor(x));
  } else if constexpr (wrap == Wrap::kMirror) {
    const V t = hn::NegMulAdd(hn::Set(d, 2.0f), hn::Floor(hn::Mul(x, hn::Set(d, 0.5f))), x);
    return hn::IfThenElse(hn::Gt(t, one), hn::Sub(hn::Set(d, 2.0f), t), t);
  } else if constexpr (wrap == Wrap::kGlClamp) {
    return s::ClampHigh(s::ClampLow(x, hn::Zero(d)), one);
  } else {
    return s::ClampHigh(s::ClampLow(x, hn::Set(d, -4.0f)), hn::Set(d, 4.0f));
  }
}

// A cell, and the place in it, of an axis whose cells are low..last.
template <Want want>
HWY_INLINE V WithinEnds(V cell, V g, V low, V last, V& place) {
  const s::D d;
  g = hn::IfThenZeroElse(hn::Lt(cell, low), g);
  place = hn::IfThenElse(hn::Gt(cell, last), hn::Set(d, want == Want::kNearer ? -0.0f : 1.0f), g);
  return hn::Min(hn::Max(cell, low), last);
}
// Where products of coordinates and scale are rounded.
template <Want want>
HWY_INLINE V CellFromNearest(V x, V scale, V offset, V low, V last, V& place) {
  const s::D d;
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), product = hn::Mul(x, scale);
  const V nearest = hn::Round(hn::Add(product, offset));
  // The distance from the nearest entry with one rounding. Where it is within the rounding of the coordinate
  // itself, the coordinate is the entry's.
  V g = s::Fused(x, scale, hn::Sub(offset, nearest));
  const auto there = hn::Le(hn::Abs(g), hn::Abs(hn::Mul(product, hn::Set(d, 0x1p-24f))));
  const V before = hn::IfThenElseZero(hn::Lt(g, zero), one);
  const V cell = hn::Sub(nearest, hn::IfThenZeroElse(there, before));
  if constexpr (want == Want::kFraction) g = s::Fused(x, scale, hn::Sub(offset, cell));
  return WithinEnds<want>(cell, hn::IfThenZeroElse(there, g), low, last, place);
}

// Where a coordinate lies on an axis: the entry, and the place beyond it that was asked for.
template <Want want>
HWY_INLINE V Cell(const GridAxis& axis, V x, V& place) {
  const s::D d;
  const V scale = hn::Set(d, axis.scale), offset = hn::Set(d, axis.offset), low = hn::Set(d, axis.low);
  if constexpr (want == Want::kEntry) {
    const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const V product = hn::Mul(x, scale);
    const V v = s::ClampHigh(s::ClampLow(hn::Floor(hn::Add(product, offset)), low), hn::Set(d, axis.high));
    // Rounding may have lifted the position to the next entry.
    const auto lifted = hn::Lt(s::Fused(x, scale, hn::Sub(offset, v)), zero);
    return s::ClampLow(hn::IfThenElse(lifted, hn::Sub(v, one), v), low);
  } else {
    const V last = hn::Set(d, static_cast<float>(axis.last));
    if (!axis.exact) return CellFromNearest<want>(x, scale, offset, low, last, place);
    // The product is exact, so is the subtraction wherever it matters.
    const V position = hn::Add(hn::Mul(x, scale), offset), cell = hn::Floor(position);
    const V g = hn::Sub(position, cell);
    return WithinEnds<want>(cell, want == Want::kNearer ? FromNearer(g) : g, low, last, place);
  }
}

// The same for a coordinate in [0,1] of a table whose last cell is chosen at its own end. kExact: the
// products are exact because the scale is a power of two, so there is nothing to round.
template <bool kExact, Want want>
HWY_INLINE V CellInside(V x, V scale, V last, V& place) {
  const s::D d;
  const V product = hn::Mul(x, scale), cell = hn::Min(hn::Floor(product), last);
  if constexpr (kExact) {
    place = hn::Sub(product, cell);
    if constexpr (want == Want::kNearer) place = FromNearer(place);
  } else {
    const V nearest = hn::Round(product), g = FusedSub(x, scale, nearest);
    const auto there = hn::Le(hn::Abs(g), hn::Mul(product, hn::Set(d, 0x1p-24f)));
    // Just below an entry that it stands for, the coordinate is at the end of the cell before.
    if constexpr (want == Want::kNearer) {
      const V before = hn::And(hn::SignBit(d), hn::Sub(cell, nearest));
      place = hn::Or(hn::IfThenZeroElse(there, g), before);
    } else {
      place = hn::IfThenElse(there, hn::Sub(nearest, cell), FusedSub(x, scale, cell));
    }
  }
  return cell;
}
HWY_INLINE V Unit(V x) { return s::ClampHigh(s::ClampLow(x, hn::Zero(s::D())), hn::Set(s::D(), 1.0f)); }

// First pass over all axes for coordinates that are clamped to [0,1], NaN to 0, in a table that is whole: no
// flags.
template <int kDims, bool kExact, Want want>
HWY_INLINE void LocateInside(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  const s::DI di;
  for (int i = 0; i < count; i += s::kLanes) {
    VI base = hn::Zero(di);
    for (int a = 0; a < kDims; ++a) {
      const GridAxis& axis = grid.axis(a);
      V place;
      const V cell = CellInside<kExact, want>(Unit(hn::Load(d, chunk.coord[a] + i)), hn::Set(d, axis.scale),
                                              hn::Set(d, static_cast<float>(axis.last)), place);
      hn::Store(place, d, chunk.weight[a] + i);
      const VI index = hn::ConvertTo(di, cell);
      base = a == 0 ? index : hn::Add(base, hn::Mul(index, hn::Set(di, axis.stride)));
    }
    hn::Store(base, di, chunk.base + i);
  }
}
template <int kDims, Want want>
HWY_INLINE void LocateUnit(const Grid& grid, Chunk& chunk, int count) {
  if constexpr (want != Want::kEntry) {
    if (grid.ends_inside()) {
      return grid.exact() ? LocateInside<kDims, true, want>(grid, chunk, count)
                          : LocateInside<kDims, false, want>(grid, chunk, count);
    }
  }
  const s::D d;
  const s::DI di;
  for (int i = 0; i < count; i += s::kLanes) {
    VI base = hn::Zero(di);
    for (int a = 0; a < kDims; ++a) {
      const V x = Unit(hn::Load(d, chunk.coord[a] + i));
      V place = x;
      const VI index = hn::ConvertTo(di, Cell<want>(grid.axis(a), x, place));
      base = hn::Add(base, hn::Mul(index, hn::Set(di, grid.axis(a).stride)));
      if constexpr (want != Want::kEntry) hn::Store(place, d, chunk.weight[a] + i);
    }
    hn::Store(base, di, chunk.base + i);
  }
}

// One axis of the first pass: adds to base, stores places; true when some pixel is to be flagged, which is
// done only when asked: hardly any chunk has one. kSeams: taps may lie outside of what is stored.
template <Wrap wrap, Want want, bool kSeams>
HWY_INLINE bool LocateAxis(const GridAxis& axis, const float* coord, float* places, Chunk& chunk,
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
    constexpr bool kPeriodic = wrap == Wrap::kRepeat || wrap == Wrap::kMirror;
    const auto lost = hn::IsNaN(kPeriodic ? reduced : raw);
    const V x = kPeriodic ? hn::IfThenElse(lost, hn::Zero(d), reduced) : reduced;
    V place = x;
    const VI index = hn::ConvertTo(di, Cell<want>(axis, x, place));
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
    if constexpr (want != Want::kEntry) hn::Store(place, d, places + i);
  }
  return !hn::AllTrue(di, hn::Eq(any, hn::Zero(di)));
}

// First pass over all axes for any coordinates; places go to weight[axis]. A function of its own, called
// once for a chunk: every method would have a copy otherwise.
template <Want want>
HWY_NOINLINE bool LocateAnywhere(const Grid& grid, Chunk& chunk, int count, int first_tap, int last_tap) {
  const auto all_axes = [&](bool flag) HWY_ATTR {
    bool flagged = false;
    for (int a = 0; a < grid.dims(); ++a) {
      const GridAxis& axis = grid.axis(a);
      const auto locate = [&](auto wrap, auto seams) HWY_ATTR {
        flagged |= LocateAxis<decltype(wrap)::value, want, decltype(seams)::value>(
            axis, chunk.coord[a], chunk.weight[a], chunk, first_tap, last_tap, a == 0, flag, count);
      };
      using EdgeOrBorder = std::integral_constant<Wrap, Wrap::kClamp>;
      switch (axis.wrap) {
        case Wrap::kClamp:
          if (grid.whole() || !axis.seams) {
            locate(EdgeOrBorder(), std::false_type());
            break;
          }
          [[fallthrough]];
        case Wrap::kBlack:
          locate(EdgeOrBorder(), std::true_type());
          break;
        case Wrap::kGlClamp:
          locate(std::integral_constant<Wrap, Wrap::kGlClamp>(), std::true_type());
          break;
        case Wrap::kRepeat:
          locate(std::integral_constant<Wrap, Wrap::kRepeat>(), std::true_type());
          break;
        case Wrap::kMirror:
          locate(std::integral_constant<Wrap, Wrap::kMirror>(), std::true_type());
          break;
        default:  // refused when the table was named
          break;
      }
    }
    return flagged;
  };
  return all_axes(false) && all_axes(true);
}

// Where a coordinate lies on an axis that is clamped to its edge, both of its cells' entries in memory.
// kExact: as in CellInside.
template <bool kExact, Want want>
HWY_INLINE V EdgeCell(const GridAxis& axis, V x, V& place) {
  if constexpr (!kExact) {
    return Cell<want>(axis, Reduce<Wrap::kClamp>(x), place);
  } else {
    const s::D d;
    const V last = hn::Set(d, static_cast<float>(axis.last)),
            end = hn::Set(d, static_cast<float>(axis.last + 1));
    const V position = hn::Add(hn::Mul(x, hn::Set(d, axis.scale)), hn::Set(d, axis.offset));
    const V inside = s::ClampHigh(s::ClampLow(position, hn::Zero(d)), end);
    const V cell = hn::Min(hn::Floor(inside), last);
    place = hn::Sub(inside, cell);
    if constexpr (want == Want::kNearer) place = FromNearer(place);
    return cell;
  }
}

// The same where every axis is clamped to its edge, all taps of two neighbours are in memory, and the
// coordinates are numbers: the commonest lookup of a picture. False when some are not; then nothing is said
// about the others.
template <int kDims, Want want>
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
      V place;
      const V cell =
          axis.exact ? EdgeCell<true, want>(axis, x, place) : EdgeCell<false, want>(axis, x, place);
      hn::Store(place, d, chunk.weight[a] + i);
      const VI index = SmallInteger(cell);
      base = a == 0 ? index : hn::Add(base, hn::Mul(index, hn::Set(di, axis.stride)));
    }
    hn::Store(base, di, chunk.base + i);
  }
  return hn::AllFalse(d, lost);
}

template <int kDims, Want want, bool kUnit>
HWY_INLINE bool Locate(const Grid& grid, Chunk& chunk, int count, int first_tap, int last_tap) {
  if constexpr (kUnit) {
    LocateUnit<kDims, want>(grid, chunk, count);
    return false;
  } else {
    if constexpr (want != Want::kEntry) {
      if (first_tap == 0 && grid.edges() && LocateEdges<kDims, want>(grid, chunk, count)) return false;
    }
    return LocateAnywhere<want>(grid, chunk, count, first_tap, last_tap);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
