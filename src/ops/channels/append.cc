// Appends the channels of one image to another's.
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/channels/channels_ops.h"
#include "ops/union.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

struct AppendParams {};

class AppendOp final : public graph::OpWith<AppendParams> {
 public:
  AppendOp() : OpWith({}) {}
  std::string Name() const override { return "chappend"; }
  graph::OpKind Kind() const override { return graph::OpKind::kShuffle; }

  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow("chappend", inputs);
    ImageSpec out = inputs[0];
    const int first = inputs[0].channel_count();
    for (const std::string& name : inputs[1].channels) {
      const bool taken = std::find(out.channels.begin(), out.channels.end(), name) != out.channels.end();
      out.channels.push_back(taken ? std::string("channel").append(std::to_string(out.channels.size()))
                                   : name);
    }
    if (out.alpha < 0 && inputs[1].alpha >= 0) out.alpha = first + inputs[1].alpha;
    return out;
  }

  std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec> inputs) const override {
    std::vector<graph::ChannelRef> map;
    for (int k = 0; k < 2; ++k) {
      for (int c = 0; c < inputs[static_cast<size_t>(k)].channel_count(); ++c) map.push_back({k, c, 0});
    }
    return map;
  }
};

}  // namespace

OpInfo AppendChannelsInfo() {
  OpInfo info;
  info.name = "chappend";
  info.family = "channels";
  info.inputs = 2;
  info.summary = "Append the channels of two images";
  info.help =
      "The result has all channels of the lower image, then all of the upper one, and covers "
      "both data windows, as oiiotool's: a pixel that one of them does not have is 0 in its channels. A name that is taken already becomes channelN, N its position from 0. Alpha is the lower "
      "image's, or else the upper one's. Samples keep their bits.";
  info.bound = "exact";
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return AppendChannels(in[0], in[1]);
  };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node AppendChannels(const Node& a, const Node& b) {
  return graph::MakeNode(std::make_shared<const ops::AppendOp>(), ops::OnUnion({a, b}));
}

}  // namespace tessera
