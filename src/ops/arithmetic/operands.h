// What the arithmetic operations share: checks of their images and lists of constants.
#ifndef TESSERA_OPS_ARITHMETIC_OPERANDS_H_
#define TESSERA_OPS_ARITHMETIC_OPERANDS_H_

#include <cfloat>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/registry.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/image.h"

namespace tessera::ops {

// More channels than any file format has.
inline constexpr int kMaxConstants = 65536;

// Parameters of an operation that has none.
struct NoParams {};

// The spec of a result whose images all have the first one's data window and channel count; throws Error
// otherwise.
inline ImageSpec RequireSameShape(const std::string& op, std::span<const ImageSpec> inputs) {
  graph::RequireSameWindow(op, inputs);
  for (const ImageSpec& input : inputs) {
    if (input.channel_count() == inputs[0].channel_count()) continue;
    const auto list = [](const ImageSpec& spec) {
      constexpr int kShown = 8;  // a file may have a thousand
      std::string text = std::to_string(spec.channel_count()) + " (";
      for (int c = 0; c < spec.channel_count() && c < kShown; ++c) {
        text += (c > 0 ? "," : "") + spec.channels[static_cast<size_t>(c)];
      }
      return text + (spec.channel_count() > kShown ? ",…)" : ")");
    };
    throw DataError(op, "operands differ in channels: " + list(inputs[0]) + " and " + list(input) +
                            ", expected the same number");
  }
  return inputs[0];
}

// The constant of a channel: one value serves all, channels beyond the list get `otherwise`.
inline double ChannelValue(const std::vector<double>& values, int channel, double otherwise) {
  if (values.size() == 1) return values[0];
  return channel >= 0 && static_cast<size_t>(channel) < values.size() ? values[static_cast<size_t>(channel)]
                                                                      : otherwise;
}

// Throws Error unless all values are finite in float32.
inline void RequireFinite(const std::string& op, const std::vector<double>& values) {
  for (double v : values) {
    if (!(std::fabs(v) <= double{FLT_MAX})) {
      throw Error(op, "found " + base::NumberText(v) + ", expected finite numbers within float32's range");
    }
  }
}
// The same, and at least one value.
inline void RequireConstants(const std::string& op, const std::vector<double>& values) {
  if (values.empty()) throw Error(op, "found no numbers, expected one, or one per channel");
  RequireFinite(op, values);
}

// The positional argument of an operation with constants; `role` says what they do.
inline ParamInfo ConstantsArgument(const std::string& role) {
  ParamInfo param;
  param.name = "VALUES";
  param.type = ParamType::kNumbers;
  param.help = "one number for all channels, or comma-separated ones per channel: " + role;
  param.max_count = kMaxConstants;
  param.min = -double{FLT_MAX};
  param.max = double{FLT_MAX};
  return param;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ARITHMETIC_OPERANDS_H_
