// Changes the data window; geometry words.
#include <charconv>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/op.h"
#include "ops/channels/channels_ops.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {
namespace {

class CropOp final : public graph::OpWith<Roi> {
 public:
  explicit CropOp(const Roi& window) : OpWith(window) {}
  std::string Name() const override { return "crop"; }
  graph::OpKind Kind() const override { return graph::OpKind::kCrop; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    out.data_window = params();
    return out;
  }
  std::string Describe() const override {
    std::string text = "crop ";
    text += std::to_string(params().width()) + "x" + std::to_string(params().height());
    return text;
  }
};

// Both windows become one.
class FrameOp final : public graph::OpWith<Roi> {
 public:
  explicit FrameOp(const Roi& window) : OpWith(window) {}
  std::string Name() const override { return "frame"; }
  graph::OpKind Kind() const override { return graph::OpKind::kCrop; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    out.data_window = out.display_window = params();
    return out;
  }
};

// A window of that size, as close to the origin as may be, that has no pixel of the image.
Roi BesideImage(const Roi& image, const Roi& window) {
  Roi place{0, 0, window.width(), window.height()};
  if (Intersection(image, place).empty()) return place;
  const int64_t left = int64_t{image.x0} - window.width(), right = int64_t{image.x1} + window.width();
  if (right <= std::numeric_limits<int32_t>::max()) return {image.x1, 0, static_cast<int>(right), place.y1};
  return left >= std::numeric_limits<int32_t>::min() ? Roi{static_cast<int>(left), 0, image.x0, place.y1}
                                                     : window;
}

// The window's pixels at the origin, as a picture of their own.
Node Cut(const Node& image, const Roi& given) {
  const Roi& exists = image.spec().data_window;
  // A long way to nothing is walked no less slowly than any other.
  const Roi window = Intersection(exists, given).empty() ? BesideImage(exists, given) : given;
  const Roi place{0, 0, window.width(), window.height()};
  // Moved inside a window that holds both places.
  const Roi both = Union(window, place);
  const Node moved =
      window == place ? image : Shift(Crop(image, both), {.x = -double(window.x0), .y = -double(window.y0)});
  return graph::MakeNode(std::make_shared<const FrameOp>(place), {moved});
}

// Takes a whole number off the front of the text; a sign is demanded, allowed (minus only) or refused.
std::optional<int64_t> TakeNumber(std::string_view& text, bool signed_offset) {
  std::string_view rest = text;
  if (signed_offset) {
    if (rest.empty() || (rest[0] != '+' && rest[0] != '-')) return std::nullopt;
    if (rest[0] == '+') rest.remove_prefix(1);
    if (text[0] == '+' && !rest.empty() && rest[0] == '-') return std::nullopt;
  }
  int64_t value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc()) return std::nullopt;
  text = rest.substr(static_cast<size_t>(end - rest.data()));
  return value;
}

bool TakeChar(std::string_view& text, char c) {
  if (text.empty() || text[0] != c) return false;
  text.remove_prefix(1);
  return true;
}

struct Corners {
  int64_t x0, y0, x1, y1;  // half-open
};

// x0,y0,x1,y1 with x1 and y1 included.
std::optional<Corners> ParseCorners(std::string_view text) {
  int64_t v[4];
  for (int i = 0; i < 4; ++i) {
    if (i > 0 && !TakeChar(text, ',')) return std::nullopt;
    const auto number = TakeNumber(text, false);
    if (!number) return std::nullopt;
    v[i] = *number;
  }
  constexpr int64_t kMost = std::numeric_limits<int32_t>::max();
  if (!text.empty() || v[2] > kMost || v[3] > kMost) return std::nullopt;
  return Corners{v[0], v[1], v[2] + 1, v[3] + 1};
}

// WxH, WxH+X+Y, +X+Y.
std::optional<Corners> ParseSize(std::string_view text, const Roi& base) {
  constexpr int64_t kMost = std::numeric_limits<int32_t>::max();
  int64_t x = base.x0, y = base.y0, w = base.width(), h = base.height();
  const bool offset_only = !text.empty() && (text[0] == '+' || text[0] == '-');
  if (!offset_only) {
    const auto width = TakeNumber(text, false);
    if (!width || !TakeChar(text, 'x')) return std::nullopt;
    const auto height = TakeNumber(text, false);
    if (!height) return std::nullopt;
    w = *width, h = *height;
  }
  if (!text.empty()) {
    const auto left = TakeNumber(text, true);
    const auto top = left ? TakeNumber(text, true) : std::nullopt;
    if (!left || !top || !text.empty()) return std::nullopt;
    x = *left, y = *top;
  }
  for (const int64_t v : {x, y, w, h}) {
    if (v > kMost || v < -kMost) return std::nullopt;
  }
  return Corners{x, y, x + w, y + h};
}

ParamInfo GeometryArgument() {
  return TextModifier("GEOM", "a geometry like 640x480+10+20 or 10,20,649,499");
}

}  // namespace

OpInfo CropInfo() {
  OpInfo info;
  info.name = "crop";
  info.family = "channels";
  info.summary = "Set the data window, cutting off or padding with zero";
  info.help =
      "GEOM is WxH, WxH+X+Y, +X+Y or x0,y0,x1,y1 (x1 and y1 included); what is not named stays. The display "
      "window stays, and formats without windows are written that large: --cut makes a smaller picture. "
      "Pixels that the image does not have are zero in every channel. Pixels outside are neither read nor "
      "computed.";
  info.bound = "exact";
  info.arguments = {GeometryArgument()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Crop(in[0], ParseGeometry(a.Text("GEOM"), in[0].spec().data_window));
  };
  info.examples = {"19x7+3+2", "-3,-2,70,5"};
  return info;
}

OpInfo CutInfo() {
  OpInfo info;
  info.name = "cut";
  info.family = "channels";
  info.summary = "Cut a rectangle out as a picture of its own";
  info.help =
      "GEOM as --crop takes it. The result's data and display window are that rectangle, moved to the origin, "
      "as oiiotool's --cut. Pixels that the image does not have are zero in every channel. Pixels outside are "
      "neither read nor computed.";
  info.bound = "exact";
  info.arguments = {GeometryArgument()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Cut(in[0], ParseGeometry(a.Text("GEOM"), in[0].spec().data_window));
  };
  info.examples = {"19x7+3+2", "-3,-2,70,5"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Crop(const Node& image, const Roi& window) {
  return graph::MakeNode(std::make_shared<const ops::CropOp>(window.empty() ? Roi{} : window), {image});
}

Roi ParseGeometry(const std::string& text, const Roi& base) {
  const auto corners =
      text.find(',') != std::string::npos ? ops::ParseCorners(text) : ops::ParseSize(text, base);
  if (!corners) {
    throw Error("geometry",
                "found \"" + text.substr(0, 60) + "\", expected WxH, WxH+X+Y, +X+Y or x0,y0,x1,y1");
  }
  const auto [x0, y0, x1, y1] = *corners;
  constexpr int64_t kMost = std::numeric_limits<int32_t>::max();
  if (x1 <= x0 || y1 <= y0) {
    throw Error("geometry", "\"" + text + "\" is " + std::to_string(x1 - x0) + "x" + std::to_string(y1 - y0) +
                                " pixels, expected at least 1x1");
  }
  if (x0 < -kMost || y0 < -kMost || x1 > kMost || y1 > kMost || x1 - x0 > kMost || y1 - y0 > kMost) {
    throw Error("geometry", "\"" + text + "\" leaves the range of coordinates, +-" + std::to_string(kMost));
  }
  return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1), static_cast<int>(y1)};
}

}  // namespace tessera
