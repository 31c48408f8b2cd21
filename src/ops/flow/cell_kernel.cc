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

// One end of the lines of a vector of pixels: which pixel, what that pixel holds, and how far it is, along
// each component of its direction, to the pixel's edge.
struct Crossing {
  VI at;  // index in Lines::cells, relative to the vector's first pixel
  VI cell;
  V x, y;
};

// What crossing an edge adds to an index, by the signs of the direction; 0 where the line stays.
class Strides {
 public:
  explicit HWY_INLINE Strides(ptrdiff_t row) : row_(static_cast<int>(row)) {
    alignas(64) int32_t x[16], y[16];
    for (uint32_t i = 0; i < 16; ++i) {
      const bool still = (i & kCellStill) != 0;
      x[i] = still ? 0 : (i & kCellLeft) != 0 ? -1 : 1, y[i] = still ? 0 : (i & kCellUp) != 0 ? -row_ : row_;
    }
    x_ = hn::Load(DI(), x), y_ = hn::Load(DI(), y);
  }
  HWY_INLINE VI Of(VI cell, hn::Mask<DI> first_x) const {
    const DI di;
    if constexpr (kLanes >= 8) {
      const auto index = hn::IndicesFromVec(di, hn::And(cell, hn::Set(di, 7)));
      return hn::IfThenElse(first_x, hn::TableLookupLanes(x_, index), hn::TableLookupLanes(y_, index));
    } else {
      const auto still = hn::TestBit(cell, hn::Set(di, static_cast<int>(kCellStill)));
      const VI step = hn::IfThenElse(first_x, hn::Set(di, 1), hn::Set(di, row_));
      const VI sign = hn::IfThenElse(first_x, hn::ShiftLeft<31>(cell), hn::ShiftLeft<30>(cell));
      const VI turned = hn::IfThenElse(hn::Lt(sign, hn::Zero(di)), hn::Sub(hn::Zero(di), step), step);
      return hn::IfThenZeroElse(still, turned);
    }
  }

 private:
  int row_;
  VI x_, y_;
};

HWY_INLINE Crossing StartAt(VI at, VI cell) {
  const V half = hn::Set(D(), 0.5f);
  return {at, cell, half, half};
}

// To the edge of the pixel along its direction: whether that is the one ahead in x. What is left is then that
// of a pixel with the same signs.
HWY_INLINE hn::Mask<D> Cross(Crossing& c) {
  const D d;
  const DI di;
  const V one = hn::Set(d, 1.0f);
  // The share is the fraction of a float from 1 to 2.
  constexpr int kFraction = (kCellShareOne - 1) << kCellShareShift;
  const VI bits = hn::Or(hn::And(c.cell, hn::Set(di, kFraction)), hn::BitCast(di, one));
  const V minus_share = hn::Sub(one, hn::BitCast(d, bits));
  const auto wide = hn::RebindMask(d, hn::TestBit(c.cell, hn::Set(di, static_cast<int>(kCellWide))));
  const V major = hn::IfThenElse(wide, c.x, c.y), minor = hn::IfThenElse(wide, c.y, c.x);
  // What is left along the smaller component where the edge ahead along the larger one is met.
  const V left = hn::MulAdd(major, minus_share, minor);
  const auto minor_first = hn::Lt(left, hn::Zero(d));
  const V rest = hn::IfThenElse(minor_first, hn::Div(left, minus_share), left);
  const auto first_x = hn::Xor(wide, minor_first);
  c.x = hn::IfThenElse(first_x, one, rest), c.y = hn::IfThenElse(first_x, rest, one);
  return first_x;
}

// The pixel that was entered.
HWY_INLINE void Enter(VI cell, Crossing& c) {
  const D d;
  const DI di;
  // A little more than 1: nothing left falls below 0.
  const V whole = hn::Set(d, 1.0f + 0x1p-22f);
  const VI turned = hn::Xor(c.cell, cell);
  const auto turned_x = hn::RebindMask(d, hn::TestBit(turned, hn::Set(di, static_cast<int>(kCellLeft))));
  const auto turned_y = hn::RebindMask(d, hn::TestBit(turned, hn::Set(di, static_cast<int>(kCellUp))));
  c.x = hn::IfThenElse(turned_x, hn::Sub(whole, c.x), c.x);
  c.y = hn::IfThenElse(turned_y, hn::Sub(whole, c.y), c.y);
  c.cell = cell;
}

HWY_INLINE V NoiseOf(VI cell) {
  return hn::ConvertTo(D(), hn::BitCast(DI(), hn::ShiftRight<kCellNoiseShift>(hn::BitCast(DU(), cell))));
}

// kLanes pixels from (x, y) on; `vectors` of them side by side, in flight together. kEnds: lines may end.
template <int kVectors, bool kEnds>
HWY_INLINE void ConvolveCodes(const Lines& lines, int x, int y, float* result) {
  const D d;
  const DI di;
  const auto* cells = reinterpret_cast<const int32_t*>(lines.cells) + y * lines.cell_row + x;
  constexpr int kBoth = 2 * kVectors;
  const Strides strides(lines.cell_row);
  const VI end = hn::Set(di, static_cast<int>(kCellEnd));
  Crossing c[kBoth];
  V sum[kBoth], weight[kBoth], own[kVectors];
  for (int i = 0; i < kVectors; ++i) {
    VI at = hn::Iota(di, i * kLanes);
    if constexpr (kEnds) at = hn::Min(at, hn::Set(di, lines.width - 1 - x));
    c[i] = c[i + kVectors] =
        StartAt(at, kEnds ? hn::GatherIndex(di, cells, at) : hn::LoadU(di, cells + i * kLanes));
  }
  for (int i = 0; i < kBoth; ++i) sum[i] = weight[i] = hn::Zero(d);
  for (int i = 0; i < kVectors; ++i) own[i] = NoiseOf(c[i].cell);
  const auto masked = [&](int i) HWY_ATTR { return hn::RebindMask(d, hn::Eq(c[i].cell, end)); };
  hn::Mask<D> none[kVectors];
  for (int i = 0; i < kVectors; ++i) none[i] = masked(i);
  for (int t = 0; t < lines.taps; ++t) {
    const V forward = hn::Set(d, lines.forward[static_cast<size_t>(t)]);
    const V backward = hn::Set(d, lines.backward[static_cast<size_t>(t)]);
    HWY_UNROLL(4)  // else what lines hold goes through memory between taps
    for (int i = 0; i < kBoth; ++i) {
      const VI old = c[i].cell;
      const VI stride = strides.Of(old, hn::RebindMask(di, Cross(c[i])));
      c[i].at = i < kVectors ? hn::Add(c[i].at, stride) : hn::Sub(c[i].at, stride);
      Enter(s::GatherWords<4>(cells, c[i].at), c[i]);
      const V w = i < kVectors ? forward : backward;
      sum[i] = hn::MulAdd(w, NoiseOf(c[i].cell), sum[i]);
      if constexpr (kEnds) weight[i] = hn::Add(weight[i], hn::IfThenZeroElse(masked(i), w));
    }
  }
  const V centre = hn::Set(d, lines.centre);
  for (int i = 0; i < kVectors; ++i) {
    const V all = hn::MulAdd(centre, own[i], hn::Add(sum[i], sum[i + kVectors]));
    V total = hn::Set(d, lines.sum);
    if constexpr (kEnds) total = hn::Add(hn::Add(weight[i], weight[i + kVectors]), centre);
    V mean = hn::Div(hn::Mul(all, hn::Set(d, lines.unit)), total);
    if constexpr (kEnds) {
      mean = hn::IfThenElseZero(hn::Gt(total, hn::Zero(d)), hn::IfThenZeroElse(none[i], mean));
    }
    hn::StoreU(mean, d, result + i * kLanes);
  }
}

// The same for up to kLanes pixels anywhere, lengths of their own, borders and any texture.
void ConvolveAnywhere(const Lines& lines, int x, int y, int count, float* result) {
  const D d;
  const DI di;
  const Place place = PlaceOf(lines, x, y);
  const VI lane = hn::Min(hn::Iota(di, 0), hn::Set(di, count - 1));
  const auto* cells = reinterpret_cast<const int32_t*>(lines.cells) + y * lines.cell_row + x;
  const VI row = hn::Set(di, static_cast<int>(lines.cell_row));
  const Strides strides(1);
  const V own_inside = Inside(lines, place, lane, hn::Zero(di));
  V reach = hn::Set(d, static_cast<float>(lines.taps));
  if (lines.reach != nullptr) reach = hn::GatherIndex(d, lines.reach + ptrdiff_t{y} * lines.width + x, lane);
  V sum[2][kMostChannels], weight[2];
  const V unit = hn::Set(d, lines.unit);
  const auto texel = [&](VI px, VI py, VI cell, int channel) HWY_ATTR {
    if (lines.texture_in_cells) return NoiseOf(cell);
    const VI at = hn::Add(hn::Mul(py, hn::Set(di, static_cast<int>(lines.texture_row))),
                          hn::Mul(px, hn::Set(di, lines.texture_step)));
    return s::GatherFloats(place.texture + channel, at);
  };
  for (int way = 0; way < 2; ++way) {
    Crossing c = StartAt(lane, hn::GatherIndex(di, cells, lane));
    VI px = lane, py = hn::Zero(di);
    V alive = hn::Set(d, 1.0f);
    weight[way] = hn::Zero(d);
    for (V& v : sum[way]) v = hn::Zero(d);
    for (int t = 0; t < lines.taps; ++t) {
      const VI sign = hn::Set(di, way == 0 ? 1 : -1), old = c.cell;
      const auto first_x = hn::RebindMask(di, Cross(c));
      const VI stride = hn::Mul(strides.Of(old, first_x), sign);
      px = hn::Add(px, hn::IfThenElseZero(first_x, stride));
      py = hn::Add(py, hn::IfThenZeroElse(first_x, stride));
      alive = hn::And(alive, Inside(lines, place, px, py));
      alive = hn::IfThenElseZero(hn::Le(hn::Set(d, static_cast<float>(t + 1)), reach), alive);
      Limit<true>(lines, place, px, py);
      Enter(s::GatherWords<4>(cells, hn::Add(hn::Mul(py, row), px)), c);
      const V w =
          hn::Mul(alive, hn::Set(d, (way == 0 ? lines.forward : lines.backward)[static_cast<size_t>(t)]));
      weight[way] = hn::Add(weight[way], w);
      for (int channel = 0; channel < lines.channels; ++channel) {
        // As inside, to the bit: which of the two forms a pixel gets depends on the tile.
        const V more = hn::MulAdd(w, texel(px, py, c.cell, channel), sum[way][channel]);
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
    hn::StoreU(hn::IfThenElseZero(any, hn::Div(hn::Mul(all, unit), total)), d, result + channel * kLanes);
  }
}

void FollowCells(const Lines& lines, const LineOutput& out) {
  const int far = lines.taps + 1;
  constexpr int kVectors = kLanes >= 8 ? 2 : 1, kRun = kVectors * kLanes;
  alignas(64) float result[kMostChannels * kRun];
  const bool codes = lines.reach == nullptr && lines.texture_in_cells;
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1;) {
      float* const to = out.data + (y - out.roi.y0) * out.row + ptrdiff_t{x - out.roi.x0} * out.step;
      const bool inside =
          x >= far && y >= far && x + kRun + far <= lines.width && y + 1 + far <= lines.height;
      const bool anywhere = !codes || (!inside && lines.border != LicBorder::kStop);
      const int most = anywhere ? kLanes : kRun, count = std::min(most, out.roi.x1 - x);
      if (anywhere) {
        ConvolveAnywhere(lines, x, y, count, result);
      } else if (inside && lines.mask == nullptr) {
        ConvolveCodes<kVectors, false>(lines, x, y, result);
      } else {
        ConvolveCodes<kVectors, true>(lines, x, y, result);
      }
      if (out.step == 1) {
        std::copy_n(result, count, to);
      } else {
        for (int i = 0; i < count; ++i) {
          for (int c = 0; c < lines.channels; ++c) to[i * out.step + c] = result[c * most + i];
        }
      }
      x += count;
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
