// Resizing to a geometry.
#include <algorithm>
#include <charconv>
#include <climits>
#include <cmath>
#include <string>

#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/geometry/separable.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {
namespace {

constexpr int kLongestSide = 1 << 24;

std::string FilterOf(const ResizeParams& p, const Roi& from) {
  if (!p.filter.empty()) return p.filter;
  return p.width > from.width() || p.height > from.height() ? "blackman-harris" : "lanczos3";
}

[[noreturn]] void RefuseWindow() {
  throw Error("resize",
              "found a size or an origin that leads beyond 2^31, expected a window between -2^31 and 2^31");
}

// The data window of the result, as oiiotool in float: the origin is rounded down, the size up.
Roi ScaledWindow(Roi w, const Roi& full, const ResizeParams& p) {
  const auto scaled = [](int& v0, int& v1, int from, int size, int to, int new_size) {
    const float ratio = static_cast<float>(new_size) / static_cast<float>(size);
    const double length = std::ceil(static_cast<float>(v1 - v0) * ratio);
    const double start = to + double{std::floor(static_cast<float>(v0 - from) * ratio)};
    if (!(std::fabs(start) < INT_MAX) || !(start + length < INT_MAX)) RefuseWindow();
    v0 = static_cast<int>(start);
    v1 = static_cast<int>(start + length);
  };
  scaled(w.x0, w.x1, full.x0, full.width(), p.x, p.width);
  scaled(w.y0, w.y1, full.y0, full.height(), p.y, p.height);
  w.x1 = std::max(w.x1, w.x0 + 1);
  w.y1 = std::max(w.y1, w.y0 + 1);
  return w;
}

class ResizeOp final : public graph::OpWith<ResizeParams> {
 public:
  // `data`: what is resized of the input's data window.
  ResizeOp(const ResizeParams& params, const Roi& data) : OpWith(params), data_(data) {}
  std::string Name() const override { return "resize"; }
  std::string Describe() const override {
    return "resize " + std::to_string(params().width) + "x" + std::to_string(params().height);
  }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    const ResizeParams& p = params();
    if (p.width < 1 || p.height < 1 || p.width > kLongestSide || p.height > kLongestSide) {
      throw Error("resize", "found " + std::to_string(p.width) + "x" + std::to_string(p.height) +
                                ", expected sides from 1 to " + std::to_string(kLongestSide));
    }
    if (p.x > INT_MAX - p.width || p.y > INT_MAX - p.height) RefuseWindow();
    FindFilter("resize", FilterOf(p, spec.display_window));
    const Roi full = spec.display_window.empty() ? spec.data_window : spec.display_window;
    spec.display_window = {p.x, p.y, p.x + p.width, p.y + p.height};
    spec.data_window = data_.empty()   ? Roi{}
                       : data_ == full ? spec.display_window
                                       : ScaledWindow(data_, full, p);
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
    return MakeSeparableStage(map, in.type);
  }

 private:
  Roi data_;
};

// WxH with 0 for "keep the aspect", percentages, and an origin: as oiiotool's --resize.
ResizeParams ParseSize(const std::string& text, const Roi& from) {
  ResizeParams p;
  p.x = from.x0, p.y = from.y0;
  const char* at = text.data();
  const char* const end = at + text.size();
  double side[2] = {0, 0};
  bool percent[2] = {false, false};
  const auto refuse = [&]() {
    throw Error("geometry", "found \"" + text.substr(0, 60) + "\", expected WxH, W%, W%xH% or WxH+X+Y");
  };
  const auto number = [&](double* value) {
    const auto [stop, error] = std::from_chars(at, end, *value);
    if (error != std::errc() || !(*value >= 0) || *value > 1e9) refuse();
    at = stop;
  };
  number(&side[0]);
  if (at < end && *at == '%') percent[0] = true, ++at;
  if (at < end && *at == 'x') {
    ++at;
    number(&side[1]);
    if (at < end && *at == '%') percent[1] = true, ++at;
  } else if (percent[0]) {
    side[1] = side[0], percent[1] = true;
  } else {
    refuse();
  }
  if (at < end) {
    const Roi offset = ParseGeometry(std::string(at, end), {0, 0, 1, 1});
    p.x = offset.x0, p.y = offset.y0;
  }
  if (percent[0]) side[0] = std::floor(from.width() * side[0] / 100 + 0.5);
  if (percent[1]) side[1] = std::floor(from.height() * side[1] / 100 + 0.5);
  if (side[0] == 0 && side[1] == 0) refuse();
  if (side[0] == 0) side[0] = std::floor(side[1] * from.width() / std::max(1, from.height()) + 0.5);
  if (side[1] == 0) side[1] = std::floor(side[0] * from.height() / std::max(1, from.width()) + 0.5);
  p.width = static_cast<int>(side[0]), p.height = static_cast<int>(side[1]);
  return p;
}

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
      "Where a box halves both sides, a pixel of an 8- or 16-bit image is the exact mean of four codes, "
      "rounded half to even. A pixel that lies on a box's very edge counts for both its neighbours; oiiotool, "
      "which finds places in float, leaves it out of one of them where rounding falls so.";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  ParamInfo geometry;
  geometry.name = "GEOM";
  geometry.type = ParamType::kText;
  geometry.help = "the new size, such as 1920x1080, 50% or 1280x0";
  info.arguments = {geometry};
  info.modifiers = {FilterModifier("", "the filter"), HighlightModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const ImageSpec& spec = in[0].spec();
    ResizeParams p =
        ParseSize(a.Text("GEOM"), spec.display_window.empty() ? spec.data_window : spec.display_window);
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
  return graph::MakeNode(std::make_shared<const ops::ResizeOp>(params, data),
                         {framed == data ? image : Crop(image, framed)});
}

}  // namespace tessera
