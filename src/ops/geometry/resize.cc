// Resizing to a geometry.
#include <algorithm>
#include <string>

#include "ops/codes.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/geometry/resize_window.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {
namespace {

std::string FilterOf(const ResizeParams& p, const Roi& from) {
  if (!p.filter.empty()) return p.filter;
  return p.width > from.width() || p.height > from.height() ? "blackman-harris" : "lanczos3";
}

class ResizeOp final : public graph::OpWith<ResizeParams> {
 public:
  // `data`: what is resized of the input's data window.
  ResizeOp(const ResizeParams& params, const Roi& data, PixelType codes)
      : OpWith(params), data_(data), codes_(codes) {}
  std::string Name() const override { return "resize"; }
  std::string Describe() const override {
    return "resize " + std::to_string(params().width) + "x" + std::to_string(params().height);
  }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    const ResizeParams& p = params();
    const Roi display = ResizedDisplay("resize", {p.x, p.y, p.width, p.height});
    FindFilter("resize", FilterOf(p, spec.display_window));
    const Roi full = spec.display_window.empty() ? spec.data_window : spec.display_window;
    spec.display_window = display;
    spec.data_window = data_.empty()   ? Roi{}
                       : data_ == full ? spec.display_window
                                       : ScaledWindow("resize", data_, full, display);
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const ImageSpec& in = context.inputs[0];
    const Roi& out = context.output.data_window;
    const Roi& from = in.display_window.empty() ? in.data_window : in.display_window;
    const Roi& to = context.output.display_window;
    SeparableMap map;
    const auto axis = [](int o0, int o1, int s0, int s1, int from0, int from_size, int to0, int to_size) {
      AxisMap m{o0, o1, s0, s1, 0, 1, 1};
      m.step = static_cast<double>(from_size) / to_size;
      m.origin = from0 - to0 * m.step;
      m.scale = std::min(1.0, static_cast<double>(to_size) / from_size);
      return m;
    };
    const Roi& source = in.data_window;
    map.x = axis(out.x0, out.x1, source.x0, source.x1, from.x0, from.width(), to.x0, to.width());
    map.y = axis(out.y0, out.y1, source.y0, source.y1, from.y0, from.height(), to.y0, to.height());
    // As oiiotool, an axis that keeps its size is not filtered.
    map.filter = &FindFilter("resize", FilterOf(params(), from));
    if (from.width() == to.width() && from.height() == to.height()) map.filter = &FindFilter("resize", "box");
    return MakeSeparableStage(map, codes_);
  }

 private:
  Roi data_;
  PixelType codes_;  // of the image, whose stage may be given them as floats
};

}  // namespace

OpInfo ResizeInfo() {
  OpInfo info;
  info.name = "resize";
  info.family = "geometry";
  info.summary = "Resize to a geometry with a filter";
  info.help =
      "GEOM is WxH, WxH+X+Y, W% or W%xH%; a side of 0 keeps the aspect. The display window takes that size "
      "and keeps its origin unless one is given, and the data window is scaled along. Beyond its edge the "
      "rest of the display window is black, and beyond both the edge pixels are repeated. Weights are "
      "computed in double at exact positions; the filter spans pixels of the coarser of the two images on "
      "each axis. Without a filter it is lanczos3, or blackman-harris where a side grows, and an image that "
      "keeps its size keeps its bits: as oiiotool. NaN spreads to pixels whose filter gives it weight. "
      "Where a box halves both sides, a pixel of 8- or 16-bit codes is the exact mean of four of them, "
      "rounded half to even. A pixel that lies on a box's very edge counts for both its neighbours; oiiotool, "
      "which finds places in float, leaves it out of one of them where rounding falls so.";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  info.arguments = {TextModifier("GEOM", "the new size, such as 1920x1080, 50% or 1280x0")};
  info.modifiers = {FilterModifier("", "the filter"), HighlightModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const ImageSpec& spec = in[0].spec();
    ResizeParams p =
        ParseResize(a.Text("GEOM"), spec.display_window.empty() ? spec.data_window : spec.display_window);
    if (a.Given("filter")) p.filter = a.Text("filter");
    p.compress_highlights = a.Flag("highlightcomp");
    return Resize(in[0], p);
  };
  info.identity = "100%";
  info.examples = {"50%",
                   "50% filter=box",
                   "50% filter=mitchell",
                   "61x17 filter=triangle",
                   "37%x210%",
                   "150x0+3-4 filter=catmull-rom",
                   "40x11 filter=disk",
                   "2x1 filter=gaussian"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Resize(const Node& image, const ResizeParams& params) {
  if (params.compress_highlights) {
    ResizeParams plain = params;
    plain.compress_highlights = false;
    return ops::ExpandRange(Resize(ops::CompressRange(image), plain));
  }
  const Roi& data = image.spec().data_window;
  const Roi framed = data.empty() ? data : Union(data, image.spec().display_window);
  return graph::MakeNode(std::make_shared<const ops::ResizeOp>(params, data, ops::CodesOf(image)),
                         {framed == data ? image : Crop(image, framed)});
}

}  // namespace tessera
