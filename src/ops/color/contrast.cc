// Contrast: interpolation from a constant grey, given or the mean luminance of the image.
#include <cmath>

#include "ops/color/color_ops.h"
#include "tessera/ops/channels.h"

namespace tessera {
namespace ops {
namespace {

// The form whose pivot is known only when the image's mean is.
class ContrastOp final : public graph::OpWith<ContrastParams> {
 public:
  explicit ContrastOp(ContrastParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "contrast"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  bool IsIdentity() const override { return params().x == 1; }
  std::vector<graph::StatisticRequest> Statistics() const override {
    const LuminanceWeights w = NormalizedWeights(Name(), params().weights);
    return {{0, {w.r, w.g, w.b}}};
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    const double mean = context.statistics[0];
    const bool known = std::isfinite(mean);
    double m[4][5] = {};
    for (int i = 0; i < 4; ++i) {
      const int c = context.channels[i];
      const bool color = known && c >= 0 && c < 3;
      m[i][i] = color ? params().x : 1;
      m[i][4] = color ? (1 - params().x) * mean : 0;
    }
    return MakeAffineStage(AffineClass::kDiagonal, m, {});
  }
};

}  // namespace

OpInfo ContrastInfo() {
  OpInfo info;
  info.name = "contrast";
  info.family = "color";
  info.summary = "Scale R,G,B about a grey: interpolation from it";
  info.help =
      "R,G,B become pivot + X * (v - pivot): above 1 more contrast, between 0 and 1 less, 1 the input bit "
      "for bit. Without a pivot it is the mean luminance of the image (rec709 weights) over its finite "
      "pixels, found in a pass of its own and kept by the operation; an image without finite pixels comes "
      "back unchanged. Alpha is kept. Source: Haeberli and Voorhies 1994.";
  info.bound = "3 u (|X v| + |(1-X) pivot|)";
  info.bound_u = 3;
  info.arguments = {NumberParam("X", "factor, 1 keeps the image")};
  ParamInfo pivot;
  pivot.name = "pivot";
  pivot.type = ParamType::kChoice;
  pivot.default_value = "mean";
  pivot.help = "the grey that stays: a number, or mean for the image's mean luminance";
  pivot.choices = {"mean"};
  pivot.numbers_too = true;
  info.modifiers = {pivot};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ContrastParams p;
    p.x = a.Number("X");
    if (const auto& n = a.Numbers("pivot"); !n.empty()) p.pivot = n[0];
    return Contrast(in[0], p);
  };
  info.examples = {"1.5", "0.5 pivot=0.18", "2 pivot=0.5"};
  info.identity = "1";
  return info;
}

}  // namespace ops

Node Contrast(const Node& image, const ContrastParams& params) {
  ops::RequireFinite("contrast", "factor", params.x);
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [&params](const Node& colors) { return Contrast(colors, params); });
  }
  if (!params.pivot) return graph::MakeNode(std::make_shared<const ops::ContrastOp>(params), {image});
  ops::RequireFinite("contrast", "pivot", *params.pivot);
  return ops::MakeScaleBiasNode("contrast", image, params.x, (1 - params.x) * *params.pivot, params);
}

Node Contrast(const Node& image, double x) {
  return Contrast(image, ContrastParams{.x = x, .pivot = {}, .weights = kRec709});
}

}  // namespace tessera
