// The vector of a bilinear field at the positions of a vector of lines, each relative to its own pixel's
// centre.
#if defined(TESSERA_OPS_FLOW_FIELD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_FIELD_INL_H_
#undef TESSERA_OPS_FLOW_FIELD_INL_H_
#else
#define TESSERA_OPS_FLOW_FIELD_INL_H_
#endif

#include <hwy/highway.h>

#include <cstring>

#include "ops/flow/lines.h"
#include "simd/gather-inl.h"
#include "simd/pixels-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::D;
using s::DI;
using s::DU;
using s::V;
using s::VI;
using s::VU;

constexpr int kLanes = s::kLanes;
constexpr int kParts = kPacket / kLanes;  // vectors of a packet

// Whether indices of codes are unsigned. The gather instruction wants them signed.
constexpr bool kCodesFromAbove = HWY_TARGET == HWY_AVX2;

struct V2 {
  V x, y;
};

// Where the lines of one vector start: pixels relative to the packet's first one.
struct Starts {
  VI x, y;
};

// A packet's place in the picture. Indices into `uv`, in vectors, and into `codes` count from a row that
// lines do not leave upward, so that they are not negative: on most processors that spares an instruction for
// each.
struct Place {
  int x = 0, y = 0;
  const float* uv = nullptr;
  const float* near_uv =
      nullptr;  // of the packet's first pixel less kWhole vectors; null where IsNear is not
  const float* texture = nullptr;  // of the packet's first pixel
  const uint8_t* codes = nullptr;
  const uint32_t* mask = nullptr;         // of the packet's first pixel
  uint32_t first_uv = 0, first_code = 0;  // the index of the packet's first pixel
  float still = 0;                        // the square of the length below which vectors are 0
};

// The rows from y up to the one above the picture, or as many as half the range of indices.
HWY_INLINE ptrdiff_t RowsAbove(int y, ptrdiff_t row) {
  const ptrdiff_t rows = ptrdiff_t{y} + 1, most = ptrdiff_t{1} << 31;
  return rows * row <= most ? rows : most / row;
}

// Floats of a size below 2^22 to the nearest integers, even ones where two are: kWhole more than they are.
// The conversions of the instruction set come with the care that numbers beyond all integers need.
constexpr float kWholeUnit = 12582912.0f;  // 3 * 2^22, where neighbouring floats are 1 apart
constexpr uint32_t kWhole = 0x4b400000u;   // its bits
HWY_INLINE VU WholeBits(V v) { return hn::BitCast(DU(), hn::Add(v, hn::Set(D(), kWholeUnit))); }
// What to add to that for the sum of number and start.
HWY_INLINE VU WholeBaseOf(VI start) { return hn::Sub(hn::BitCast(DU(), start), hn::Set(DU(), kWhole)); }

// Whether the vectors up to `far` pixels from a packet's first one are so few that floats count them.
HWY_INLINE bool IsNear(const Lines& lines, double far) {
  return (far + 2) * (static_cast<double>(lines.uv_row / 2) + 1) < 0x1p22;
}
// `far`: how far lines lead from the packet's first pixel.
HWY_INLINE Place PlaceOf(const Lines& lines, int x, int y, double far) {
  Place p{x, y};
  if (lines.uv != nullptr) {
    const ptrdiff_t rows = RowsAbove(y, lines.uv_row);
    p.uv = lines.uv + (y - rows) * lines.uv_row - 2;
    p.first_uv = static_cast<uint32_t>(rows * (lines.uv_row / 2) + x + 1);
    const auto first = reinterpret_cast<uintptr_t>(lines.uv + y * lines.uv_row + 2 * ptrdiff_t{x});
    if (IsNear(lines, far)) p.near_uv = reinterpret_cast<const float*>(first - uintptr_t{8} * kWhole);
  }
  const ptrdiff_t at = ptrdiff_t{x} * lines.texture_step;
  if (lines.texture != nullptr) p.texture = lines.texture + y * lines.texture_row + at;
  if (lines.codes != nullptr) {
    const ptrdiff_t rows = kCodesFromAbove ? RowsAbove(y, lines.texture_row) : 0;
    p.codes = lines.codes + (y - rows) * lines.texture_row + (kCodesFromAbove ? 0 : at);
    p.first_code = kCodesFromAbove ? static_cast<uint32_t>(rows * lines.texture_row + at) : 0;
  }
  if (lines.mask != nullptr) p.mask = lines.mask + ptrdiff_t{y} * lines.width + x;
  p.still = lines.smallest * lines.smallest;
  return p;
}

// Image coordinate `at` modulo `size`, for |at| below 2^24; beyond, where positions are no pixels any more,
// any of the coordinates there are.
HWY_INLINE VI Wrap(VI at, int size) {
  const D d;
  const DI di;
  const VI n = hn::Set(di, size);
  const V turns = hn::Floor(hn::Mul(hn::ConvertTo(d, at), hn::Set(d, 1.0f / static_cast<float>(size))));
  VI r = hn::Sub(at, hn::Mul(hn::ConvertTo(di, turns), n));
  r = hn::IfThenElse(hn::Lt(r, hn::Zero(di)), hn::Add(r, n), r);
  r = hn::IfThenElse(hn::Lt(r, n), r, hn::Sub(r, n));
  return hn::Min(hn::Max(r, hn::Zero(di)), hn::Set(di, size - 1));
}

// Four bytes from each of Place's codes, the first one lowest.
HWY_INLINE VU LoadBytes(const uint8_t* from, VU index) { return s::LoadWords(from, index); }

// Four floats, which are two vectors, for every block of a vector, at every fourth index.
template <class DF, typename Index>
HWY_INLINE hn::Vec<DF> LoadBlocks(DF d, const float* from, const Index* index) {
  if constexpr (hn::MaxLanes(DF()) <= 4) {
    return hn::LoadU(d, from + 2 * size_t{index[0]});
  } else {
    const hn::Half<DF> half;
    const auto low = LoadBlocks(half, from, index);
    return hn::Combine(d, LoadBlocks(half, from, index + hn::MaxLanes(DF()) / 8), low);
  }
}

// The vectors of a row of two pixels, between the rows of `from` and those a row further on.
struct Between {
  V u0, v0, u1, v1;
};
// What vectors say about the field around them: the largest second difference across the four pixels, in each
// lane of any order, and the smallest squared length.
struct Evenness {
  V twist, squared;
};
// kEven: `even` is brought up to date.
template <bool kEven>
HWY_INLINE Between BetweenRows(const float* from, ptrdiff_t row, VU index, V share, Evenness* even) {
  const D d;
  (void)even;
  const s::LaneList at(index);
  // Four lanes for a position: what is between the rows is found before the lanes are sorted.
  const auto mix = [&](int lane, V t) HWY_ATTR {
    decltype(at[0]) index_of[kLanes / 4];
    for (int i = 0; i < kLanes / 4; ++i) index_of[i] = at[4 * i + lane];
    const V top = LoadBlocks(d, from, index_of), low = LoadBlocks(d, from + row, index_of);
    const V rise = hn::Sub(low, top);
    if constexpr (kEven) {
      even->twist = hn::Max(even->twist, hn::Abs(hn::Sub(rise, hn::Shuffle1032(rise))));
    }
    return hn::MulAdd(t, rise, top);
  };
  Between b{mix(0, hn::Broadcast<0>(share)), mix(1, hn::Broadcast<1>(share)), mix(2, hn::Broadcast<2>(share)),
            mix(3, hn::Broadcast<3>(share))};
  s::Transpose4(b.u0, b.v0, b.u1, b.v1);
  return b;
}

// Where a sample of the field is taken: the index of the pixel left above and the shares of the others.
struct Sampled {
  VU index;
  V tx, ty;
};

// f between the four pixels there; `from`: Place::uv or Place::near_uv.
template <bool kEven = false>
HWY_INLINE V2 VectorAt(const float* from, ptrdiff_t row, const Sampled& at, Evenness* even = nullptr) {
  const Between b = BetweenRows<kEven>(from, row, at.index, at.ty, even);
  return {hn::MulAdd(at.tx, hn::Sub(b.u1, b.u0), b.u0), hn::MulAdd(at.tx, hn::Sub(b.v1, b.v0), b.v0)};
}
// f / |f|, 0 where |f| is below `smallest`.
template <bool kEven = false>
HWY_INLINE V2 DirectionOf(const Place& place, const V2& f, Evenness* even = nullptr) {
  const D d;
  const V squared = hn::MulAdd(f.x, f.x, hn::Mul(f.y, f.y));
  if constexpr (kEven) even->squared = hn::Min(even->squared, squared);
  const auto moves = hn::Ge(squared, hn::Set(d, place.still));
  const V inverse = hn::IfThenElseZero(moves, hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared)));
  return {hn::Mul(f.x, inverse), hn::Mul(f.y, inverse)};
}
// f, or its direction where vectors do not keep their lengths.
HWY_INLINE V2 VelocityAt(const Lines& lines, const Place& place, const float* from, const Sampled& at) {
  const V2 f = VectorAt(from, lines.uv_row, at);
  return lines.speed ? f : DirectionOf(place, f);
}

// At positions near the packet that have all four pixels around them. `row`: Lines::uv_row in vectors.
HWY_INLINE V NearBaseOf(const Starts& starts, V row) {
  const D d;
  const V first = hn::MulAdd(hn::ConvertTo(d, starts.y), row, hn::ConvertTo(d, starts.x));
  return hn::Add(first, hn::Set(d, kWholeUnit));
}
HWY_INLINE Sampled SampledNear(V row, V base, const V2& p) {
  const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
  const V index = hn::MulAdd(floor_y, row, hn::Add(floor_x, base));
  return {hn::BitCast(DU(), index), hn::Sub(p.x, floor_x), hn::Sub(p.y, floor_y)};
}

// At any positions.
HWY_INLINE Sampled SampledAnywhere(const Lines& lines, const Place& place, const Starts& starts,
                                   const V2& p) {
  const DI di;
  const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
  VI x = hn::Add(hn::ConvertTo(di, floor_x), starts.x), y = hn::Add(hn::ConvertTo(di, floor_y), starts.y);
  // Where the frame repeats the edge the field does not change out there.
  const auto limit = [&](VI at, int first, int size, bool around) HWY_ATTR {
    const VI start = hn::Set(di, first);
    if (around) return hn::Sub(Wrap(hn::Add(at, start), size), start);
    return hn::Min(hn::Max(at, hn::Set(di, -1 - first)), hn::Set(di, size - 1 - first));
  };
  x = limit(x, place.x, lines.width, lines.around_x), y = limit(y, place.y, lines.height, lines.around_y);
  const VI offset = hn::Add(hn::Mul(y, hn::Set(di, static_cast<int>(lines.uv_row / 2))), x);
  const VU index = hn::Add(hn::BitCast(DU(), offset), hn::Set(DU(), place.first_uv));
  return {index, hn::Sub(p.x, floor_x), hn::Sub(p.y, floor_y)};
}
// Where speed does not count, the code is shared.
inline HWY_NOINLINE V2 VelocityAnywhere(const Lines& lines, const Place& place, const Starts& starts,
                                        const V2& p) {
  return VelocityAt(lines, place, place.uv, SampledAnywhere(lines, place, starts, p));
}
inline HWY_NOINLINE V2 VectorAnywhere(const Lines& lines, const Place& place, const Starts& starts,
                                      const V2& p) {
  return VectorAt(place.uv, lines.uv_row, SampledAnywhere(lines, place, starts, p));
}

// What one step found: where it ends and the vector there.
struct Stepped {
  V2 end, velocity;
  V wrong;  // an estimate of the end's error, squared, where it was asked for
};

// The places between two ends of a step: cubic Hermite polynomials, share t in [0, 1] of the step.
struct Curve {
  V2 a, b, c;
  HWY_INLINE V2 At(const V2& start, V t) const {
    return {hn::MulAdd(t, hn::MulAdd(t, hn::MulAdd(t, c.x, b.x), a.x), start.x),
            hn::MulAdd(t, hn::MulAdd(t, hn::MulAdd(t, c.y, b.y), a.y), start.y)};
  }
};
HWY_INLINE V2 HermiteTerm(V start, V end, V h, V k0, V k1) {
  const D d;
  const V chord = hn::Sub(end, start);
  const V both = hn::Mul(h, hn::Add(k0, k1));
  const V c = hn::NegMulAdd(hn::Set(d, 2.0f), chord, both);
  return {hn::Sub(hn::Sub(chord, hn::Mul(h, k0)), c), c};
}
HWY_INLINE Curve Hermite(const V2& start, V h, const V2& k0, const V2& end, const V2& k1) {
  const V2 x = HermiteTerm(start.x, end.x, h, k0.x, k1.x), y = HermiteTerm(start.y, end.y, h, k0.y, k1.y);
  return {{hn::Mul(h, k0.x), hn::Mul(h, k0.y)}, {x.x, y.x}, {x.y, y.y}};
}

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
