// Reference of the generators.
#include "tessera/ops/generate.h"

#include <any>
#include <cmath>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

double ValueOf(const std::vector<double>& color, int channel, double missing) {
  if (color.size() == 1) return color.front();
  if (channel < static_cast<int>(color.size())) return color.at(static_cast<size_t>(channel));
  return missing;
}

void EvaluateConstant(const Call& call) {
  const auto& p = std::any_cast<const ConstantParams&>(call.parameters);
  ForEachSample(call, [&](int, int, int c) { return Rounded(ValueOf(p.color, c, 1)); });
}

void EvaluateChecker(const Call& call) {
  const auto& p = std::any_cast<const CheckerParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double column = std::floor(static_cast<double>(x) / p.width);
    const double row = std::floor(static_cast<double>(y) / p.height);
    const bool second = std::fmod(column + row, 2.0) != 0;
    return Rounded(second ? ValueOf(p.color2, c, 1) : ValueOf(p.color1, c, 0));
  });
}

void EvaluateRamp(const Call& call) {
  const auto& p = std::any_cast<const RampParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    switch (c) {
      case 0:
        return Rounded((x + 0.5 - p.frame.x0) / p.frame.width());
      case 1:
        return Rounded((y + 0.5 - p.frame.y0) / p.frame.height());
      case 2:
        return Rounded(0);
      default:
        return Rounded(1);
    }
  });
}

}  // namespace

std::vector<Entry> GenerateEntries() {
  return {{"constant", EvaluateConstant},
          {"create", EvaluateConstant},
          {"checker", EvaluateChecker},
          {"ramp", EvaluateRamp}};
}

}  // namespace tessera::reference
