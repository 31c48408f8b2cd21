// Reference of the generators.
#include "tessera/ops/generate.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <utility>
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

void EvaluateFill(const Call& call) {
  const auto& p = std::any_cast<const FillParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    const bool inside = x >= p.box.x0 && x < p.box.x1 && y >= p.box.y0 && y < p.box.y1;
    if (!inside) return {call.in[0].at(x, y, c), 0};
    const double u = p.box.width() > 1 ? (x - p.box.x0) / (p.box.width() - 1.0) : 0;
    const double v = p.box.height() > 1 ? (y - p.box.y0) / (p.box.height() - 1.0) : 0;
    const double corners[4] = {ValueOf(p.top_left, c, 1), ValueOf(p.top_right, c, 1),
                               ValueOf(p.bottom_left, c, 1), ValueOf(p.bottom_right, c, 1)};
    const double weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    double sum = 0, largest = 0;
    for (int k = 0; k < 4; ++k)
      sum += weights[k] * corners[k], largest = std::max(largest, std::fabs(corners[k]));
    return {sum, largest};
  });
}

// The last steps of Jenkins' lookup3 on three words.
uint32_t Jenkins(uint32_t a, uint32_t b, uint32_t c) {
  const auto mix = [](uint32_t& to, uint32_t from, int bits) {
    to ^= from;
    to -= (from << bits) | (from >> (32 - bits));
  };
  mix(c, b, 14), mix(a, c, 11), mix(b, a, 25), mix(c, b, 16), mix(a, c, 4), mix(b, a, 14), mix(c, b, 24);
  return c;
}
double UnitNoise(int x, int y, int channel, uint32_t seed) {
  const uint32_t place = Jenkins(static_cast<uint32_t>(x), static_cast<uint32_t>(y), 0);
  return (Jenkins(place, static_cast<uint32_t>(channel), seed) % (1u << 20)) / 1048576.0;
}
double NormalNoise(int x, int y, int channel, uint32_t seed) {
  for (;; ++seed) {
    const auto a = static_cast<float>(2 * UnitNoise(x, y, channel, seed) - 1),
               b = static_cast<float>(2 * UnitNoise(x, y, channel, seed + 139) - 1);
    const float aa = a * a, bb = b * b, r = aa + bb;  // in float: it decides
    if (r > 0 && r <= 1) return a * std::sqrt(-2 * std::log(double{r}) / r);
  }
}

void EvaluateAddNoise(const Call& call) {
  const auto& p = std::any_cast<const AddNoiseParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    const double v = call.in[0].at(x, y, c);
    if (c >= p.channels) return {v, 0};
    const int channel = p.mono ? 0 : c;
    if (p.type == AddedNoise::kGaussian) {
      const double bent = p.stddev * NormalNoise(x, y, channel, p.seed);
      return {v + p.mean + bent, std::fabs(v) + std::fabs(p.mean) + std::fabs(bent)};
    }
    const double t = UnitNoise(x, y, channel, p.seed);
    if (p.type == AddedNoise::kUniform)
      return {v + p.min * (1 - t) + p.max * t, std::fabs(v) + std::fabs(p.min) + std::fabs(p.max)};
    return t < double{static_cast<float>(p.portion)} ? Rounded(p.value) : std::pair(v, 0.0);
  });
}

}  // namespace

std::vector<Entry> GenerateEntries() {
  return {{"constant", EvaluateConstant}, {"create", EvaluateConstant}, {"checker", EvaluateChecker},
          {"ramp", EvaluateRamp},         {"fill", EvaluateFill},       {"noise", EvaluateAddNoise}};
}

}  // namespace tessera::reference
