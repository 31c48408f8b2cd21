// Renames channels.
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/channels/channels_ops.h"
#include "ops/channels/names.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

class RenameOp final : public graph::OpWith<std::vector<std::string>> {
 public:
  explicit RenameOp(std::vector<std::string> names) : OpWith(std::move(names)) {}
  std::string Name() const override { return "chnames"; }
  graph::OpKind Kind() const override { return graph::OpKind::kShuffle; }

  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    for (size_t c = 0; c < out.channels.size() && c < params().size(); ++c) {
      if (!params()[c].empty()) out.channels[c] = params()[c];
    }
    const int named = AlphaByName(out.channels);
    if (named >= 0) out.alpha = named;
    return out;
  }

  std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec> inputs) const override {
    std::vector<graph::ChannelRef> map;
    for (int c = 0; c < inputs[0].channel_count(); ++c) map.push_back({0, c, 0});
    return map;
  }
};

}  // namespace

OpInfo RenameChannelsInfo() {
  OpInfo info;
  info.name = "chnames";
  info.family = "channels";
  info.summary = "Rename channels";
  info.help =
      "NAMES holds comma-separated names, in channel order. An empty name, or one that the list does not "
      "reach, stays; names beyond the last channel are ignored. A channel named A or alpha becomes the alpha "
      "channel.";
  info.bound = "exact";
  info.arguments = {TextModifier("NAMES", "a comma-separated list of names")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return RenameChannels(in[0], SplitCommas(a.Text("NAMES")));
  };
  info.examples = {"X,Y,Z", ",,Z"};
  info.identity = "X";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node RenameChannels(const Node& image, const std::vector<std::string>& names) {
  return graph::MakeNode(std::make_shared<const ops::RenameOp>(names), {image});
}

}  // namespace tessera
