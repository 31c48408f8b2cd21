// Modifiers that the filters share.
#include "ops/modifiers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>

#include "ops/filter/filter_ops.h"
#include "ops/filter/window/methods.h"
#include "ops/wrap.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {}  // namespace

ParamInfo FilterWrapModifier() {
  return WrapModifier(
      {"clamp", "black", "repeat", "mirror", "mirror101", "renormalize", "valid"}, "clamp",
      "what lies beyond the image: its nearest pixel (black where a display window goes further than "
      "the data window), bordervalue, the image again, its mirror image (edge pixel twice or once); or "
      "nothing (weights inside count), or a smaller result");
}

void RequireFilterWrap(const std::string& op, Wrap wrap) {
  RequireWrap(op, wrap,
              {Wrap::kClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101, Wrap::kRenormalize,
               Wrap::kValid});
}

ParamInfo BorderValueModifier() {
  return OnlyWith("wrap=black", NumberModifier("bordervalue", "0", "every channel's value beyond the image"));
}

ParamInfo MethodModifier(std::vector<std::string> methods) {
  return {.name = "method",
          .type = ParamType::kChoice,
          .default_value = "auto",
          .help = "how it is computed; auto takes the cheapest within the bound",
          .choices = std::move(methods)};
}

ParamInfo BufferBitsModifier() {
  return IntegerModifier(
      "bits", "0", 0, 32,
      "models an accumulation buffer in fixed point with that many binary places, 8 to 32; 0 is exact");
}

FilterMethod MethodNamed(const std::string& name) {
  const std::span<const MethodRow> rows = Methods();
  return std::find_if(rows.begin(), rows.end(), [&](const MethodRow& row) { return name == row.name; })
      ->method;
}

std::pair<double, double> ParseSize(const std::string& subject, const std::string& text) {
  double size[2] = {0, 0};
  const char* const end = text.data() + text.size();
  auto [p, error] = std::from_chars(text.data(), end, size[0]);
  if (error == std::errc() && p != end && *p == 'x') {
    const auto second = std::from_chars(p + 1, end, size[1]);
    p = second.ptr, error = second.ec;
  } else {
    size[1] = size[0];
  }
  if (error != std::errc() || p != end ||
      !(size[0] >= 1 && size[0] <= 65535 && size[1] >= 1 && size[1] <= 65535)) {
    throw Error(subject, "found the size '" + text + "', expected WIDTHxHEIGHT or one number, 1 to 65535");
  }
  return {size[0], size[1]};
}

}  // namespace tessera::ops
