// Three images: a * b + c.
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "ops/union.h"
#include "tessera/ops/arithmetic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/mad.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

// Fused where the target has it, so all targets that do agree in every bit.
struct MadF {
  HWY_INLINE s::V operator()(s::V a, s::V b, s::V c) const { return hn::MulAdd(a, b, c); }
};
std::unique_ptr<graph::PointStage> MakeMad() { return s::MakeFusedStage<3>(MadF{}); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeMad);

class MadOp final : public graph::OpWith<NoParams> {
 public:
  MadOp() : OpWith({}) {}
  std::string Name() const override { return "mad"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = RequireSameShape("mad", inputs);
    for (const ImageSpec& input : inputs)
      spec.display_window = Union(spec.display_window, input.display_window);
    return spec;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(MakeMad)();
  }
};

}  // namespace

OpInfo MadInfo() {
  OpInfo info;
  info.name = "mad";
  info.family = "arithmetic";
  info.inputs = 3;
  info.summary = "Multiply two images and add a third";
  info.help =
      "Each sample of the result is A * B + C, where A is the lowest and C the uppermost of three images on "
      "the stack; alpha and further channels are treated like the others. The result covers all windows, "
      "data and display, as oiiotool's; a pixel that one of them does not have is 0 there. All need the same "
      "number of channels. The result keeps the names, alpha and metadata of A.\n"
      "NaN and infinities follow IEEE 754. Product and sum are rounded once where the processor can (fused "
      "multiply-add), twice elsewhere. Nothing is clamped.";
  info.bound = "2 u * (|A B| + |C|)";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return Mad(in[0], in[1], in[2]);
  };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Mad(const Node& a, const Node& b, const Node& c) {
  return graph::MakeNode(std::make_shared<const ops::MadOp>(), ops::OnUnion({a, b, c}));
}

}  // namespace tessera
#endif  // HWY_ONCE
