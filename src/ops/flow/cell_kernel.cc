// Line integral convolution from pixel to pixel, the direction constant within each: Cabral and Leedom's
// lines with a tap for every pixel crossed.
#include <algorithm>

#include "ops/flow/lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/cell_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/flow/texture-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// One end of the lines of a vector of pixels: which pixel, where in it (0 to 1), and what that pixel holds.
struct Crossing {
  VI x, y;  // kChecked: pixel, relative to the vector's first one
  VI at;    // else: its index in the picture, relative to the same
  V fx, fy;
  VI cell;
};

// To the edge of the pixel along its direction (`sign` -1 goes backward), and into the next one.
template <bool kChecked>
HWY_INLINE void Cross(float sign, int row, Crossing& c) {
  const D d;
  const DI di;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const V u = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<20>(hn::ShiftLeft<20>(c.cell))), hn::Set(d, sign));
  const V v = hn::Mul(hn::ConvertTo(d, hn::ShiftRight<20>(hn::ShiftLeft<8>(c.cell))), hn::Set(d, sign));
  const auto right = hn::Gt(u, zero), down = hn::Gt(v, zero);
  const V left_x = hn::IfThenElse(right, hn::Sub(one, c.fx), c.fx);
  const V left_y = hn::IfThenElse(down, hn::Sub(one, c.fy), c.fy);
  const V speed_x = hn::Abs(u), speed_y = hn::Abs(v);
  // left_x / speed_x < left_y / speed_y; a speed of 0 never arrives.
  const auto first_x =
      hn::Or(hn::Lt(hn::Mul(left_x, speed_y), hn::Mul(left_y, speed_x)), hn::Eq(speed_y, zero));
  const V slope = hn::Div(hn::IfThenElse(first_x, hn::Mul(left_x, v), hn::Mul(left_y, u)),
                          hn::IfThenElse(first_x, speed_x, speed_y));
  const V edge_x = hn::IfThenElseZero(hn::Not(right), one), edge_y = hn::IfThenElseZero(hn::Not(down), one);
  c.fx = hn::IfThenElse(first_x, edge_x, hn::Add(c.fx, slope));
  c.fy = hn::IfThenElse(first_x, hn::Add(c.fy, slope), edge_y);
  const VI ahead = hn::Set(di, 1), back = hn::Set(di, -1), stay = hn::Zero(di);
  const auto step_x = hn::RebindMask(di, first_x);
  VI dx = hn::IfThenElse(hn::RebindMask(di, right), ahead, back);
  VI dy = hn::IfThenElse(hn::RebindMask(di, down), ahead, back);
  // Without a direction the line stays; then both speeds are 0 and first_x holds.
  dx = hn::IfThenZeroElse(hn::RebindMask(di, hn::Eq(speed_x, zero)), dx);
  if constexpr (kChecked) {
    c.x = hn::Add(c.x, hn::IfThenElse(step_x, dx, stay));
    c.y = hn::Add(c.y, hn::IfThenElse(step_x, stay, dy));
  } else {
    c.at = hn::Add(
        c.at, hn::IfThenElse(step_x, dx,
                             hn::IfThenElse(hn::RebindMask(di, down), hn::Set(di, row), hn::Set(di, -row))));
  }
}

HWY_INLINE V NoiseOf(VI cell) {
  const D d;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(DI(), hn::ShiftRight<24>(hn::BitCast(DU(), cell)))),
                 hn::Set(d, 1.0f / 255));
}

// kLanes pixels from (x, y) whose lines stay inside; `vectors` of them side by side, in flight together.
template <int kVectors>
HWY_INLINE void ConvolveInside(const Lines& lines, int x, int y, float* result) {
  const D d;
  const DI di;
  const auto* cells = reinterpret_cast<const int32_t*>(lines.cells) + ptrdiff_t{y} * lines.width + x;
  constexpr int kBoth = 2 * kVectors;
  Crossing c[kBoth];
  V sum[kBoth];
  for (int i = 0; i < kBoth; ++i) {
    c[i].at = hn::Iota(di, i % kVectors * kLanes);
    c[i].fx = c[i].fy = hn::Set(d, 0.5f);
    c[i].cell = hn::GatherIndex(di, cells, c[i].at);
    sum[i] = hn::Zero(d);
  }
  V own[kVectors];
  for (int i = 0; i < kVectors; ++i) own[i] = NoiseOf(c[i].cell);
  for (int t = 0; t < lines.taps; ++t) {
    const V ahead = hn::Set(d, lines.forward[static_cast<size_t>(t)]);
    const V back = hn::Set(d, lines.backward[static_cast<size_t>(t)]);
    for (int i = 0; i < kBoth; ++i) {
      Cross<false>(i < kVectors ? 1.0f : -1.0f, lines.width, c[i]);
      c[i].cell = hn::GatherIndex(di, cells, c[i].at);
      sum[i] = hn::MulAdd(i < kVectors ? ahead : back, NoiseOf(c[i].cell), sum[i]);
    }
  }
  for (int i = 0; i < kVectors; ++i) {
    const V all = hn::MulAdd(hn::Set(d, lines.centre), own[i], hn::Add(sum[i], sum[i + kVectors]));
    hn::StoreU(hn::Div(all, hn::Set(d, lines.sum)), d, result + i * kLanes);
  }
}

// The same for up to kLanes pixels anywhere, masks, borders and any texture.
void ConvolveAnywhere(const Lines& lines, int x, int y, int count, float* result) {
  const D d;
  const DI di;
  const Place place = PlaceOf(lines, x, y);
  const VI lane = hn::Min(hn::Iota(di, 0), hn::Set(di, count - 1));
  const auto* cells = reinterpret_cast<const int32_t*>(lines.cells) + ptrdiff_t{y} * lines.width + x;
  const V own_inside = Inside(lines, place, lane, hn::Zero(di));
  V reach = hn::Set(d, static_cast<float>(lines.taps));
  if (lines.reach != nullptr) reach = hn::GatherIndex(d, lines.reach + ptrdiff_t{y} * lines.width + x, lane);
  V sum[2][kMostChannels], weight[2];
  const auto texel = [&](VI px, VI py, VI cell, int channel) HWY_ATTR {
    if (lines.texture_in_cells) return NoiseOf(cell);
    const VI at = hn::Add(hn::Mul(py, hn::Set(di, static_cast<int>(lines.texture_row))),
                          hn::Mul(px, hn::Set(di, lines.texture_step)));
    return hn::GatherIndex(d, place.texture + channel, at);
  };
  for (int way = 0; way < 2; ++way) {
    Crossing c{
        lane, hn::Zero(di), lane, hn::Set(d, 0.5f), hn::Set(d, 0.5f), hn::GatherIndex(di, cells, lane)};
    V alive = hn::Set(d, 1.0f);
    weight[way] = hn::Zero(d);
    for (V& v : sum[way]) v = hn::Zero(d);
    for (int t = 0; t < lines.taps; ++t) {
      Cross<true>(way == 0 ? 1.0f : -1.0f, lines.width, c);
      alive = hn::And(alive, Inside(lines, place, c.x, c.y));
      alive = hn::IfThenElseZero(hn::Le(hn::Set(d, static_cast<float>(t + 1)), reach), alive);
      Limit<true>(lines, place, c.x, c.y);
      c.cell = hn::GatherIndex(di, cells, hn::Add(hn::Mul(c.y, hn::Set(di, lines.width)), c.x));
      const V w =
          hn::Mul(alive, hn::Set(d, (way == 0 ? lines.forward : lines.backward)[static_cast<size_t>(t)]));
      weight[way] = hn::Add(weight[way], w);
      for (int channel = 0; channel < lines.channels; ++channel) {
        // As inside, to the bit: which of the two forms a pixel gets depends on the tile.
        const V more = hn::MulAdd(w, texel(c.x, c.y, c.cell, channel), sum[way][channel]);
        sum[way][channel] = hn::IfThenElse(hn::Gt(w, hn::Zero(d)), more, sum[way][channel]);
      }
    }
  }
  const V centre = hn::Set(d, lines.centre), total = hn::Add(hn::Add(weight[0], weight[1]), centre);
  const auto any = hn::And(hn::Gt(total, hn::Zero(d)), hn::Gt(own_inside, hn::Zero(d)));
  for (int channel = 0; channel < lines.channels; ++channel) {
    V own = texel(lane, hn::Zero(di), hn::GatherIndex(di, cells, lane), channel);
    if (lines.centre == 0) own = hn::Zero(d);
    const V all = hn::MulAdd(centre, own, hn::Add(sum[0][channel], sum[1][channel]));
    hn::StoreU(hn::IfThenElseZero(any, hn::Div(all, total)), d, result + channel * kLanes);
  }
}

void FollowCells(const Lines& lines, const LineOutput& out) {
  const int far = lines.taps + 1;
  constexpr int kVectors = kLanes >= 8 ? 2 : 1, kRun = kVectors * kLanes;
  alignas(64) float result[kMostChannels * kRun];
  const bool plain = lines.mask == nullptr && lines.reach == nullptr && lines.texture_in_cells;
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1;) {
      float* const to = out.data + (y - out.roi.y0) * out.row + ptrdiff_t{x - out.roi.x0} * out.step;
      const bool inside =
          x >= far && y >= far && x + kRun + far <= lines.width && y + 1 + far <= lines.height;
      if (plain && inside) {
        const int count = std::min(kRun, out.roi.x1 - x);
        ConvolveInside<kVectors>(lines, x, y, result);
        for (int i = 0; i < count; ++i) to[i * out.step] = result[i];
        x += count;
      } else {
        const int count = std::min(kLanes, out.roi.x1 - x);
        ConvolveAnywhere(lines, x, y, count, result);
        for (int i = 0; i < count; ++i) {
          for (int c = 0; c < lines.channels; ++c) to[i * out.step + c] = result[c * kLanes + i];
        }
        x += count;
      }
    }
  }
}

FollowLines CellLinesHere() { return FollowCells; }

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::flow {

HWY_EXPORT(CellLinesHere);

FollowLines CellLines() { return HWY_DYNAMIC_DISPATCH(CellLinesHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
