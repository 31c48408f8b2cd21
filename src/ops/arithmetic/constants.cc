// An image and a constant per channel: add, subtract, multiply, divide, minimum, maximum. All are affine
// operations, so that neighbours fold into one.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "ops/color/affine.h"
#include "ops/modifiers.h"
#include "tessera/ops/arithmetic.h"

namespace tessera::ops {
namespace {

// The affine operation of this image's shape that changes nothing yet.
AffineParams Unchanged(const ImageSpec& spec) {
  AffineParams affine;
  affine.channels = spec.channel_count();
  affine.alpha = spec.alpha;
  affine.scale.assign(spec.channels.size(), 1.0);
  affine.bias.assign(spec.channels.size(), 0.0);
  affine.limits.assign(spec.channels.size(), Limits());
  return affine;
}

// `set(affine, c, value)` puts a channel's constant in its place.
template <class F>
Node WithConstants(const char* name, const Node& image, const std::vector<double>& values, double otherwise,
                   F set) {
  RequireConstants(name, values);
  AffineParams affine = Unchanged(image.spec());
  for (int c = 0; c < affine.channels; ++c)
    set(affine, static_cast<size_t>(c), ChannelValue(values, c, otherwise));
  return graph::MakeNode(MakeAffine(name, std::move(affine), ChannelConstants{values}), {image});
}

OpInfo Row(const char* name, const char* summary, const char* role, const char* formula,
           const char* otherwise) {
  OpInfo info;
  info.name = name;
  info.family = "arithmetic";
  info.summary = summary;
  info.arguments = {ConstantsArgument(role)};
  info.help =
      std::string("Each sample of the result is ") + formula +
      ". One value serves all channels, alpha included; of several values the n-th is channel n's, channels "
      "beyond the list have c = " +
      otherwise + " and values beyond the last channel are ignored, as oiiotool. Nothing else is clamped.";
  return info;
}

}  // namespace

OpInfo AddConstantInfo() {
  OpInfo info = Row("addc", "Add a constant per channel", "added", "A + c", "0");
  info.bound = "2 u * (|A| + |c|)";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return AddConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"0.1,0.2,-0.3,0", "0.5", "-1e-3,0.25", "0"};
  info.identity = "0";
  return info;
}

OpInfo SubConstantInfo() {
  OpInfo info = Row("subc", "Subtract a constant per channel", "subtracted", "A - c", "0");
  info.bound = "2 u * (|A| + |c|)";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return SubConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"0.1,0.2,-0.3,0", "0.5", "0"};
  info.identity = "0";
  return info;
}

OpInfo MulConstantInfo() {
  OpInfo info = Row("mulc", "Multiply by a constant per channel", "factors", "A * c", "1");
  info.bound = "2 u * |A c|";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MulConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"1.1,0.9,0.5,1", "2.5", "0.3,-2", "1"};
  info.identity = "1";
  return info;
}

OpInfo DivConstantInfo() {
  OpInfo info = Row("divc", "Divide by a constant per channel", "divisors", "A / c", "1");
  info.help +=
      " A divisor of 0 multiplies by 0, so that numbers become 0, as oiiotool's; NaN and infinities become NaN "
      "there. A divisor whose reciprocal is beyond float's range (below 2.94e-39) is refused.";
  info.bound = "2 u * |A / c|";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return DivConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"1.5,0.8,2,1", "2", "0.3,-7", "0.5,0", "1"};
  info.identity = "1";
  return info;
}

OpInfo MinConstantInfo() {
  OpInfo info = Row("minc", "Limit from above by a constant per channel", "upper limits", "min(A, c)", "0");
  info.help += " The constant wins over NaN.";
  info.bound = "1 rounding of each constant";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MinConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"0.5", "0.1,0.9,0.5,1", "0.3,0.7"};
  return info;
}

OpInfo MaxConstantInfo() {
  OpInfo info = Row("maxc", "Limit from below by a constant per channel", "lower limits", "max(A, c)", "0");
  info.help += " The constant wins over NaN.";
  info.bound = "1 rounding of each constant";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MaxConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"0.5", "0.1,0.9,0.5,1", "0.3,0.7"};
  return info;
}

OpInfo InvertInfo() {
  OpInfo info;
  info.name = "invert";
  info.family = "arithmetic";
  info.summary = "Subtract from 1";
  info.help =
      "Channels from chbegin up to but without chend become 1 - A; the others keep their bits. The default "
      "is the first three, which spares alpha. The inverse of premultiplied colours is alpha - A: "
      "--unpremult first where that is meant.";
  info.bound = "2 u * (|A| + 1)";
  info.bound_u = 2;
  ParamInfo first = IntegerModifier("chbegin", "0", 0, kMaxConstants, "first channel, from 0");
  ParamInfo last = first;
  last.name = "chend";
  last.default_value = "3";
  last.help = "one past the last channel";
  info.modifiers = {first, last};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Invert(in[0], {.first = a.Integer("chbegin"), .last = a.Integer("chend")});
  };
  info.examples = {"", "chend=4", "chbegin=1 chend=2", "chbegin=0 chend=0"};
  info.identity = "chbegin=0 chend=0";
  return info;
}

OpInfo ClampInfo() {
  OpInfo info;
  info.name = "clamp";
  info.family = "arithmetic";
  info.summary = "Limit values";
  info.help =
      "min= and max= hold one limit for all channels, or one per channel; a channel without a limit is free "
      "on that side. clampalpha=1 limits alpha to [0, 1] as well. A limit wins over NaN, the lower one where "
      "there are both; a channel without limits keeps its bits. Without modifiers nothing is limited, as "
      "oiiotool.";
  info.bound = "1 rounding of each limit";
  info.bound_u = 1;
  ParamInfo low = ConstantsArgument("");
  low.name = "min";
  low.help = "lower limits, one or per channel; none by default";
  ParamInfo high = low;
  high.name = "max";
  high.help = "upper limits, one or per channel; none by default";
  info.modifiers = {low, high, FlagModifier("clampalpha", "1 limits alpha to [0, 1]")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Clamp(in[0],
                 {.min = a.Numbers("min"), .max = a.Numbers("max"), .clamp_alpha = a.Flag("clampalpha")});
  };
  info.identity = "clampalpha=0";
  info.examples = {"min=0 max=1", "min=0.1,0.2 max=0.5,0.6,0.7", "max=0.9", "min=-1e30 clampalpha=1", ""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node AddConstant(const Node& image, const std::vector<double>& values) {
  return ops::WithConstants("addc", image, values, 0,
                            [](ops::AffineParams& p, size_t c, double v) { p.bias[c] = v; });
}
Node SubConstant(const Node& image, const std::vector<double>& values) {
  return ops::WithConstants("subc", image, values, 0,
                            [](ops::AffineParams& p, size_t c, double v) { p.bias[c] = v == 0 ? 0 : -v; });
}
Node MulConstant(const Node& image, const std::vector<double>& values) {
  return ops::WithConstants("mulc", image, values, 1,
                            [](ops::AffineParams& p, size_t c, double v) { p.scale[c] = v; });
}
Node DivConstant(const Node& image, const std::vector<double>& values) {
  for (const double v : values) {
    if (v == 0 || std::fabs(1 / v) <= double{FLT_MAX}) continue;
    throw Error("divc", "found " + base::NumberText(v) +
                            ", expected 0 or a divisor whose reciprocal is within float32's range");
  }
  return ops::WithConstants("divc", image, values, 1, [](ops::AffineParams& p, size_t c, double v) {
    p.scale[c] = v == 0 ? 0 : 1 / v;
  });
}
Node MinConstant(const Node& image, const std::vector<double>& values) {
  return ops::WithConstants("minc", image, values, 0, [](ops::AffineParams& p, size_t c, double v) {
    p.limits[c] = ops::MakeLimits(-ops::kNoLimit, v);
  });
}
Node MaxConstant(const Node& image, const std::vector<double>& values) {
  return ops::WithConstants("maxc", image, values, 0, [](ops::AffineParams& p, size_t c, double v) {
    p.limits[c] = ops::MakeLimits(v, ops::kNoLimit);
  });
}

Node Invert(const Node& image, const InvertParams& params) {
  if (params.first < 0 || params.last < params.first) {
    throw Error("invert", "found channels " + std::to_string(params.first) + " to " +
                              std::to_string(params.last) + ", expected 0 <= chbegin <= chend");
  }
  ops::AffineParams affine = ops::Unchanged(image.spec());
  for (int c = params.first; c < params.last && c < affine.channels; ++c) {
    affine.scale[static_cast<size_t>(c)] = -1;
    affine.bias[static_cast<size_t>(c)] = 1;
  }
  return graph::MakeNode(ops::MakeAffine("invert", std::move(affine), params), {image});
}

Node Clamp(const Node& image, const ClampParams& params) {
  ops::RequireFinite("clamp:min", params.min);
  ops::RequireFinite("clamp:max", params.max);
  ops::AffineParams affine = ops::Unchanged(image.spec());
  for (int c = 0; c < affine.channels; ++c) {
    const double low = ops::ChannelValue(params.min, c, -ops::kNoLimit);
    const double high = ops::ChannelValue(params.max, c, ops::kNoLimit);
    if (low > high) {
      throw Error("clamp", "found a minimum " + base::NumberText(low) + " above the maximum " +
                               base::NumberText(high) + " in channel " + std::to_string(c) +
                               ", expected min <= max");
    }
    affine.limits[static_cast<size_t>(c)] = ops::MakeLimits(low, high);
  }
  if (params.clamp_alpha && affine.alpha >= 0) {
    // As oiiotool: limited by its own limits first, then to [0, 1].
    ops::Limits& limits = affine.limits[static_cast<size_t>(affine.alpha)];
    limits = ops::MakeLimits(std::clamp(limits.low, 0.0, 1.0), std::clamp(limits.high, 0.0, 1.0));
  }
  return graph::MakeNode(ops::MakeAffine("clamp", std::move(affine), params), {image});
}

}  // namespace tessera
