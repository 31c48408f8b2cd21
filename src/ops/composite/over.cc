// Over and depth-sorted over, as oiiotool does them.
#include <algorithm>

#include "ops/composite/composite_ops.h"
#include "ops/composite/pick_kernels.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/composite.h"

namespace tessera {
namespace ops {
namespace {

void RequireAlpha(const char* op, const Node& a, const Node& b) {
  if (a.spec().alpha >= 0 || b.spec().alpha >= 0 || a.spec().channel_count() == 3) return;
  throw DataError(
      op, "found images without alpha, expected at least one with a channel A (or R,G,B, which are opaque)");
}

}  // namespace

OpInfo OverInfo() {
  OpInfo info;
  info.name = "over";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "The lower image of the stack over the upper one";
  info.help =
      "FG BG --over: each sample is FG + (1 - clamp(A, 0, 1)) BG, A the foreground's alpha, colours "
      "premultiplied; a depth channel (Z, depth) is the foreground's where that alpha is not 0, else the "
      "background's. As oiiotool --over, windows too: the result covers both images, transparent black where "
      "one has no pixel. Images without alpha are opaque: of RGBA and RGB the result is RGBA, the RGB one "
      "with alpha 1 where it has pixels. Floats are not limited; integers saturate, 8-bit results are correctly rounded. NaN follows IEEE 754, but in alpha counts as 0. Source: Porter and "
      "Duff 1984.";
  info.bound = "3 u (|FG| + |(1 - A) BG|)";
  info.bound_u = 3;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Over(in[0], in[1]); };
  info.examples = {""};
  return info;
}

OpInfo ZOverInfo() {
  OpInfo info;
  info.name = "zover";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "Over, the nearer pixel in front";
  info.help =
      "A B --zover: A over B where A's depth is <= B's, else B over A (so it is where a depth is NaN); both "
      "depths are compared before anything else, the smaller is nearer. Depth of the result: that of the "
      "front pixel where its alpha is above 0, else of the other. zeroisinf=1 takes depth 0 as infinitely "
      "far. As oiiotool --zover. For more than two images see --zcomposite.";
  info.bound = "3 u (|front| + |(1 - A) back|)";
  info.bound_u = 3;
  info.modifiers = {FlagModifier("zeroisinf", "1: depth 0 is infinitely far"), DepthModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return ZOver(in[0], in[1], {a.Flag("zeroisinf"), a.Text("depth")});
  };
  info.examples = {"depth=2", "depth=2 zeroisinf=1"};
  return info;
}

}  // namespace ops

Node Over(const Node& a, const Node& b) {
  ops::RequireAlpha("over", a, b);
  const ops::Layers layers = ops::MakeLayers("over", {a, b});
  const int depth = ops::FindDepth("over", layers.spec, "");
  const bool rgba =
      layers.spec.channel_count() == 4 && layers.spec.alpha == 3 && b.spec().alpha == 3 && depth < 0;
  ops::CompositeOp::Traits t{.name = "over",
                             .description = {},
                             .parameters = std::any(0),
                             .spec = layers.spec,
                             .rgba = rgba,
                             .make = {}};
  t.make = [rgba, depth](const graph::StageContext& context) {
    ops::BlendPlanes planes;
    if (!rgba) {
      planes.form = ops::BlendPlanes::Form::kPlanes;
      std::ranges::copy(ops::RolesOf(context, depth), planes.roles);
    }
    return ops::MakePorterDuffStage(ops::PorterDuff::kOverClamped, planes);
  };
  std::vector<Node> inputs = layers.images;
  if (!rgba) inputs.insert(inputs.end(), {ops::AlphaOf(layers.images[0]), ops::AlphaOf(layers.images[1])});
  return ops::MakeCompositeNode(std::move(t), std::move(inputs));
}

Node ZOver(const Node& a, const Node& b, const ZOverParams& params) {
  ops::RequireAlpha("zover", a, b);
  const ops::Layers layers = ops::MakeLayers("zover", {a, b});
  const int depth = ops::RequireDepth("zover", layers.spec, params.depth);
  ops::CompositeOp::Traits t{.name = "zover",
                             .description = {},
                             .parameters = ZOverParams{params.zero_is_infinite, std::to_string(depth)},
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [depth, zero = params.zero_is_infinite](const graph::StageContext& context) {
    ops::ChannelRole roles[4];
    std::ranges::copy(ops::RolesOf(context, depth), roles);
    return ops::MakeZOverStage(roles, zero);
  };
  const Node &fa = layers.images[0], &fb = layers.images[1];
  return ops::MakeCompositeNode(std::move(t), {fa, fb, ops::AlphaOf(fa), ops::AlphaOf(fb),
                                               ops::ChannelOf(fa, depth), ops::ChannelOf(fb, depth)});
}

}  // namespace tessera
