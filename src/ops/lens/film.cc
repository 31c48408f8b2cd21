// Lateral colour, vignette and grain.
#include <cmath>

#include "base/number_text.h"
#include "ops/grade/grade_ops.h"
#include "ops/lens/lens_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/geometry.h"
#include "tessera/ops/noise.h"

namespace tessera {
namespace ops {
namespace {

// One channel scaled about the frame's centre.
Node Magnified(const Node& channel, const LensFrame& frame, double scale) {
  if (scale == 1) return channel;
  WarpParams warp;
  warp.matrix = {scale, 0, 0, 0, scale, 0, frame.x * (1 - scale), frame.y * (1 - scale), 1};
  warp.filter = "catmull-rom";
  warp.wrap = Wrap::kClamp;
  return Warp(channel, warp);
}

// 1 over the standard deviation of white noise, even from -1 to 1, behind a Gaussian of that sigma.
double InverseDeviation(double sigma) {
  if (sigma == 0) return std::sqrt(3.0);
  double sum = 0, squares = 0;
  const int reach = static_cast<int>(std::ceil(8 * sigma));
  for (int i = -reach; i <= reach; ++i) {
    const double w = std::exp(-i * i / (2 * sigma * sigma));
    sum += w, squares += w * w;
  }
  return std::sqrt(3.0) * sum * sum / squares;  // of both axes
}

}  // namespace

OpInfo AberrationInfo() {
  OpInfo info = MadeRow(
      "lens", "aberration", "Lateral colour of a lens: red and blue of another size",
      "Red and blue are scaled about the centre, so that at half the display window's diagonal from it they move outwards "
      "by RED and BLUE pixels. Negative numbers take away what positive ones make. Filtered by Catmull and Rom's "
      "cubic; beyond the picture its edge goes on. Needs R,G,B; green, alpha and further channels are kept bit for bit.");
  info.help += " Red and blue are held in memory whole.";
  ParamInfo red = NumberModifier("RED", "", -1e6, 1e6, "pixels outwards at the corner"), blue = red;
  blue.name = "BLUE";
  info.arguments = {red, blue};
  info.modifiers = {CentreModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Aberration(in[0], {.red = a.Number("RED"), .blue = a.Number("BLUE"), .centre = CentreOf(a)});
  };
  info.examples = {"1.5 -1", "-0.5 0.25 center=0.4,0.6", "2 0"};
  info.identity = "0 0";
  return info;
}

OpInfo VignetteInfo() {
  OpInfo info = MadeRow(
      "lens", "vignette", "Darker towards the corners, or no longer",
      "R,G,B times (1 + STRENGTH r^2)^-2, r the distance from the centre in half diagonals of the display window: the "
      "fourth power of the cosine, with STRENGTH the squared tangent of the angle that a corner is seen at (0.5 is a "
      "wide lens). remove=1 divides by it. For linear light. Alpha and further channels are kept; 0 returns the input "
      "bit for bit.");
  info.arguments = {NumberModifier("STRENGTH", "", 0, 100, "0 keeps the image")};
  info.modifiers = {FlagModifier("remove", "1: lightens the corners"), CentreModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Vignette(in[0],
                    {.strength = a.Number("STRENGTH"), .remove = a.Flag("remove"), .centre = CentreOf(a)});
  };
  info.examples = {"0.5", "0.3 remove=1", "1 center=0.3,0.4"};
  info.identity = "0";
  return info;
}

OpInfo GrainInfo() {
  OpInfo info = MadeRow(
      "lens", "grain", "Film grain",
      "R,G,B plus STRENGTH * 4 L (1 - L) * noise, L the luminance within [0,1]: most in the middle tones, none in black and "
      "white, for codes as a display shows them. The noise is white, blurred by a Gaussian of size/2 pixels, and has "
      "standard deviation 1; color=1 has one of its own for each of R,G,B. seed={FRAME_NUMBER} makes every frame another. "
      "The picture's place does not matter: a crop has the same grain. Alpha and further channels are kept; 0 returns the "
      "input bit for bit. For sizes of 4 and more the noise is held in memory whole.");
  info.arguments = {NumberModifier("STRENGTH", "", 0, 100, "standard deviation in the middle tones")};
  info.modifiers = {NumberModifier("size", "1.5", 0, 50, "pixels across a grain; 0 is single pixels"),
                    FlagModifier("color", "1: grain of three colours"),
                    IntegerModifier("seed", "0", 0, 4294967295.0, "other grain")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Grain(in[0], {.strength = a.Number("STRENGTH"),
                         .size = a.Number("size"),
                         .color = a.Flag("color"),
                         .seed = static_cast<uint32_t>(a.Number("seed"))});
  };
  info.examples = {"0.06", "0.1 size=0 color=1", "0.04 size=2.5 seed=7"};
  info.identity = "0";
  return info;
}

}  // namespace ops

Node Aberration(const Node& image, const AberrationParams& p) {
  if (image.spec().channel_count() < 3)
    throw DataError("aberration", "found " + std::to_string(image.spec().channel_count()) +
                                      " channels, expected R,G,B at least");
  const ops::LensFrame frame = ops::FrameOf(image.spec(), p.centre);
  for (const double pixels : {p.red, p.blue}) {
    if (std::fabs(pixels) < 0.9 * frame.unit || pixels == 0) continue;
    throw Error("aberration", "found " + base::NumberText(pixels) +
                                  " pixels, expected less than nine tenths of " +
                                  base::NumberText(frame.unit) + ", half the diagonal");
  }
  if (p.red == 0 && p.blue == 0) return image;
  const Node red = ops::Magnified(ops::Picked(image, {0}), frame, 1 + p.red / frame.unit);
  const Node blue = ops::Magnified(ops::Picked(image, {2}), frame, 1 + p.blue / frame.unit);
  return ops::WithColors(image, AppendChannels(AppendChannels(red, ops::Picked(image, {1})), blue));
}

Node Vignette(const Node& image, const VignetteParams& p) {
  if (!(p.strength >= 0 && p.strength <= 100))
    throw Error("vignette", "found " + base::NumberText(p.strength) + ", expected 0 to 100");
  if (p.strength == 0 || image.spec().data_window.empty()) return image;
  return AsColors(image, [&](const Node& colors) {
    const ops::LensFrame frame = ops::FrameOf(colors.spec(), p.centre);
    const Node squares = ops::SquaresOf(ops::PlacesOf(colors.spec(), frame));
    const Node factor =
        PowerConstant(AddConstant(MulConstant(squares, {p.strength}), {1}), {p.remove ? 2.0 : -2.0});
    return ops::WithColors(colors, Mul(ops::Picked(colors, {0, 1, 2}), factor));
  });
}

Node Grain(const Node& image, const GrainParams& p) {
  if (!(p.strength >= 0 && p.strength <= 100) || !(p.size >= 0 && p.size <= 50)) {
    throw Error("grain", "found strength " + base::NumberText(p.strength) + " and size " +
                             base::NumberText(p.size) + ", expected 0 to 100 and 0 to 50");
  }
  if (p.strength == 0 || image.spec().data_window.empty()) return image;
  return AsColors(image, [&](const Node& colors) {
    ImageSpec spec = colors.spec();
    spec.channels = p.color ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"Y"};
    spec.alpha = -1;
    spec.type = PixelType::kFloat;
    NoiseParams white;
    white.kind = NoiseKind::kWhite;
    white.frequency = 0;
    white.seed = p.seed;
    white.output = p.color ? NoiseOutput::kColor : NoiseOutput::kValue;
    Node noise = Noise(spec, white);
    if (p.size > 0) noise = GaussianBlur(noise, p.size / 2);
    const Node rgb = ops::Picked(colors, {0, 1, 2});
    const Node grey = Clamp(ops::Picked(Luminance(rgb), {0}), {.min = {0}, .max = {1}});
    const double scale = 4 * p.strength * ops::InverseDeviation(p.size / 2);
    const Node amount = MulConstant(Mul(grey, AddConstant(MulConstant(grey, {-1}), {1})), {scale});
    const Node grain = p.color ? Mul(noise, amount) : ops::Picked(Mul(noise, amount), {0, 0, 0});
    return ops::WithColors(colors, Add(rgb, grain));
  });
}

}  // namespace tessera
