// Moving the content by fractions of a pixel.
#include <cmath>
#include <string>

#include "base/number_text.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"

namespace tessera::ops {
namespace {

constexpr double kFarthest = 1 << 24;

class ShiftOp final : public graph::OpWith<ShiftParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "shift"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override { return params().x == 0 && params().y == 0; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    for (const double v : {params().x, params().y}) {
      if (!(std::fabs(v) <= kFarthest)) {
        throw Error("shift", "found " + base::NumberText(v) + ", expected a distance of at most 2^24 pixels");
      }
    }
    if (!FindFilter("shift", params().filter).separable) {
      throw Error("shift", "found the filter \"" + params().filter + "\", expected a separable one");
    }
    return inputs[0];
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const Roi& w = context.output.data_window;
    SeparableMap map;
    map.x = {w.x0, w.x1, w.x0, w.x1, -params().x, 1, 1};
    map.y = {w.y0, w.y1, w.y0, w.y1, -params().y, 1, 1};
    map.filter = &FindFilter("shift", params().filter);
    map.wrap = params().wrap;
    // A whole shift is a shift, also with a filter that blurs.
    if (params().x == std::floor(params().x) && params().y == std::floor(params().y)) {
      map.filter = &FindFilter("shift", "box");
    }
    return MakeSeparableStage(map);
  }
};

}  // namespace

OpInfo ShiftInfo() {
  OpInfo info;
  info.name = "shift";
  info.family = "geometry";
  info.summary = "Move the content by fractions of a pixel";
  info.help =
      "The content moves X pixels to the right and Y down, the windows stay. Whole numbers move pixels bit "
      "for bit; fractions interpolate with the filter. Beyond the image wrap= decides. NaN spreads over "
      "the filter's width.";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  info.arguments = {NumbersModifier("X,Y", "", 2, -kFarthest, kFarthest, "pixels to the right and down")};
  info.modifiers = {WarpFilterModifier("lanczos3"), WrapModifier("wrap", "clamp")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::vector<double>& by = a.Numbers("X,Y");
    return Shift(in[0], {by[0], by[1], a.Text("filter"), WrapNamed(a.Text("wrap"))});
  };
  info.examples = {"0.25,-0.4", "3,-2 wrap=repeat", "-7.5,0.5 filter=triangle wrap=mirror",
                   "0,0.125 filter=mitchell wrap=black", "100,-80.5 wrap=repeat"};
  info.identity = "0,0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Shift(const Node& image, const ShiftParams& params) {
  ops::RequireImageWrap("shift", params.wrap);
  return graph::MakeNode(std::make_shared<const ops::ShiftOp>(params), {image});
}

}  // namespace tessera
