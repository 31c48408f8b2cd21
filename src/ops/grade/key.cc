// Screens: a matte by colour difference, and the screen's light taken away.
#include "base/number_text.h"
#include "ops/grade/grade_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"

namespace tessera {
namespace ops {
namespace {

// Numbers of the screen's channel and of the two others.
struct Order {
  int screen, first, second;
};
Order OrderOf(Screen screen) { return screen == Screen::kGreen ? Order{1, 0, 2} : Order{2, 0, 1}; }

void RequireColors(const char* op, const Node& image) {
  if (image.spec().channel_count() >= 3) return;
  throw DataError(
      op, "found " + std::to_string(image.spec().channel_count()) + " channels, expected R,G,B at least");
}

Node LimitOf(const Node& image, const Order& order, SpillLimit limit) {
  const Node a = Picked(image, {order.first}), b = Picked(image, {order.second});
  if (limit == SpillLimit::kLarger) return Max(a, b);
  if (limit == SpillLimit::kSmaller) return Min(a, b);
  return MulConstant(Add(a, b), {0.5});
}

// The image's colours with another channel in the screen's place.
Node Replaced(const Node& image, const Order& order, const Node& channel) {
  const Node four = AppendChannels(Picked(image, {0, 1, 2}), channel);
  std::vector<ChannelChoice> choices = {{0, 0, ""}, {1, 0, ""}, {2, 0, ""}};
  choices[static_cast<size_t>(order.screen)] = {3, 0,
                                                image.spec().channels[static_cast<size_t>(order.screen)]};
  return SelectChannels(four, choices);
}

ParamInfo ScreenModifier() {
  return ChoiceModifier("screen", {"green", "blue"}, "what the screen is painted");
}
Screen ScreenOf(const Arguments& a) { return a.Text("screen") == "blue" ? Screen::kBlue : Screen::kGreen; }

}  // namespace

OpInfo DespillInfo() {
  OpInfo info = MadeRow(
      "grade", "despill", "Take a screen's light from what is before it",
      "The screen's channel goes down to the limit that the two others give where it is above: their average, the larger "
      "or the smaller of them. amount= mixes with the image. Needs R,G,B; alpha and further channels are kept. Source: "
      "Smith and Blinn 1996.");
  info.modifiers = {
      ScreenModifier(),
      ChoiceModifier("limit", {"average", "larger", "smaller"}, "how much the screen's channel may have"),
      NumberModifier("amount", "1", 0, 1, "0 keeps the image")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& limit = a.Text("limit");
    return Despill(in[0], {.screen = ScreenOf(a),
                           .limit = limit == "larger"    ? SpillLimit::kLarger
                                    : limit == "smaller" ? SpillLimit::kSmaller
                                                         : SpillLimit::kAverage,
                           .amount = a.Number("amount")});
  };
  info.examples = {"screen=green", "screen=blue limit=larger", "limit=smaller amount=0.5"};
  info.identity = "amount=0";
  return info;
}

OpInfo KeyInfo() {
  OpInfo info = MadeRow(
      "grade", "key", "A matte by colour difference, for green and blue screens",
      "The screen's excess is its channel less the larger of the two others. Where it is at most keep= the matte is 1, from "
      "drop= on 0, a line between. The colours lose the excess (despill=0: they do not) and are multiplied by the matte, "
      "which becomes the alpha, times the image's own where it has one: R,G,B,A, premultiplied, for --over. Further "
      "channels are dropped. Needs R,G,B. Source: Smith and Blinn 1996.");
  info.modifiers = {ScreenModifier(),
                    NumberModifier("keep", "0.05", -1e6, 1e6, "excess up to which all is kept"),
                    NumberModifier("drop", "0.3", -1e6, 1e6, "excess from which nothing is kept"),
                    FlagModifier("despill", "0: the colours stay", "1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Key(in[0], {.screen = ScreenOf(a),
                       .keep = a.Number("keep"),
                       .drop = a.Number("drop"),
                       .despill = a.Flag("despill")});
  };
  info.examples = {"screen=green", "screen=blue keep=0.02 drop=0.2", "despill=0 drop=0.5"};
  return info;
}

}  // namespace ops

Node Despill(const Node& image, const DespillParams& p) {
  ops::RequireColors("despill", image);
  if (!(p.amount >= 0 && p.amount <= 1))
    throw Error("despill", "found amount=" + base::NumberText(p.amount) + ", expected 0 to 1");
  if (p.amount == 0) return image;
  const ops::Order order = ops::OrderOf(p.screen);
  const Node screen = ops::Picked(image, {order.screen});
  Node lowered = Min(screen, ops::LimitOf(image, order, p.limit));
  if (p.amount != 1) lowered = Interpolate(screen, lowered, p.amount);
  return ops::WithColors(image, ops::Replaced(image, order, lowered));
}

Node Key(const Node& image, const KeyParams& p) {
  ops::RequireColors("key", image);
  if (!(p.keep < p.drop)) {
    throw Error("key", "found keep=" + base::NumberText(p.keep) + " and drop=" + base::NumberText(p.drop) +
                           ", expected keep < drop");
  }
  const ops::Order order = ops::OrderOf(p.screen);
  const Node screen = ops::Picked(image, {order.screen});
  const Node limit = ops::LimitOf(image, order, SpillLimit::kLarger);
  const double slope = -1 / (p.drop - p.keep);
  Node matte = Clamp(AddConstant(MulConstant(Sub(screen, limit), {slope}), {-slope * p.drop}),
                     {.min = {0}, .max = {1}});
  if (image.spec().alpha >= 0) matte = Mul(matte, ops::Picked(image, {image.spec().alpha}));
  const Node colors =
      p.despill ? ops::Replaced(image, order, Min(screen, limit)) : ops::Picked(image, {0, 1, 2});
  return AppendChannels(Mul(colors, ops::Picked(matte, {0, 0, 0})),
                        SelectChannels(matte, std::vector<ChannelChoice>{{0, 0, "A"}}));
}

}  // namespace tessera
