// Black and white, with a ramp between them where it is wanted.
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "ops/modifiers.h"
#include "tessera/ops/arithmetic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/threshold.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct Threshold {
  float at[4];
  float slope;  // 0: a step

  HWY_INLINE s::V One(s::V x, float threshold) const {
    const s::D d;
    const s::V one = hn::Set(d, 1.0f), beyond = hn::Sub(x, hn::Set(d, threshold));
    if (slope == 0) return hn::IfThenElseZero(hn::Gt(beyond, hn::Zero(d)), one);
    const s::V ramp = hn::MulAdd(beyond, hn::Set(d, slope), hn::Set(d, 0.5f));
    return s::ClampHigh(s::ClampLow(ramp, hn::Zero(d)), one);  // NaN to 0
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    return {One(p.r, at[0]), One(p.g, at[1]), One(p.b, at[2]), One(p.a, at[3])};
  }
};
std::unique_ptr<graph::PointStage> MakeThreshold(const float* at, float slope) {
  return s::MakeFusedStage<1>(Threshold{{at[0], at[1], at[2], at[3]}, slope});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeThreshold);

constexpr double kLeastSoftness = 1e-30, kMostSoftness = 1e30;

class ThresholdOp final : public graph::OpWith<ThresholdParams> {
 public:
  explicit ThresholdOp(ThresholdParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "threshold"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    float at[4];
    for (int i = 0; i < 4; ++i)
      at[i] = static_cast<float>(ChannelValue(params().values, context.channels[i], 0));
    const double softness = params().softness;
    return HWY_DYNAMIC_DISPATCH(MakeThreshold)(at, softness > 0 ? static_cast<float>(1 / softness) : 0.0f);
  }
};

}  // namespace

OpInfo ThresholdInfo() {
  OpInfo info;
  info.name = "threshold";
  info.family = "arithmetic";
  info.summary = "1 above a threshold, 0 below";
  info.help =
      "Each sample becomes 1 where it is above the threshold, else 0, the threshold itself and NaN too; alpha "
      "and further channels alike: --luminance or --ch first makes a mask of one channel. softness=S makes a "
      "ramp of it that rises from 0 at S / 2 below to 1 at S / 2 above. Of several thresholds the n-th is "
      "channel n's, and channels beyond the list have 0.";
  info.bound = "a step: exact, of the threshold as a float; a ramp: 4 u * (|threshold| / S + 1)";
  info.bound_u = 4;
  info.arguments = {ConstantsArgument("what is exceeded")};
  info.modifiers = {NumberModifier("softness", "0", 0, kMostSoftness, "width of the ramp; 0, a step")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return tessera::Threshold(in[0], {a.Numbers("VALUES"), a.Number("softness")});
  };
  info.examples = {"0.5", "0.1,0.9,0.5,1", "0.5 softness=0.25", "0.2,0.4 softness=2"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Threshold(const Node& image, const ThresholdParams& params) {
  ops::RequireConstants("threshold", params.values);
  const double s = params.softness;
  if (s != 0 && !(s >= ops::kLeastSoftness && s <= ops::kMostSoftness)) {
    throw Error("threshold", "found a softness of " + base::NumberText(s) + ", expected 0 or 1e-30 to 1e30");
  }
  return graph::MakeNode(std::make_shared<const ops::ThresholdOp>(params), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
