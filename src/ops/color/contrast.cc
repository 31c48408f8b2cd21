// Contrast: interpolation from a constant grey, given or the mean luminance of the image.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "ops/arithmetic/operands.h"
#include "ops/color/color_ops.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"

namespace tessera {
namespace ops {
namespace {

// The form whose pivot is the second image's one sample, the mean luminance.
class ContrastOp final : public graph::OpWith<ContrastParams> {
 public:
  explicit ContrastOp(ContrastParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "contrast"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  bool IsIdentity() const override { return params().x == 1; }
  bool NeedsWhole(int k) const override { return k == 1; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    const ConstImageView& pivot = context.whole[1];
    const double mean = *reinterpret_cast<const float*>(pivot.At(0, 0));
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
      "back unchanged. Alpha is kept. Source: Haeberli and Voorhies 1994.\n"
      "With any of black= white= min= max= scontrast= sthresh= clamp= it is oiiotool's --contrast, has no X, "
      "and takes every channel, alpha too: r = (v - black) / (white - black), bent into a sigmoid of slope "
      "scontrast that is steepest at sthresh, gives min + r (max - min). Each is one number, or one per "
      "channel; channels beyond a list have its last number. Where black is white the channel is min below "
      "it and max from there on (oiiotool: only if all channels are so, else infinite). As soon as one "
      "scontrast is not 1 every channel is bent; 0 is the line (oiiotool: NaN). clamp=1 limits the result to "
      "[min, max].";
  info.bound =
      "3 u (|X v| + |(1-X) pivot|); 3 u (|result| + |min| + its terms), terms of a sigmoid divided by 2^20";
  info.bound_u = 3;
  constexpr char kOurs[] = "!black !white !min !max !scontrast !sthresh !clamp";
  ParamInfo x = NumberModifier("X", "", "factor, 1 keeps the image");
  x.default_value = "1";
  x.only_with = kOurs;
  info.arguments = {x};
  ParamInfo pivot = OnlyWith(
      kOurs, ChoiceModifier("pivot", {"mean"},
                            "the grey that stays: a number, or mean for the image's mean luminance"));
  pivot.numbers_too = true;
  const auto list = [](const char* name, const char* value, const char* help) {
    ParamInfo param = ConstantsArgument("");
    param.name = name, param.default_value = value, param.help = help;
    return param;
  };
  ParamInfo limit = FlagModifier("clamp", "1 limits the result to [min, max]");
  info.modifiers = {pivot,
                    list("black", "0", "one number, or one per channel, that becomes min"),
                    list("white", "1", "one number, or one per channel, that becomes max"),
                    list("min", "0", "what black becomes"),
                    list("max", "1", "what white becomes"),
                    list("scontrast", "1", "slope of the sigmoid; 1 for none"),
                    list("sthresh", "0.5", "where the sigmoid is steepest, 0 at black and 1 at white"),
                    limit};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    constexpr const char* kRemap[] = {"black", "white", "min", "max", "scontrast", "sthresh", "clamp"};
    if (std::any_of(std::begin(kRemap), std::end(kRemap), [&](const char* name) { return a.Given(name); })) {
      return ContrastRemap(in[0], {.black = a.Numbers("black"),
                                   .white = a.Numbers("white"),
                                   .min = a.Numbers("min"),
                                   .max = a.Numbers("max"),
                                   .scontrast = a.Numbers("scontrast"),
                                   .sthresh = a.Numbers("sthresh"),
                                   .clamp = a.Flag("clamp")});
    }
    ContrastParams p;
    p.x = a.Number("X");
    if (const auto& n = a.Numbers("pivot"); !n.empty()) p.pivot = n[0];
    return Contrast(in[0], p);
  };
  info.examples = {"1.5",
                   "0.5 pivot=0.18",
                   "2 pivot=0.5",
                   "black=0.1 white=0.75",
                   "black=1 white=0 clamp=1",
                   "scontrast=5 sthresh=0.4,0.5,0.6",
                   "black=0.1,0.3 white=0.9,0.3,0.8 min=-0.5,0.25 max=1.5 scontrast=1,2,0",
                   "black=0.5 white=0.5 min=0.2 max=0.7"};
  info.identity = "1";
  return info;
}

}  // namespace ops

Node Contrast(const Node& image, const ContrastParams& params) {
  ops::RequireFinite("contrast", "factor", params.x);
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [&params](const Node& colors) { return Contrast(colors, params); });
  }
  if (!params.pivot) {
    const LuminanceWeights w = ops::NormalizedWeights("contrast", params.weights);
    std::vector<double> weights(image.spec().channels.size());
    weights[0] = w.r, weights[1] = w.g, weights[2] = w.b;
    return graph::MakeNode(std::make_shared<const ops::ContrastOp>(params),
                           {image, Mean(ChannelSum(image, {.weights = weights}))});
  }
  ops::RequireFinite("contrast", "pivot", *params.pivot);
  return ops::MakeScaleBiasNode("contrast", image, params.x, (1 - params.x) * *params.pivot, params);
}

Node Contrast(const Node& image, double x) {
  return Contrast(image, ContrastParams{.x = x, .pivot = {}, .weights = kRec709});
}

}  // namespace tessera
