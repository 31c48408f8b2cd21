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

struct V2 {
  V x, y;
};

// Where the lines of one vector start: pixels relative to the packet's first one.
struct Starts {
  VI x, y;
};

// A packet's place, and the limits of indices relative to it.
struct Place {
  int x = 0, y = 0;
  const float* uv = nullptr;  // of the packet's first pixel
  const float* texture = nullptr;
  const uint8_t* codes = nullptr;
  const uint32_t* mask = nullptr;
};

HWY_INLINE Place PlaceOf(const Lines& lines, int x, int y) {
  const ptrdiff_t at = y * lines.texture_row + ptrdiff_t{x} * lines.texture_step;
  const ptrdiff_t pixel = ptrdiff_t{y} * lines.width + x;
  return {x,
          y,
          lines.uv == nullptr ? nullptr : lines.uv + y * lines.uv_row + 2 * ptrdiff_t{x},
          lines.texture == nullptr ? nullptr : lines.texture + at,
          lines.codes == nullptr ? nullptr : lines.codes + at,
          lines.mask == nullptr ? nullptr : lines.mask + pixel};
}

// Image coordinate `at` modulo `size`, for |at| below 2^24.
HWY_INLINE VI Wrap(VI at, int size) {
  const D d;
  const DI di;
  const VI n = hn::Set(di, size);
  const V turns = hn::Floor(hn::Mul(hn::ConvertTo(d, at), hn::Set(d, 1.0f / static_cast<float>(size))));
  VI r = hn::Sub(at, hn::Mul(hn::ConvertTo(di, turns), n));
  r = hn::IfThenElse(hn::Lt(r, hn::Zero(di)), hn::Add(r, n), r);
  return hn::IfThenElse(hn::Lt(r, n), r, hn::Sub(r, n));
}

// Floats of a size below 2^22 to the nearest integers, even ones where two are: kWhole more than they are.
// The conversions of the instruction set come with the care that numbers beyond all integers need.
constexpr float kWholeUnit = 12582912.0f;  // 3 * 2^22, where neighbouring floats are 1 apart
constexpr uint32_t kWhole = 0x4b400000u;   // its bits
HWY_INLINE VU WholeBits(V v) { return hn::BitCast(DU(), hn::Add(v, hn::Set(D(), kWholeUnit))); }
// What to add to that for the sum of number and start.
HWY_INLINE VU WholeBaseOf(VI start) { return hn::Sub(hn::BitCast(DU(), start), hn::Set(DU(), kWhole)); }

// Four bytes from each offset, the first one lowest; offsets are those of bytes.
HWY_INLINE VU LoadBytes(const uint8_t* from, VI offset) {
  const DU du;
  if constexpr (hn::MaxLanes(D()) >= 8) {
    return hn::BitCast(du, s::GatherWords<1>(from, offset));
  } else {
    alignas(16) int32_t at[kLanes];
    alignas(16) uint32_t four[kLanes];
    hn::Store(offset, DI(), at);
    for (int i = 0; i < kLanes; ++i) std::memcpy(four + i, from + at[i], 4);
    return hn::Load(du, four);
  }
}

#if HWY_TARGET != HWY_SCALAR
// Four floats from each offset, and four from as many floats further on: of every block of four offsets the
// k-th one's go to a block of quads[k] and further[k].
template <class DF, class Offsets>
HWY_INLINE void LoadQuads(DF d, const float* from, ptrdiff_t further, Offsets offsets, hn::Vec<DF>* quads,
                          hn::Vec<DF>* beyond) {
  if constexpr (hn::MaxLanes(DF()) <= 4) {
    const auto pairs = hn::BitCast(hn::Repartition<int64_t, DF>(), offsets);
    const int64_t low = hn::GetLane(pairs), high = hn::ExtractLane(pairs, 1);
    const float* const at[] = {from + static_cast<int32_t>(low), from + (low >> 32),
                               from + static_cast<int32_t>(high), from + (high >> 32)};
    for (int k = 0; k < 4; ++k) quads[k] = hn::LoadU(d, at[k]), beyond[k] = hn::LoadU(d, at[k] + further);
  } else {
    const hn::Half<DF> half;
    const hn::RebindToSigned<hn::Half<DF>> half_offsets;
    hn::Vec<hn::Half<DF>> low[4], high[4], low_beyond[4], high_beyond[4];
    LoadQuads(half, from, further, hn::LowerHalf(half_offsets, offsets), low, low_beyond);
    LoadQuads(half, from, further, hn::UpperHalf(half_offsets, offsets), high, high_beyond);
    for (int k = 0; k < 4; ++k) {
      quads[k] = hn::Combine(d, high[k], low[k]), beyond[k] = hn::Combine(d, high_beyond[k], low_beyond[k]);
    }
  }
}
#endif

// The vectors of the four pixels around a position.
struct Corners {
  V u00, v00, u10, v10, u01, v01, u11, v11;
};
HWY_INLINE Corners LoadCorners(const float* from, ptrdiff_t row, VI offset) {
  const D d;
#if HWY_TARGET == HWY_SCALAR
  const float* const p = from + hn::GetLane(offset);
  return {hn::Set(d, p[0]),   hn::Set(d, p[1]),       hn::Set(d, p[2]),       hn::Set(d, p[3]),
          hn::Set(d, p[row]), hn::Set(d, p[row + 1]), hn::Set(d, p[row + 2]), hn::Set(d, p[row + 3])};
#else
  V top[4], low[4];
  LoadQuads(d, from, row, offset, top, low);
  s::Transpose4(top[0], top[1], top[2], top[3]);
  s::Transpose4(low[0], low[1], low[2], low[3]);
  return {top[0], top[1], top[2], top[3], low[0], low[1], low[2], low[3]};
#endif
}

// f between the four pixels at `offset` and around it, then f / |f| (0 where |f| is below `smallest`) unless
// vectors keep their lengths.
HWY_INLINE V2 VelocityAt(const Lines& lines, const Place& place, VI offset, V tx, V ty) {
  const D d;
  const auto [u00, v00, u10, v10, u01, v01, u11, v11] = LoadCorners(place.uv, lines.uv_row, offset);
  const V u_top = hn::MulAdd(tx, hn::Sub(u10, u00), u00), v_top = hn::MulAdd(tx, hn::Sub(v10, v00), v00);
  const V u_low = hn::MulAdd(tx, hn::Sub(u11, u01), u01), v_low = hn::MulAdd(tx, hn::Sub(v11, v01), v01);
  const V u = hn::MulAdd(ty, hn::Sub(u_low, u_top), u_top), v = hn::MulAdd(ty, hn::Sub(v_low, v_top), v_top);
  if (lines.speed) return {u, v};
  const V squared = hn::MulAdd(u, u, hn::Mul(v, v));
  const auto moves = hn::Ge(squared, hn::Set(d, lines.smallest * lines.smallest));
  const V inverse = hn::IfThenElseZero(moves, hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared)));
  return {hn::Mul(u, inverse), hn::Mul(v, inverse)};
}

// At positions that have all four pixels around them. `base`: BaseOf of the starts.
HWY_INLINE VU BaseOf(const Lines& lines, const Starts& starts) {
  const DU du;
  const auto row = static_cast<uint32_t>(lines.uv_row);
  const VU x = hn::BitCast(du, starts.x), y = hn::BitCast(du, starts.y);
  return hn::Sub(hn::Add(hn::Mul(y, hn::Set(du, row)), hn::Add(x, x)), hn::Set(du, kWhole * (row + 2)));
}
HWY_INLINE V2 VelocityInside(const Lines& lines, const Place& place, VU base, const V2& p) {
  const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
  const VU row = hn::Set(DU(), static_cast<uint32_t>(lines.uv_row)), x = WholeBits(floor_x);
  const VU offset = hn::Add(hn::Add(hn::Mul(WholeBits(floor_y), row), hn::Add(x, x)), base);
  return VelocityAt(lines, place, hn::BitCast(DI(), offset), hn::Sub(p.x, floor_x), hn::Sub(p.y, floor_y));
}

// At any. Where speed does not count, the code is shared.
inline HWY_NOINLINE V2 VelocityAnywhere(const Lines& lines, const Place& place, const Starts& starts,
                                        const V2& p) {
  const DI di;
  const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
  VI x = hn::Add(hn::ConvertTo(di, floor_x), starts.x), y = hn::Add(hn::ConvertTo(di, floor_y), starts.y);
  if (lines.border == LicBorder::kRepeat) {
    x = hn::Sub(Wrap(hn::Add(x, hn::Set(di, place.x)), lines.width), hn::Set(di, place.x));
    y = hn::Sub(Wrap(hn::Add(y, hn::Set(di, place.y)), lines.height), hn::Set(di, place.y));
  } else {
    // The frame repeats the edge: out there the field does not change.
    x = hn::Min(hn::Max(x, hn::Set(di, -1 - place.x)), hn::Set(di, lines.width - 1 - place.x));
    y = hn::Min(hn::Max(y, hn::Set(di, -1 - place.y)), hn::Set(di, lines.height - 1 - place.y));
  }
  const VI offset = hn::Add(hn::Mul(y, hn::Set(di, static_cast<int>(lines.uv_row))), hn::Add(x, x));
  return VelocityAt(lines, place, offset, hn::Sub(p.x, floor_x), hn::Sub(p.y, floor_y));
}

HWY_INLINE V2 Along(const V2& p, V h, const V2& k) {
  return {hn::MulAdd(h, k.x, p.x), hn::MulAdd(h, k.y, p.y)};
}

// What one step found: where it ends and the vector there.
struct Stepped {
  V2 end, velocity;
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
