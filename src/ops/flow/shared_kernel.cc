// Line integral convolution by lines that pixels share: every line's running sums go to the pixels that it
// crosses, and each pixel keeps the value of the line that passes nearest to its centre.
#include <algorithm>
#include <array>

#include "ops/flow/lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/shared_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/flow/texture-inl.h"
#include "ops/flow/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// The weight of a line that passes about a quarter of a pixel beside the centre.
constexpr int kNearEnough = 170;

// Sixteen lines: where they start, relative to the first one, and how far each serves other pixels.
struct Bundle {
  int x = 0, y = 0;
  Starts starts[kParts];
  int served = 0;  // taps each way
};

template <bool kChecked>
void Sample(const Lines& lines, const Roi& roi, const Bundle& bundle, SharedScratch& scratch) {
  const D d;
  const DI di;
  const Place place = PlaceOf(lines, bundle.x, bundle.y);
  const int all = bundle.served + lines.taps;
  const VI part_width = hn::Set(di, roi.width()), part_height = hn::Set(di, roi.height());
  const VI x0 = hn::Set(di, bundle.x - roi.x0), y0 = hn::Set(di, bundle.y - roi.y0);
  V alive[kChains];
  V2 last[kChains];
  for (int c = 0; c < kChains; ++c) alive[c] = hn::Set(d, 1.0f), last[c] = {hn::Zero(d), hn::Zero(d)};
  const V per_pixel = hn::Set(d, 1.0f / lines.step);
  const auto tap = [&](int c, int number, const V2& p) HWY_ATTR {
    const Starts& start = bundle.starts[c % kParts];
    const int at = (c < kParts ? all + number : all - number) * kPacket + c % kParts * kLanes;
    const Texels<false> texels = FindTexels<kChecked, false>(lines, place, start, p);
    V value = texels.Value(place.texture);
    if constexpr (kChecked) {
      alive[c] = hn::And(alive[c], texels.inside);
      value = hn::IfThenElseZero(hn::Gt(alive[c], hn::Zero(d)), value);
      hn::StoreU(alive[c], d, scratch.there.data() + at);
    }
    hn::StoreU(value, d, scratch.samples.data() + at);
    if (number > bundle.served) return;
    const VI near_x = hn::NearestInt(p.x), near_y = hn::NearestInt(p.y);
    const VI x = hn::Add(hn::Add(near_x, start.x), x0), y = hn::Add(hn::Add(near_y, start.y), y0);
    // How far beside the pixel's centre the line passes; along the line values hardly change.
    const V off_x = hn::Sub(p.x, hn::ConvertTo(d, near_x)), off_y = hn::Sub(p.y, hn::ConvertTo(d, near_y));
    const V dx = hn::Sub(p.x, last[c].x), dy = hn::Sub(p.y, last[c].y);
    last[c] = p;
    const V beside = hn::Mul(hn::Abs(hn::NegMulAdd(off_x, dy, hn::Mul(off_y, dx))), per_pixel);
    const V along = hn::Mul(hn::Abs(hn::MulAdd(off_x, dx, hn::Mul(off_y, dy))), per_pixel);
    const V off = hn::MulAdd(hn::Set(d, 0.1f), along, beside);
    const VI weight = hn::Max(hn::ConvertTo(di, hn::NegMulAdd(hn::Set(d, 320.0f), off, hn::Set(d, 256.0f))),
                              hn::Set(di, 1));
    const VI index = hn::Add(hn::Mul(y, part_width), x);
    const VI before = hn::Set(di, -1);
    auto here = hn::And(hn::And(hn::Gt(x, before), hn::Lt(x, part_width)),
                        hn::And(hn::Gt(y, before), hn::Lt(y, part_height)));
    if constexpr (kChecked) here = hn::And(here, hn::RebindMask(di, hn::Gt(alive[c], hn::Zero(d))));
    const VI packed = hn::Or(hn::ShiftLeft<kWeightShift>(weight), index);
    hn::StoreU(hn::IfThenElse(here, packed, hn::Set(di, -1)), di, scratch.places.data() + at);
  };
  for (int c = 0; c < kParts; ++c) tap(c, 0, {hn::Zero(d), hn::Zero(d)});
  for (int c = kParts; c < kChains; ++c) alive[c] = alive[c - kParts];
  Walker<kChecked>(lines, place, bundle.starts).Run(all, tap);
}

// Gives the convolution at a tap to the pixels that no line has passed nearer.
HWY_INLINE void Deposit(const float* value, const int32_t* place, SharedScratch& scratch) {
  for (int lane = 0; lane < kPacket; ++lane) {
    if (place[lane] < 0) continue;
    const auto pixel = static_cast<size_t>(place[lane] & ((1 << kWeightShift) - 1));
    const int32_t weight = place[lane] >> kWeightShift;
    if (weight <= scratch.weights[pixel]) continue;
    scratch.values[pixel] = value[lane], scratch.weights[pixel] = weight;
  }
}

template <bool kChecked>
void Convolve(const Lines& lines, const Bundle& bundle, SharedScratch& scratch) {
  const D d;
  const int taps = lines.taps, all = bundle.served + taps;
  const V zero = hn::Zero(d);
  const auto sample = [&](int at, int part) HWY_ATTR {
    return hn::LoadU(d, scratch.samples.data() + at * kPacket + part * kLanes);
  };
  const auto there = [&](int at, int part) HWY_ATTR {
    return hn::LoadU(d, scratch.there.data() + at * kPacket + part * kLanes);
  };
  alignas(64) float value[kPacket];
  V sum[kParts], count[kParts];
  for (int part = 0; part < kParts; ++part) sum[part] = count[part] = zero;
  if (lines.box) {
    for (int i = 0; i < 2 * taps; ++i) {
      for (int part = 0; part < kParts; ++part) {
        sum[part] = hn::Add(sum[part], sample(i, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(i, part));
      }
    }
  }
  for (int at = taps; at <= 2 * all - taps; ++at) {
    for (int part = 0; part < kParts; ++part) {
      if (lines.box) {
        sum[part] = hn::Add(sum[part], sample(at + taps, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(at + taps, part));
      } else {
        sum[part] = hn::Mul(hn::Set(d, lines.centre), sample(at, part));
        if constexpr (kChecked) count[part] = hn::Mul(hn::Set(d, lines.centre), there(at, part));
        for (int t = 1; t <= taps; ++t) {
          const V ahead = hn::Set(d, lines.forward[static_cast<size_t>(t - 1)]);
          const V back = hn::Set(d, lines.backward[static_cast<size_t>(t - 1)]);
          sum[part] =
              hn::MulAdd(ahead, sample(at + t, part), hn::MulAdd(back, sample(at - t, part), sum[part]));
          if constexpr (kChecked) {
            count[part] =
                hn::MulAdd(ahead, there(at + t, part), hn::MulAdd(back, there(at - t, part), count[part]));
          }
        }
      }
      const V total = kChecked ? count[part] : hn::Set(d, lines.sum);
      hn::StoreU(hn::IfThenElseZero(hn::Gt(total, zero), hn::Div(sum[part], total)), d,
                 value + part * kLanes);
    }
    Deposit(value, scratch.places.data() + at * kPacket, scratch);
    if (!lines.box) continue;
    for (int part = 0; part < kParts; ++part) {
      sum[part] = hn::Sub(sum[part], sample(at - taps, part));
      if constexpr (kChecked) count[part] = hn::Sub(count[part], there(at - taps, part));
    }
  }
}

// The lines of a bundle whose starts lie within `spread` pixels right of and below its first one.
void Run(const Lines& lines, const Roi& roi, const Bundle& bundle, const Roi& starts,
         SharedScratch& scratch) {
  const auto rows = static_cast<size_t>(2 * (bundle.served + lines.taps) + 1);
  if (scratch.samples.size() < rows * kPacket) {
    scratch.samples.resize(rows * kPacket), scratch.there.resize(rows * kPacket),
        scratch.places.resize(rows * kPacket);
  }
  const int far = static_cast<int>(static_cast<float>(bundle.served + lines.taps) * lines.step) + 2;
  const Roi reach = Inflate(starts, far, far);
  if (lines.mask == nullptr && Roi{0, 0, lines.width, lines.height}.Contains(reach)) {
    Sample<false>(lines, roi, bundle, scratch);
    Convolve<false>(lines, bundle, scratch);
  } else {
    Sample<true>(lines, roi, bundle, scratch);
    Convolve<true>(lines, bundle, scratch);
  }
}

bool Masked(const Lines& lines, int x, int y) {
  return lines.mask != nullptr && lines.mask[ptrdiff_t{y} * lines.width + x] != 0;
}

// Pixels that no line of the grid passed near enough, sixteen at a time; lines from them serve their
// neighbours too.
void FillHoles(const Lines& lines, const Roi& roi, SharedScratch& scratch) {
  const DI di;
  std::array<int32_t, kPacket> xs{}, ys{};
  size_t found = 0;
  const auto flush = [&]() HWY_ATTR {
    if (found == 0) return;
    const int left = *std::min_element(xs.begin(), xs.begin() + found), top = ys[0];
    const Roi starts{left, top, *std::max_element(xs.begin(), xs.begin() + found) + 1, ys[found - 1] + 1};
    for (size_t i = 0; i < kPacket; ++i) {
      const size_t from = std::min(i, found - 1);
      xs[i] = i < found ? xs[i] - left : xs[from], ys[i] = i < found ? ys[i] - top : ys[from];
    }
    Bundle bundle{left, top, {}, lines.taps / 4};
    for (int part = 0; part < kParts; ++part) {
      bundle.starts[part] = {hn::LoadU(di, xs.data() + part * kLanes),
                             hn::LoadU(di, ys.data() + part * kLanes)};
    }
    Run(lines, roi, bundle, starts, scratch);
    found = 0;
  };
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      const size_t pixel = static_cast<size_t>(y - roi.y0) * static_cast<size_t>(roi.width()) +
                           static_cast<size_t>(x - roi.x0);
      if (scratch.weights[pixel] >= kNearEnough || Masked(lines, x, y)) continue;
      xs[found] = x, ys[found] = y;
      if (++found == kPacket) flush();
    }
  }
  flush();
}

void Share(const Lines& lines, const LineOutput& out, SharedScratch& scratch) {
  const DI di;
  const Roi& roi = out.roi;
  scratch.values.assign(static_cast<size_t>(roi.pixels()), 0.0f);
  scratch.weights.assign(static_cast<size_t>(roi.pixels()), 0);
  // About three values for a pixel; lines long enough to earn their ends.
  const int served = std::max(40, lines.taps);
  int grid = 4;
  while ((grid + 1) * (grid + 1) * 3 < 2 * served) ++grid;
  const int most = (kSide - 1) * grid;
  for (int y = roi.y0 + grid / 2; y < roi.y1; y += kSide * grid) {
    for (int x = roi.x0 + grid / 2; x < roi.x1; x += kSide * grid) {
      Bundle bundle{x, y, {}, served};
      PixelStarts(kSide - 1, kSide - 1, bundle.starts);
      for (Starts& s : bundle.starts) {
        s.x = hn::Min(hn::Mul(s.x, hn::Set(di, grid)), hn::Set(di, roi.x1 - 1 - x));
        s.y = hn::Min(hn::Mul(s.y, hn::Set(di, grid)), hn::Set(di, roi.y1 - 1 - y));
      }
      Run(lines, roi, bundle, {x, y, x + most + 1, y + most + 1}, scratch);
    }
  }
  FillHoles(lines, roi, scratch);
  for (int y = roi.y0; y < roi.y1; ++y) {
    float* const to = out.data + (y - roi.y0) * out.row;
    const size_t row = static_cast<size_t>(y - roi.y0) * static_cast<size_t>(roi.width());
    for (int x = roi.x0; x < roi.x1; ++x) {
      const size_t pixel = row + static_cast<size_t>(x - roi.x0);
      const bool known = scratch.weights[pixel] > 0 && !Masked(lines, x, y);
      to[(x - roi.x0) * out.step] = known ? scratch.values[pixel] : 0.0f;
    }
  }
}

ShareLines SharedLinesHere() { return Share; }

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::flow {

HWY_EXPORT(SharedLinesHere);

ShareLines SharedLines() { return HWY_DYNAMIC_DISPATCH(SharedLinesHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
