// Reference of the arithmetic operations on images and constants.
#include "tessera/ops/arithmetic.h"

#include <any>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using Sample = std::pair<double, double>;  // value, scale of its bound

// value(a, b) of two images; one rounding.
template <double (*value)(double, double)>
void EvaluatePair(const Call& call) {
  ForEachSample(call, [&](int x, int y, int c) {
    return Rounded(value(call.in[0].at(x, y, c), call.in[1].at(x, y, c)));
  });
}
double Sum(double a, double b) { return a + b; }
double Difference(double a, double b) { return a - b; }
double Product(double a, double b) { return a * b; }
double Distance(double a, double b) { return std::fabs(a - b); }
// A quotient is whatever, where the divisor may be 0 within its own error.
void EvaluateDiv(const Call& call) {
  ForEachSample(call, [&](int x, int y, int c) {
    const double a = call.in[0].at(x, y, c), b = call.in[1].at(x, y, c);
    if (const double reach = call.Tolerance(1, x, y, c); reach > 0 && std::fabs(b) <= reach)
      call.Undecided(x, y, c, kEndlessJump);
    return Rounded(b == 0 ? 0 : a / b);
  });
}
// C's fmin and fmax: the number wins over NaN.
double Smaller(double a, double b) { return std::fmin(a, b); }
double Larger(double a, double b) { return std::fmax(a, b); }

void EvaluateMad(const Call& call) {
  ForEachSample(call, [&](int x, int y, int c) {
    const double product = call.in[0].at(x, y, c) * call.in[1].at(x, y, c), summand = call.in[2].at(x, y, c);
    return Sample(product + summand, std::fabs(product) + std::fabs(summand));
  });
}

// A list of constants as a channel sees it.
double ConstantOf(const std::vector<double>& values, int channel, double missing) {
  if (values.size() == 1) return values.front();
  if (channel < static_cast<int>(values.size())) return values.at(static_cast<size_t>(channel));
  return missing;
}

// f(sample, constant) -> {value, scale}.
template <class F>
void EvaluateConstants(const Call& call, double missing, F f) {
  const auto& p = std::any_cast<const ChannelConstants&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    return f(call.in[0].at(x, y, c), ConstantOf(p.values, c, missing));
  });
}

void EvaluateAddc(const Call& call) {
  EvaluateConstants(call, 0, [](double v, double k) { return Sample(v + k, std::fabs(v) + std::fabs(k)); });
}
void EvaluateSubc(const Call& call) {
  EvaluateConstants(call, 0, [](double v, double k) { return Sample(v - k, std::fabs(v) + std::fabs(k)); });
}
void EvaluateMulc(const Call& call) {
  EvaluateConstants(call, 1, [](double v, double k) { return Rounded(v * k); });
}
void EvaluateDivc(const Call& call) {
  EvaluateConstants(call, 1, [](double v, double k) { return Rounded(k == 0 ? 0 * v : v / k); });
}
void EvaluateMinc(const Call& call) {
  EvaluateConstants(call, 0, [](double v, double k) { return Rounded(std::fmin(v, k)); });
}
void EvaluateMaxc(const Call& call) {
  EvaluateConstants(call, 0, [](double v, double k) { return Rounded(std::fmax(v, k)); });
}
// Also the absolute value, whose constant is 0.
void EvaluateAbsDiffc(const Call& call) {
  EvaluateConstants(call, 0,
                    [](double v, double k) { return Sample(std::fabs(v - k), std::fabs(v) + std::fabs(k)); });
}

void EvaluateInvert(const Call& call) {
  const auto& p = std::any_cast<const InvertParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double v = call.in[0].at(x, y, c);
    return c >= p.first && c < p.last ? Sample(1 - v, 1 + std::fabs(v)) : Rounded(v);
  });
}

void EvaluateClamp(const Call& call) {
  const auto& p = std::any_cast<const ClampParams&>(call.parameters);
  const double inf = std::numeric_limits<double>::infinity();
  ForEachSample(call, [&](int x, int y, int c) {
    double v = call.in[0].at(x, y, c);
    const double low = ConstantOf(p.min, c, -inf), high = ConstantOf(p.max, c, inf);
    if (low != -inf) v = std::fmax(v, low);
    if (high != inf) v = std::fmin(v, high);
    if (p.clamp_alpha && c == call.out_spec.alpha) v = std::fmin(std::fmax(v, 0), 1);
    return Rounded(v);
  });
}

// A step is at the threshold as a float.
void EvaluateThreshold(const Call& call) {
  const auto& p = std::any_cast<const ThresholdParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double v = call.in[0].at(x, y, c), at = ConstantOf(p.values, c, 0);
    if (p.softness == 0) return {v > static_cast<float>(at) ? 1.0 : 0.0, 0};
    const double ramp = std::isnan(v) ? 0 : (v - at) / p.softness + 0.5;
    return {std::clamp(ramp, 0.0, 1.0), std::fabs(at) / p.softness + 1};
  });
}

// Each sample from the image as it was. Where an input may be off, NaN and infinities are what they are.
void EvaluateFixNan(const Call& call) {
  const auto& p = std::any_cast<const FixNanParams&>(call.parameters);
  const Roi& all = call.in_specs[0].data_window;
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double v = call.in[0].at(x, y, c);
    if (std::isfinite(v) || p.mode == FixNanMode::kError) return {v, 0};
    if (p.mode == FixNanMode::kBlack) return {0, 0};
    double sum = 0, size = 0, count = 0;
    for (int j = y - 1; j <= y + 1; ++j) {
      for (int i = x - 1; i <= x + 1; ++i) {
        if (i < all.x0 || i >= all.x1 || j < all.y0 || j >= all.y1) continue;
        const double near = call.in[0].at(i, j, c);
        if (std::isfinite(near)) sum += near, size += std::fabs(near), count += 1;
      }
    }
    return count == 0 ? Sample(0, 0) : Sample(sum / count, std::fabs(sum / count) + size * 0x1p-24);
  });
}
Roi NinePixels(const std::any& parameters, int, const Roi& out) {
  const bool mean = std::any_cast<const FixNanParams&>(parameters).mode == FixNanMode::kBox3;
  return mean ? Roi{out.x0 - 1, out.y0 - 1, out.x1 + 1, out.y1 + 1} : out;
}

// The dither's hash, in plain integers.
uint32_t Hash(uint32_t h) {
  h = (h ^ (h >> 16)) * 0x21f0aaadu;
  h = (h ^ (h >> 15)) * 0xd35a2d97u;
  return h ^ (h >> 15);
}

// In codes, from -1/2 up to but without 1/2.
double DitherOffset(int x, int y, int channel, uint32_t seed) {
  const uint32_t key = Hash(seed * 0xc2b2ae3du + static_cast<uint32_t>(channel) + 1);
  const uint32_t row = Hash(static_cast<uint32_t>(y) * 0x85ebca77u ^ key);
  const uint32_t hash = Hash(static_cast<uint32_t>(x) * 0x9e3779b1u ^ row);
  return std::ldexp(static_cast<double>(hash >> 8), -24) - 0.5;
}

double RoundHalfToEven(double v) {
  const double below = std::floor(v), excess = v - below;
  if (excess != 0.5) return excess < 0.5 ? below : below + 1;
  return std::fmod(below, 2.0) == 0 ? below : below + 1;
}

void EvaluateQuantize(const Call& call) {
  const auto& p = std::any_cast<const QuantizeParams&>(call.parameters);
  const double last = std::ldexp(1.0, p.bits) - 1;
  ForEachSample(call, [&](int x, int y, int c) {
    double v = call.in[0].at(x, y, c);
    if (!(v > 0)) v = 0;
    if (v > 1) v = 1;
    double code = v * last;
    if (p.dither) code += DitherOffset(x, y, c, p.seed);
    const double rounded = std::fabs(RoundHalfToEven(code)) / last;
    // An input that may be off by some codes itself adds the rounding of both; one that is off by less may
    // be at a tie.
    const double reach = call.Tolerance(0, x, y, c) * last;
    if (reach >= 0.25) return std::pair(rounded, std::fabs(rounded) + 0x1p24 / last);
    if (reach > 0 && std::fabs(code - std::floor(code) - 0.5) <= reach) call.Undecided(x, y, c, 1 / last);
    return Rounded(rounded);
  });
}

}  // namespace

std::vector<Entry> ArithmeticEntries() {
  return {
      {"add", EvaluatePair<Sum>},
      {"sub", EvaluatePair<Difference>},
      {"mul", EvaluatePair<Product>},
      {"absdiff", EvaluatePair<Distance>},
      {"min", EvaluatePair<Smaller>},
      {"max", EvaluatePair<Larger>},
      {"mad", EvaluateMad},
      {"addc", EvaluateAddc},
      {"subc", EvaluateSubc},
      {"mulc", EvaluateMulc},
      {"div", EvaluateDiv},
      {"divc", EvaluateDivc},
      {"minc", EvaluateMinc},
      {"maxc", EvaluateMaxc},
      {"abs", EvaluateAbsDiffc},
      {"absdiffc", EvaluateAbsDiffc},
      {"invert", EvaluateInvert},
      {"clamp", EvaluateClamp},
      {"threshold", EvaluateThreshold},
      {"quantize", EvaluateQuantize},
      {"fixnan", EvaluateFixNan, NinePixels},
  };
}

}  // namespace tessera::reference
