// Tone by numbers: exposure, lift and gain, ASC CDL, levels, vibrance.
#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "ops/grade/grade_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"

namespace tessera {
namespace ops {
namespace {

constexpr double kLargest = 1e6;  // of a number of a grade

}  // namespace

OpInfo MadeRow(const char* family, const char* name, const char* summary, const char* help) {
  OpInfo info;
  info.name = name;
  info.family = family;
  info.summary = summary;
  info.help = help;
  info.bound = "what the operations that it is made of make together";
  return info;
}

ParamInfo RgbModifier(const char* name, const char* default_value, const char* help) {
  ParamInfo p = ListModifier(name, default_value, 3, -kLargest, kLargest, help);
  p.counts = {1, 3};
  return p;
}

Rgb RgbOf(const Arguments& arguments, const char* name) {
  const std::vector<double>& v = arguments.Numbers(name);
  return v.size() == 1 ? Rgb{v[0], v[0], v[0]} : Rgb{v[0], v[1], v[2]};
}

Node Scaled(const Node& image, const Rgb& factor, const Rgb& summand) {
  Node result = image;
  if (factor != Rgb{1, 1, 1}) result = MulConstant(result, Listed(factor));
  if (summand != Rgb{0, 0, 0}) result = AddConstant(result, Listed(summand));
  return result;
}

Node Powers(const Node& image, const Rgb& exponents) {
  if (exponents == Rgb{1, 1, 1}) return image;
  CurveParams curves;
  for (const double e : exponents) {
    CurveFormula formula;
    formula.kind = e == 1 ? CurveFormula::Kind::kLinear : CurveFormula::Kind::kPower;
    formula.exponent = e;
    formula.negatives = Negatives::kKeep;
    curves.formulas.push_back(formula);
  }
  return ApplyCurve(image, curves);
}

Node Picked(const Node& image, const std::vector<int>& channels) {
  std::vector<ChannelChoice> choices;
  for (const int c : channels) choices.push_back({c, 0, ""});
  return SelectChannels(image, choices);
}

Node WithColors(const Node& image, const Node& colors) {
  std::vector<int> others;
  for (int c = 3; c < image.spec().channel_count(); ++c) others.push_back(c);
  return others.empty() ? colors : AppendChannels(colors, Picked(image, others));
}

OpInfo ExposureInfo() {
  OpInfo info = MadeRow(
      "grade", "exposure", "Exposure in stops",
      "R,G,B times 2^STOPS: one stop more is twice the light. For linear light; codes of a display are decoded first "
      "(--curve:inverse=1 srgb). Alpha and further channels are kept; 0 returns the input bit for bit.");
  info.arguments = {NumberModifier("STOPS", "", -60, 60, "stops, 0 keeps the image")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Exposure(in[0], a.Number("STOPS"));
  };
  info.examples = {"1.5", "-2", "0.333"};
  info.identity = "0";
  return info;
}

OpInfo GradeInfo() {
  OpInfo info = MadeRow(
      "grade", "grade", "Lift, gamma and gain, black and white",
      "R,G,B become multiply (gain - lift) / (white - black) (v - black) + multiply lift + offset, then to the power "
      "1/gamma: the controls of a compositor's Grade. Each is one number, or three for R,G,B. What lies below 0 is kept "
      "from the power, or is 0 with clampblack=1; clampwhite=1 limits the result to 1. Alpha and further channels are "
      "kept.");
  info.modifiers = {RgbModifier("black", "0", "the input that becomes lift"),
                    RgbModifier("white", "1", "the input that becomes gain"),
                    RgbModifier("lift", "0", "what black becomes"),
                    RgbModifier("gain", "1", "what white becomes"),
                    RgbModifier("multiply", "1", "factor of all"),
                    RgbModifier("offset", "0", "added to all"),
                    RgbModifier("gamma", "1", "above 1 lifts the middle"),
                    FlagModifier("clampblack", "1: below 0 is 0"),
                    FlagModifier("clampwhite", "1: above 1 is 1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Grade(in[0], {.black = RgbOf(a, "black"),
                         .white = RgbOf(a, "white"),
                         .lift = RgbOf(a, "lift"),
                         .gain = RgbOf(a, "gain"),
                         .multiply = RgbOf(a, "multiply"),
                         .offset = RgbOf(a, "offset"),
                         .gamma = RgbOf(a, "gamma"),
                         .clamp_black = a.Flag("clampblack"),
                         .clamp_white = a.Flag("clampwhite")});
  };
  info.examples = {"lift=0.02,0,0.03 gamma=1.2 gain=1.1,1,0.95", "black=0.05 white=0.8", "gain=1.3",
                   "multiply=0.9 offset=0.05,0,-0.05", "gamma=0.8,1,1.4 clampblack=1 clampwhite=1"};
  info.identity = "gain=1";
  return info;
}

OpInfo CdlInfo() {
  OpInfo info = MadeRow(
      "grade", "cdl", "ASC CDL: slope, offset, power, saturation",
      "R,G,B become (slope v + offset)^power, then saturation about Rec.709's luminance: the ten numbers of a colour "
      "decision list, version 1.2. Values are limited to [0,1] before the power and at the end, as the ASC wants it; "
      "clamp=0 limits nothing and keeps what lies below 0 from the power. Files of these numbers (.cc, .ccc, .cdl) are "
      "read by --lut. Alpha and further channels are kept.");
  info.modifiers = {RgbModifier("slope", "1", "factor, at least 0"), RgbModifier("offset", "0", "added"),
                    RgbModifier("power", "1", "exponent, above 0"),
                    NumberModifier("saturation", "1", 0, kLargest, "0 is grey, 1 keeps"),
                    FlagModifier("clamp", "0: nothing is limited", "1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Cdl(in[0], {.slope = RgbOf(a, "slope"),
                       .offset = RgbOf(a, "offset"),
                       .power = RgbOf(a, "power"),
                       .saturation = a.Number("saturation"),
                       .clamp = a.Flag("clamp")});
  };
  info.examples = {"slope=1.1,1,0.9 offset=0.01,0,-0.02 power=1,0.95,1.1 saturation=1.2", "slope=1.2 clamp=0",
                   "offset=-0.1 power=0.8 clamp=0", "saturation=0.5"};
  info.identity = "slope=1 clamp=0";
  return info;
}

OpInfo LevelsInfo() {
  OpInfo info = MadeRow(
      "grade", "levels", "Levels: black, white, middle",
      "(v - BLACK) / (WHITE - BLACK), limited to [0,1], to the power 1/gamma, and from [0,1] to outblack and outwhite. "
      "clamp=0 limits nothing and keeps what lies below 0 from the power. BLACK and WHITE may be three numbers for "
      "R,G,B. Alpha and further channels are kept.");
  ParamInfo black = RgbModifier("BLACK", "", "the input that becomes outblack");
  ParamInfo white = RgbModifier("WHITE", "", "the input that becomes outwhite");
  info.arguments = {black, white};
  info.modifiers = {NumberModifier("gamma", "1", 1e-3, 1e3, "above 1 lifts the middle"),
                    NumberModifier("outblack", "0", -kLargest, kLargest, "what BLACK becomes"),
                    NumberModifier("outwhite", "1", -kLargest, kLargest, "what WHITE becomes"),
                    FlagModifier("clamp", "0: nothing is limited", "1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Levels(in[0], {.black = RgbOf(a, "BLACK"),
                          .white = RgbOf(a, "WHITE"),
                          .gamma = a.Number("gamma"),
                          .out_black = a.Number("outblack"),
                          .out_white = a.Number("outwhite"),
                          .clamp = a.Flag("clamp")});
  };
  info.examples = {"0.05 0.85 gamma=1.2", "0.1,0.05,0 0.9", "0 0.5 clamp=0",
                   "0.2 0.8 outblack=0.1 outwhite=0.9"};
  return info;
}

OpInfo VibranceInfo() {
  OpInfo info = MadeRow(
      "grade", "vibrance", "More saturation where there is little",
      "R,G,B become L + (1 + AMOUNT (1 - s)) (v - L), L the luminance by Rec.709's weights and s = max - min of R,G,B, "
      "limited to [0,1]: pale colours gain, strong ones stay. A negative AMOUNT takes from the pale ones. Alpha and "
      "further channels are kept.");
  info.arguments = {NumberModifier("AMOUNT", "", -100, 100,
                                   "0 keeps the colours, 1 at most doubles their distance from grey")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Vibrance(in[0], a.Number("AMOUNT"));
  };
  info.examples = {"0.6", "-0.5", "1"};
  info.identity = "0";
  return info;
}

}  // namespace ops

Node Exposure(const Node& image, double stops) {
  if (!(std::fabs(stops) <= 60)) {
    throw Error("exposure", "found " + base::NumberText(stops) + " stops, expected -60 to 60");
  }
  const double factor = std::exp2(stops);
  return AsColors(image, [&](const Node& colors) { return MulConstant(colors, {factor, factor, factor}); });
}

Node Grade(const Node& image, const GradeParams& p) {
  Rgb factor, summand, exponent;
  for (size_t c = 0; c < 3; ++c) {
    const double range = p.white[c] - p.black[c];
    if (range == 0 || !(p.gamma[c] > 0)) {
      throw Error("grade",
                  range == 0 ? "found black=" + base::NumberText(p.black[c]) +
                                   " equal to white, expected two different values"
                             : "found gamma=" + base::NumberText(p.gamma[c]) + ", expected a number above 0");
    }
    factor[c] = p.multiply[c] * (p.gain[c] - p.lift[c]) / range;
    summand[c] = p.offset[c] + p.multiply[c] * p.lift[c] - factor[c] * p.black[c];
    exponent[c] = 1 / p.gamma[c];
  }
  return AsColors(image, [&](const Node& colors) {
    Node result = ops::Scaled(colors, factor, summand);
    if (p.clamp_black) result = Clamp(result, {.min = {0, 0, 0}, .max = {}});
    result = ops::Powers(result, exponent);
    return p.clamp_white ? Clamp(result, {.min = {}, .max = {1, 1, 1}}) : result;
  });
}

Node Cdl(const Node& image, const CdlParams& p) {
  for (size_t c = 0; c < 3; ++c) {
    if (p.slope[c] >= 0 && p.power[c] > 0) continue;
    throw Error("cdl", "found slope=" + base::NumberText(p.slope[c]) +
                           " and power=" + base::NumberText(p.power[c]) +
                           ", expected a slope of at least 0, a power above 0");
  }
  if (!(p.saturation >= 0))
    throw Error("cdl", "found saturation=" + base::NumberText(p.saturation) + ", expected at least 0");
  const auto limited = [&](const Node& n) {
    return p.clamp ? Clamp(n, {.min = {0, 0, 0}, .max = {1, 1, 1}}) : n;
  };
  return AsColors(image, [&](const Node& colors) {
    const Node powered = ops::Powers(limited(ops::Scaled(colors, p.slope, p.offset)), p.power);
    return limited(p.saturation == 1 ? powered : Saturate(powered, p.saturation));
  });
}

Node Levels(const Node& image, const LevelsParams& p) {
  if (!(p.gamma > 0)) {
    throw Error("levels", "found gamma=" + base::NumberText(p.gamma) + ", expected a number above 0");
  }
  Rgb factor, summand;
  for (size_t c = 0; c < 3; ++c) {
    if (p.white[c] == p.black[c]) {
      throw Error("levels", "found black and white at " + base::NumberText(p.black[c]) +
                                ", expected two different values");
    }
    factor[c] = 1 / (p.white[c] - p.black[c]);
    summand[c] = -p.black[c] * factor[c];
  }
  const double range = p.out_white - p.out_black;
  return AsColors(image, [&](const Node& colors) {
    Node result = ops::Scaled(colors, factor, summand);
    if (p.clamp) result = Clamp(result, {.min = {0, 0, 0}, .max = {1, 1, 1}});
    result = ops::Powers(result, {1 / p.gamma, 1 / p.gamma, 1 / p.gamma});
    return ops::Scaled(result, {range, range, range}, {p.out_black, p.out_black, p.out_black});
  });
}

Node Vibrance(const Node& image, double amount) {
  if (!(std::fabs(amount) <= 100)) {
    throw Error("vibrance", "found " + base::NumberText(amount) + ", expected -100 to 100");
  }
  if (amount == 0) return image;
  return AsColors(image, [&](const Node& colors) {
    const Node rgb = ops::Picked(colors, {0, 1, 2}), grey = ops::Picked(Luminance(rgb), {0, 1, 2});
    const Node span = Clamp(Sub(MaxChannel(rgb), MinChannel(rgb)), {.min = {0}, .max = {1}});
    const Node factor = AddConstant(MulConstant(span, {-amount}), {1 + amount});
    const Node mixed = Mad(Sub(rgb, grey), ops::Picked(factor, {0, 0, 0}), grey);
    return ops::WithColors(colors, mixed);
  });
}

}  // namespace tessera
