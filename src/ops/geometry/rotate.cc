// A turn by any angle: a warp.
#include <cmath>
#include <string>

#include "base/turn.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {

OpInfo RotateInfo() {
  OpInfo info;
  info.name = "rotate";
  info.family = "geometry";
  info.summary = "Turn the picture by any angle";
  info.help =
      "By DEGREES clockwise about the display window's centre, or about center=X,Y, as oiiotool: --warp with that "
      "matrix, whose help says how. Whole quarter turns about a centre that carries pixels onto pixels keep bits; "
      "--rotate90 and its kin turn the windows as well. The windows stay unless recompute_roi=1.";
  info.help += " The image is held in memory whole.";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  ParamInfo degrees = NumberModifier("DEGREES", "", -1e6, 1e6, "the angle, clockwise");
  info.arguments = {degrees};
  ParamInfo recompute = FlagModifier("recompute_roi", "the data window holds the whole turned image");
  info.modifiers = {
      NumbersModifier("center", "", 2, -1e7, 1e7,
                      "the point that stays, X,Y in pixels; the display window's centre when left out"),
      WarpFilterModifier("lanczos3"), recompute, HighlightModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    RotateParams p;
    p.degrees = a.Number("DEGREES");
    if (a.Given("center")) {
      p.about_center = false;
      p.center_x = a.Numbers("center")[0], p.center_y = a.Numbers("center")[1];
    }
    p.filter = a.Text("filter");
    p.recompute_window = a.Flag("recompute_roi");
    p.compress_highlights = a.Flag("highlightcomp");
    return Rotate(in[0], p);
  };
  info.examples = {"30", "-45 filter=triangle", "90 center=10,8", "12.5 recompute_roi=1",
                   "200 filter=mitchell center=3.25,-7"};
  info.identity = "360";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Rotate(const Node& image, const RotateParams& params) {
  if (!std::isfinite(params.degrees) || !std::isfinite(params.center_x) || !std::isfinite(params.center_y)) {
    throw Error("rotate", "found an angle or a centre that is not finite, expected a number");
  }
  const Roi& frame = image.spec().display_window;
  const double cx = params.about_center ? 0.5 * (double{1} * frame.x0 + frame.x1) : params.center_x;
  const double cy = params.about_center ? 0.5 * (double{1} * frame.y0 + frame.y1) : params.center_y;
  const auto [c, s] = base::TurnOf(params.degrees);
  return Warp(image, {.matrix = {c, s, 0, -s, c, 0, cx - c * cx + s * cy, cy - s * cx - c * cy, 1},
                      .filter = params.filter,
                      .wrap = Wrap::kBlack,
                      .recompute_window = params.recompute_window,
                      .compress_highlights = params.compress_highlights});
}

}  // namespace tessera
