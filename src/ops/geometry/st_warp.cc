// Warps by an image of coordinates.
#include <cmath>
#include <cstdint>
#include <string>

#include "ops/geometry/gather_stage.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

class StWarpOp final : public graph::OpWith<StWarpParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "st_warp"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int k) const override { return k == 0; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const StWarpParams& p = params();
    for (const int channel : {p.channel_s, p.channel_t}) {
      if (channel < 0 || channel >= inputs[1].channel_count()) {
        throw DataError("st_warp", "found the channel " + std::to_string(channel) + ", expected one of the " +
                                       std::to_string(inputs[1].channel_count()) +
                                       " of the coordinates, from 0");
      }
    }
    RequireWarpFilter("st_warp", Filter());
    ImageSpec spec = inputs[0];
    spec.data_window = inputs[1].data_window;
    spec.display_window = inputs[1].display_window;
    return spec;
  }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>&, const ImageSpec& in) const override {
    // Coordinates of up to four channels are read where they lie.
    constexpr size_t kMostInPlace = 4;
    std::vector<bool> needed(in.channels.size(), k == 0 || in.channels.size() <= kMostInPlace);
    if (k == 1) {
      needed[static_cast<size_t>(params().channel_s)] = true;
      needed[static_cast<size_t>(params().channel_t)] = true;
    }
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const StWarpParams& p = params();
    const Roi& full = context.inputs[0].display_window;
    GatherSettings s;
    s.map.from_image = true;
    s.map.x_scale = p.flip_s ? -full.width() : full.width();
    s.map.x_offset = p.flip_s ? full.x1 : full.x0;
    s.map.y_scale = p.flip_t ? -full.height() : full.height();
    s.map.y_offset = p.flip_t ? full.y1 : full.y0;
    s.filter = Filter();
    s.wrap_x = p.wrap_s;
    s.wrap_y = p.wrap_t;
    s.renormalize = true;
    s.channel_x = p.channel_s;
    s.channel_y = p.channel_t;
    return MakeGatherStage(s, context);
  }

 private:
  std::string Filter() const { return params().filter.empty() ? "lanczos3" : params().filter; }
};

ParamInfo Channel(const char* name, const char* default_value, const char* help) {
  return IntegerModifier(name, default_value, 0, 1023, help);
}

ParamInfo Flip(const char* name, const char* help) { return FlagModifier(name, help); }

}  // namespace

OpInfo StWarpInfo() {
  OpInfo info;
  info.name = "st_warp";
  info.family = "geometry";
  info.inputs = 2;
  info.summary = "Warp an image by an image of s, t coordinates";
  info.help =
      "IMAGE COORDINATES --st_warp: each result pixel is the image at (s, t), two channels of the "
      "coordinates, from 0 to 1 across the image's display window. The result has the coordinates' windows. "
      "The filter keeps its width of source pixels, as oiiotool's; wrap= names one mode for both axes, "
      "wrap_t= another for t. With black, pixels beyond the edge are left out of the weights; where nothing but "
      "negative lobes is left, the result is black. Without wrap= the picture is oiiotool's: the result has the image's "
      "data window, black where there are no coordinates, and beyond the right and the lower edge one row of black "
      "pixels counts. NaN and infinite coordinates give black.";
  info.help += " The image that is warped is held in memory whole.";
  info.bound = "6 u * (1 + taps / 128) * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  ParamInfo wrap = WrapModifier("wrap", "oiiotool"), wrap_t = WrapModifier("wrap_t", "");
  wrap.choices.insert(wrap.choices.begin(), "oiiotool");
  wrap_t.only_with = "wrap=black|clamp|repeat|mirror";
  info.modifiers = {WarpFilterModifier("lanczos3"),
                    wrap,
                    wrap_t,
                    Channel("chan_s", "0", "channel of s"),
                    Channel("chan_t", "1", "channel of t"),
                    Flip("flip_s", "s counts from the right"),
                    Flip("flip_t", "t counts from below")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    StWarpParams p;
    p.filter = a.Text("filter");
    const bool as_oiiotool = a.Text("wrap") == "oiiotool";
    p.wrap_s = as_oiiotool ? Wrap::kBlack : WrapNamed(a.Text("wrap"));
    p.wrap_t = a.Given("wrap_t") ? WrapNamed(a.Text("wrap_t")) : p.wrap_s;
    p.channel_s = a.Integer("chan_s");
    p.channel_t = a.Integer("chan_t");
    p.flip_s = a.Flag("flip_s");
    p.flip_t = a.Flag("flip_t");
    if (!as_oiiotool) return StWarp(in[0], in[1], p);
    const Roi window = in[0].spec().data_window;
    if (window.empty()) return StWarp(in[0], in[1], p);
    Roi with_edge = window;
    if (with_edge.x1 < INT32_MAX && with_edge.y1 < INT32_MAX) ++with_edge.x1, ++with_edge.y1;
    return Crop(StWarp(Crop(in[0], with_edge), in[1], p), window);
  };
  info.examples = {"filter=triangle wrap=repeat",
                   "",
                   "filter=mitchell wrap=mirror wrap_t=clamp flip_s=1",
                   "filter=box wrap=clamp chan_s=2 flip_t=1",
                   "filter=gaussian",
                   "wrap=black"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node StWarp(const Node& image, const Node& coordinates, const StWarpParams& params) {
  ops::RequireImageWrap("st_warp", params.wrap_s);
  ops::RequireImageWrap("st_warp", params.wrap_t);
  return graph::MakeNode(std::make_shared<const ops::StWarpOp>(params), {image, coordinates});
}

}  // namespace tessera
