// Textures that repeat without a seam: each axis cross-faded with the picture shifted by half.
#include <cmath>
#include <string>

#include "base/number_text.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/grade/grade_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"

namespace tessera {
namespace ops {
namespace {

// 0 in the middle of an axis, up to 1 in the first and the last of its `size` pixels.
Node EdgeShare(const ImageSpec& image, int axis, int size, double blend) {
  ImageSpec spec = image;
  spec.channels = {"s", "t"};
  spec.alpha = -1;
  spec.type = PixelType::kFloat;
  spec.display_window = spec.data_window;
  const Node place = SelectChannels(Ramp(spec), std::vector<ChannelChoice>{{axis, 0, "Y"}});
  const Node away = Abs(SubConstant(place, {0.5}));
  const double width = blend - 0.5 / size;
  return Clamp(MulConstant(SubConstant(away, {0.5 - blend}), {1 / width}), {.min = {0}, .max = {1}});
}

}  // namespace

OpInfo TileableInfo() {
  OpInfo info = MadeRow(
      "geometry", "tileable", "A texture that repeats without a seam: offset and blend",
      "Along each axis the image fades, over blend= of its size at either end, into itself shifted by half: there what was "
      "the middle meets itself beyond the edge, and the rest keeps its bits. Detail is averaged where it fades: noise and "
      "grain lose contrast there, and large shapes of the middle come back at the edges. axis=x or y treats one alone. "
      "It is done to the data window. The image is held in memory whole where it is shifted.");
  info.modifiers = {NumberModifier("blend", "0.25", 0.01, 0.5, "of the width and height, at either end"),
                    ChoiceModifier("axis", {"both", "x", "y"}, "which edges meet")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& axis = a.Text("axis");
    return Tileable(in[0], {a.Number("blend"), axis != "y", axis != "x"});
  };
  info.examples = {"", "blend=0.1 axis=x", "blend=0.5 axis=y"};
  return info;
}

}  // namespace ops

Node Tileable(const Node& image, const TileableParams& p) {
  if (!(p.blend >= 0.01 && p.blend <= 0.5))
    throw Error("tileable", "found blend=" + base::NumberText(p.blend) + ", expected 0.01 to 0.5");
  const Roi& window = image.spec().data_window;
  Node result = image;
  for (const int axis : {0, 1}) {
    const int size = axis == 0 ? window.width() : window.height();
    // Of less than a pixel there is nothing to fade.
    if (!(axis == 0 ? p.x : p.y) || p.blend * size < 1) continue;
    const Node shifted = CircularShift(result, axis == 0 ? Offset{size / 2, 0} : Offset{0, size / 2});
    const Node change = Sub(shifted, result);
    result = Add(Mul(change, ops::EdgeShare(image.spec(), axis, size, p.blend)), result);
  }
  return result;
}

}  // namespace tessera
