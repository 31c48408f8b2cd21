// Grey-scale morphology: opening, closing, gradient, top hat and black hat, of dilation and erosion.
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "ops/filter/filter_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {
namespace {

const std::vector<std::string> kNames = {"open", "close", "gradient", "tophat", "blackhat"};

}  // namespace

OpInfo MorphologyInfo() {
  OpInfo info;
  info.name = "morphology";
  info.family = "filter";
  info.summary = "Opening, closing, gradient, top hat, black hat";
  info.help =
      "Of --dilate and --erode with a window of WxH, each channel for itself, alpha too: open is the erosion "
      "dilated (light spots that the window does not fit into go), close the dilation eroded (dark ones go), "
      "gradient dilation - erosion, tophat A - open (the light spots alone), blackhat close - A. W and H are "
      "odd, up to 255, so that nothing moves. Pixels beyond the image take no part, as OpenCV's "
      "morphologyEx.";
  info.bound = "open, close: exact; differences: 2 u * (|a| + |b|)";
  info.bound_u = 2;
  info.arguments = {ChoiceArgument("OPERATOR", kNames, "which of them"),
                    TextModifier("SIZE", "WxH in pixels, odd")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const auto at = std::find(kNames.begin(), kNames.end(), a.Text("OPERATOR")) - kNames.begin();
    return Morphology(in[0], static_cast<MorphologyOperator>(at), WindowSize("morphology", a));
  };
  info.examples = {"open 3x3", "close 5x1", "gradient 3x5", "tophat 7x7", "blackhat 1x9"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Morphology(const Node& image, MorphologyOperator op, const RankParams& window) {
  const auto fits = [](int side) { return side >= 1 && side <= 255 && side % 2 == 1; };
  if (!fits(window.width) || !fits(window.height)) {
    throw Error("morphology", "found a window of " + std::to_string(window.width) + "x" +
                                  std::to_string(window.height) + ", expected odd sides of 1 to 255");
  }
  const auto opened = [&] { return Dilate(Erode(image, window), window); };
  const auto closed = [&] { return Erode(Dilate(image, window), window); };
  switch (op) {
    case MorphologyOperator::kOpen:
      return opened();
    case MorphologyOperator::kClose:
      return closed();
    case MorphologyOperator::kGradient:
      return Sub(Dilate(image, window), Erode(image, window));
    case MorphologyOperator::kTopHat:
      return Sub(image, opened());
    case MorphologyOperator::kBlackHat:
      break;
  }
  return Sub(closed(), image);
}

}  // namespace tessera
