// Lists of images: merged by depth, counted by depth, laid on as decals by priority.
#include <algorithm>
#include <cfloat>

#include "ops/composite/composite_ops.h"
#include "ops/composite/pick_kernels.h"
#include "ops/modifiers.h"

namespace tessera {
namespace ops {
namespace {

constexpr int kMostDecals = 7;  // a stencil of 8 bits has one for the base

ParamInfo CountModifier(const char* help, int most, const char* default_value) {
  return IntegerModifier("n", default_value, 1, most, help);
}

}  // namespace

OpInfo ZCompositeInfo() {
  OpInfo info;
  info.name = "zcomposite";
  info.family = "composite";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Integer("n"); };
  info.summary = "Merge images by their depth channel";
  info.help =
      "Takes n= images (2). mode=nearest: each pixel is, whole and depth included, that of the image whose "
      "depth is smallest, the first of equal ones; a NaN depth loses against every number. Depth 1 or "
      "infinity is the neutral element; the order of images matters at ties only. mode=over: pixels are "
      "sorted by depth, near to far (equal ones in order, NaN last), and each is laid over what lies behind "
      "it; depth is that of the nearest pixel whose alpha is above 0, else of the last. At most 256 images "
      "there. The result covers all windows; beyond its own an image is 0, depth included, which is near: "
      "give it a depth first (--crop then --depthtest), or equal windows. Source: McReynolds et al. 1997, "
      "14.4.";
  info.bound = "nearest: exact; over: 4 n u * sum of |A-weighted terms|";
  info.bound_u = 4;
  info.modifiers = {
      CountModifier("number of images", kMostSorted, "2"),
      ChoiceModifier("mode", {"nearest", "over"}, "the nearest pixel alone, or all laid over each other"),
      DepthModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return ZComposite({in.begin(), in.end()}, {a.Text("mode") == "over", a.Text("depth")});
  };
  info.identity = "n=2 depth=2";
  info.examples = {"depth=2", "n=5 depth=1", "n=4 depth=2 mode=over", "n=1 depth=0"};
  return info;
}

OpInfo DepthComplexityInfo() {
  OpInfo info;
  info.name = "depthcomplexity";
  info.family = "composite";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Integer("n"); };
  info.summary = "How many of several images have something at a pixel";
  info.help =
      "Takes n= images (2) and counts at every pixel those whose depth is below far=, in one channel: 0, 1, "
      "2, ... (times 1/255 it is a stencil). NaN does not count. Source: "
      "McReynolds et al. 1997, 14.3.";
  info.bound = "exact";
  info.modifiers = {
      CountModifier("number of images", 65536, "2"),
      NumberModifier("far", "1", -double{FLT_MAX}, double{FLT_MAX}, "depths from here on are nothing"),
      DepthModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return DepthComplexity({in.begin(), in.end()}, {static_cast<float>(a.Number("far")), a.Text("depth")});
  };
  info.examples = {"far=0.5 depth=2", "n=5 depth=0"};
  return info;
}

OpInfo DecalsInfo() {
  OpInfo info;
  info.name = "decals";
  info.family = "composite";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Integer("n") + 1; };
  info.summary = "Lay decals on a base, the first one on top";
  info.help =
      "BASE DECAL1 ... DECALn --decals:n=: where BASE has alpha above 0, the first decal whose alpha is "
      "above threshold= is laid over it; decals below it do not show there, and outside the base nothing "
      "changes: what priorities in a stencil buffer do, base value 2^n, decal k value 2^(k-1), drawn where "
      "less. BASE's depth stays. n is at most 7. Source: McReynolds et al. 1997, 14.2.";
  info.bound = "3 u (|decal| + |(1 - A) base|)";
  info.bound_u = 3;
  info.modifiers = {
      CountModifier("number of decals", kMostDecals, "1"),
      NumberModifier("threshold", "0", -double{FLT_MAX}, double{FLT_MAX}, "alpha that counts as nothing")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Decals(in[0], {in.begin() + 1, in.end()}, {static_cast<float>(a.Number("threshold"))});
  };
  info.examples = {"", "n=4 threshold=0.25", "n=7 threshold=0.5"};
  return info;
}

}  // namespace ops

Node ZComposite(const std::vector<Node>& images, const ZCompositeParams& params) {
  const ops::Layers layers = ops::MakeLayers("zcomposite", images);
  const int n = static_cast<int>(images.size());
  if (n > ops::kMostSorted) {
    throw Error("zcomposite", "found " + std::to_string(n) + " images, expected at most " +
                                  std::to_string(ops::kMostSorted));
  }
  const int depth = ops::RequireDepth("zcomposite", layers.spec, params.depth);
  std::vector<Node> inputs = layers.images;
  for (const Node& image : layers.images) inputs.push_back(ops::AlphaOf(image));
  for (const Node& image : layers.images) inputs.push_back(ops::ChannelOf(image, depth));
  ops::CompositeOp::Traits t{.name = "zcomposite",
                             .description = "zcomposite of " + std::to_string(n),
                             .parameters = ZCompositeParams{params.over, std::to_string(depth)},
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [n, over = params.over, depth](const graph::StageContext& context) {
    ops::ChannelRole roles[4];
    std::ranges::copy(ops::RolesOf(context, depth), roles);
    return ops::MakeDepthMergeStage(n, over, roles);
  };
  return ops::MakeCompositeNode(std::move(t), std::move(inputs));
}

Node DepthComplexity(const std::vector<Node>& images, const DepthComplexityParams& params) {
  const ops::Layers layers = ops::MakeLayers("depthcomplexity", images);
  const int n = static_cast<int>(images.size());
  const int depth = ops::RequireDepth("depthcomplexity", layers.spec, params.depth);
  std::vector<Node> inputs;
  for (const Node& image : layers.images) inputs.push_back(ops::ChannelOf(image, depth));
  ImageSpec spec = layers.spec;
  spec.channels = {"Y"};
  spec.alpha = -1;
  ops::CompositeOp::Traits t{.name = "depthcomplexity",
                             .description = {},
                             .parameters = params,
                             .spec = std::move(spec),
                             .rgba = false,
                             .make = {}};
  t.make = [n, far = params.far](const graph::StageContext&) { return ops::MakeDepthCountStage(n, far); };
  return ops::MakeCompositeNode(std::move(t), std::move(inputs));
}

Node Decals(const Node& base, const std::vector<Node>& decals, const DecalParams& params) {
  const int n = static_cast<int>(decals.size());
  if (n < 1 || n > ops::kMostDecals) {
    throw Error("decals", "found " + std::to_string(n) + " decals, expected 1 to 7");
  }
  std::vector<Node> images = {base};
  images.insert(images.end(), decals.begin(), decals.end());
  const ops::Layers layers = ops::MakeLayers("decals", images);
  const int depth = ops::FindDepth("decals", layers.spec, "");
  std::vector<Node> inputs = {layers.images[0], ops::AlphaOf(layers.images[0])};
  inputs.insert(inputs.end(), layers.images.begin() + 1, layers.images.end());
  for (size_t k = 1; k < layers.images.size(); ++k) inputs.push_back(ops::AlphaOf(layers.images[k]));
  ops::CompositeOp::Traits t{.name = "decals",
                             .description = {},
                             .parameters = params,
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [n, depth, threshold = params.threshold](const graph::StageContext& context) {
    ops::ChannelRole roles[4];
    std::ranges::copy(ops::RolesOf(context, depth), roles);
    return ops::MakeDecalStage(n, threshold, roles);
  };
  return ops::MakeCompositeNode(std::move(t), std::move(inputs));
}

}  // namespace tessera
