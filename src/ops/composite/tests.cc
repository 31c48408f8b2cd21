// Alpha, depth and stencil tests on whole images.
#include <algorithm>
#include <cfloat>

#include "ops/composite/composite_ops.h"
#include "ops/composite/pick_kernels.h"
#include "ops/modifiers.h"

namespace tessera {

const std::vector<std::string>& ComparisonNames() {
  static const std::vector<std::string> kNames = {"never",   "less",     "equal",  "lequal",
                                                  "greater", "notequal", "gequal", "always"};
  return kNames;
}

const std::vector<std::string>& StencilActionNames() {
  static const std::vector<std::string> kNames = {"keep", "zero",   "replace",   "incr",
                                                  "decr", "invert", "incr-wrap", "decr-wrap"};
  return kNames;
}

namespace ops {
namespace {

ParamInfo TestArgument(const char* help) { return ChoiceArgument("OP", ComparisonNames(), help); }
Comparison TestOf(const Arguments& a) { return ChoiceOf<Comparison>(ComparisonNames(), a.Text("OP")); }
StencilAction ActionOf(const Arguments& a, const char* name) {
  return ChoiceOf<StencilAction>(StencilActionNames(), a.Text(name));
}
ImageSpec OneChannel(ImageSpec spec) {
  spec.channels = {"Y"};
  spec.alpha = -1;
  return spec;
}

void RequireBytes(const StencilParams& p) {
  for (const int v : {p.reference, p.mask, p.write_mask}) {
    if (v < 0 || v > 255)
      throw Error("stencil", "found " + std::to_string(v) + ", expected a byte, 0 to 255");
  }
}

}  // namespace

OpInfo AlphaTestInfo() {
  OpInfo info;
  info.name = "alphatest";
  info.family = "composite";
  info.summary = "Discard pixels by their alpha";
  info.help =
      "Pixels whose alpha compares as OP with ref= keep their bits, the others become 0 in every channel: "
      "alpha OP ref. To discard pixels of alpha 0: greater, or notequal, with ref=0. A NaN alpha passes only "
      "notequal and always; an image without alpha is opaque. Source: OpenGL 2.1 section 4.1.4.";
  info.bound = "exact";
  info.arguments = {TestArgument("never, less, equal, lequal, greater, notequal, gequal or always")};
  info.modifiers = {
      NumberModifier("ref", "0", -double{FLT_MAX}, double{FLT_MAX}, "what alpha is compared with")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return AlphaTest(in[0], {TestOf(a), static_cast<float>(a.Number("ref"))});
  };
  info.examples = {"greater ref=0.5", "less ref=0.25", "equal ref=0.5", "lequal",
                   "notequal",        "gequal ref=1",  "never",         "always"};
  info.identity = "always";
  return info;
}

OpInfo DepthTestInfo() {
  OpInfo info;
  info.name = "depthtest";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "Foreground pixels that pass a depth test replace the background's";
  info.help =
      "FG BG --depthtest OP: where FG's depth compares as OP with BG's, FG's pixel is taken whole, depth "
      "included, else BG's: less is the usual rule, ties keep BG. scale= and bias= squeeze FG's depth first "
      "(z' = scale z + bias, two roundings) and the squeezed depth is what the result holds. A NaN depth of "
      "FG never passes less, equal or greater; where BG's depth is NaN, any number of FG passes. The result "
      "covers both windows.";
  info.bound = "exact; 3 u (|scale z| + |bias|) in a squeezed depth";
  info.bound_u = 3;
  info.arguments = {TestArgument("never, less, equal, lequal, greater, notequal, gequal or always")};
  info.modifiers = {NumberModifier("scale", "1", -double{FLT_MAX}, double{FLT_MAX}, "factor of FG's depth"),
                    NumberModifier("bias", "0", -double{FLT_MAX}, double{FLT_MAX}, "added to FG's depth"),
                    DepthModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return DepthTest(in[0], in[1],
                     {TestOf(a), static_cast<float>(a.Number("scale")), static_cast<float>(a.Number("bias")),
                      a.Text("depth")});
  };
  info.identity = "always depth=2";
  info.examples = {"less depth=2", "gequal depth=0", "greater depth=1", "notequal depth=2"};
  return info;
}

OpInfo StencilInfo() {
  OpInfo info;
  info.name = "stencil";
  info.family = "composite";
  info.inputs = 3;
  info.operands = [](const Arguments& a) { return a.Flag("update") ? 1 : 3; };
  info.summary = "Choose between two images, or update a mask, by a stencil test";
  info.help =
      "FG BG STENCIL --stencil OP: FG's pixel where (ref & mask) OP (S & mask), else BG's; S is the byte in "
      "the stencil "
      "image's first channel, code / 255.\n"
      "STENCIL --stencil OP:update=1 gives the stencil afterwards: pass= or fail= (keep, zero, replace by "
      "ref, incr and decr that saturate, invert, incr-wrap, decr-wrap) acts on the bits of writemask=. "
      "Values between codes are rounded to the nearest, NaN is 0. Source: OpenGL 4.6 section 17.3.3.";
  info.bound = "exact; an updated stencil is code / 255, correctly rounded";
  info.bound_u = 1;
  info.arguments = {
      TestArgument("how ref compares with the stencil: never, less, equal, lequal, greater, notequal, "
                   "gequal or always")};
  info.modifiers = {
      IntegerModifier("ref", "1", 0, 255, "reference, 0 to 255"),
      IntegerModifier("mask", "255", 0, 255, "bits that are compared"),
      FlagModifier("update", "1: takes the stencil alone and gives it after the actions"),
      OnlyWith("update", ChoiceModifier("pass", StencilActionNames(), "action where the test passes")),
      OnlyWith("update", ChoiceModifier("fail", StencilActionNames(), "action where it fails")),
      OnlyWith("update", IntegerModifier("writemask", "255", 0, 255, "bits that actions may change"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    StencilParams p{TestOf(a),           a.Integer("ref"),   a.Integer("mask"), a.Integer("writemask"),
                    ActionOf(a, "fail"), ActionOf(a, "pass")};
    return a.Flag("update") ? StencilUpdate(in[0], p) : StencilSelect(in[0], in[1], in[2], p);
  };
  info.identity = "always";
  info.examples = {"equal ref=128 mask=128",
                   "less ref=100",
                   "gequal ref=7 mask=15",
                   "never",
                   "always",
                   "less ref=100 update=1 pass=incr fail=decr",
                   "greater ref=60 update=1 pass=replace fail=invert",
                   "notequal ref=0 update=1 pass=incr-wrap fail=zero writemask=15",
                   "lequal ref=9 update=1 pass=decr-wrap"};
  return info;
}

}  // namespace ops

Node AlphaTest(const Node& image, const AlphaTestParams& params) {
  ops::CompositeOp::Traits t{.name = "alphatest",
                             .description = {},
                             .parameters = params,
                             .spec = image.spec(),
                             .rgba = false,
                             .make = {}};
  t.make = [params](const graph::StageContext&) { return ops::MakeAlphaTestStage(params); };
  return ops::MakeCompositeNode(std::move(t), {image, ops::AlphaOf(image)});
}

Node DepthTest(const Node& foreground, const Node& background, const DepthTestParams& params) {
  const ops::Layers layers = ops::MakeLayers("depthtest", {foreground, background});
  const int depth = ops::RequireDepth("depthtest", layers.spec, params.depth);
  DepthTestParams resolved = params;
  resolved.depth = std::to_string(depth);
  ops::CompositeOp::Traits t{.name = "depthtest",
                             .description = {},
                             .parameters = resolved,
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [params, depth](const graph::StageContext& context) {
    ops::ChannelRole roles[4];
    std::ranges::copy(ops::RolesOf(context, depth), roles);
    return ops::MakeDepthTestStage(roles, params);
  };
  const Node &f = layers.images[0], &b = layers.images[1];
  return ops::MakeCompositeNode(std::move(t), {f, b, ops::ChannelOf(f, depth), ops::ChannelOf(b, depth)});
}

Node StencilSelect(const Node& foreground, const Node& background, const Node& stencil,
                   const StencilParams& params) {
  ops::RequireBytes(params);
  const ops::Layers layers = ops::MakeLayers("stencil", {foreground, background});
  const ImageSpec specs[] = {layers.spec, stencil.spec()};
  graph::RequireSameWindow("stencil", specs);
  ops::CompositeOp::Traits t{.name = "stencil",
                             .description = {},
                             .parameters = params,
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [params](const graph::StageContext&) { return ops::MakeStencilSelectStage(params); };
  return ops::MakeCompositeNode(std::move(t),
                                {layers.images[0], layers.images[1], ops::ChannelOf(stencil, 0)});
}

Node StencilUpdate(const Node& stencil, const StencilParams& params) {
  ops::RequireBytes(params);
  ops::CompositeOp::Traits t{.name = "stencil",
                             .description = "stencil update",
                             .parameters = params,
                             .spec = ops::OneChannel(stencil.spec()),
                             .rgba = false,
                             .make = {}};
  t.make = [params](const graph::StageContext&) { return ops::MakeStencilUpdateStage(params); };
  return ops::MakeCompositeNode(std::move(t), {ops::ChannelOf(stencil, 0)});
}

}  // namespace tessera
