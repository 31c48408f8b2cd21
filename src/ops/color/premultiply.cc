// Premultiplication by alpha and its inverse.
#include <memory>

#include "ops/color/color_ops.h"
#include "tessera/color_state.h"
#include "tessera/ops/channels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/premultiply.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

struct PremultiplyKernel {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    return {hn::Mul(p.r, p.a), hn::Mul(p.g, p.a), hn::Mul(p.b, p.a), p.a};
  }
};
struct RepremultiplyKernel {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const auto zero = hn::Eq(p.a, hn::Zero(s::D()));
    return {hn::IfThenElse(zero, p.r, hn::Mul(p.r, p.a)), hn::IfThenElse(zero, p.g, hn::Mul(p.g, p.a)),
            hn::IfThenElse(zero, p.b, hn::Mul(p.b, p.a)), p.a};
  }
};
struct UnpremultiplyKernel {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const auto zero = hn::Eq(p.a, hn::Zero(s::D()));
    return {hn::IfThenElse(zero, p.r, hn::Div(p.r, p.a)), hn::IfThenElse(zero, p.g, hn::Div(p.g, p.a)),
            hn::IfThenElse(zero, p.b, hn::Div(p.b, p.a)), p.a};
  }
};
std::unique_ptr<graph::PointStage> MakePremultiply() { return s::MakeFusedStage<1>(PremultiplyKernel{}); }
std::unique_ptr<graph::PointStage> MakeRepremultiply() { return s::MakeFusedStage<1>(RepremultiplyKernel{}); }
std::unique_ptr<graph::PointStage> MakeUnpremultiply() { return s::MakeFusedStage<1>(UnpremultiplyKernel{}); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakePremultiply);
HWY_EXPORT(MakeRepremultiply);
HWY_EXPORT(MakeUnpremultiply);

enum class Way { kPremultiply, kRepremultiply, kUnpremultiply };

class PremultiplyOp final : public graph::Op {
 public:
  explicit PremultiplyOp(Way way) : way_(way) {}
  std::string Name() const override {
    constexpr const char* kNames[] = {"premult", "repremult", "unpremult"};
    return kNames[static_cast<int>(way_)];
  }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  const std::any& Parameters() const override { return parameters_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    ImageSpec spec = inputs[0];
    SetColorState(spec, {ColorStateOf(spec).space, way_ != Way::kUnpremultiply});
    return spec;
  }
  bool ReadsAlpha() const override { return true; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    switch (way_) {
      case Way::kPremultiply:
        return HWY_DYNAMIC_DISPATCH(MakePremultiply)();
      case Way::kRepremultiply:
        return HWY_DYNAMIC_DISPATCH(MakeRepremultiply)();
      default:
        return HWY_DYNAMIC_DISPATCH(MakeUnpremultiply)();
    }
  }

 private:
  Way way_;
  std::any parameters_ = PremultiplyParams();
};

Node MakePremultiplyNode(const Node& image, Way way) {
  // Without alpha there is nothing to do, whatever the channels: the input itself.
  if (image.spec().alpha < 0) return image;
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [way](const Node& colors) { return MakePremultiplyNode(colors, way); });
  }
  return graph::MakeNode(std::make_shared<const PremultiplyOp>(way), {image});
}

}  // namespace

OpInfo PremultiplyInfo() {
  OpInfo info;
  info.name = "premult";
  info.family = "color";
  info.summary = "Multiply R,G,B by alpha";
  info.help =
      "R,G,B become R*A, G*A, B*A; alpha and further channels are kept, and the image counts "
      "as premultiplied. An image without alpha is returned unchanged. As oiiotool "
      "--premult. Source: Porter and Duff 1984.";
  info.bound = "u |result|";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Premultiply(in[0]); };
  info.examples = {""};
  return info;
}

OpInfo RepremultiplyInfo() {
  OpInfo info;
  info.name = "repremult";
  info.family = "color";
  info.summary = "Multiply R,G,B by alpha, but keep light where alpha is 0";
  info.help =
      "R,G,B become R*A, G*A, B*A where alpha is not 0; pixels with alpha 0 (glows, fire: light that hides "
      "nothing) keep their colours, so that it undoes --unpremult everywhere. Alpha and further channels are "
      "kept, and the image counts as premultiplied. An image without alpha is returned unchanged. "
      "As oiiotool --repremult.";
  info.bound = "u |result|";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return Repremultiply(in[0]);
  };
  info.examples = {""};
  return info;
}

OpInfo UnpremultiplyInfo() {
  OpInfo info;
  info.name = "unpremult";
  info.family = "color";
  info.summary = "Divide R,G,B by alpha";
  info.help =
      "R,G,B become R/A, G/A, B/A where alpha is not 0; pixels with alpha 0 are left alone, a tiny alpha may "
      "divide to infinity, a NaN alpha gives NaN. Alpha and further channels are kept; the result counts as "
      "unpremultiplied, so that files say what they hold. An image without alpha is returned "
      "unchanged. Source: as oiiotool --unpremult.";
  info.bound = "u |result|";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return Unpremultiply(in[0]);
  };
  info.examples = {""};
  return info;
}

}  // namespace ops

Node Premultiply(const Node& image) { return ops::MakePremultiplyNode(image, ops::Way::kPremultiply); }
Node Repremultiply(const Node& image) { return ops::MakePremultiplyNode(image, ops::Way::kRepremultiply); }
Node Unpremultiply(const Node& image) { return ops::MakePremultiplyNode(image, ops::Way::kUnpremultiply); }

}  // namespace tessera
#endif  // HWY_ONCE
