// Unsharp mask: an image and its blurred self.
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "ops/filter/filter_ops.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/filter.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/unsharp.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct Sharpen {
  float contrast, threshold;
  HWY_INLINE s::Pixels operator()(const s::Pixels& image, const s::Pixels& blurred) const {
    const s::D d;
    const s::V c = hn::Set(d, contrast), t = hn::Set(d, threshold);
    return s::Map(image, blurred, [&](s::V x, s::V b) HWY_ATTR {
      const s::V difference = hn::Sub(x, b);
      const s::V kept = hn::IfThenZeroElse(hn::Lt(hn::Abs(difference), t), difference);
      const s::V sharp = hn::MulAdd(c, kept, x);
      // Every NaN leaves as the same one: which of two a sum passes on depends on the compiler.
      return hn::IfThenElse(hn::IsNaN(sharp), hn::NaN(d), sharp);
    });
  }
};
std::unique_ptr<graph::PointStage> MakeSharpen(float contrast, float threshold) {
  return s::MakeFusedStage<2>(Sharpen{contrast, threshold});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeSharpen);

// Inputs: the image, the blurred image.
class UnsharpOp final : public graph::OpWith<UnsharpParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "unsharp"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow(Name(), inputs);
    return inputs[0];
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(MakeSharpen)(static_cast<float>(params().contrast),
                                             static_cast<float>(params().threshold));
  }
};

}  // namespace

OpInfo UnsharpInfo() {
  OpInfo info;
  info.name = "unsharp";
  info.family = "filter";
  info.summary = "Sharpens by the difference from a blurred copy";
  info.help =
      "image + contrast * (image - blurred), as oiiotool: blurred is the image convolved with kernel= of "
      "width= pixels both ways (or kernel=median); a difference below threshold= counts as 0. Every channel, "
      "alpha included. bits= blurs through an accumulation buffer, as --convolve:bits=.";
  info.bound = "4 u * (|image| + contrast * |image - blurred|)";
  info.bound_u = 4;
  ParamInfo wrap = FilterWrapModifier();
  wrap.only_with = "!kernel=median";
  info.modifiers = {TextModifier("kernel", "a kernel's name, or median", "gaussian"),
                    NumberModifier("width", "3", 1, 255, "its size in pixels"),
                    NumberModifier("contrast", "1", "factor of the difference"),
                    NumberModifier("threshold", "0", 0, 1e38, "smaller differences are dropped"),
                    wrap,
                    BufferBitsModifier(),
                    MethodModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return UnsharpMask(in[0],
                       {a.Text("kernel"), a.Number("width"), a.Number("contrast"), a.Number("threshold"),
                        WrapNamed(a.Text("wrap")), a.Integer("bits"), MethodNamed(a.Text("method"))});
  };
  info.examples = {"", "kernel=box width=7 contrast=0.6 wrap=mirror", "kernel=median width=3",
                   "width=5 method=fft"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node UnsharpMask(const Node& image, const UnsharpParams& p) {
  if (p.wrap == Wrap::kValid) throw Error("unsharp", "found wrap=valid, expected one that keeps the size");
  if (!(p.contrast >= -1e30 && p.contrast <= 1e30) || !(p.threshold >= 0)) {
    throw Error("unsharp",
                "found a contrast or threshold out of range, expected a finite contrast and a threshold of 0 "
                "or more");
  }
  Node blurred;
  if (p.kernel == "median") {
    if (p.bits != 0) {
      throw Error("unsharp", "found bits=" + std::to_string(p.bits) +
                                 " with the kernel median, which sums nothing, expected another kernel");
    }
    if (p.method != FilterMethod::kAuto)
      throw Error("unsharp", "found a method with the kernel median, which sums nothing, expected auto");
    const int size = static_cast<int>(p.width + 0.999999);
    blurred = Median(image, {size, size});
  } else {
    ConvolveParams c;
    c.wrap = p.wrap, c.bits = p.bits, c.method = p.method;
    blurred =
        ops::MadeOf("unsharp", [&] { return Convolve(image, NamedKernel(p.kernel, p.width, p.width), c); });
  }
  return graph::MakeNode(std::make_shared<const ops::UnsharpOp>(p), {image, blurred});
}

}  // namespace tessera
#endif  // HWY_ONCE
