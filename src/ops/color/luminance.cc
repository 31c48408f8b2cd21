// Luminance: three equal channels w . (R,G,B).
#include "ops/color/color_ops.h"

namespace tessera {
namespace ops {
OpInfo LuminanceInfo() {
  OpInfo info;
  info.name = "luminance";
  info.family = "color";
  info.summary = "Grey image of the weighted luminance";
  info.help =
      "R = G = B = wR R + wG G + wB B; alpha and further channels are kept. The weights are divided by their "
      "sum; a sum near 0 is refused. Source: Haeberli 1993.";
  info.bound = "4 u (|wR R| + |wG G| + |wB B|)";
  info.bound_u = 4;
  info.modifiers = {WeightsParam()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Luminance(in[0], {WeightsOf(a)});
  };
  info.examples = {"", "weights=haeberli", "weights=yiq", "weights=1,1,1"};
  return info;
}

}  // namespace ops

Node Luminance(const Node& image, const LuminanceParams& params) {
  const LuminanceWeights w = ops::NormalizedWeights("luminance", params.weights);
  return ops::MakeRgbNode("luminance", image, {{{w.r, w.g, w.b}, {w.r, w.g, w.b}, {w.r, w.g, w.b}}}, params);
}

}  // namespace tessera
