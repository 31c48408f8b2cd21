// Lines that need steps of their own from one tap to the next, near critical points of an even field.
#if defined(TESSERA_OPS_FLOW_CLOSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_CLOSE_INL_H_
#undef TESSERA_OPS_FLOW_CLOSE_INL_H_
#else
#define TESSERA_OPS_FLOW_CLOSE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "ops/flow/field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// The smallest step of a line of its own, in pixels: lines that still bend there are close to a critical
// point.
constexpr float kLeastStep = 1.0f / 16;

// Whether the field changes less from pixel to pixel than over two of them, here: that its lines can be
// followed closely. Of noise the squares of second differences are three times as large as those of first
// ones.
inline HWY_NOINLINE bool IsEvenAround(const Lines& lines, const Place& place) {
  constexpr int kFloats = 2 * kSide;
  if (lines.width < kSide || lines.height < kSide) return false;
  const int x = std::min(place.x, lines.width - kSide), y = std::min(place.y, lines.height - kSide);
  const ptrdiff_t row = lines.uv_row;
  const float* p = lines.uv + y * row + 2 * ptrdiff_t{x};
  // Sums for each column, so that every target adds in one order.
  float slopes[kFloats] = {}, bends[kFloats] = {};
  for (int j = 0; j < kSide; ++j, p += row) {
    for (int i = 0; i < kFloats; ++i) {
      const float twice = 2 * p[i];
      const float across = p[i + 2] - p[i - 2], bend_across = (p[i + 2] + p[i - 2]) - twice;
      const float down = p[i + row] - p[i - row], bend_down = (p[i + row] + p[i - row]) - twice;
      slopes[i] += across * across + down * down;
      bends[i] += bend_across * bend_across + bend_down * bend_down;
    }
  }
  float slope = 0, bend = 0;
  for (int i = 0; i < kFloats; ++i) slope += slopes[i], bend += bends[i];
  return bend < slope;
}

// One bit for each lane.
HWY_INLINE uint32_t BitsOf(hn::Mask<D> lanes) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(D(), lanes, bits);
  return bits[0] | static_cast<uint32_t>(bits[1]) << 8;
}

// The lines of a packet, forward ones first, at a tap and at the next one.
constexpr int kLines = 2 * kPacket;
struct Tapped {
  alignas(64) float x[kLines], y[kLines], u[kLines], v[kLines];
  alignas(64) float end_x[kLines], end_y[kLines], end_u[kLines], end_v[kLines];
};

// Lanes whose lines, along `sign` times the field, end in a sink within `most` of p, which becomes the sink:
// the field's zero by one step of Newton's method, 1e-4 pixels off or less where it starts a quarter of a
// pixel away in an even field.
inline HWY_NOINLINE hn::Mask<D> EndInSink(const Lines& lines, const Place& place, const Starts& starts,
                                          V sign, V most, V2& p) {
  const D d;
  constexpr float kBeside = 1.0f / 16, kLeastPull = 0.02f;
  const V beside = hn::Set(d, kBeside);
  const auto at = [&](V x, V y) HWY_ATTR { return VectorAnywhere(lines, place, starts, {x, y}); };
  const V2 f = at(p.x, p.y), across = at(hn::Add(p.x, beside), p.y), down = at(p.x, hn::Add(p.y, beside));
  const V ux = hn::Sub(across.x, f.x), vx = hn::Sub(across.y, f.y);
  const V uy = hn::Sub(down.x, f.x), vy = hn::Sub(down.y, f.y);
  const V area = hn::MulSub(ux, vy, hn::Mul(uy, vx)), pull = hn::Mul(sign, hn::Add(ux, vy));
  const V scale = hn::Div(beside, area);
  const V x = hn::Mul(scale, hn::MulSub(uy, f.y, hn::Mul(vy, f.x)));
  const V y = hn::Mul(scale, hn::MulSub(vx, f.x, hn::Mul(ux, f.y)));
  // Lines around a centre stay on their ways, and so do those that pass by a saddle.
  const auto pulls =
      hn::And(hn::Lt(pull, hn::Zero(d)), hn::Gt(hn::Mul(pull, pull), hn::Mul(hn::Set(d, kLeastPull), area)));
  const auto near = hn::Le(hn::MulAdd(x, x, hn::Mul(y, y)), hn::Mul(most, most));
  const auto sink = hn::And(hn::Gt(area, hn::Zero(d)), hn::And(pulls, near));
  p = {hn::IfThenElse(sink, hn::Add(p.x, x), p.x), hn::IfThenElse(sink, hn::Add(p.y, y), p.y)};
  return sink;
}

// Lines from one tap to the next, `size` on, by steps of their own, of classical Runge-Kutta, such that what
// they differ by from third order is small enough: h / 6 times what the field at the step's end differs by
// from the last stage. Those that end in a sink are 0 in what is returned.
inline HWY_NOINLINE V FollowClosely(const Lines& lines, const Place& place, const Starts& starts, float size,
                                    V sign, V2& p, V2& v) {
  constexpr float kSharp = 0.9f;
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f), half = hn::Set(d, 0.5f);
  const V error = hn::Set(d, lines.error * lines.error), smallest = hn::Set(d, kLeastStep);
  const auto at = [&](const V2& q) HWY_ATTR { return VelocityAnywhere(lines, place, starts, q); };
  // The whole step has been tried.
  V left = hn::Set(d, size), length = hn::Set(d, 0.5f * size), moving = one;
  while (!hn::AllFalse(d, hn::Gt(left, zero))) {
    const V long_by = hn::Min(left, length), step = hn::Mul(long_by, sign);
    const V half_step = hn::Mul(half, step), sixth = hn::Mul(step, hn::Set(d, 1.0f / 6));
    const auto along = [&](V part, const V2& k) HWY_ATTR {
      return V2{hn::MulAdd(part, k.x, p.x), hn::MulAdd(part, k.y, p.y)};
    };
    const V2 k2 = at(along(half_step, v)), k3 = at(along(half_step, k2)), k4 = at(along(step, k3));
    const V2 sum{hn::MulAdd(two, hn::Add(k2.x, k3.x), hn::Add(v.x, k4.x)),
                 hn::MulAdd(two, hn::Add(k2.y, k3.y), hn::Add(v.y, k4.y))};
    const V2 end = along(sixth, sum), last = at(end);
    const V off_x = hn::Mul(sixth, hn::Sub(k4.x, last.x)), off_y = hn::Mul(sixth, hn::Sub(k4.y, last.y));
    const V wrong = hn::MulAdd(off_x, off_x, hn::Mul(off_y, off_y));
    const auto with = [&](const V2& k) HWY_ATTR { return hn::MulAdd(k.x, v.x, hn::Mul(k.y, v.y)); };
    const V cosine = hn::Min(hn::Min(with(k2), with(k4)), with(last));
    const auto goes = hn::Gt(left, zero);
    const auto good =
        hn::And(goes, hn::Or(hn::Le(long_by, smallest), hn::And(hn::Le(wrong, error), hn::Gt(cosine, zero))));
    // Lines that turn round within the smallest step have met their end; others that turn much may have.
    const auto bent = hn::And(good, hn::And(hn::Le(long_by, smallest), hn::Lt(cosine, hn::Set(d, kSharp))));
    auto caught = hn::And(bent, hn::Lt(cosine, zero));
    if (!hn::AllFalse(d, bent)) {
      V2 there = p;
      const auto ends =
          hn::And(bent, EndInSink(lines, place, starts, sign, hn::Set(d, 4 * kLeastStep), there));
      p = {hn::IfThenElse(ends, there.x, p.x), hn::IfThenElse(ends, there.y, p.y)};
      caught = hn::Or(caught, ends);
    }
    const auto taken = hn::AndNot(caught, good);
    p = {hn::IfThenElse(taken, end.x, p.x), hn::IfThenElse(taken, end.y, p.y)};
    v = {hn::IfThenElse(taken, last.x, v.x), hn::IfThenElse(taken, last.y, v.y)};
    moving = hn::IfThenElse(caught, zero, moving);
    left = hn::IfThenElse(caught, zero, hn::Sub(left, hn::IfThenElseZero(good, long_by)));
    const auto longer = hn::Le(wrong, hn::Mul(error, hn::Set(d, 1.0f / 256)));
    length = hn::Mul(long_by, hn::IfThenElse(good, hn::IfThenElse(longer, two, one), half));
  }
  return moving;
}
// The same for those lines of a packet that `which` has a bit for; a bit for each that has ended in a sink.
inline HWY_NOINLINE uint32_t FollowClosely(const Lines& lines, const Place& place, const Starts* starts,
                                           float size, uint32_t which, Tapped& at) {
  const D d;
  const DI di;
  alignas(64) int32_t start_x[kPacket], start_y[kPacket];
  for (int part = 0; part < kParts; ++part) {
    hn::Store(starts[part].x, di, start_x + part * kLanes),
        hn::Store(starts[part].y, di, start_y + part * kLanes);
  }
  uint32_t still = 0;
  while (which != 0) {
    int line[kLanes], count = 0;
    alignas(64) float x[kLanes], y[kLanes], u[kLanes], v[kLanes], sign[kLanes];
    alignas(64) int32_t from_x[kLanes], from_y[kLanes];
    for (int i = 0; i < kLanes; ++i) {
      if (which != 0) line[count++] = std::countr_zero(which), which &= which - 1;
      const int l = line[count - 1];
      x[i] = at.x[l], y[i] = at.y[l], u[i] = at.u[l], v[i] = at.v[l], sign[i] = l < kPacket ? 1.0f : -1.0f;
      from_x[i] = start_x[l % kPacket], from_y[i] = start_y[l % kPacket];
    }
    V2 p{hn::Load(d, x), hn::Load(d, y)}, k{hn::Load(d, u), hn::Load(d, v)};
    const Starts from{hn::Load(di, from_x), hn::Load(di, from_y)};
    const V moving = FollowClosely(lines, place, from, size, hn::Load(d, sign), p, k);
    hn::Store(p.x, d, x), hn::Store(p.y, d, y), hn::Store(k.x, d, u), hn::Store(k.y, d, v);
    hn::Store(moving, d, sign);
    for (int i = 0; i < count; ++i) {
      const int l = line[i];
      at.end_x[l] = x[i], at.end_y[l] = y[i], at.end_u[l] = u[i], at.end_v[l] = v[i];
      if (sign[i] == 0) still |= 1u << l;
    }
  }
  return still;
}

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
