// Displacement by an image.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/number_text.h"
#include "ops/geometry/filters.h"
#include "ops/geometry/gather_stage.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

class DistortOp final : public graph::OpWith<DistortParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "distort"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int k) const override { return k == 0; }
  bool IsIdentity() const override {
    return params().amount == 0 && FindFilter("distort", Filter()).Interpolates();
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    if (!(std::fabs(params().amount) <= 1e9) || !std::isfinite(params().centre)) {
      throw Error("distort", "found an amount of " + base::NumberText(params().amount) +
                                 " pixels, expected at most 1e9");
    }
    RequireWarpFilter("distort", Filter());
    graph::RequireSameWindow("distort", inputs);
    if (params().channel_x < 0 || params().channel_y < 0 || params().channel_x >= inputs[1].channel_count()) {
      throw DataError("distort", "found a channel that the displacement image lacks, expected 0 to " +
                                     std::to_string(inputs[1].channel_count() - 1));
    }
    return inputs[0];
  }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), k == 0);
    if (k == 1) {
      needed[static_cast<size_t>(params().channel_x)] = true;
      needed[static_cast<size_t>(ChannelY(in))] = true;
    }
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const DistortParams& p = params();
    GatherSettings s;
    s.map.from_image = true;
    s.map.x_scale = s.map.y_scale = p.amount;
    s.map.x_per_pixel = s.map.y_per_pixel = 1;
    s.map.x_offset = s.map.y_offset = -p.amount * p.centre;
    s.filter = Filter();
    s.wrap_x = s.wrap_y = p.wrap;
    s.renormalize = false;
    s.channel_x = p.channel_x;
    s.channel_y = ChannelY(context.inputs[1]);
    return MakeGatherStage(s, context);
  }

 private:
  std::string Filter() const { return params().filter.empty() ? "triangle" : params().filter; }
  int ChannelY(const ImageSpec& in) const { return std::min(params().channel_y, in.channel_count() - 1); }
};

}  // namespace

OpInfo DistortInfo() {
  OpInfo info;
  info.name = "distort";
  info.family = "geometry";
  info.inputs = 2;
  info.summary = "Displace an image by another, such as noise";
  info.help =
      "IMAGE DISPLACEMENT --distort AMOUNT: the result at (x, y) is the image at (x + AMOUNT (d_x - centre), "
      "y + AMOUNT (d_y - centre)), d_x and d_y the displacement image's first two channels (the first twice "
      "where there is one alone). AMOUNT is in pixels. NaN displacements give black.";
  info.help += " The image that is warped is held in memory whole.";
  info.bound = "6 u * (1 + taps / 128) * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  ParamInfo amount = NumberModifier("AMOUNT", "", -1e9, 1e9, "pixels per unit of displacement");
  ParamInfo centre = NumberModifier("centre", "0.5", "the displacement value that moves nothing");
  info.arguments = {amount};
  info.modifiers = {WarpFilterModifier("triangle"), WrapModifier("wrap", "clamp"), centre};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    DistortParams p;
    p.amount = a.Number("AMOUNT");
    p.centre = a.Number("centre");
    p.filter = a.Text("filter");
    p.wrap = WrapNamed(a.Text("wrap"));
    return Distort(in[0], in[1], p);
  };
  info.examples = {"8", "-3.5 filter=lanczos3 wrap=mirror", "40 filter=catmull-rom wrap=repeat centre=0"};
  info.identity = "0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Distort(const Node& image, const Node& displacement, const DistortParams& params) {
  ops::RequireImageWrap("distort", params.wrap);
  return graph::MakeNode(std::make_shared<const ops::DistortOp>(params), {image, displacement});
}

}  // namespace tessera
