// Absolute value, and absolute difference from a constant: |x - c|.
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "tessera/ops/arithmetic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/abs.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct AbsDifference {
  float constant[4];
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const s::D d;
    return {hn::Abs(hn::Sub(p.r, hn::Set(d, constant[0]))), hn::Abs(hn::Sub(p.g, hn::Set(d, constant[1]))),
            hn::Abs(hn::Sub(p.b, hn::Set(d, constant[2]))), hn::Abs(hn::Sub(p.a, hn::Set(d, constant[3])))};
  }
};
std::unique_ptr<graph::PointStage> MakeAbsDifference(const float* constant) {
  return s::MakeFusedStage<1>(AbsDifference{{constant[0], constant[1], constant[2], constant[3]}});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeAbsDifference);

// `values` as given by the user; for "abs" the single constant 0.
class AbsOp final : public graph::OpWith<ChannelConstants> {
 public:
  AbsOp(const char* name, ChannelConstants params) : OpWith(std::move(params)), name_(name) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    float constant[4];
    for (int i = 0; i < 4; ++i) {
      constant[i] = static_cast<float>(ChannelValue(params().values, context.channels[i], 0));
    }
    return HWY_DYNAMIC_DISPATCH(MakeAbsDifference)(constant);
  }

 private:
  const char* name_;
};

}  // namespace

OpInfo AbsInfo() {
  OpInfo info;
  info.name = "abs";
  info.family = "arithmetic";
  info.summary = "Absolute value";
  info.help =
      "Each sample of the result is |A|, alpha and further channels included. -0 becomes +0, NaN stays NaN, "
      "-infinity becomes +infinity.";
  info.bound = "exact";
  info.bound_u = 0;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Abs(in[0]); };
  info.examples = {""};
  return info;
}

OpInfo AbsDiffConstantInfo() {
  OpInfo info;
  info.name = "absdiffc";
  info.family = "arithmetic";
  info.summary = "Absolute difference from a constant per channel";
  info.help =
      "Each sample of the result is |A - c|. One value serves all channels, alpha included; of several "
      "values the n-th is channel n's, and channels beyond the list have c = 0. NaN and infinities follow "
      "IEEE 754.";
  info.bound = "2 u * (|A| + |c|)";
  info.bound_u = 2;
  info.arguments = {ConstantsArgument("subtracted before the absolute value is taken")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return AbsDiffConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"0.25", "0.5,0.25,0.125,0", "0.1,1e-30"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Abs(const Node& image) {
  return graph::MakeNode(std::make_shared<const ops::AbsOp>("abs", ChannelConstants{{0}}), {image});
}

Node AbsDiffConstant(const Node& image, const std::vector<double>& values) {
  ops::RequireConstants("absdiffc", values);
  return graph::MakeNode(std::make_shared<const ops::AbsOp>("absdiffc", ChannelConstants{values}), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
