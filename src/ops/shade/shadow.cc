// Shadow maps: visibility of positions from a light, and the mean over several samples of one.
#include <cmath>
#include <memory>
#include <utility>

#include "graph/op.h"
#include "model/shade_settings.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/shade_ops.h"
#include "ops/shade/shadow_map.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

class ShadowOp final : public graph::OpWith<ShadowSettings> {
 public:
  explicit ShadowOp(ShadowSettings settings) : OpWith(std::move(settings)) {}
  std::string Name() const override { return "shadow"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  bool NeedsWhole(int k) const override { return k == 1; }
  std::string Describe() const override {
    const int n = params().shadow.size;
    return "shadow " + std::to_string(n) + "x" + std::to_string(n);
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireColor("shadow positions", in[0]);
    ImageSpec out = in[0];
    out.channels = {"V"};
    out.alpha = -1;
    return out;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    auto map = std::make_shared<const ShadowMap>(context.whole[1], params(), context.workers);
    return MakeShadowStage(MakeShadowPlan(params(), map->width(), map->height()), map);
  }
};

// The step between neighbouring codes at 1; of floats, a few roundings of whoever made them.
double StepOf(PixelType type, int bits, bool relative) {
  if (bits > 0) return 1 / (std::exp2(bits) - 1);
  switch (type) {
    case PixelType::kUint8:
      return 1.0 / 255;
    case PixelType::kUint16:
      return 1.0 / 65535;
    case PixelType::kHalf:
      return relative ? 0x1p-11 : 0x1p-12;
    default:
      return relative ? 0x1p-24 : 0x1p-22;
  }
}

ShadowParams ShadowArguments(const Arguments& a) {
  ShadowParams p;
  p.bias = a.Text("bias") == "auto" ? -1 : a.Numbers("bias")[0];
  p.size = a.Integer("pcf");
  p.filter = a.Text("filter") == "bilinear" ? ShadowFilter::kBilinear : ShadowFilter::kBox;
  p.dark_outside = a.Text("outside") == "dark";
  p.map_bits = a.Integer("mapbits");
  p.position_bits = a.Integer("positionbits");
  return p;
}

// The map as window depths, as the light's own planes have them. A file of AOVs holds planar depths.
Node MapOf(const std::string& op, const Node& map, const Arguments& a, const Camera& light) {
  const std::string& kind = a.Text("depth");
  DepthParams p;
  p.from = kind == "auto" ? (IsAovFile(map.spec()) ? DepthKind::kPlanar : DepthKind::kWindow)
                          : DepthKindNamed(kind);
  p.to = DepthKind::kWindow;
  if (p.from == p.to) return map;
  p.camera = light, p.parallel = !light.perspective();
  if (p.from != DepthKind::kReversedWindow) {
    const auto planes = light.ClipPlanes();
    if (!planes) {
      throw DataError(op,
                      "found a light whose matrix has no near and far plane, expected them where the map "
                      "holds depths in world units");
    }
    p.near = planes->near, p.far = planes->far;
  }
  return ConvertDepth(DepthsOf(map), p);
}

std::vector<ParamInfo> ShadowModifiers() {
  ParamInfo bias =
      ChoiceModifier("bias", {"auto"}, "added to the map's depths; auto: from its slopes and precision");
  bias.numbers_too = true;
  bias.min = 0, bias.max = 1;
  return {
      bias,
      IntegerModifier("pcf", "1", 1, 64, "width of the square of comparisons, texels"),
      ChoiceModifier("filter", {"box", "bilinear"}, "equal weights, or bilinear ones of the nearest four"),
      ChoiceModifier("depth", {"auto", "window", "planar", "euclidean", "reversed"},
                     "what the map holds; auto: planar in a file of AOVs, window in others"),
      ChoiceModifier("outside", {"lit", "dark"}, "beside the map"),
      IntegerModifier("mapbits", "0", 0, 32, "precision of the map for bias=auto; 0: of its file"),
      IntegerModifier("positionbits", "0", 0, 32,
                      "precision of the positions for bias=auto; 0: of their file")};
}

constexpr const char* kShadowHelp =
    "light is 16 numbers, row by row: the matrix from world to the light's clip space, projective or "
    "parallel (default the map's worldToNDC). (x,y,z,w) = light (P,1); the map is looked up at s = "
    "(x/w+1)/2, t = (1-y/w)/2 (row 0 on top) and compared with r = (z/w+1)/2: 1 where r <= m + bias. The map "
    "holds depth mapped to [0,1], 1 where nothing was hit; planar, euclidean (world units, infinite where nothing was hit) and reversed "
    "depths, by depth=, become that with the near and far plane of the light's matrix (planar depths of a parallel light count from its near plane, "
    "or from the camera where light= or the metadata have both matrices). pcf=N averages N x N comparisons: k/N^2 exactly; "
    "depths are never averaged. bias=auto is, per texel, how much deeper its own surface is within the taps' "
    "reach (slope, bend and twist of the depths around it, or the depths themselves; those behind an edge do "
    "not count) plus the map's quantisation, and what half-float positions have lost. Lit: beside the map "
    "(outside=dark), beyond its far plane, NaN positions and texels, texels of 1 and more; dark: behind the "
    "light (w <= 0). ";

}  // namespace

OpInfo ShadowInfo() {
  OpInfo info;
  info.name = "shadow";
  info.family = "shade";
  info.inputs = 2;
  info.summary = "Visibility of positions from a light by its depth map, 1 lit";
  info.help = std::string("POSITION LIGHTDEPTH --shadow:light=M gives one channel V. ") + kShadowHelp +
              "Multiply what the light adds by it. Source: Williams 1978; Reeves et al. 1987; Segal et "
              "al. 1992, 3.3 (with its epsilon on the other side).";
  info.help += " The light's depth is held in memory whole.";
  info.bound = "comparisons right unless |r - m - bias| < 4 u; box weights exact, bilinear 4 u";
  info.bound_u = 4;
  info.modifiers = {CameraModifier("light", "world to the light's clip space; default the map's metadata")};
  for (ParamInfo& m : ShadowModifiers()) info.modifiers.push_back(std::move(m));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ShadowParams p = ShadowArguments(a);
    const Camera light = NeededCamera("shadow", a, "light", in.subspan(1, 1));
    p.light = light.world_to_clip();
    return Shadow(PositionsOf(in[0]), MapOf("shadow", in[1], a, light), p);
  };
  const std::string light =
      "light=0.9,0.1,0.05,-0.31,-0.07,0.8,0.2,-0.42,0.11,0.21,1.3,-0.53,0.03,0.07,0.4,1.7";
  info.examples = {light + " pcf=3 mapbits=16 positionbits=24", light + " bias=0.0137",
                   light + " filter=bilinear outside=dark mapbits=8 positionbits=11",
                   light + " pcf=6 bias=0.013",
                   "light=0.9,0.1,0,-0.31,-0.07,0.8,0,-0.42,0,0,1.02,-0.2,0,0,1,0 depth=planar bias=0.013"};
  return info;
}

OpInfo SoftShadowInfo() {
  OpInfo info;
  info.name = "softshadow";
  info.family = "shade";
  info.operands = [](const Arguments& a) { return a.Integer("N") + 1; };
  info.inputs = 3;
  info.summary = "Mean visibility of several samples of an area light";
  info.help =
      std::string(
          "POSITION MAP1 … MAPN --softshadow N: every map is tested as --shadow does, with its own matrix "
          "(the maps' worldToNDC, or lights= with 16 N numbers), and the visibilities are averaged: "
          "N + 1 levels. Jittered light positions give N levels in every penumbra. ") +
      kShadowHelp + "Source: Heckbert and Herf 1997.";
  info.help += " The lights' depths are held in memory whole.";
  info.bound = "as --shadow's";
  info.bound_u = 4;
  info.arguments = {IntegerModifier("N", "", 2, 256, "number of maps")};
  ParamInfo lights =
      ListModifier("lights", "", 4096, -1e38, 1e38, "16 numbers per map; default their metadata");
  lights.min_count = 32;
  info.modifiers = {lights};
  for (ParamInfo& m : ShadowModifiers()) info.modifiers.push_back(std::move(m));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const size_t count = in.size() - 1;
    std::vector<Matrix4> lights(count);
    std::vector<Node> maps;
    const std::vector<double>& numbers = a.Numbers("lights");
    if (a.Given("lights") && numbers.size() != 16 * count) {
      throw Error("softshadow:lights", "found " + std::to_string(numbers.size()) + " numbers, expected " +
                                           std::to_string(16 * count) + ", 16 for each map");
    }
    for (size_t k = 0; k < count; ++k) {
      if (a.Given("lights")) {
        std::copy_n(numbers.begin() + static_cast<ptrdiff_t>(16 * k), 16, lights[k].begin());
        maps.push_back(MapOf("softshadow", in[k + 1], a, Camera(lights[k], "softshadow:lights")));
      } else {
        const auto camera = Camera::FromMetadata(in[k + 1].spec());
        if (!camera) {
          throw DataError("softshadow",
                          "found map " + std::to_string(k + 1) +
                              " without worldToNDC, expected lights= with 16 numbers for each map");
        }
        lights[k] = camera->world_to_clip();
        maps.push_back(MapOf("softshadow", in[k + 1], a, *camera));
      }
    }
    return SoftShadow(PositionsOf(in[0]), maps, lights, ShadowArguments(a));
  };
  info.examples = {
      "2 pcf=3 mapbits=16 positionbits=24 "
      "lights=0.9,0.1,0.05,-0.31,-0.07,0.8,0.2,-0.42,0.11,0.21,1.3,-0.53,0.03,0.07,0.4,1.7,0.91,0.13,0.05,-0.33,-0.07,0.8,0.2,-0.4,0.13,0.21,1.3,-0.5,0.03,0.07,0.43,1.7"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Shadow(const Node& position, const Node& light_depth, const ShadowParams& params) {
  ops::RequireFinite3("shadow", "light", params.light);
  Inverse(params.light, "shadow light");
  if (params.size < 1 || params.size > 64) {
    throw Error("shadow", "found a filter of " + std::to_string(params.size) + " texels, expected 1 to 64");
  }
  if (!std::isfinite(params.bias))
    throw Error("shadow", "found a bias that is not finite, expected a number");
  ops::ShadowSettings settings;
  settings.shadow = params;
  settings.map_step = ops::StepOf(light_depth.spec().type, params.map_bits, false);
  settings.position_step = ops::StepOf(position.spec().type, params.position_bits, true);
  return graph::MakeNode(std::make_shared<const ops::ShadowOp>(settings), {position, DepthsOf(light_depth)});
}

Node SoftShadow(const Node& position, const std::vector<Node>& light_depths,
                const std::vector<Matrix4>& lights, const ShadowParams& params) {
  if (light_depths.size() != lights.size() || lights.empty() || lights.size() > 256) {
    throw Error("softshadow", "found " + std::to_string(light_depths.size()) + " maps and " +
                                  std::to_string(lights.size()) +
                                  " lights, expected equal numbers from 1 to 256");
  }
  std::vector<Node> visible;
  for (size_t k = 0; k < lights.size(); ++k) {
    ShadowParams p = params;
    p.light = lights[k];
    visible.push_back(Shadow(position, light_depths[k], p));
  }
  return Average(visible);
}

}  // namespace tessera
