// Fitting a picture into a window with its aspect kept: a resize, or a warp to a fraction of a pixel.
#include <memory>
#include <string>

#include "ops/geometry/gather_stage.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {
namespace {

constexpr int kLongestSide = 1 << 24;

std::string FilterOf(const FitParams& p, const Roi& from) {
  if (!p.filter.empty()) return p.filter;
  return p.width > from.width() || p.height > from.height() ? "blackman-harris" : "lanczos3";
}

bool FillsHeight(const FitParams& p, const Roi& from) {
  if (p.mode != FitMode::kLetterbox) return p.mode == FitMode::kHeight;
  return int64_t{p.width} * from.height() >= int64_t{p.height} * from.width();
}

// As the reference knows it: the picture times `scale` lies in the window's middle.
class ExactFitOp final : public graph::OpWith<FitParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "fit"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int) const override { return true; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const FitParams& p = params();
    RequireWarpFilter("fit", FilterOf(p, inputs[0].display_window));
    ImageSpec spec = inputs[0];
    spec.data_window = spec.display_window = {p.x, p.y, p.x + p.width, p.y + p.height};
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const FitParams& p = params();
    const Roi& from = context.inputs[0].display_window;
    const double inverse = FillsHeight(p, from) ? static_cast<double>(from.height()) / p.height
                                                : static_cast<double>(from.width()) / p.width;
    GatherSettings s;
    // Middles meet.
    s.map.m[0] = s.map.m[4] = inverse;
    s.map.m[6] = 0.5 * (double{1} * from.x0 + from.x1) - (p.x + 0.5 * p.width) * inverse;
    s.map.m[7] = 0.5 * (double{1} * from.y0 + from.y1) - (p.y + 0.5 * p.height) * inverse;
    s.map.reduce = true;
    s.renormalize = true;
    s.filter = FilterOf(p, from);
    return MakeGatherStage(s, context);
  }
};

// The size that keeps the aspect, as oiiotool in float.
ResizeParams SizeWithin(const FitParams& p, const Roi& from) {
  ResizeParams size;
  size.width = p.width, size.height = p.height, size.x = p.x, size.y = p.y;
  const float aspect = static_cast<float>(from.width()) / static_cast<float>(from.height());
  if (FillsHeight(p, from)) {
    size.width = std::max(1, static_cast<int>(static_cast<float>(p.height) * aspect + 0.5f));
  } else {
    size.height = std::max(1, static_cast<int>(static_cast<float>(p.width) / aspect + 0.5f));
  }
  size.filter = FilterOf(p, from);
  return size;
}

Node FitWhole(const Node& image, const FitParams& p) {
  const Node framed = CropToDisplay(image);
  const Roi& from = framed.spec().display_window;
  const ResizeParams size = SizeWithin(p, from);
  const Roi window{p.x, p.y, p.x + p.width, p.y + p.height};
  const Node sized =
      from == Roi{p.x, p.y, p.x + size.width, p.y + size.height} ? framed : Resize(framed, size);
  const Node placed = Move(sized, {(p.width - size.width) / 2, (p.height - size.height) / 2});
  const Node shown = WithDisplayWindow(placed, window);
  return p.pad ? CropToDisplay(shown) : shown;
}

}  // namespace

OpInfo FitInfo() {
  OpInfo info;
  info.name = "fit";
  info.family = "geometry";
  info.summary = "Resize to fit into a window, the aspect kept";
  info.help =
      "GEOM is WxH or WxH+X+Y, the result's display window. The picture, as large as may be, lies in its middle; "
      "fillmode=width fills the width and fillmode=height the height, whatever sticks out or is left over. The data "
      "window is the picture's; with pad=1 it is the whole window, zero beside the picture. The size is rounded to "
      "whole pixels, with exact=1 not (then the data window is the whole window, pixels beyond the picture's edge are "
      "left out of the weights, and the image is held in memory whole). Without filter= it is lanczos3, or "
      "blackman-harris where the window is wider or higher than the picture. As oiiotool, except that where it "
      "enlarges a picture into a window of another aspect or with exact=1, oiiotool's filter is wider than its name "
      "says, and that it loses the origin of windows off (0, 0).";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  info.arguments = {TextModifier("GEOM", "the window, such as 1920x1080")};
  info.modifiers = {FilterModifier("", "the filter"),
                    FlagModifier("pad", "1: the data window is the whole window"),
                    ChoiceModifier("fillmode", {"letterbox", "width", "height"}, "what is filled"),
                    FlagModifier("exact", "1: to a fraction of a pixel"), HighlightModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const Roi window = ParseGeometry(a.Text("GEOM"), in[0].spec().display_window);
    FitParams p;
    p.width = window.width(), p.height = window.height(), p.x = window.x0, p.y = window.y0;
    const std::string& mode = a.Text("fillmode");
    p.mode = mode == "width" ? FitMode::kWidth : mode == "height" ? FitMode::kHeight : FitMode::kLetterbox;
    p.pad = a.Flag("pad");
    p.exact = a.Flag("exact");
    if (a.Given("filter")) p.filter = a.Text("filter");
    p.compress_highlights = a.Flag("highlightcomp");
    return Fit(in[0], p);
  };
  info.examples = {"60x60",
                   "31x47 pad=1",
                   "50x20 fillmode=width filter=triangle",
                   "23x40 exact=1",
                   "90x30 exact=1 filter=mitchell fillmode=height",
                   "40x11 fillmode=height pad=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Fit(const Node& image, const FitParams& params) {
  const Roi& from = image.spec().display_window;
  if (params.width < 1 || params.height < 1 || params.width > ops::kLongestSide ||
      params.height > ops::kLongestSide || params.x > INT32_MAX - params.width ||
      params.y > INT32_MAX - params.height) {
    throw Error("fit", "found " + std::to_string(params.width) + "x" + std::to_string(params.height) +
                           ", expected a window with sides from 1 to " + std::to_string(ops::kLongestSide));
  }
  if (from.empty()) throw DataError("fit", "found an image without a display window, expected one");
  if (image.spec().data_window.empty())  // of nothing nothing is shown
    return WithDisplayWindow(image, {params.x, params.y, params.x + params.width, params.y + params.height});
  if (params.compress_highlights) {
    FitParams plain = params;
    plain.compress_highlights = false;
    return ops::ExpandRange(Fit(ops::CompressRange(image), plain));
  }
  if (!params.exact) return ops::FitWhole(image, params);
  return graph::MakeNode(std::make_shared<const ops::ExactFitOp>(params), {CropToDisplay(image)});
}

}  // namespace tessera
