// Exact rearrangements: flip, flop, quarter turns, transpose, circular shift, moves of the data window.
#include <climits>
#include <memory>
#include <string>

#include "graph/op.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/places.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

const char* NameOf(Rearrangement how) {
  constexpr const char* kNames[] = {"flip", "flop", "rotate90", "rotate180", "rotate270", "transpose"};
  return kNames[static_cast<int>(how)];
}

const Roi& FrameOf(const ImageSpec& spec) {
  return spec.display_window.empty() ? spec.data_window : spec.display_window;
}

// Within a frame, the corner of which stays where it is; a transpose is about the origin.
Places PlacesOf(Rearrangement how, const Roi& frame) {
  const int64_t x0 = frame.x0, y0 = frame.y0, right = int64_t{frame.x1} - 1, bottom = int64_t{frame.y1} - 1;
  switch (how) {
    case Rearrangement::kFlip:
      return {false, {false, 0}, {true, y0 + bottom}};
    case Rearrangement::kFlop:
      return {false, {true, x0 + right}, {false, 0}};
    case Rearrangement::kRotate90:
      return {true, {false, x0 - y0}, {true, x0 + bottom}};
    case Rearrangement::kRotate180:
      return {false, {true, x0 + right}, {true, y0 + bottom}};
    case Rearrangement::kRotate270:
      return {true, {true, y0 + right}, {false, y0 - x0}};
    case Rearrangement::kTranspose:
      break;
  }
  return {true, {false, 0}, {false, 0}};
}

class RearrangeOp final : public graph::OpWith<Rearrangement> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return NameOf(params()); }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    const Places places = PlacesOf(params(), FrameOf(spec));
    spec.data_window = ResultOfPlaces(places, spec.data_window, NameOf(params()));
    spec.display_window = ResultOfPlaces(places, spec.display_window, NameOf(params()));
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return MakePlacesStage(PlacesOf(params(), FrameOf(context.inputs[0])));
  }
};

// Pixels and data window move, the display window stays.
class MoveOp final : public graph::OpWith<Offset> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "originoffset"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override { return params() == Offset{}; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    spec.data_window = ResultOfPlaces(Moved(), spec.data_window, "originoffset");
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return MakePlacesStage(Moved());
  }

 private:
  Places Moved() const { return {false, {false, -int64_t{params().x}}, {false, -int64_t{params().y}}}; }
};

class CircularShiftOp final : public graph::OpWith<Offset> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "cshift"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override { return params() == Offset{}; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const Roi& window = context.output.data_window;
    // Less than one image away, on the left and above.
    const auto rest = [](int64_t by, int size) { return size == 0 ? 0 : (by % size + size) % size; };
    return MakePlacesStage(
        {false, {false, -rest(params().x, window.width())}, {false, -rest(params().y, window.height())}});
  }
};

OpInfo RearrangementRow(Rearrangement how, const std::string& summary, const std::string& help) {
  OpInfo info;
  info.name = NameOf(how);
  info.family = "geometry";
  info.summary = summary;
  info.help = help + " Bits stay, whatever the samples are.";
  info.bound = "exact";
  info.examples = {""};
  return info;
}

ParamInfo OffsetArgument(const std::string& help) { return TextModifier("+X+Y", help); }

constexpr char kFrame[] =
    " It is done to the display window: what lies off its middle, or a data window within it, goes to the other "
    "side. As oiiotool.";
constexpr char kTurned[] =
    " The display window keeps its upper left corner and swaps its sides; the data window turns with it. As "
    "oiiotool where that corner is the origin (elsewhere oiiotool loses pixels).";

}  // namespace

Offset ParseOffset(const std::string& subject, const std::string& text) {
  if (!text.empty() && (text[0] == '+' || text[0] == '-') && text.find(',') == std::string::npos) {
    const Roi place = ParseGeometry(text, {0, 0, 1, 1});
    return {place.x0, place.y0};
  }
  throw Error(subject, "found \"" + text.substr(0, 60) + "\", expected +X+Y, such as +20-10");
}

OpInfo FlipInfo() {
  OpInfo info = RearrangementRow(Rearrangement::kFlip, "Mirror the image, top to bottom",
                                 std::string("The upper row becomes the lowest.") + kFrame);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Flip(in[0]); };
  return info;
}

OpInfo FlopInfo() {
  OpInfo info = RearrangementRow(Rearrangement::kFlop, "Mirror the image, left to right",
                                 std::string("The left column becomes the rightmost.") + kFrame);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Flop(in[0]); };
  return info;
}

OpInfo Rotate90Info() {
  OpInfo info = RearrangementRow(Rearrangement::kRotate90, "Turn the image by 90 degrees, clockwise",
                                 std::string("The left column becomes the upper row, backwards.") + kTurned);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Rotate90(in[0]); };
  return info;
}

OpInfo Rotate180Info() {
  OpInfo info = RearrangementRow(Rearrangement::kRotate180, "Turn the image by 180 degrees",
                                 std::string("A flip and a flop.") + kFrame);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Rotate180(in[0]); };
  return info;
}

OpInfo Rotate270Info() {
  OpInfo info =
      RearrangementRow(Rearrangement::kRotate270, "Turn the image by 270 degrees clockwise, 90 the other way",
                       std::string("The right column becomes the upper row.") + kTurned);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Rotate270(in[0]); };
  return info;
}

OpInfo TransposeInfo() {
  OpInfo info =
      RearrangementRow(Rearrangement::kTranspose, "Mirror the image about its diagonal: columns become rows",
                       "Pixel (x, y) goes to (y, x), the windows with it, as oiiotool.");
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Transpose(in[0]); };
  return info;
}

OpInfo CircularShiftInfo() {
  OpInfo info;
  info.name = "cshift";
  info.family = "geometry";
  info.summary = "Move the pixels in a circle: what leaves on one side comes in on the other";
  info.help =
      "The pixels of the data window move X to the right and Y down, as oiiotool. Bits stay, whatever the "
      "samples are. --shift moves by fractions of a pixel, and has other borders.";
  info.bound = "exact";
  info.arguments = {OffsetArgument("pixels to the right and down")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return CircularShift(in[0], ParseOffset("cshift", a.Text("+X+Y")));
  };
  info.examples = {"+7+3", "-3+1", "+100-200"};
  info.identity = "+0+0";
  return info;
}

OpInfo OriginInfo() {
  OpInfo info;
  info.name = "origin";
  info.family = "geometry";
  info.summary = "Set where the data window begins";
  info.help =
      "Pixels and data window move until its upper left corner lies at (X, Y); the display window stays. As "
      "oiiotool. Bits stay.";
  info.bound = "exact";
  info.arguments = {OffsetArgument("the new place of the upper left pixel")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return WithOrigin(in[0], ParseOffset("origin", a.Text("+X+Y")));
  };
  info.examples = {"+7+3", "-3+1"};
  return info;
}

OpInfo OriginOffsetInfo() {
  OpInfo info;
  info.name = "originoffset";
  info.family = "geometry";
  info.summary = "Move the data window";
  info.help =
      "Pixels and data window move X to the right and Y down; the display window stays. As oiiotool. Bits stay.";
  info.bound = "exact";
  info.arguments = {OffsetArgument("pixels to the right and down")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Move(in[0], ParseOffset("originoffset", a.Text("+X+Y")));
  };
  info.examples = {"+7+3", "-3+1"};
  info.identity = "+0+0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Rearrange(const Node& image, Rearrangement how) {
  return graph::MakeNode(std::make_shared<const ops::RearrangeOp>(how), {image});
}

Node CircularShift(const Node& image, const Offset& by) {
  return graph::MakeNode(std::make_shared<const ops::CircularShiftOp>(by), {image});
}

Node Move(const Node& image, const Offset& by) {
  return graph::MakeNode(std::make_shared<const ops::MoveOp>(by), {image});
}

Node WithOrigin(const Node& image, const Offset& origin) {
  const Roi& window = image.spec().data_window;
  const int64_t x = int64_t{origin.x} - window.x0, y = int64_t{origin.y} - window.y0;
  if (x <= INT_MIN || x > INT_MAX || y <= INT_MIN || y > INT_MAX) {
    throw DataError("origin", "found a way of more than 2^31 pixels, expected a shorter one");
  }
  return Move(image, {static_cast<int>(x), static_cast<int>(y)});
}

}  // namespace tessera
