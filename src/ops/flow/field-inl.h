// The vector of a bilinear field at the positions of a vector of lines, each relative to its own pixel's
// centre.
#if defined(TESSERA_OPS_FLOW_FIELD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_FIELD_INL_H_
#undef TESSERA_OPS_FLOW_FIELD_INL_H_
#else
#define TESSERA_OPS_FLOW_FIELD_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/flow/lines.h"
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
  const uint32_t* mask = nullptr;
};

HWY_INLINE Place PlaceOf(const Lines& lines, int x, int y) {
  const ptrdiff_t at = y * lines.texture_row + ptrdiff_t{x} * lines.texture_step;
  const ptrdiff_t pixel = ptrdiff_t{y} * lines.width + x;
  return {x, y, lines.uv == nullptr ? nullptr : lines.uv + y * lines.uv_row + 2 * ptrdiff_t{x},
          lines.texture == nullptr ? nullptr : lines.texture + at,
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

#if HWY_TARGET != HWY_SCALAR
// Four floats from every fourth offset, side by side.
template <class DF>
HWY_INLINE hn::Vec<DF> LoadQuads(DF d, const float* from, const int32_t* offset) {
  if constexpr (hn::MaxLanes(DF()) <= 4) {
    return hn::LoadU(d, from + offset[0]);
  } else {
    const hn::Half<DF> half;
    return hn::Combine(d, LoadQuads(half, from, offset + hn::MaxLanes(DF()) / 2),
                       LoadQuads(half, from, offset));
  }
}
#endif

// The (u, v) pairs of two neighbouring pixels for every lane: four floats from each offset, taken apart.
HWY_INLINE void LoadPairs(const float* from, const int32_t* offset, V& u0, V& v0, V& u1, V& v1) {
  const D d;
#if HWY_TARGET == HWY_SCALAR
  const float* const p = from + offset[0];
  u0 = hn::Set(d, p[0]), v0 = hn::Set(d, p[1]), u1 = hn::Set(d, p[2]), v1 = hn::Set(d, p[3]);
#else
  u0 = LoadQuads(d, from, offset), v0 = LoadQuads(d, from, offset + 1);
  u1 = LoadQuads(d, from, offset + 2), v1 = LoadQuads(d, from, offset + 3);
  s::Transpose4(u0, v0, u1, v1);
#endif
}

// f at the positions, then f / |f| (0 where |f| is below `smallest`) unless vectors keep their lengths.
template <bool kChecked>
HWY_INLINE V2 Velocity(const Lines& lines, const Place& place, const Starts& starts, const V2& p) {
  const D d;
  const DI di;
  const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
  const V tx = hn::Sub(p.x, floor_x), ty = hn::Sub(p.y, floor_y);
  VI x = hn::Add(hn::ConvertTo(di, floor_x), starts.x), y = hn::Add(hn::ConvertTo(di, floor_y), starts.y);
  if constexpr (kChecked) {
    if (lines.border == LicBorder::kRepeat) {
      x = hn::Sub(Wrap(hn::Add(x, hn::Set(di, place.x)), lines.width), hn::Set(di, place.x));
      y = hn::Sub(Wrap(hn::Add(y, hn::Set(di, place.y)), lines.height), hn::Set(di, place.y));
    } else {
      // The frame repeats the edge: out there the field does not change.
      x = hn::Min(hn::Max(x, hn::Set(di, -1 - place.x)), hn::Set(di, lines.width - 1 - place.x));
      y = hn::Min(hn::Max(y, hn::Set(di, -1 - place.y)), hn::Set(di, lines.height - 1 - place.y));
    }
  }
  const int row = static_cast<int>(lines.uv_row);
  alignas(64) int32_t offset[kLanes];
  hn::Store(hn::Add(hn::Mul(y, hn::Set(di, row)), hn::Add(x, x)), di, offset);
  V u00, v00, u10, v10, u01, v01, u11, v11;
  LoadPairs(place.uv, offset, u00, v00, u10, v10);
  LoadPairs(place.uv + row, offset, u01, v01, u11, v11);
  const V u_top = hn::MulAdd(tx, hn::Sub(u10, u00), u00), v_top = hn::MulAdd(tx, hn::Sub(v10, v00), v00);
  const V u_low = hn::MulAdd(tx, hn::Sub(u11, u01), u01), v_low = hn::MulAdd(tx, hn::Sub(v11, v01), v01);
  const V u = hn::MulAdd(ty, hn::Sub(u_low, u_top), u_top), v = hn::MulAdd(ty, hn::Sub(v_low, v_top), v_top);
  if (lines.speed) return {u, v};
  const V squared = hn::MulAdd(u, u, hn::Mul(v, v));
  const auto moves = hn::Ge(squared, hn::Set(d, lines.smallest * lines.smallest));
  const V inverse = hn::IfThenElseZero(moves, hn::Div(hn::Set(d, 1.0f), hn::Sqrt(squared)));
  return {hn::Mul(u, inverse), hn::Mul(v, inverse)};
}

// Where speed does not count, the code is shared.
inline HWY_NOINLINE V2 VelocityAnywhere(const Lines& lines, const Place& place, const Starts& starts,
                                        const V2& p) {
  return Velocity<true>(lines, place, starts, p);
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
