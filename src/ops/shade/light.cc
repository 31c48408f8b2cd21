// Light on positions: samples of area lights, spotlights and projected slides.
#include <cmath>
#include <memory>
#include <numbers>

#include "base/number_text.h"
#include "graph/op.h"
#include "model/shade_settings.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/light_kernel.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"

namespace tessera::ops {
namespace {

class DiffuseLightOp final : public graph::OpWith<LightSample> {
 public:
  explicit DiffuseLightOp(LightSample light) : OpWith(light) {}
  std::string Name() const override { return "diffuselight"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    graph::RequireColor("diffuselight positions", in[0]);
    graph::RequireColor("diffuselight normals", in[1]);
    ImageSpec out = in[0];
    out.channels = {"Y"};
    out.alpha = -1;
    return out;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeDiffuseLightStage(params());
  }
};

class SpotlightOp final : public graph::OpWith<ops::SpotlightSettings> {
 public:
  explicit SpotlightOp(ops::SpotlightSettings settings) : OpWith(std::move(settings)) {}
  std::string Name() const override { return "spotlight"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    graph::RequireColor("spotlight positions", in[0]);
    ImageSpec out = in[0];
    out.channels = {"R", "G", "B"};
    out.alpha = -1;
    return out;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    const SpotlightParams& p = params().light;
    SpotlightPlan plan;
    const Matrix4& m = p.light.world_to_clip();
    std::copy_n(m.begin(), 4, plan.x);
    std::copy_n(m.begin() + 4, 4, plan.y);
    std::copy_n(m.begin() + 12, 4, plan.w);
    for (size_t k = 0; k < 3; ++k) {
      plan.eye[k] = p.light.eye()[k], plan.forward[k] = p.light.forward()[k];
      plan.color[k] = p.color[k], plan.attenuation[k] = p.attenuation[k];
    }
    plan.exponent = p.exponent;
    const double degrees = std::numbers::pi / 180;
    plan.cos_outer = std::cos(p.cone * degrees);
    plan.cos_width = p.cone > 0 ? std::max(std::cos((p.cone - p.rim) * degrees) - plan.cos_outer, 1e-9) : 0;
    plan.perspective = p.light.perspective();
    plan.slide = params().slide;
    return MakeSpotlightStage(plan);
  }
};

}  // namespace

OpInfo DiffuseLightInfo() {
  OpInfo info;
  info.name = "diffuselight";
  info.family = "shade";
  info.inputs = 2;
  info.summary = "Light of one sample of an area light on a diffuse surface, unshadowed";
  info.help =
      "POSITION NORMAL --diffuselight:light=x,y,z:direction=x,y,z:area=A gives one channel: (A/pi) max(cos "
      "at the receiver, 0) max(cos at the light, 0) / max(r^2, A). direction is where the light faces; 0,0,0 "
      "sends light to all sides. Multiply by the sample's --shadow, sum over the samples, multiply by the "
      "surface's colour and add the ambient light: each hard shadow is weighted per pixel before the sum. 0 "
      "where the position or normal is NaN. Source: Heckbert and Herf 1997, 3.";
  info.bound = "8 u * (A/pi) |n| / max(r^2, A)";
  info.bound_u = 8;
  info.modifiers = {NumbersModifier("light", "0,10,0", 3, "the sample's place in world space"),
                    NumbersModifier("direction", "0,0,0", 3, "where it faces; 0,0,0: all sides"),
                    NumberModifier("area", "1", 1e-30, 1e30, "of this sample, square world units")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return DiffuseLight(PositionsOf(in[0]), NormalsOf(in[1]),
                        {VectorOf(a, "light"), VectorOf(a, "direction"), a.Number("area")});
  };
  info.examples = {"light=0.5,3,-0.5 direction=0,-1,0.2 area=0.25", "light=2,1.5,2"};
  return info;
}

OpInfo SpotlightInfo() {
  OpInfo info;
  info.name = "spotlight";
  info.family = "shade";
  info.operands = [](const Arguments& a) { return a.Flag("slide") ? 2 : 1; };
  info.inputs = 1;
  info.summary = "Light of a spot, or of a slide projector, on positions";
  info.help =
      "POSITION --spotlight:light=M gives R,G,B: color / (kc + kl d + kq d^2) times max(0, cos to the "
      "axis)^exponent, 0 behind the light and outside its frame. light= as --shadow's; d is the distance to "
      "it. cone= limits it to that half angle with a soft rim= inside. POSITION SLIDE --spotlight:slide=1 "
      "projects an image, bilinear, its edges the frame's: 0 beyond them. Add the lights, multiply by "
      "--shadow. The denominator is at least 1e-20. Source: Segal et al. 1992, 3.1 and 3.2.";
  info.bound = "16 u * |color slide| / attenuation, plus the slide's look-up";
  info.bound_u = 16;
  info.modifiers = {
      CameraModifier("light", "world to the light's clip space; default the position image's metadata"),
      NumbersModifier("color", "1,1,1", 3, "of the light"),
      NumbersModifier("attenuation", "1,0,0", 3, "kc,kl,kq"),
      NumberModifier("exponent", "0", 0, 1e6, "of the cosine to the axis"),
      NumberModifier("cone", "0", 0, 89.9, "half angle in degrees; 0: the whole frame"),
      OnlyWith("cone", NumberModifier("rim", "0", 0, 89.9, "degrees of soft edge inside the cone")),
      FlagModifier("slide", "one more operand: the slide")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    SpotlightParams p;
    p.light = NeededCamera("spotlight", a, "light", in.subspan(0, 1));
    p.color = VectorOf(a, "color"), p.attenuation = VectorOf(a, "attenuation");
    p.exponent = a.Number("exponent"), p.cone = a.Number("cone"), p.rim = a.Number("rim");
    return Spotlight(PositionsOf(in[0]), p, a.Flag("slide") ? in[1] : Node());
  };
  const std::string light =
      "light=0.9,0.1,0.05,-0.31,-0.07,0.8,0.2,-0.42,0.11,0.21,1.3,-0.53,0.03,0.07,0.4,1.7";
  info.examples = {light + " attenuation=0.2,0.1,0.3 exponent=3 color=1,0.9,0.7", light + " cone=40 rim=15"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node DiffuseLight(const Node& position, const Node& normal, const LightSample& light) {
  ops::RequireFinite3("diffuselight", "light", light.position);
  ops::RequireFinite3("diffuselight", "direction", light.direction);
  ops::RequireAtLeast("diffuselight", "area", light.area, 1e-300);
  return graph::MakeNode(std::make_shared<const ops::DiffuseLightOp>(light), {position, normal});
}

Node Spotlight(const Node& position, const SpotlightParams& p, const Node& slide) {
  ops::RequireFinite3("spotlight", "color", p.color);
  for (const double k : p.attenuation) ops::RequireAtLeast("spotlight", "attenuation", k, 0);
  ops::RequireAtLeast("spotlight", "exponent", p.exponent, 0);
  ops::RequireAtLeast("spotlight", "cone", p.cone, 0);
  if (!(p.rim >= 0 && p.rim <= p.cone) || p.cone >= 90) {
    throw Error("spotlight", "found cone " + base::NumberText(p.cone) + " and rim " +
                                 base::NumberText(p.rim) + ", expected 0 <= rim <= cone < 90 degrees");
  }
  ops::SpotlightSettings settings{p, static_cast<bool>(slide)};
  std::vector<Node> inputs = {position};
  if (slide) {
    // s w, t w, w of every position: s = (x/w + 1)/2, t = (1 - y/w)/2.
    const Matrix4& m = p.light.world_to_clip();
    TransformParams place;
    for (size_t k = 0; k < 4; ++k) {
      place.matrix[k] = 0.5 * (m[k] + m[12 + k]);
      place.matrix[4 + k] = 0.5 * (m[12 + k] - m[4 + k]);
      place.matrix[8 + k] = m[12 + k];
    }
    LookupParams lookup;
    lookup.wrap = {Wrap::kClamp};  // what lies beyond the frame is not lit
    lookup.axes = {0, 1, 2};
    lookup.projective = true;
    TableLayout layout;
    layout.dims = 2;
    inputs.push_back(ops::ThreeChannels(Lookup(TransformPoints(position, place), slide, layout, lookup)));
  }
  return graph::MakeNode(std::make_shared<const ops::SpotlightOp>(std::move(settings)), std::move(inputs));
}

}  // namespace tessera
