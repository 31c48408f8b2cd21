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

HWY_INLINE VI GatherCells(const int32_t* cells, VI at) {
  return hn::BitCast(DI(), s::LoadWords(cells, hn::BitCast(DU(), at)));
}

// One end of the lines of a vector of pixels: which pixel, what that pixel holds, and how far it is, along
// each component of its direction, to the pixel's edge.
struct Crossing {
  VI at;  // index in Lines::cells, relative to the vector's first pixel
  VI cell;
  V x, y;
};

// Lanes in which one bit of a cell is set, to be used by IfThenElse alone: on AVX2 that looks at the sign
// only.
template <int kBit>
HWY_INLINE hn::Mask<D> BitOf(VI cell) {
#if HWY_TARGET == HWY_AVX2
  return hn::MaskFromVec(hn::BitCast(D(), hn::ShiftLeft<31 - kBit>(cell)));
#else
  return hn::RebindMask(D(), hn::TestBit(cell, hn::Set(DI(), 1 << kBit)));
#endif
}

// What crossing an edge adds to an index, by the signs of the direction; 0 where the line stays.
class Strides {
 public:
  explicit HWY_INLINE Strides(ptrdiff_t row) : row_(static_cast<int>(row)) {
    alignas(64) int32_t x[16], y[16];
    for (uint32_t i = 0; i < 16; ++i) {
      const bool still = (i & kCellStill) != 0;
      x[i] = still ? 0 : (i & kCellLeft) != 0 ? -1 : 1, y[i] = still ? 0 : (i & kCellUp) != 0 ? -row_ : row_;
    }
#if HWY_TARGET == HWY_AVX2
    // Permutations within four lanes look at two bits: x has the lowest ones, y the next.
    for (uint32_t i = 0; i < kLanes; ++i) x[i] = x[i % 4], y[i] = 0;
    for (uint32_t i = 0; i < kLanes; ++i) y[i] = i % 4 >= 2 ? 0 : i % 4 == 1 ? -row_ : row_;
#endif
    x_ = hn::Load(DI(), x), y_ = hn::Load(DI(), y);
  }
  // `left`: of Cross.
  HWY_INLINE VI Of(VI cell, V left) const {
    const D d;
    const DI di;
#if HWY_TARGET == HWY_AVX2
    const V x = s::OneOfFour(hn::BitCast(d, x_), hn::BitCast(DU(), cell));
    const V y = s::OneOfFour(hn::BitCast(d, y_), hn::BitCast(DU(), hn::ShiftRight<kCellUpShift>(cell)));
    return hn::BitCast(di, s::IfNegative(left, y, x));
#else
    const auto y_first = hn::RebindMask(di, hn::Lt(left, hn::Zero(d)));
    if constexpr (kLanes >= 16) {
      const auto index = hn::IndicesFromVec(di, hn::And(cell, hn::Set(di, 15)));
      return hn::IfThenElse(y_first, hn::TableLookupLanes(y_, index), hn::TableLookupLanes(x_, index));
    } else {
      const auto still = hn::TestBit(cell, hn::Set(di, 2));
      const VI step = hn::IfThenElse(y_first, hn::Set(di, row_), hn::Set(di, 1));
      const VI sign =
          hn::IfThenElse(y_first, hn::ShiftLeft<31 - kCellUpShift>(cell), hn::ShiftLeft<31>(cell));
      const VI turned = hn::IfThenElse(hn::Lt(sign, hn::Zero(di)), hn::Sub(hn::Zero(di), step), step);
      return hn::IfThenZeroElse(still, turned);
    }
#endif
  }

 private:
  int row_;
  VI x_, y_;
};

HWY_INLINE Crossing StartAt(VI at, VI cell) {
  const V half = hn::Set(D(), 0.5f);
  return {at, cell, half, half};
}

// To the edge of the pixel along its direction: less than 0 where that is the one ahead in y. What is left is
// then that of a pixel with the same signs.
HWY_INLINE V Cross(Crossing& c) {
  const D d;
  const V one = hn::Set(d, 1.0f);
  const VU share = hn::ShiftRight<kCellShareShift>(hn::BitCast(DU(), c.cell));
  const V along_x = hn::ConvertTo(d, hn::BitCast(DI(), share));
  const V minus_y = hn::Sub(along_x, hn::Set(d, kCellWhole));
  // What is left along y where the edge ahead in x is met, or less than 0. On an edge lines along y, whose
  // share is 0, go along y too.
  const V left = hn::MulAdd(c.x, minus_y, hn::MulSub(c.y, along_x, hn::Set(d, 0x1p-30f)));
  const V rest = hn::Div(left, s::IfNegative(left, minus_y, along_x));
  c.x = s::IfNegative(left, rest, one), c.y = s::IfNegative(left, one, rest);
  return left;
}

// The pixel that was entered.
HWY_INLINE void Enter(VI cell, Crossing& c) {
  const D d;
  // A little more than 1: nothing left falls below 0.
  const V whole = hn::Set(d, 1.0f + 0x1p-22f);
  const VI turned = hn::Xor(c.cell, cell);
  c.x = hn::IfThenElse(BitOf<0>(turned), hn::Sub(whole, c.x), c.x);
  c.y = hn::IfThenElse(BitOf<kCellUpShift>(turned), hn::Sub(whole, c.y), c.y);
  c.cell = cell;
}

// In units of Lines::unit.
HWY_INLINE VI CodeOf(VI cell) { return hn::And(cell, hn::Set(DI(), static_cast<int>(kCellNoise))); }
HWY_INLINE V NoiseOf(VI cell) { return hn::ConvertTo(D(), CodeOf(cell)); }

// What Iota gives, which compilers would put together lane by lane.
alignas(64) constexpr int32_t kNumbers[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

// kVectors times kLanes pixels, the first one's cell cells[first]; `room` more cells of its row can be read.
// Of each of its ends a vector is in flight together with the others. No index is negative. kEnds: lines may
// end. kBox: all weights are 1 and sums of codes below 2^24, so that integers give what floats would.
template <int kVectors, bool kEnds, bool kBox>
HWY_NOINLINE void ConvolveCodes(const Lines& lines, const Strides& strides_of, const int32_t* cells,
                                int first, int room, float* result) {
  const D d;
  const DI di;
  constexpr int kBoth = 2 * kVectors;
  const Strides strides = strides_of;
  const VI end = hn::Set(di, static_cast<int>(kCellEnd));
  Crossing c[kBoth];
  VI codes[kVectors], missing[kVectors];  // of both ways together
  V sum[kBoth], weight[kBoth], own[kVectors];
  for (int i = 0; i < kVectors; ++i) {
    VI at = hn::Add(hn::Load(di, kNumbers), hn::Set(di, first + i * kLanes));
    if constexpr (kEnds) at = hn::Min(at, hn::Set(di, first + room));
    c[i] = c[i + kVectors] =
        StartAt(at, kEnds ? hn::GatherIndex(di, cells, at) : hn::LoadU(di, cells + first + i * kLanes));
  }
  for (int i = 0; i < kBoth; ++i) {
    sum[i] = weight[i] = hn::Zero(d);
  }
  for (int i = 0; i < kVectors; ++i) {
    own[i] = NoiseOf(c[i].cell), codes[i] = missing[i] = hn::Zero(di);
  }
  const auto masked = [&](int i) HWY_ATTR { return hn::Eq(c[i].cell, end); };
  hn::Mask<D> none[kVectors];
  for (int i = 0; i < kVectors; ++i) none[i] = hn::RebindMask(d, masked(i));
  for (int t = 0; t < lines.taps; ++t) {
    V forward, backward;
    if constexpr (!kBox) {
      forward = hn::Set(d, lines.forward[static_cast<size_t>(t)]);
      backward = hn::Set(d, lines.backward[static_cast<size_t>(t)]);
    }
    // All of them to their edges before the first one's pixel is read: else the processor, which looks only
    // so far ahead, would wait for one after the other.
    HWY_UNROLL(4)  // else what lines hold goes through memory between taps
    for (int i = 0; i < kBoth; ++i) {
      const VI old = c[i].cell;
      const VI stride = strides.Of(old, Cross(c[i]));
      c[i].at = i < kVectors ? hn::Add(c[i].at, stride) : hn::Sub(c[i].at, stride);
    }
    HWY_UNROLL(4)
    for (int i = 0; i < kBoth; ++i) {
      Enter(GatherCells(cells, c[i].at), c[i]);
      if constexpr (kBox) {
        const int v = i % kVectors;
        codes[v] = hn::Add(codes[v], CodeOf(c[i].cell));
        if constexpr (kEnds) missing[v] = hn::Add(missing[v], hn::VecFromMask(di, masked(i)));
      } else {
        const V w = i < kVectors ? forward : backward;
        sum[i] = hn::MulAdd(w, NoiseOf(c[i].cell), sum[i]);
        if constexpr (kEnds) {
          weight[i] = hn::Add(weight[i], hn::IfThenZeroElse(hn::RebindMask(d, masked(i)), w));
        }
      }
    }
  }
  if constexpr (kBox) {
    // Whole numbers, which floats add up as exactly.
    const VI taps = hn::Set(di, 2 * lines.taps);
    HWY_UNROLL(2)
    for (int i = 0; i < kVectors; ++i) {
      sum[i] = hn::ConvertTo(d, codes[i]), weight[i] = hn::ConvertTo(d, hn::Add(taps, missing[i]));
    }
  }
  const V centre = hn::Set(d, lines.centre);
  HWY_UNROLL(2)
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
  const Place place = PlaceOf(lines, x, y, lines.farthest);
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
      const V left = Cross(c);
      const auto first_y = hn::RebindMask(di, hn::Lt(left, hn::Zero(d)));
      const VI stride = hn::Mul(strides.Of(old, left), sign);
      px = hn::Add(px, hn::IfThenZeroElse(first_y, stride));
      py = hn::Add(py, hn::IfThenElseZero(first_y, stride));
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
  const bool box = lines.box && lines.taps < kMostBoxTaps;
  const Strides strides(lines.cell_row);
  const int most_above = (1 << 30) / static_cast<int>(lines.cell_row);
  const decltype(&ConvolveCodes<kVectors, true, true>) codes_of[2] = {
      box ? ConvolveCodes<kVectors, true, true> : ConvolveCodes<kVectors, true, false>,
      box ? ConvolveCodes<kVectors, false, true> : ConvolveCodes<kVectors, false, false>};
  const int left = out.roi.x0, width = out.roi.width(), height = out.roi.height();
  for (int i = 0; i < (width + kStrip - 1) / kStrip * height; ++i) {
    const int y = out.roi.y0 + i % height, from = left + i / height * kStrip;
    const int right = std::min(from + kStrip, out.roi.x1);
    for (int x = from; x < right;) {
      float* const to = out.data + (y - out.roi.y0) * out.row + ptrdiff_t{x - out.roi.x0} * out.step;
      const bool inside =
          x >= far && y >= far && x + kRun + far <= lines.width && y + 1 + far <= lines.height;
      const bool anywhere = !codes || (!inside && (lines.wrap != Wrap::kRenormalize || lines.around_x));
      const int most = anywhere ? kLanes : kRun, count = std::min(most, right - x);
      if (anywhere) {
        ConvolveAnywhere(lines, x, y, count, result);
      } else {
        // Indices count from the start of a row that no line leaves upward, that of the frame at most: they
        // are not negative.
        const int above = std::min(std::min(y, lines.taps) + 1, most_above);
        const auto* const cells =
            reinterpret_cast<const int32_t*>(lines.cells) + (y - above) * lines.cell_row;
        const int first = above * static_cast<int>(lines.cell_row) + x + 1;
        const auto convolve = codes_of[inside && lines.mask == nullptr];
        convolve(lines, strides, cells - 1, first, lines.width - 1 - x, result);
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

FollowLines FindCellLines() { return HWY_DYNAMIC_DISPATCH(CellLinesHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
