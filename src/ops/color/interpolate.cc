// Interpolation and extrapolation between two images.
#include <memory>

#include "ops/color/color_ops.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/interpolate.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// Works from the nearer image, so that the error stays within the weighted sum: near + y (far - near), y <=
// 1/2 inside [0, 1]. Where the difference is not finite the weighted sum is taken instead.
struct InterpolateKernel {
  float y;       // weight of the far image
  float rest;    // 1 - y
  bool swapped;  // the second image is the near one

  HWY_INLINE s::V operator()(s::V a, s::V b) const {
    if (y == 0) return swapped ? b : a;
    const s::D d;
    const s::V near = swapped ? b : a, far = swapped ? a : b;
    const s::V weight = hn::Set(d, y), difference = hn::Sub(far, near);
    const s::V sum = hn::MulAdd(weight, far, hn::Mul(hn::Set(d, rest), near));
    return hn::IfThenElse(hn::IsFinite(difference), hn::MulAdd(weight, difference, near), sum);
  }
  HWY_INLINE s::V OfFinite(s::V a, s::V b) const {
    const s::V near = swapped ? b : a, far = swapped ? a : b;
    return hn::MulAdd(hn::Set(s::D(), y), hn::Sub(far, near), near);
  }
};
std::unique_ptr<graph::PointStage> MakeInterpolate(float y, float rest, bool swapped) {
  return s::MakeFusedStage<2>(InterpolateKernel{y, rest, swapped});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakeInterpolate);

class InterpolateOp final : public graph::OpWith<InterpolateParams> {
 public:
  explicit InterpolateOp(InterpolateParams params) : OpWith(params) {}
  std::string Name() const override { return "interp"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow(Name(), inputs);
    if (inputs[0].channel_count() != inputs[1].channel_count()) {
      throw DataError(Name(), "operands have " + std::to_string(inputs[0].channel_count()) + " and " +
                                  std::to_string(inputs[1].channel_count()) +
                                  " channels, expected equal counts");
    }
    return inputs[0];
  }
  bool IsIdentity() const override { return params().x == 0; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    const double x = params().x;
    const bool swapped = x > 0.5;
    const double y = swapped ? 1 - x : x;
    return HWY_DYNAMIC_DISPATCH(MakeInterpolate)(static_cast<float>(y), static_cast<float>(1 - y), swapped);
  }
};

}  // namespace

OpInfo InterpolateInfo() {
  OpInfo info;
  info.name = "interp";
  info.family = "color";
  info.inputs = 2;
  info.summary = "Interpolate or extrapolate between two images";
  info.help =
      "(1 - X) * first + X * second, every channel. X = 0 and X = 1 return the first and the second image "
      "bit for bit, X outside [0,1] extrapolates; equal images give themselves for any X. FLT_MAX and "
      "-FLT_MAX meet at 0. Source: Haeberli and Voorhies 1994.";
  info.bound = "4 u (|(1-X) first| + |X second|)";
  info.bound_u = 4;
  info.arguments = {NumberModifier("X", "", "weight of the second image")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Interpolate(in[0], in[1], a.Number("X"));
  };
  info.examples = {"0.3", "0.75", "1.5", "-1", "1"};
  info.identity = "0";
  return info;
}

}  // namespace ops

Node Interpolate(const Node& first, const Node& second, const InterpolateParams& params) {
  ops::RequireFinite("interp", "weight", params.x);
  return graph::MakeNode(std::make_shared<const ops::InterpolateOp>(params), {first, second});
}

Node Interpolate(const Node& first, const Node& second, double x) {
  return Interpolate(first, second, InterpolateParams{x});
}

}  // namespace tessera
#endif  // HWY_ONCE
