// Environment lookups: what is validated and prepared once.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "base/number_text.h"
#include "graph/op.h"
#include "model/environment_settings.h"
#include "ops/environment/environment_ops.h"
#include "ops/environment/environment_stages.h"
#include "ops/geometry/pixel_footprint.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {
namespace {

class EnvironmentOp final : public graph::OpWith<ops::EnvironmentSettings> {
 public:
  // `map`: of the map, wherever it is.
  EnvironmentOp(ops::EnvironmentSettings settings, bool positions, const ImageSpec& map,
                std::optional<EnvironmentTexture> texture = {})
      : OpWith(std::move(settings)),
        positions_(positions),
        alpha_(map.channel_count() == 4 && map.alpha == 3),
        colors_(alpha_ || (map.channel_count() == 3 && map.alpha < 0)),
        texture_(std::move(texture)) {}
  std::string Name() const override { return "envmap"; }
  // Filtered mirrors look at the neighbours.
  graph::OpKind Kind() const override {
    const bool point = colors_ && params().params.filter == EnvironmentFilter::kBilinear;
    return point ? graph::OpKind::kColor : graph::OpKind::kTile;
  }
  bool WritesAlpha() const override { return alpha_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const ImageSpec& map = params().FromInput() ? inputs.back() : params().picture.spec();
    const size_t pixels = positions_ ? 2 : 1;
    for (size_t k = 0; k < pixels; ++k) graph::RequireColor("envmap", inputs[k]);
    graph::RequireSameWindow("envmap", inputs.first(pixels));
    LayoutOf("envmap", params().params.map, map.width(), map.height(), params().params.field_of_view);
    ImageSpec spec = inputs[0];
    spec.channels = map.channels;
    spec.alpha = map.alpha;
    spec.type = map.type;
    return spec;
  }
  bool NeedsWhole(int k) const override { return k > (positions_ ? 1 : 0); }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), NeedsWhole(k));
    if (!NeedsWhole(k)) std::fill_n(needed.begin(), 3, true);
    return needed;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return MakeEnvironmentPointStage(PlanOf(context), context);
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return MakeEnvironmentTileStage(PlanOf(context), context);
  }

 private:
  EnvironmentStagePlan PlanOf(const graph::StageContext& context) const {
    const EnvironmentParams& p = params().params;
    auto map = texture_ ? texture_->data()->Prepared(context.workers)
                        : std::make_shared<const PreparedEnvironment>(context.whole.back(), p, false,
                                                                      context.workers);
    return {p, positions_, std::move(map)};
  }

  bool positions_, alpha_, colors_;  // colors_: RGB or RGBA, as colour operations want them
  std::optional<EnvironmentTexture> texture_;
};

void Check(const EnvironmentParams& p, bool positions) {
  RequireVector("envmap", "view", p.view, true);
  if (p.eye) RequireVector("envmap", "eye", *p.eye, false);
  if (positions && !p.eye && !p.camera) {
    throw Error("envmap", "found positions without an eye, expected eye=x,y,z or a camera");
  }
  RequireFieldOfView("envmap", "fov", p.map, p.field_of_view);
  const Matrix4& m = p.matrix;
  Inverse({m[0], m[1], m[2], 0, m[4], m[5], m[6], 0, m[8], m[9], m[10], 0, 0, 0, 0, 1}, "envmap matrix");
  if (!(p.lobe >= 0 && p.lobe <= 10000)) {
    throw Error("envmap", "found gloss=" + base::NumberText(p.lobe) + ", expected 0 (a mirror) to 10000");
  }
  if (p.lobe > 0 && p.lobe < 1e-3)
    throw Error("envmap", "found gloss below 0.001, expected 0 or more than that");
  if (p.table < -1 || p.table > 4096) {
    throw Error("envmap",
                "found table=" + std::to_string(p.table) + ", expected -1 (exact), 0 (chosen) or up to 4096");
  }
  if (p.lobe > 0 && p.filter != EnvironmentFilter::kBilinear) {
    const char* const name = p.filter == EnvironmentFilter::kMip         ? "mip"
                             : p.filter == EnvironmentFilter::kTrilinear ? "trilinear"
                                                                         : "ewa";
    throw Error("envmap", std::string("found filter=") + name +
                              " with gloss, expected a mirror: a lobe is an average already");
  }
  if (p.anisotropy < 1 || p.anisotropy > kMostAnisotropy) {
    throw Error("envmap", "found the anisotropy " + std::to_string(p.anisotropy) + ", expected 1 to " +
                              std::to_string(kMostAnisotropy));
  }
  if (p.fresnel && !(*p.fresnel >= 0 && *p.fresnel <= 1)) {
    throw Error("envmap", "found fresnel=" + base::NumberText(*p.fresnel) + ", expected 0 to 1");
  }
  if (p.bits < 0 || p.bits > 24) {
    throw Error("envmap", "found bits=" + std::to_string(p.bits) + ", expected 0 (none) to 24");
  }
}

// The texture's own map and lobe in the place of the parameters'.
ops::EnvironmentSettings SettingsOf(const EnvironmentTexture& texture, EnvironmentParams p, bool positions) {
  const EnvironmentTexture::Data& data = *texture.data();
  p.map = data.params.map, p.lobe = data.params.lobe, p.table = data.params.table,
  p.filter = data.params.filter, p.field_of_view = data.params.field_of_view;
  Check(p, positions);
  return {p, data.picture};
}

Node MakeEnvironment(std::span<const Node> in, const Arguments& a, const ImageSpec*) {
  EnvironmentParams p;
  p.map = MapNamed(a.Text("map"));
  p.field_of_view = a.Number("fov");
  if (a.Given("matrix")) p.matrix = MatrixOf(a.Numbers("matrix"));
  if (a.Given("view")) p.view = VectorOf(a.Numbers("view"));
  if (a.Given("eye")) p.eye = VectorOf(a.Numbers("eye"));
  p.lobe = a.Number("gloss");
  if (a.Text("along") == "normal" || a.Flag("diffuse")) p.direction = EnvironmentDirection::kNormal;
  if (a.Flag("diffuse") && !a.Given("gloss")) p.lobe = 1;
  p.table = a.Integer("table");
  const std::string& filter = a.Text("filter");
  p.filter = filter == "mip"         ? EnvironmentFilter::kMip
             : filter == "trilinear" ? EnvironmentFilter::kTrilinear
             : filter == "ewa"       ? EnvironmentFilter::kEwa
                                     : EnvironmentFilter::kBilinear;
  p.anisotropy = a.Integer("aniso");
  p.bits = a.Integer("bits");
  if (a.Given("fresnel")) p.fresnel = a.Number("fresnel");
  if (a.Text("camera") == "metadata") {
    for (size_t k = 0; k + 1 < in.size() && !p.camera; ++k) p.camera = Camera::FromMetadata(in[k].spec());
    if (!p.camera)
      throw DataError("envmap:camera", "found no worldToNDC in the metadata, expected 16 or 32 numbers");
  } else if (a.Given("camera")) {
    p.camera = Camera::FromNumbers(a.Numbers("camera"), "envmap:camera");
  }
  if (in.size() == 3) {
    if (!p.camera && !p.eye) p.camera = Camera::FromMetadata(in[1].spec());
    return Environment(NormalsOf(in[0]), PositionsOf(in[1]), in[2], p);
  }
  return Environment(NormalsOf(in[0]), in[1], p);
}

}  // namespace

OpInfo EnvironmentInfo() {
  OpInfo info;
  info.name = "envmap";
  info.family = "environment";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Flag("position") ? 3 : 2; };
  info.summary = "Reflection of an environment map in surfaces with given normals";
  info.help =
      "NORMAL MAP --envmap looks the map up in the direction of reflection u - 2 (n.u) n of every normal "
      "(the normals of an AOV file by their names, else the first three channels; any length); u points "
      "from the eye to the surface: against view= (default +z, "
      "an orthographic viewer), along the rays of camera=, or, as NORMAL POSITION MAP --envmap:position=1, "
      "from eye= (or the camera, or the one in the positions' metadata) to each position. matrix= turns "
      "directions from the normals' space into the map's. along=normal looks up the normal "
      "itself.\n"
      "map=latlong: +z in the middle, +x a quarter to its left, y up; sphere: a mirrored ball seen from +z; "
      "parabolic: (x,y)/(1+z), nothing behind; dualparabolic: front and back side by side; cube: OpenGL's "
      "faces as a 6:1 or 1:6 strip (+x -x +y -y +z -z) or a 4:3 or 3:4 cross; octahedral: |x|+|y|+|z|=1 "
      "unfolded, +z in the middle. Lookups are linear and continuous over seams and poles. A lens's picture "
      "(perspective, equidistant as light probes are, equisolid, stereographic, orthographic, cylinder; fov= "
      "degrees across) looks along +z as latlong does and shows 0 beyond its edges.\n"
      "gloss=E averages the map with the weights max(d.w,0)^E of a Phong lobe (white stays white); "
      "diffuse=1 is the lobe 1 about the normal: irradiance over pi. Lobes are tabulated as a cube map of "
      "table=N texels an edge (0: by the exponent; -1: summed exactly for every pixel, slow). fresnel=F0 "
      "multiplies the colour by F0 + (1-F0)(1-|n.v|)^5. filter=mip shows, in a mirror, an average as wide "
      "as the angle to the directions looked up by the neighbouring pixels, between the map and a chain of "
      "cube maps, each of half the edge: what is seen from afar is calm. Where a surface bends more one way than "
      "the other those directions are an ellipse, which mip takes for the circle about it; filter=trilinear has "
      "the mean of up to aniso= such averages along it, filter=ewa a Gaussian's under it (Heckbert 1989). bits=8 or 12 first stores the "
      "normals as the papers' framebuffers did.\n"
      "The result has the map's channels; normals (or positions) that are 0, NaN or infinite give 0, so "
      "that adding the result to a picture leaves its background alone. Source: McReynolds et al. 1997, "
      "9.3.2 (eq. 2 with its sign turned); Heidrich and Seidel 1998.";
  info.help += " The map is held in memory whole.";
  info.bound =
      "8 u times the largest texel (lat-long: times 1 + w/8 + h/3, which is where the texel is looked up); a "
      "lobe's table 1 % of the map's contrast; the other filters twice that of the map's largest texel";
  info.bound_u = 8;
  ParamInfo camera =
      NumbersModifier("camera", "", {16, 32}, "world to clip, or world to camera and to clip; or metadata");
  camera.type = ParamType::kChoice;
  camera.choices = {"metadata"};
  camera.numbers_too = true;
  info.modifiers = {
      MapChoice("map", "latlong", "projection of the map"),
      FieldOfViewModifier("fov", "the map's"),
      NumbersModifier("matrix", "", {9, 16}, "from the normals' space to the map's, row-major"),
      NumberModifier("gloss", "0", 0, 10000, "exponent of the lobe; 0: a mirror"),
      FlagModifier("diffuse", "irradiance over pi: gloss=1:along=normal"),
      OnlyWith("!diffuse", ChoiceModifier("along", {"reflection", "normal"}, "what is looked up")),
      FlagModifier("position", "positions are given, below the map"),
      OnlyWith("!position !camera", NumbersModifier("view", "", {3}, "to a distant viewer")),
      OnlyWith("position", NumbersModifier("eye", "", {3}, "the viewer's place")),
      camera,
      NumberModifier("fresnel", "1", 0, 1, "reflectance at normal incidence"),
      IntegerModifier("table", "0", -1, 4096, "texels along an edge of a lobe's table"),
      ChoiceModifier("filter", {"bilinear", "mip", "trilinear", "ewa"},
                     "of a mirror: four texels, or as wide as a pixel's reflection, or of its shape"),
      OnlyWith("filter=trilinear|ewa",
               IntegerModifier("aniso", "16", 1, kMostAnisotropy,
                               "longest length of a pixel's reflection, in widths of it; longer is widened")),
      IntegerModifier("bits", "0", 0, 24, "of the framebuffer that holds the normals; 0: none")};
  info.make = MakeEnvironment;
  info.examples = {"",
                   "map=sphere matrix=0,0,1,0,1,0,-1,0,0",
                   "map=dualparabolic fresnel=0.04",
                   "map=parabolic along=normal",
                   "position=1 eye=0.5,3,-2",
                   "gloss=20 table=-1",
                   "diffuse=1 table=-1 map=sphere",
                   "map=octahedral",
                   "map=equidistant fov=360 along=normal",
                   "filter=mip map=sphere fresnel=0.1",
                   "filter=trilinear aniso=8",
                   "filter=ewa map=octahedral",
                   "filter=trilinear map=equidistant along=normal",
                   "camera=1,0,0,0,0,1,0,0,0,0,-1,0,0,0,-1,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Environment(const Node& normals, const Node& map, const EnvironmentParams& params) {
  ops::Check(params, false);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(ops::EnvironmentSettings{params, {}}, false, map.spec()),
      {normals, map});
}

Node Environment(const Node& normals, const Node& positions, const Node& map,
                 const EnvironmentParams& params) {
  ops::Check(params, true);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(ops::EnvironmentSettings{params, {}}, true, map.spec()),
      {normals, positions, map});
}

Node Environment(const Node& normals, const EnvironmentTexture& texture, const EnvironmentParams& params) {
  const ops::EnvironmentSettings settings = ops::SettingsOf(texture, params, false);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(settings, false, settings.picture.spec(), texture),
      {normals});
}

Node Environment(const Node& normals, const Node& positions, const EnvironmentTexture& texture,
                 const EnvironmentParams& params) {
  const ops::EnvironmentSettings settings = ops::SettingsOf(texture, params, true);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(settings, true, settings.picture.spec(), texture),
      {normals, positions});
}

}  // namespace tessera
