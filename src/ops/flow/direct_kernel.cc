// Direct line integral convolution: a line from every pixel, sixteen pixels at a time.
#include <algorithm>

#include "ops/flow/lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/direct_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/flow/texture-inl.h"
#include "ops/flow/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// How far lines lead from their packet's first pixel.
HWY_INLINE double FarOf(const Lines& lines) { return lines.farthest + 2.0 * kSide; }

// The sums of one packet. With kChecked lines may leave the picture, meet a mask or end early. kBox: of
// codes, not checked, with weights of 1, so that integers give what floats would.
template <int kMost, bool kChecked, bool kLinear, bool kBox, Orders kOrders = Orders::kAny>
HWY_NOINLINE void ConvolvePacket(const Lines& lines, int x, int y, float* result) {
  const D d;
  const Place place = PlaceOf(lines, x, y, FarOf(lines));
  Starts starts[kParts];
  PixelStarts(lines.width - 1 - x, lines.height - 1 - y, starts);
  const int channels = kMost == 1 ? 1 : lines.channels;
  V sum[kChains][kMost], weight[kChains], alive[kChains];
  bool whole[kChains];  // no line of the chain has ended
  for (int c = 0; c < kChains; ++c) {
    weight[c] = hn::Zero(d), alive[c] = hn::Set(d, 1.0f);
    whole[c] =
        kMost == 1 && !kLinear && place.codes != nullptr && lines.mask == nullptr && lines.reach == nullptr;
    for (int i = 0; i < kMost; ++i) sum[c][i] = hn::Zero(d);
  }
  VI codes[kChains];
  for (int c = 0; c < kChains; ++c) codes[c] = hn::Zero(DI());
  CodeBase bases[kParts];
  for (int part = 0; part < kParts; ++part) bases[part] = CodeBaseOf(lines, place, starts[part]);
  V reach[kParts];
  if (kChecked && lines.reach != nullptr) {
    for (int part = 0; part < kParts; ++part) {
      const VI at = hn::Add(hn::Mul(starts[part].y, hn::Set(DI(), lines.width)), starts[part].x);
      reach[part] = hn::GatherIndex(d, lines.reach + ptrdiff_t{y} * lines.width + x, at);
    }
  }
  const auto tap = [&](int c, int number, const V2& p, bool inside) HWY_ATTR {
    if constexpr (kBox) {
      codes[c] = hn::Add(codes[c], NearestCodes(lines, place, bases[c % kParts], p));
      return;
    }
    const auto i = static_cast<size_t>(number - 1);
    V w = hn::Set(d, c < kParts ? lines.forward[i] : lines.backward[i]);
    const Starts& start = starts[c % kParts];
    if constexpr (!kChecked && !kLinear) {
      if (place.codes != nullptr) {
        const V value = hn::ConvertTo(d, NearestCodes(lines, place, bases[c % kParts], p));
        sum[c][0] = hn::MulAdd(w, value, sum[c][0]);
        return;
      }
    }
    if constexpr (kChecked && !kLinear) {
      if (inside && whole[c]) {
        const V value = hn::ConvertTo(d, NearestCodes(lines, place, bases[c % kParts], p));
        weight[c] = hn::Add(weight[c], w);
        sum[c][0] = hn::Add(sum[c][0], hn::Mul(w, value));
        return;
      }
    }
    const bool check = kChecked && !(inside && lines.mask == nullptr);
    if (check && hn::AllFalse(d, hn::Gt(alive[c], hn::Zero(d)))) return;  // all of these lines have ended
    if constexpr (kChecked) {
      if (lines.reach != nullptr) {
        const auto within = hn::Le(hn::Set(d, static_cast<float>(number)), reach[c % kParts]);
        alive[c] = hn::IfThenElseZero(within, alive[c]);
      }
    }
    const auto take = [&](const auto& texels) HWY_ATTR {
      if constexpr (kChecked) {
        w = hn::Mul(w, alive[c]);
        weight[c] = hn::Add(weight[c], w);
      }
      for (int channel = 0; channel < channels; ++channel) {
        const V value = texels.Value(place, channel);
        if constexpr (kChecked) {
          // A line that has ended takes nothing, not even NaN.
          const V part = hn::IfThenElseZero(hn::Gt(w, hn::Zero(d)), hn::Mul(w, value));
          sum[c][channel] = hn::Add(sum[c][channel], part);
        } else {
          sum[c][channel] = hn::MulAdd(w, value, sum[c][channel]);
        }
      }
    };
    if (check) {
      const Texels<kLinear> texels = FindTexels<true, kLinear>(lines, place, start, p);
      alive[c] = hn::And(alive[c], texels.inside);
      whole[c] = whole[c] && hn::AllTrue(d, hn::Gt(alive[c], hn::Zero(d)));
      take(texels);
    } else {
      take(FindTexels<false, kLinear>(lines, place, start, p));
    }
  };
  Walker<kChecked, kOrders>(lines, place, starts).Run(lines.taps, tap);
  if constexpr (kBox) {
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) sum[c][0] = hn::ConvertTo(d, codes[c]);
  }

  const V centre = hn::Set(d, lines.centre);
  for (int part = 0; part < kParts; ++part) {
    const Texels<kLinear> own =
        FindTexels<kChecked, kLinear>(lines, place, starts[part], {hn::Zero(d), hn::Zero(d)});
    const V total =
        kChecked ? hn::Add(hn::Add(weight[part], weight[part + kParts]), centre) : hn::Set(d, lines.sum);
    for (int channel = 0; channel < channels; ++channel) {
      // Forward plus backward first: a field turned round gives the same bits.
      const V both = hn::Add(sum[part][channel], sum[part + kParts][channel]);
      V v = own.Value(place, channel);
      if (lines.centre == 0) v = hn::Zero(d);
      const V all = hn::MulAdd(centre, v, both);
      V mean = hn::Div(hn::Mul(all, hn::Set(d, lines.unit)), total);
      if constexpr (kChecked) {
        mean = hn::IfThenElseZero(hn::Gt(total, hn::Zero(d)), mean);
        mean = hn::IfThenElseZero(hn::Gt(own.inside, hn::Zero(d)), mean);
      }
      hn::StoreU(mean, d, result + channel * kPacket + part * kLanes);
    }
  }
}

void FollowFrom(const Lines& lines, const LineOutput& out) {
  const int far = static_cast<int>(lines.farthest) + 2;
  const bool plain = lines.mask == nullptr && lines.reach == nullptr && lines.channels == 1 &&
                     !lines.linear && IsNear(lines, FarOf(lines));
  const bool box = lines.box && lines.codes != nullptr && lines.taps < kMostBoxTaps;
  const decltype(&ConvolvePacket<1, false, false, true, Orders::kHigh>) plain_of[2][2] = {
      {ConvolvePacket<1, false, false, false, Orders::kHigh>,
       ConvolvePacket<1, false, false, true, Orders::kHigh>},
      {ConvolvePacket<1, false, false, false, Orders::kLow>,
       ConvolvePacket<1, false, false, true, Orders::kLow>}};
  const auto convolve_plain = plain_of[IsLow(lines.integrator)][box];
  alignas(64) float result[kMostChannels * kPacket];
  const int left = out.roi.x0 / kSide * kSide, top = out.roi.y0 / kSide * kSide;
  const int rows = (out.roi.y1 - top + kSide - 1) / kSide, strips = (out.roi.x1 - left + kStrip - 1) / kStrip;
  for (int i = 0; i < strips * rows; ++i) {
    const int y = top + i % rows * kSide, from = left + i / rows * kStrip;
    for (int x = from; x < std::min(from + kStrip, out.roi.x1); x += kSide) {
      const bool inside =
          x >= far && y >= far && x + kSide + far <= lines.width && y + kSide + far <= lines.height;
      if (inside && plain) {
        convolve_plain(lines, x, y, result);
      } else if (lines.linear) {
        ConvolvePacket<kMostChannels, true, true, false>(lines, x, y, result);
      } else if (lines.channels == 1) {
        ConvolvePacket<1, true, false, false>(lines, x, y, result);
      } else {
        ConvolvePacket<kMostChannels, true, false, false>(lines, x, y, result);
      }
      for (int py = std::max(y, out.roi.y0); py < std::min(y + kSide, out.roi.y1); ++py) {
        for (int px = std::max(x, out.roi.x0); px < std::min(x + kSide, out.roi.x1); ++px) {
          float* const to = out.data + (py - out.roi.y0) * out.row + ptrdiff_t{px - out.roi.x0} * out.step;
          for (int c = 0; c < lines.channels; ++c) to[c] = result[c * kPacket + (py - y) * kSide + px - x];
        }
      }
    }
  }
}

FollowLines DirectLinesHere() { return FollowFrom; }

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::flow {

HWY_EXPORT(DirectLinesHere);

FollowLines FindDirectLines() { return HWY_DYNAMIC_DISPATCH(DirectLinesHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
