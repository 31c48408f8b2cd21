// All channels to one: weighted sum, maximum, minimum. Made of selections and of arithmetic, no kernel of
// their own.
#include <cfloat>
#include <cmath>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "ops/arithmetic/operands.h"
#include "ops/channels/channels_ops.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"

namespace tessera::ops {
namespace {

// One channel as an image whose channel has oiiotool's name for a single one.
Node OneChannel(const Node& image, int channel) { return SelectChannels(image, {{channel, 0, "Y"}}); }

// The channels one after the other through an operation on two images.
Node Folded(const Node& image, Node (*pair)(const Node&, const Node&)) {
  Node result = OneChannel(image, 0);
  for (int c = 1; c < image.spec().channel_count(); ++c) result = pair(result, OneChannel(image, c));
  return result;
}

OpInfo Row(const char* name, const char* summary, const std::string& what) {
  OpInfo info;
  info.name = name;
  info.family = "channels";
  info.summary = summary;
  info.help = "The result has one channel, Y: " + what +
              " Alpha and further channels count like the others (--ch R,G,B before it leaves them out). "
              "Windows and metadata are the image's.";
  info.examples = {""};
  return info;
}

}  // namespace

OpInfo ChannelSumInfo() {
  OpInfo info =
      Row("chsum", "Sum of all channels",
          "the sum of all channels times their weights. One weight serves all channels; of several the "
          "n-th is channel n's, channels beyond the list have weight 1 and weights beyond the last channel "
          "are ignored, as oiiotool. A channel of weight 0 takes no part, be it NaN (oiiotool: NaN).");
  info.bound =
      "4 u * sum of |weight * sample| for R,G,B; one rounding for each further channel and its weight";
  info.bound_u = 4;
  ParamInfo weight = ConstantsArgument("");
  weight.name = "weight";
  weight.default_value = "1";
  weight.help = "one number for all channels, or comma-separated ones per channel";
  info.modifiers = {weight};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return ChannelSum(in[0], {.weights = a.Numbers("weight")});
  };
  info.examples = {"weight=.2126,.7152,.0722,0", "", "weight=0.25", "weight=0,2,0,-1", "weight=0"};
  return info;
}

OpInfo MaxChannelInfo() {
  OpInfo info =
      Row("maxchan", "The largest channel of each pixel",
          "the largest sample of each pixel, bit for bit. A number wins over NaN; NaN only where all are.");
  info.bound = "exact";
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return MaxChannel(in[0]); };
  return info;
}

OpInfo MinChannelInfo() {
  OpInfo info =
      Row("minchan", "The smallest channel of each pixel",
          "the smallest sample of each pixel, bit for bit. A number wins over NaN; NaN only where all are.");
  info.bound = "exact";
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return MinChannel(in[0]); };
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ChannelSum(const Node& image, const ChannelSumParams& params) {
  ops::RequireConstants("chsum", params.weights);
  const ImageSpec& spec = image.spec();
  const auto weight = [&](int c) { return ops::ChannelValue(params.weights, c, 1); };
  Node sum;
  const auto add = [&sum](const Node& term) { sum = sum ? Add(sum, term) : term; };
  int next = 0;
  if (spec.channel_count() >= 3 && (spec.alpha < 0 || spec.alpha >= 3)) {
    // R, G and B by one matrix, of whose three equal results one is kept.
    std::vector<double> rows;
    for (int c = 0; c < 3; ++c) rows.insert(rows.end(), 3, weight(c));
    next = 3;
    if (weight(0) != 0 || weight(1) != 0 || weight(2) != 0)
      add(ops::OneChannel(ColorMatrix(image, {.values = rows}), 0));
  }
  for (int c = next; c < spec.channel_count(); ++c) {
    if (weight(c) == 0) continue;
    const Node term = ops::OneChannel(image, c);
    add(weight(c) == 1 ? term : MulConstant(term, {weight(c)}));
  }
  return sum ? sum : SelectChannels(image, {{-1, 0, "Y"}});
}

Node MaxChannel(const Node& image) { return ops::Folded(image, Max); }
Node MinChannel(const Node& image) { return ops::Folded(image, Min); }

}  // namespace tessera
