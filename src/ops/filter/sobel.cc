// Sobel's gradient: magnitude, direction or both components, from differences of neighbours.
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/border.h"
#include "graph/op.h"
#include "ops/filter/filter_ops.h"
#include "ops/filter/frame.h"
#include "ops/filter/window/window.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/filter.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/sobel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pixels-inl.h"

#ifndef TESSERA_OPS_FILTER_SOBEL_CC_
#define TESSERA_OPS_FILTER_SOBEL_CC_
namespace tessera::ops {

// The kernels of one instruction set.
struct SobelFunctions {
  void (*row)(const float* in, ptrdiff_t stride, int channels, int samples, float* x, float* y);
  void (*length)(const float* x, const float* y, int samples, float* out);
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_SOBEL_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;

HWY_INLINE V Load(const float* p) { return hn::LoadU(D(), p); }

// sqrt(x^2 + y^2); where the squares would leave float's range the components are scaled by a power of two.
HWY_INLINE V Length(V x, V y) {
  const D d;
  const V sum = hn::MulAdd(x, x, hn::Mul(y, y));
  const V largest = hn::Max(hn::Abs(x), hn::Abs(y));
  const auto low = hn::And(hn::Lt(largest, hn::Set(d, 0x1p-50f)), hn::Gt(largest, hn::Zero(d)));
  const auto high = hn::Gt(largest, hn::Set(d, 0x1p60f));
  if (HWY_LIKELY(hn::AllFalse(d, hn::Or(low, high)))) return hn::Sqrt(sum);
  const V one = hn::Set(d, 1.0f);
  const V up = hn::IfThenElse(low, hn::Set(d, 0x1p99f), hn::IfThenElse(high, hn::Set(d, 0x1p-66f), one));
  const V down = hn::IfThenElse(low, hn::Set(d, 0x1p-99f), hn::IfThenElse(high, hn::Set(d, 0x1p66f), one));
  const V a = hn::Mul(x, up), b = hn::Mul(y, up);
  return hn::Mul(hn::Sqrt(hn::MulAdd(a, a, hn::Mul(b, b))), down);
}

// X and Y, or the magnitude in `x` when `y` is null, of `count` samples; rows of whole vectors. `in` is the
// sample above and left of the first one.
void SobelRow(const float* in, ptrdiff_t stride, int channels, int count, float* x, float* y) {
  const V two = hn::Set(D(), 2.0f);
  const float* const top = in;
  const float* const middle = in + stride;
  const float* const bottom = middle + stride;
  const ptrdiff_t c = channels;
  for (ptrdiff_t i = 0; i < count; i += kLanes) {
    const V tl = Load(top + i), tr = Load(top + i + 2 * c), bl = Load(bottom + i),
            br = Load(bottom + i + 2 * c);
    const V across = hn::Sub(Load(middle + i + 2 * c), Load(middle + i));
    const V down = hn::Sub(Load(bottom + i + c), Load(top + i + c));
    const V gx = hn::MulAdd(two, across, hn::Add(hn::Sub(tr, tl), hn::Sub(br, bl)));
    const V gy = hn::MulAdd(two, down, hn::Add(hn::Sub(bl, tl), hn::Sub(br, tr)));
    const V first = y == nullptr ? Length(gx, gy) : gx;
    // Every NaN leaves as the same one.
    hn::StoreU(hn::IfThenElse(hn::IsNaN(first), hn::NaN(D()), first), D(), x + i);
    if (y != nullptr) hn::StoreU(hn::IfThenElse(hn::IsNaN(gy), hn::NaN(D()), gy), D(), y + i);
  }
}

// The magnitude of `count` samples of both components.
void LengthRow(const float* x, const float* y, int count, float* out) {
  ptrdiff_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    const V v = Length(Load(x + i), Load(y + i));
    hn::StoreU(hn::IfThenElse(hn::IsNaN(v), hn::NaN(D()), v), D(), out + i);
  }
  for (; i < count; ++i) {
    // The rest of a row, repeated over a vector: there may be nothing behind it.
    const V v = Length(hn::Set(D(), x[i]), hn::Set(D(), y[i]));
    out[i] = hn::GetLane(hn::IfThenElse(hn::IsNaN(v), hn::NaN(D()), v));
  }
}
SobelFunctions SobelOfTarget() { return {SobelRow, LengthRow}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(SobelOfTarget);

SobelFunctions ChooseSobel() { return HWY_DYNAMIC_DISPATCH(SobelOfTarget)(); }

class SobelStage final : public graph::TileStage {
 public:
  explicit SobelStage(const SobelParams& p) : params_(p) {}
  Roi InputRoi(int, const Roi& out) const override { return params_.by_parts() ? out : Inflate(out, 1, 1); }
  Wrap InputBorder(int) const override { return params_.wrap; }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const ConstImageView& in = args.in[0];
    const int samples = o.width() * in.channels;
    float* x = args.scratch.Allocate<float>(static_cast<size_t>(samples) + 16);
    float* y = params_.output == SobelOutput::kMagnitude
                   ? nullptr
                   : args.scratch.Allocate<float>(static_cast<size_t>(samples) + 16);
    for (int row = o.y0; row < o.y1; ++row) {
      if (params_.by_parts()) {
        const auto* const first = reinterpret_cast<const float*>(in.At(o.x0, row));
        const auto* const second = reinterpret_cast<const float*>(args.in[1].At(o.x0, row));
        if (y == nullptr) {
          functions_.length(first, second, samples, x);
        } else {
          std::copy_n(first, samples, x), std::copy_n(second, samples, y);
        }
      } else {
        functions_.row(reinterpret_cast<const float*>(in.At(o.x0 - 1, row - 1)), in.row_stride / 4,
                       in.channels, samples, x, y);
      }
      float* out = reinterpret_cast<float*>(args.out.At(o.x0, row));
      switch (params_.output) {
        case SobelOutput::kMagnitude:
          std::copy_n(x, samples, out);
          break;
        case SobelOutput::kDirection:
          // A difference of zeros may be -0, whose direction would be pi.
          for (int i = 0; i < samples; ++i)
            out[i] = static_cast<float>(std::atan2(double{y[i]} + 0.0, double{x[i]} + 0.0));
          break;
        case SobelOutput::kXY:
          // Result channel 2c is X, 2c + 1 is Y of channel c; some may not be wanted.
          for (int i = 0; i < args.out.channels; ++i) {
            const int channel = args.channels[static_cast<size_t>(i)];
            const auto& held = args.in_channels[0];
            const float* from = (channel % 2 == 0 ? x : y) +
                                (std::find(held.begin(), held.end(), channel / 2) - held.begin());
            for (int p = 0; p < o.width(); ++p) out[p * args.out.channels + i] = from[p * in.channels];
          }
          break;
      }
    }
  }

 private:
  SobelFunctions functions_ = ChooseSobel();
  SobelParams params_;
};

// By parts the inputs are X and Y, else the image.
class SobelOp final : public graph::OpWith<SobelParams> {
 public:
  explicit SobelOp(const SobelParams& p) : OpWith(p) {
    RequireWrap("sobel", p.wrap,
                {Wrap::kClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101});
    if (p.method == FilterMethod::kRecursive || p.method == FilterMethod::kDecimated) {
      throw Error("sobel",
                  "found method=recursive or decimated, expected auto, direct, separable, lowrank or fft");
    }
    if (p.bits != 0 && p.method != FilterMethod::kAuto && p.method != FilterMethod::kDirect) {
      throw Error("sobel", "found bits=" + std::to_string(p.bits) +
                               " with another method than direct, expected method=auto or direct");
    }
  }
  std::string Name() const override { return "sobel"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    if (params().output != SobelOutput::kXY) return out;
    out.channels.clear();
    for (const std::string& name : inputs[0].channels)
      out.channels.insert(out.channels.end(), {name + ".x", name + ".y"});
    out.alpha = -1;
    return out;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec& in) const override {
    if (params().output != SobelOutput::kXY) return result;
    std::vector<bool> needed(in.channels.size());
    for (size_t c = 0; c < needed.size(); ++c) needed[c] = result[2 * c] || result[2 * c + 1];
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<SobelStage>(params());
  }
};

}  // namespace

OpInfo SobelInfo() {
  OpInfo info;
  info.name = "sobel";
  info.family = "filter";
  info.summary = "Gradient by Sobel's operator";
  info.help =
      "Differences of the neighbours left and right (X) and below and above (Y), weighted 1 2 1: a ramp of "
      "slope g per pixel gives 8 g, a flat image exactly 0, whatever its value. output=magnitude is sqrt(X^2 "
      "+ Y^2), direction is atan2(Y, X) in radians (y down: the direction in which the image grows "
      "brighter), xy makes two channels c.x and c.y of each channel c. Every channel is treated, alpha "
      "too. bits= sums X and Y in an accumulation buffer, as --shiftaccum:bits=. direct, separable and "
      "lowrank are the same differences and sums; fft convolves with sobel_x and sobel_y in blocks, whose "
      "error (--convolve) gives flat parts a direction by chance.";
  info.bound = "4 u * sum of |weight * difference| (X, Y, magnitude); direction: that over the magnitude";
  info.bound_u = 4;
  ParamInfo wrap = FilterWrapModifier();
  wrap.choices = {"clamp", "black", "repeat", "mirror", "mirror101"};
  info.modifiers = {ChoiceModifier("output", {"magnitude", "direction", "xy"}, "what is written"), wrap,
                    BufferBitsModifier(), MethodModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& output = a.Text("output");
    return Sobel(in[0], {output == "xy"          ? SobelOutput::kXY
                         : output == "direction" ? SobelOutput::kDirection
                                                 : SobelOutput::kMagnitude,
                         WrapNamed(a.Text("wrap")), a.Integer("bits"), MethodNamed(a.Text("method"))});
  };
  info.examples = {"", "output=xy wrap=mirror101", "output=direction", "output=xy bits=12",
                   "output=xy method=fft wrap=mirror"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Sobel(const Node& image, const SobelParams& params) {
  auto op = std::make_shared<const ops::SobelOp>(params);
  if (!params.by_parts()) {
    return ops::InDisplayWindow(image, params.wrap,
                                [&](const Node& framed) { return graph::MakeNode(op, {framed}); });
  }
  if (params.bits == 0) {
    const auto part = [&](const char* kernel) {
      return Convolve(image, NamedKernel(kernel),
                      {.correlate = true, .wrap = params.wrap, .method = params.method});
    };
    return graph::MakeNode(std::move(op), {part("sobel_x"), part("sobel_y")});
  }
  ShiftAccumulateParams x{.taps = {-1, 0, 1, -2, 0, 2, -1, 0, 1}, .bits = params.bits, .wrap = params.wrap};
  ShiftAccumulateParams y = x;
  y.taps = {-1, -2, -1, 0, 0, 0, 1, 2, 1};
  return ops::MadeOf("sobel", [&] {
    return graph::MakeNode(std::move(op), {ShiftAccumulate(image, x), ShiftAccumulate(image, y)});
  });
}

}  // namespace tessera
#endif  // HWY_ONCE
