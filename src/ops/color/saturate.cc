// Saturation: S(s) = s I + (1 - s) 1 w^T.
#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

namespace tessera {
namespace ops {
OpInfo SaturateInfo() {
  OpInfo info;
  info.name = "saturate";
  info.family = "color";
  info.summary = "Change saturation, keeping luminance";
  info.help =
      "R,G,B become S * (R,G,B) + (1 - S) * L, L being the weighted luminance. S = 0 is grey, 1 the input "
      "bit for bit, above 1 oversaturated, below 0 the chroma is reflected through grey. Alpha and further "
      "channels are kept; nothing is clamped. NaN or infinity in R, G or B reaches all three. Source: "
      "Haeberli 1993.";
  info.bound = "8 u max(|R|,|G|,|B|) max(1,|S|); with negative weights times (sum of |weight|) / |sum|";
  info.bound_u = 8;
  info.arguments = {NumberModifier("S", "", "saturation factor, 1 keeps the image")};
  info.modifiers = {WeightsParam()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Saturate(in[0], SaturateParams{a.Number("S"), WeightsOf(a)});
  };
  info.examples = {"1.3", "0", "-1 weights=haeberli", "0.5 weights=yiq", "2 weights=0.2,0.5,0.3"};
  info.identity = "1";
  return info;
}

}  // namespace ops

Node Saturate(const Node& image, const SaturateParams& params) {
  const double s = params.saturation;
  ops::RequireFinite("saturate", "saturation", s);
  const LuminanceWeights n = ops::NormalizedWeights("saturate", params.weights);
  const double w[3] = {n.r, n.g, n.b};
  ops::Matrix3 m;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) m[i][j] = (1 - s) * w[j] + (i == j ? s : 0);
  }
  return ops::MakeRgbNode("saturate", image, m, params);
}

Node Saturate(const Node& image, double saturation, const LuminanceWeights& weights) {
  return Saturate(image, SaturateParams{saturation, weights});
}

}  // namespace tessera
