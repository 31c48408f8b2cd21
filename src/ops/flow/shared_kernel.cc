// Line integral convolution by lines that pixels share: every line's running sums go to the pixels that it
// crosses; a pixel is the mean of what it gets, weighted by how near to its centre the lines pass.
#include <algorithm>
#include <array>
#include <cmath>

#include "ops/flow/lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/shared_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/flow/texture-inl.h"
#include "ops/flow/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// The weight of a line that just touches its pixel, before squaring, where one through the centre weighs 1.
constexpr float kLeastNearness = 0.02f;
// Values that a pixel gets, about.
constexpr double kValues = 3.25;

// Sixteen lines: where they start, relative to the first one, and how far each serves other pixels.
struct Bundle {
  int x = 0, y = 0;
  Starts starts[kParts];
  int served = 0;  // taps each way
};

#if HWY_TARGET != HWY_SCALAR
// The texture's pixel at each index, and the one right of it.
HWY_INLINE void LoadNeighbours(const float* from, VI at, V& left, V& right) {
  const D d;
  const hn::Repartition<uint64_t, D> pairs;
  const hn::Repartition<int64_t, D> offsets;
  const hn::Half<DI> half;
  const auto load = [&](auto indices) HWY_ATTR {
    const auto bytes = hn::ShiftLeft<2>(hn::PromoteTo(offsets, indices));
    return hn::BitCast(d, hn::GatherOffset(pairs, reinterpret_cast<const uint64_t*>(from), bytes));
  };
  const V low = load(hn::LowerHalf(half, at)), high = load(hn::UpperHalf(half, at));
  left = hn::ConcatEven(d, high, low), right = hn::ConcatOdd(d, high, low);
}
#endif

// The texture at positions that have all four pixels around them.
template <bool kLinear>
HWY_INLINE V TextureInside(const Lines& lines, const Place& place, const Starts& start, const V2& p) {
  if constexpr (kLinear) {
    const D d;
    const DI di;
    const DU du;
    const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
    const V tx = hn::Sub(p.x, floor_x), ty = hn::Sub(p.y, floor_y);
    const VU x = hn::Add(WholeBits(floor_x), WholeBaseOf(start.x));
    const VU y = hn::Add(WholeBits(floor_y), WholeBaseOf(start.y));
    const VU row = hn::Mul(y, hn::Set(du, static_cast<uint32_t>(lines.texture_row)));
    const auto between = [&](V a, V b, V low_a, V low_b) HWY_ATTR {
      const V top = hn::MulAdd(tx, hn::Sub(b, a), a), low = hn::MulAdd(tx, hn::Sub(low_b, low_a), low_a);
      return hn::MulAdd(ty, hn::Sub(low, top), top);
    };
    if (place.codes != nullptr) {
      const VU at = hn::Add(hn::Add(row, hn::Add(x, x)), hn::Set(du, place.first_code));
      const VU four = LoadBytes(place.codes, at);
      const auto value = [&](VU code) HWY_ATTR { return hn::ConvertTo(d, hn::BitCast(di, code)); };
      const VU byte = hn::Set(du, 255);
      return between(value(hn::And(four, byte)), value(hn::And(hn::ShiftRight<16>(four), byte)),
                     value(hn::And(hn::ShiftRight<8>(four), byte)), value(hn::ShiftRight<24>(four)));
    }
#if HWY_TARGET != HWY_SCALAR
    if (lines.texture_step == 1) {
      const VI at = hn::BitCast(di, hn::Add(row, x));
      V a, b, low_a, low_b;
      LoadNeighbours(place.texture, at, a, b);
      LoadNeighbours(place.texture + lines.texture_row, at, low_a, low_b);
      // Weight 0 takes nothing; what is not finite is left to the careful form.
      const V mean = between(a, b, low_a, low_b);
      if (hn::AllTrue(d, hn::IsFinite(mean))) return mean;
    }
#endif
  }
  return FindTexels<false, kLinear>(lines, place, start, p).Value(place, 0);
}

// Samples, places and weights of the lines' taps; whether all samples are finite.
template <bool kChecked, bool kLinear>
bool Sample(const Lines& lines, const Roi& roi, const Bundle& bundle, SharedScratch& scratch) {
  const D d;
  const DI di;
  const Place place = PlaceOf(lines, bundle.x, bundle.y);
  const int all = bundle.served + lines.taps;
  const VI part_width = hn::Set(di, roi.width()), part_height = hn::Set(di, roi.height());
  const VI x0 = hn::Set(di, bundle.x - roi.x0), y0 = hn::Set(di, bundle.y - roi.y0);
  V alive[kChains];
  for (int c = 0; c < kChains; ++c) alive[c] = hn::Set(d, 1.0f);
  V2 first[kParts];
  for (int part = 0; part < kParts; ++part) first[part] = PlacesOf(place, bundle.starts[part]);
  V watch = hn::Zero(d);
  const auto tap = [&](int c, int number, const V2& p, bool inside) HWY_ATTR {
    const Starts& start = bundle.starts[c % kParts];
    const int at = (c < kParts ? all + number : all - number) * kPacket + c % kParts * kLanes;
    // A place for each line: sums of one place would wait for each other.
    const VI nowhere = hn::Iota(di, static_cast<int>(roi.pixels()) + c % kParts * kLanes);
    if (kChecked && hn::AllFalse(d, hn::Gt(alive[c], hn::Zero(d)))) {
      // All of these lines have ended.
      hn::StoreU(hn::Zero(d), d, scratch.there.data() + at);
      hn::StoreU(hn::Zero(d), d, scratch.samples.data() + at);
      if (number > bundle.served) return;
      hn::StoreU(hn::Zero(d), d, scratch.weights.data() + at);
      hn::StoreU(nowhere, di, scratch.places.data() + at);
      return;
    }
    V value;
    if (kChecked && !(inside && lines.mask == nullptr)) {
      const Texels<kLinear> texels = FindTexels<true, kLinear>(lines, place, start, p);
      alive[c] = hn::And(alive[c], texels.inside);
      value = texels.Value(place, 0);
    } else {
      value = TextureInside<kLinear>(lines, place, start, p);
    }
    if constexpr (kChecked) {
      value = hn::IfThenElseZero(hn::Gt(alive[c], hn::Zero(d)), value);
      hn::StoreU(alive[c], d, scratch.there.data() + at);
    }
    watch = hn::MulAdd(value, hn::Zero(d), watch);
    hn::StoreU(value, d, scratch.samples.data() + at);
    if (number > bundle.served) return;
    const VI near_x = hn::NearestInt(p.x), near_y = hn::NearestInt(p.y);
    const VI x = hn::Add(hn::Add(near_x, start.x), x0), y = hn::Add(hn::Add(near_y, start.y), y0);
    const V off_x = hn::Sub(p.x, hn::ConvertTo(d, near_x)), off_y = hn::Sub(p.y, hn::ConvertTo(d, near_y));
    const V nearness = hn::Max(hn::NegMulAdd(hn::Add(off_x, off_x), off_x,
                                             hn::NegMulAdd(hn::Add(off_y, off_y), off_y, hn::Set(d, 1.0f))),
                               hn::Set(d, kLeastNearness));
    hn::StoreU(hn::Mul(nearness, nearness), d, scratch.weights.data() + at);
    const VI before = hn::Set(di, -1);
    auto here = hn::And(hn::And(hn::Gt(x, before), hn::Lt(x, part_width)),
                        hn::And(hn::Gt(y, before), hn::Lt(y, part_height)));
    if constexpr (kChecked) here = hn::And(here, hn::RebindMask(di, hn::Gt(alive[c], hn::Zero(d))));
    const VI index = hn::IfThenElse(here, hn::Add(hn::Mul(y, part_width), x), nowhere);
    hn::StoreU(index, di, scratch.places.data() + at);
  };
  for (int c = 0; c < kParts; ++c) tap(c, 0, {hn::Zero(d), hn::Zero(d)}, !kChecked);
  for (int c = kParts; c < kChains; ++c) alive[c] = alive[c - kParts];
  Walker<kChecked>(lines, place, bundle.starts).Run(all, tap);
  return hn::AllTrue(d, hn::Eq(watch, hn::Zero(d)));
}

// Adds pairs of a weighted value and its weight to the pixels where the lines are.
HWY_INLINE void Deposit(const float* pairs, const int32_t* places, float* sums) {
#if HWY_TARGET == HWY_SCALAR
  for (int lane = 0; lane < kPacket; ++lane) {
    float* const to = sums + 2 * ptrdiff_t{places[lane]};
    to[0] += pairs[2 * lane], to[1] += pairs[2 * lane + 1];
  }
#else
  const hn::CappedTag<float, 2> pair;
  HWY_UNROLL(4)
  for (int lane = 0; lane < kPacket; ++lane) {
    float* const to = sums + 2 * ptrdiff_t{places[lane]};
    hn::StoreU(hn::Add(hn::LoadU(pair, to), hn::LoadU(pair, pairs + 2 * lane)), pair, to);
  }
#endif
}

// The convolution at every tap that serves pixels. kRunning: of a box, by sums that go along.
template <bool kChecked, bool kRunning>
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
  const V unit = hn::Set(d, lines.unit), whole = hn::Set(d, lines.unit / lines.sum);
  alignas(64) float pairs[2 * kPacket];
  V sum[kParts], count[kParts];
  for (int part = 0; part < kParts; ++part) sum[part] = count[part] = zero;
  if constexpr (kRunning) {
    for (int i = 0; i < 2 * taps; ++i) {
      for (int part = 0; part < kParts; ++part) {
        sum[part] = hn::Add(sum[part], sample(i, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(i, part));
      }
    }
  }
  for (int at = taps; at <= 2 * all - taps; ++at) {
    for (int part = 0; part < kParts; ++part) {
      if constexpr (kRunning) {
        sum[part] = hn::Add(sum[part], sample(at + taps, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(at + taps, part));
      } else {
        const auto take = [&](float weight, int from) HWY_ATTR {
          if (weight == 0) return;
          const V w = hn::Set(d, weight);
          sum[part] = hn::MulAdd(w, sample(from, part), sum[part]);
          if constexpr (kChecked) count[part] = hn::MulAdd(w, there(from, part), count[part]);
        };
        sum[part] = count[part] = zero;
        take(lines.centre, at);
        for (int t = 1; t <= taps; ++t) {
          take(lines.forward[static_cast<size_t>(t - 1)], at + t);
          take(lines.backward[static_cast<size_t>(t - 1)], at - t);
        }
      }
      const V weight = hn::LoadU(d, scratch.weights.data() + at * kPacket + part * kLanes);
      V mean;
      if constexpr (kChecked) {
        mean = hn::IfThenElseZero(hn::Gt(count[part], zero), hn::Div(hn::Mul(sum[part], unit), count[part]));
      } else {
        mean = hn::Mul(sum[part], whole);
      }
      hn::StoreInterleaved2(hn::Mul(mean, weight), weight, d, pairs + 2 * part * kLanes);
    }
    Deposit(pairs, scratch.places.data() + at * kPacket, scratch.sums.data());
    if constexpr (!kRunning) continue;
    for (int part = 0; part < kParts; ++part) {
      sum[part] = hn::Sub(sum[part], sample(at - taps, part));
      if constexpr (kChecked) count[part] = hn::Sub(count[part], there(at - taps, part));
    }
  }
}

template <bool kChecked>
void Serve(const Lines& lines, const Roi& roi, const Bundle& bundle, SharedScratch& scratch) {
  const bool finite = lines.linear ? Sample<kChecked, true>(lines, roi, bundle, scratch)
                                   : Sample<kChecked, false>(lines, roi, bundle, scratch);
  // A running sum would keep what is not finite to its line's end.
  if (lines.box && finite) {
    Convolve<kChecked, true>(lines, bundle, scratch);
  } else {
    Convolve<kChecked, false>(lines, bundle, scratch);
  }
}

// The lines of a bundle whose starts lie within `spread` pixels right of and below its first one.
void Run(const Lines& lines, const Roi& roi, const Bundle& bundle, const Roi& starts,
         SharedScratch& scratch) {
  const auto rows = static_cast<size_t>(2 * (bundle.served + lines.taps) + 1);
  if (scratch.samples.size() < rows * kPacket) {
    for (std::vector<float>* v : {&scratch.samples, &scratch.there, &scratch.weights})
      v->resize(rows * kPacket);
    scratch.places.resize(rows * kPacket);
  }
  const int far = static_cast<int>(static_cast<float>(bundle.served + lines.taps) * lines.step) + 2;
  const Roi reach = Inflate(starts, far, far);
  if (lines.mask == nullptr && Roi{0, 0, lines.width, lines.height}.Contains(reach)) {
    Serve<false>(lines, roi, bundle, scratch);
  } else {
    Serve<true>(lines, roi, bundle, scratch);
  }
}

bool Masked(const Lines& lines, int x, int y) {
  return lines.mask != nullptr && lines.mask[ptrdiff_t{y} * lines.width + x] != 0;
}

// Pixels that no line of the grid crossed, sixteen at a time; lines from them serve their neighbours too.
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
    Bundle bundle{left, top, {}, std::max(8, lines.taps / 2)};
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
      if (scratch.sums[2 * pixel + 1] > 0 || Masked(lines, x, y)) continue;
      xs[found] = x, ys[found] = y;
      if (++found == kPacket) flush();
    }
  }
  flush();
}

void Share(const Lines& lines, const LineOutput& out, SharedScratch& scratch) {
  const DI di;
  const Roi& roi = out.roi;
  scratch.sums.assign(2 * (static_cast<size_t>(roi.pixels()) + kPacket), 0.0f);
  // About three values for a pixel; lines long enough to earn their ends.
  const int served = std::max(80, lines.taps + lines.taps / 2);
  const int grid = static_cast<int>(std::sqrt(2.0 * served / kValues));
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
      const float weight = scratch.sums[2 * pixel + 1];
      to[(x - roi.x0) * out.step] =
          weight > 0 && !Masked(lines, x, y) ? scratch.sums[2 * pixel] / weight : 0.0f;
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
