// What the compositing operations share: windows that cover all images, channels with a role, names.
#include "ops/composite/composite_ops.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "ops/arithmetic/operands.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

Node MakeCompositeNode(CompositeOp::Traits traits, std::vector<Node> inputs) {
  return graph::MakeNode(std::make_shared<const CompositeOp>(std::move(traits)), std::move(inputs));
}

namespace {

// An image without alpha beside one with it and otherwise as many channels is opaque: alpha 1 where that one
// has it.
Node WithAlphaOf(const Node& image, const ImageSpec& other) {
  const ImageSpec& spec = image.spec();
  if (spec.alpha >= 0 || other.alpha < 0 || spec.channel_count() + 1 != other.channel_count()) return image;
  std::vector<ChannelChoice> channels;
  for (int c = 0; c < spec.channel_count(); ++c)
    channels.push_back({c, 0, spec.channels[static_cast<size_t>(c)]});
  channels.insert(channels.begin() + other.alpha, {-1, 1, other.channels[static_cast<size_t>(other.alpha)]});
  return SelectChannels(image, channels);
}

}  // namespace

Layers MakeLayers(const std::string& op, const std::vector<Node>& given) {
  if (given.empty()) throw Error(op, "found no image, expected at least one");
  const auto with_alpha =
      std::find_if(given.begin(), given.end(), [](const Node& image) { return image.spec().alpha >= 0; });
  std::vector<Node> images;
  for (const Node& image : given)
    images.push_back(with_alpha == given.end() ? image : WithAlphaOf(image, with_alpha->spec()));
  std::vector<ImageSpec> specs;
  Layers layers{{}, images[0].spec()};
  for (const Node& image : images) {
    specs.push_back(image.spec());
    layers.spec.data_window = Union(layers.spec.data_window, specs.back().data_window);
    layers.spec.display_window = Union(layers.spec.display_window, specs.back().display_window);
  }
  for (size_t k = 0; k < images.size(); ++k) {
    const bool whole = specs[k].data_window == layers.spec.data_window;
    layers.images.push_back(whole ? images[k] : Crop(images[k], layers.spec.data_window));
    specs[k].data_window = layers.spec.data_window;
  }
  RequireSameShape(op, specs);
  return layers;
}

Node ChannelOf(const Node& image, int channel) {
  return SelectChannels(image, std::vector<ChannelChoice>{{channel, 0, "Y"}});
}

Node AlphaOf(const Node& image) {
  const int alpha = image.spec().alpha;
  if (alpha >= 0) return ChannelOf(image, alpha);
  return SelectChannels(image, std::vector<ChannelChoice>{{-1, 1, "Y"}});
}

int FindDepth(const std::string& op, const ImageSpec& spec, const std::string& channel) {
  if (!channel.empty()) {
    const int named = spec.ChannelIndex(channel);
    if (named >= 0) return named;
    const bool number =
        std::all_of(channel.begin(), channel.end(), [](unsigned char c) { return std::isdigit(c); });
    const int index = number && channel.size() < 6 ? std::stoi(channel) : -1;
    if (index >= 0 && index < spec.channel_count()) return index;
    std::string names;
    for (const std::string& name : spec.channels) names += (names.empty() ? "" : ",") + name;
    throw DataError(
        op, "found no channel " + channel + " among " + names + ", expected one of these or its number");
  }
  const std::vector<int> aov = FindAov(spec, Aov::kDepth);
  if (!aov.empty()) return aov[0];
  // In a layer of any name, but for the z of a vector's x,y,z.
  const auto lower = [](std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char x) { return std::tolower(x); });
    return text;
  };
  for (int c = 0; c < spec.channel_count(); ++c) {
    const std::string name = lower(spec.channels[static_cast<size_t>(c)]);
    const size_t start = name.rfind('.') + 1;
    const std::string layer = name.substr(0, start), last = name.substr(start);
    const bool vector = std::ranges::any_of(
        spec.channels, [&](const std::string& other) { return lower(other) == layer + "x"; });
    if (last == "depth" || (last == "z" && !vector)) return c;
  }
  return -1;
}

int RequireDepth(const std::string& op, const ImageSpec& spec, const std::string& channel) {
  const int depth = FindDepth(op, spec, channel);
  if (depth >= 0) return depth;
  std::string names;
  for (const std::string& name : spec.channels) names += (names.empty() ? "" : ",") + name;
  throw DataError(
      op, "found channels " + names + ", expected a depth channel (Z or depth; another one: depth=NAME)");
}

std::array<ChannelRole, 4> RolesOf(const graph::StageContext& context, int depth) {
  std::array<ChannelRole, 4> roles = {};
  for (size_t p = 0; p < 4; ++p) {
    const int c = context.channels[p];
    if (c >= 0 && c == context.output.alpha) roles[p] = ChannelRole::kAlpha;
    if (c >= 0 && c == depth) roles[p] = ChannelRole::kDepth;
  }
  return roles;
}

ParamInfo DepthModifier() {
  return TextModifier("depth", "the depth channel by name or number; default the first named Z or depth");
}

}  // namespace tessera::ops
