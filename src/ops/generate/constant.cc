// One colour everywhere; black.
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/generate/generate_ops.h"
#include "ops/generate/generators.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/generate/constant.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct Fill {
  float value[4];
  HWY_INLINE s::Pixels operator()(s::Position) const {
    const s::D d;
    return {hn::Set(d, value[0]), hn::Set(d, value[1]), hn::Set(d, value[2]), hn::Set(d, value[3])};
  }
};
std::unique_ptr<graph::PointStage> MakeFill(const float* value) {
  return s::MakeStage<0>(Fill{{value[0], value[1], value[2], value[3]}});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeFill);

class ConstantOp final : public GeneratorOp<ConstantParams> {
 public:
  using GeneratorOp::GeneratorOp;
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    float value[4];
    for (int i = 0; i < 4; ++i) {
      value[i] = static_cast<float>(ChannelValue(params().color, context.channels[i], 1));
    }
    return HWY_DYNAMIC_DISPATCH(MakeFill)(value);
  }
};

}  // namespace

ParamInfo ColorModifier(const char* name, const char* default_value, const char* help) {
  ParamInfo color = ConstantsArgument("");
  color.name = name;
  color.default_value = default_value;
  color.help = help;
  return color;
}

OpInfo ConstantInfo() {
  OpInfo info = GeneratorRow("constant", "One colour everywhere");
  info.help =
      "color= holds a value per channel; one value serves every channel, channels beyond the list get 1, "
      "values beyond the last channel are ignored, as oiiotool's --pattern constant.";
  info.bound = "1 rounding of each constant";
  info.bound_u = 1;
  info.modifiers = {ColorModifier("color", "1", "one number for all channels, or comma-separated ones")};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    return Constant(*output, {a.Numbers("color")});
  };
  info.examples = {"color=0.5,0.25,0.125,1", "", "color=0.1"};
  return info;
}

OpInfo CreateInfo() {
  OpInfo info = GeneratorRow("create", "A black image");
  info.help = "Every channel, alpha included, is 0, as oiiotool's --create.";
  info.bound = "exact";
  info.make = [](std::span<const Node>, const Arguments&, const ImageSpec* output) {
    return Create(*output);
  };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Constant(const ImageSpec& spec, const ConstantParams& params) {
  ops::RequireConstants("constant", params.color);
  return graph::MakeNode(std::make_shared<const ops::ConstantOp>("constant", spec, params), {});
}

Node Create(const ImageSpec& spec) {
  return graph::MakeNode(std::make_shared<const ops::ConstantOp>("create", spec, ConstantParams{{0}}), {});
}

}  // namespace tessera
#endif  // HWY_ONCE
