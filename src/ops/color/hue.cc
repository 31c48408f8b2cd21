// Hue rotation about the grey axis, keeping luminance (sheared) or not.
#include <algorithm>
#include <numbers>
#include <string>
#include <vector>

#include "base/turn.h"
#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

namespace tessera {
namespace ops {
namespace {

// H = 1 w^T + cos t P + sin t P [g]x with P = I - 1 w^T; with w = 1/3 this is the plain rotation.
Matrix3 HueMatrix(double degrees, const double (&w)[3]) {
  const auto [cos, sin] = base::TurnOf(degrees);
  const double k = 1 / std::numbers::sqrt3;
  const double cross[3][3] = {{0, -k, k}, {k, 0, -k}, {-k, k, 0}};
  Matrix3 h;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      double turned = cross[i][j];  // (P [g]x)_ij
      for (size_t l = 0; l < 3; ++l) turned -= w[l] * cross[l][j];
      h[i][j] = (1 - cos) * w[j] + (i == j ? cos : 0) + sin * turned;
    }
  }
  return h;
}

// Filter Effects Module Level 1, 9.6: feColorMatrix of type hueRotate.
Matrix3 CssHueMatrix(double degrees) {
  constexpr double kGrey[3] = {0.213, 0.715, 0.072};
  constexpr double kSine[3][3] = {{-0.213, -0.715, 0.928}, {0.143, 0.140, -0.283}, {-0.787, 0.715, 0.072}};
  const auto [cos, sin] = base::TurnOf(degrees);
  Matrix3 h;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) h[i][j] = (1 - cos) * kGrey[j] + (i == j ? cos : 0) + sin * kSine[i][j];
  }
  return h;
}

const std::vector<std::string> kPreserves = {"luminance", "none", "css"};  // in the order of HuePreserve

}  // namespace

OpInfo HueInfo() {
  OpInfo info;
  info.name = "hue";
  info.family = "color";
  info.summary = "Rotate hue about the grey axis";
  info.help =
      "R,G,B are turned by DEG degrees about the grey axis; +120 turns red to green. preserve=luminance (the "
      "default) shears so that the weighted luminance stays: H = 1 w^T + cos P + sin P [g]x, P = I - 1 w^T; "
      "preserve=none is the plain rotation, which keeps R+G+B; preserve=css is the matrix of SVG's hueRotate "
      "and CSS' hue-rotate(), whose weights are 0.213, 0.715, 0.072 and which both of them follow by "
      "--clamp:min=0:max=1 and apply to unpremultiplied colours. Greys stay grey. The angle is reduced "
      "modulo 360 in double; 0 and 360 return the input bit for bit. Results may leave [0,1]; clamp at the "
      "end, not between. Alpha is kept; NaN or infinity in R, G or B reaches all three. Source: Haeberli "
      "1993; McReynolds et al. 1997, 12.2.4 (with the shear transposed); W3C Filter Effects 1, "
      "feColorMatrix.";
  info.bound =
      "8 u max(|R|,|G|,|B|); with negative weights times (sum of |weight|) / |sum|; css: 8 u (sum of |m v|)";
  info.bound_u = 8;
  info.arguments = {NumberModifier("DEG", "", "angle in degrees")};
  ParamInfo preserve;
  preserve.name = "preserve";
  preserve.type = ParamType::kChoice;
  preserve.default_value = "luminance";
  preserve.help = "what the rotation keeps";
  preserve.choices = kPreserves;
  ParamInfo weights = WeightsParam();
  weights.only_with = "preserve=luminance";
  info.modifiers = {preserve, weights};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const auto preserve = std::find(kPreserves.begin(), kPreserves.end(), a.Text("preserve"));
    return RotateHue(
        in[0], {a.Number("DEG"), static_cast<HuePreserve>(preserve - kPreserves.begin()), WeightsOf(a)});
  };
  info.examples = {
      "30", "-75 weights=haeberli", "120 preserve=none", "180 weights=yiq", "75 preserve=css", "1000000030"};
  info.identity = "360";
  return info;
}

}  // namespace ops

Node RotateHue(const Node& image, const HueParams& params) {
  ops::RequireFinite("hue", "angle", params.degrees);
  const LuminanceWeights n = ops::NormalizedWeights("hue", params.weights);
  const double w[3] = {n.r, n.g, n.b}, third[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  const ops::Matrix3 m =
      params.preserve == HuePreserve::kCss
          ? ops::CssHueMatrix(params.degrees)
          : ops::HueMatrix(params.degrees, params.preserve == HuePreserve::kNone ? third : w);
  return ops::MakeRgbNode("hue", image, m, params);
}

Node RotateHue(const Node& image, Degrees angle, const LuminanceWeights& weights) {
  return RotateHue(image, HueParams{angle.value, HuePreserve::kLuminance, weights});
}

}  // namespace tessera
