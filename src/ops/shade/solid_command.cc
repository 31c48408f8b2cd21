// The command --solid.
#include <utility>

#include "ops/geometry/pixel_footprint.h"
#include "ops/modifiers.h"
#include "ops/shade/shade_ops.h"
#include "ops/wrap.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

SolidKind KindNamed(const std::string& name) {
  if (name == "wood") return SolidKind::kWood;
  if (name == "noise") return SolidKind::kNoise;
  if (name == "contours") return SolidKind::kContours;
  if (name == "halftone") return SolidKind::kHalftone;
  return name == "marble" ? SolidKind::kMarble : SolidKind::kTable;
}

}  // namespace

OpInfo SolidInfo() {
  OpInfo info;
  info.name = "solid";
  info.family = "shade";
  info.operands = [](const Arguments& a) { return a.Text("procedure") == "table" ? 3 : 2; };
  info.inputs = 3;
  info.summary = "Texture from a solid block at the positions of a picture";
  info.help =
      "COLOR POSITION TABLE --solid:slices=N:box=x0,y0,z0,x1,y1,z1 looks up a 3-D table, its N slices "
      "stacked along y (1, 3 or 4 channels, premultiplied where one of four is alpha), at p = (P - low) / (high - low), rotated about "
      "the block's centre: rotate= has 9 numbers, row by row, or x,y,z,degrees; values get the colours of a ramp by --colormap on the table. COLOR POSITION "
      "--solid:procedure=marble|wood|noise|contours|halftone computes the texture instead: freq= bands, "
      "rings, noise cells, lines or screen cells across the block, octaves=, seed=, strength= (of the "
      "turbulence). contours: lines where plane . p is a multiple of 1/freq, width= of the spacing, in "
      "ink=; halftone: ink where C's luminance is below a screen that sticks to the solid.\n"
      "blend: modulate C S, replace S A, over S A + C (1 - S alpha), add C + S A; C premultiplied by its "
      "alpha A, which stays. lod=1 takes the mean over what a pixel covers, by the differences of neighbouring "
      "positions on the same surface: of bands, rings, lines and screens along their own argument, of noise "
      "octave by octave; tables by mip level, and filter=trilinear or ewa, with lod= or without, by the "
      "ellipse that a pixel covers in the block, as --lookup has them. Pixels whose position is NaN keep their "
      "bits; an axis of the box without extent is 1/2. Positions are never filtered. Source: "
      "Peachey 1985; Perlin 1985; Westermann and Ertl 1997.";
  info.bound = "64 u * max(|C|, A), for the same p and noise";
  info.bound_u = 64;
  ParamInfo box =
      ListModifier("box", "0,0,0,1,1,1", 6, -1e38, 1e38, "low and high corner of the block, world units");
  box.min_count = 6;
  ParamInfo rotate = ListModifier("rotate", "0,1,0,0", 9, -1e9, 1e9, "x,y,z,degrees or 9 numbers");
  rotate.counts = {4, 9};
  info.modifiers = {
      ChoiceModifier("procedure", {"table", "marble", "wood", "noise", "contours", "halftone"},
                     "what the solid is"),
      OnlyWith("procedure=table", IntegerModifier("slices", "1", 1, 1e6, "of the table, stacked along y")),
      box,
      FlagModifier("uniform", "all axes by the box's longest side"),
      rotate,
      ChoiceModifier("blend", {"modulate", "replace", "over", "add"}, "how texture and colour meet"),
      OnlyWith("!procedure=table", NumberModifier("freq", "4", 0, 1e6, "features across the block")),
      OnlyWith("procedure=marble|wood|noise", IntegerModifier("octaves", "4", 0, 24, "of the noise")),
      OnlyWith("procedure=marble|wood|noise", IntegerModifier("seed", "0", 0, 4294967295.0, "of the noise")),
      OnlyWith("procedure=marble|wood",
               NumberModifier("strength", "1", -1e3, 1e3, "of marble's turbulence and wood's bend")),
      OnlyWith("procedure=contours", NumbersModifier("plane", "0,1,0", 3, "direction across the contours")),
      OnlyWith("procedure=contours", NumberModifier("width", "0.1", 0, 1, "of the lines, in spacings")),
      OnlyWith("procedure=contours|halftone",
               NumbersModifier("ink", "0,0,0", 3, "colour of contours and halftone")),
      OnlyWith("procedure=table",
               ChoiceModifier("filter", {"linear", "nearest", "tetrahedral", "cubic", "trilinear", "ewa"},
                              "of the table")),
      OnlyWith("filter=trilinear|ewa",
               IntegerModifier("aniso", "16", 1, kMostAnisotropy,
                               "longest length of what a pixel covers, in widths of it; longer is widened")),
      OnlyWith("procedure=table",
               WrapModifier({"clamp", "repeat", "mirror", "black"}, "clamp", "of the table")),
      FlagModifier("lod", "the mean over a pixel")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    SolidParams p;
    p.kind = KindNamed(a.Text("procedure"));
    const std::vector<double>& b = a.Numbers("box");
    p.low = {b[0], b[1], b[2]}, p.high = {b[3], b[4], b[5]};
    p.uniform = a.Flag("uniform");
    const std::vector<double>& r = a.Numbers("rotate");
    if (r.size() == 4) p.rotation = RotationAbout({r[0], r[1], r[2]}, r[3]);
    if (r.size() == 9) std::copy(r.begin(), r.end(), p.rotation.begin());
    const std::string& blend = a.Text("blend");
    p.blend = blend == "replace" ? SolidBlend::kReplace
              : blend == "over"  ? SolidBlend::kOver
              : blend == "add"   ? SolidBlend::kAdd
                                 : SolidBlend::kModulate;
    p.frequency = a.Number("freq");
    p.octaves = a.Integer("octaves");
    p.seed = static_cast<uint32_t>(a.Number("seed"));
    p.strength = a.Number("strength");
    p.plane = VectorOf(a, "plane");
    p.width = a.Number("width");
    p.ink = VectorOf(a, "ink");
    p.level_of_detail = a.Flag("lod");
    const std::string& filter = a.Text("filter");
    p.lookup.filter = filter == "nearest"       ? TableFilter::kNearest
                      : filter == "tetrahedral" ? TableFilter::kTetrahedral
                      : filter == "cubic"       ? TableFilter::kCubic
                      : filter == "trilinear"   ? TableFilter::kTrilinear
                      : filter == "ewa"         ? TableFilter::kEwa
                                                : TableFilter::kLinear;
    p.lookup.anisotropy = a.Integer("aniso");
    p.lookup.wrap = {WrapNamed(a.Text("wrap"))};
    const Node position = PositionsOf(in[1]);
    if (p.kind != SolidKind::kTable) return SolidTexture(in[0], position, p);
    TableLayout layout;
    layout.dims = 3;
    layout.slices = {a.Integer("slices")};
    return SolidTexture(in[0], position, in[2], layout, p);
  };
  info.examples = {"procedure=marble box=-1,-1,-1,2,2,2 rotate=0,1,1,30 freq=3",
                   "procedure=wood box=-1,-1,-1,2,2,2 freq=5 blend=replace",
                   "procedure=noise freq=3.5 lod=1 blend=add octaves=3",
                   "procedure=contours plane=0.3,1,0.2 freq=6 blend=over lod=1 ink=0.2,0.1,0",
                   "procedure=halftone freq=9 blend=replace",
                   "procedure=marble box=-1,-1,-1,2,2,2 freq=3 lod=1 strength=0.7",
                   "procedure=wood box=-1,-1,-1,2,2,2 freq=5 blend=replace lod=1",
                   "procedure=halftone freq=9 blend=over lod=1"};
  return info;
}

}  // namespace tessera::ops
