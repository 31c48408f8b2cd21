// Brightness: interpolation from black.
#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

namespace tessera {
namespace ops {
OpInfo BrightnessInfo() {
  OpInfo info;
  info.name = "brightness";
  info.family = "color";
  info.summary = "Scale R,G,B: interpolation from black";
  info.help =
      "R,G,B are multiplied by X: 0 is black, 1 the input bit for bit, above 1 brighter. Alpha and further "
      "channels are kept. Source: Haeberli and Voorhies 1994.";
  info.bound = "2 u |X v|";
  info.bound_u = 2;
  info.arguments = {NumberModifier("X", "", "factor, 1 keeps the image")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Brightness(in[0], a.Number("X"));
  };
  info.examples = {"1.25", "0", "-0.5"};
  info.identity = "1";
  return info;
}

}  // namespace ops

Node Brightness(const Node& image, const BrightnessParams& params) {
  ops::RequireFinite("brightness", "factor", params.x);
  return ops::MakeScaleBiasNode("brightness", image, params.x, 0, params);
}

Node Brightness(const Node& image, double x) { return Brightness(image, BrightnessParams{x}); }

}  // namespace tessera
