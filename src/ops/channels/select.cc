// Selects, repeats, renames channels and sets some to constants.
#include <cfloat>
#include <charconv>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/channels/channels_ops.h"
#include "ops/channels/names.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

using Choices = std::vector<ChannelChoice>;

class SelectOp final : public graph::OpWith<Choices> {
 public:
  explicit SelectOp(Choices choices) : OpWith(std::move(choices)) {}
  std::string Name() const override { return "ch"; }
  graph::OpKind Kind() const override { return graph::OpKind::kShuffle; }

  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const ImageSpec& in = inputs[0];
    if (params().empty())
      throw Error("ch", "found no channels, expected at least one of " + ListChannels(in));
    ImageSpec out = in;
    out.channels.clear();
    out.alpha = -1;
    for (const ChannelChoice& choice : params()) {
      if (choice.channel >= in.channel_count() || choice.channel < -1) {
        throw DataError("ch", "found channel " + std::to_string(choice.channel) + ", expected 0 to " +
                                  std::to_string(in.channel_count() - 1) + " (" + ListChannels(in) + ")");
      }
      if (!choice.name.empty()) {
        out.channels.push_back(choice.name);
      } else if (choice.channel >= 0) {
        if (choice.channel == in.alpha && out.alpha < 0) out.alpha = static_cast<int>(out.channels.size());
        out.channels.push_back(in.channels[static_cast<size_t>(choice.channel)]);
      } else {
        out.channels.push_back(PositionName(out.channels.size()));
      }
    }
    const int named = AlphaByName(out.channels);
    if (named >= 0) out.alpha = named;
    return out;
  }

  std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec>) const override {
    std::vector<graph::ChannelRef> map;
    for (const ChannelChoice& choice : params()) {
      map.push_back(choice.channel < 0 ? graph::ChannelRef{-1, 0, choice.value}
                                       : graph::ChannelRef{0, choice.channel, 0});
    }
    return map;
  }
};

std::optional<float> ParseConstant(const std::string& text) {
  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!std::isfinite(value)) throw Error("ch", "found \"" + text + "\", expected a finite number");
  return value;
}

// A channel by exact name, by name regardless of case, or by index.
int FindChannel(const ImageSpec& spec, const std::string& word) {
  const int exact = spec.ChannelIndex(word);
  if (exact >= 0) return exact;
  for (int c = 0; c < spec.channel_count(); ++c) {
    if (EqualIgnoringCase(spec.channels[static_cast<size_t>(c)], word)) return c;
  }
  int index = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (error == std::errc() && end == word.data() + word.size() && index >= 0 &&
      index < spec.channel_count()) {
    return index;
  }
  const std::string near = Nearest(word, spec.channels);
  throw DataError("ch",
                  (word.empty() ? std::string("found an empty entry") : "found no channel \"" + word + "\"") +
                      ", expected one of " + ListChannels(spec) +
                      (near.empty() ? "" : "; did you mean " + near + "?"));
}

ChannelChoice ParseChoice(const ImageSpec& spec, const std::string& word) {
  const size_t equals = word.find('=');
  // A channel's own name may hold an equals sign.
  if (equals == std::string::npos || spec.ChannelIndex(word) >= 0) return {FindChannel(spec, word), 0, ""};
  const std::string name = word.substr(0, equals), from = word.substr(equals + 1);
  if (spec.ChannelIndex(from) < 0) {
    if (const auto value = ParseConstant(from)) return {-1, *value, name};
  }
  return {FindChannel(spec, from), 0, name};
}

}  // namespace

OpInfo SelectChannelsInfo() {
  OpInfo info;
  info.name = "ch";
  info.family = "channels";
  info.summary = "Select, reorder, rename channels or set them to constants";
  info.help =
      "LIST holds comma-separated entries: a channel's name (upper and lower case are equal unless both "
      "exist) or its index from 0; NEW=CHANNEL renames; NEW=VALUE makes a constant channel, =VALUE one with "
      "the usual name of its position. Examples: B,G,R   R,G,B,A=1.0   Y,Y,Y   R=0.5,G,B. A channel that is "
      "missing is an error that lists those present (oiiotool warns and fills with 0). Alpha is the channel "
      "named A or alpha, or else the image's own where it was selected. Samples keep their bits, and "
      "channels that nobody selects are neither read nor computed.";
  info.bound = "exact";
  info.arguments = {TextModifier("LIST", "a comma-separated list of channels")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return SelectChannels(in[0], a.Text("LIST"));
  };
  info.identity = "0,1,2,3";
  info.examples = {"2,1,0", "0", "=0.5,N=1,0,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node SelectChannels(const Node& image, const std::vector<ChannelChoice>& choices) {
  return graph::MakeNode(std::make_shared<const ops::SelectOp>(choices), {image});
}

Node SelectChannels(const Node& image, const std::string& list) {
  std::vector<ChannelChoice> choices;
  for (const std::string& word : ops::SplitCommas(list))
    choices.push_back(ops::ParseChoice(image.spec(), word));
  return SelectChannels(image, choices);
}

Node AsColors(const Node& image, const std::function<Node(const Node&)>& transform) {
  const ImageSpec& spec = image.spec();
  if (spec.channel_count() >= 3) return transform(image);
  std::vector<int> own;
  for (int c = 0; c < spec.channel_count(); ++c) {
    if (c != spec.alpha) own.push_back(c);
  }
  if (own.empty()) return image;
  const bool grey = own.size() == 1;
  std::vector<ChannelChoice> colors = {
      {own[0], 0, "R"}, {own[grey ? 0 : 1], 0, "G"}, {grey ? own[0] : -1, 0, "B"}};
  std::vector<ChannelChoice> back(spec.channels.size());
  if (spec.alpha >= 0) {
    colors.push_back({spec.alpha, 0, "A"});
    back[static_cast<size_t>(spec.alpha)].channel = 3;
  }
  for (size_t k = 0; k < own.size(); ++k) back[static_cast<size_t>(own[k])].channel = static_cast<int>(k);
  for (size_t c = 0; c < back.size(); ++c) back[c].name = spec.channels[c];
  return SelectChannels(transform(SelectChannels(image, colors)), back);
}

}  // namespace tessera
