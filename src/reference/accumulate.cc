// Reference of accumulation: weighted sums, fixed-point buffers.
#include "tessera/ops/accumulate.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <vector>

#include "reference/border.h"
#include "reference/depth_of_field.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

// A number in [-1, 1] with `bits` binary places, ties to even.
double Fixed(double v, int bits) {
  if (std::isnan(v)) return 0;
  const double one = std::pow(2.0, bits), x = v * one, below = std::floor(x);
  double code = x - below < 0.5 ? below : below + 1;
  if (x - below == 0.5 && std::fmod(below, 2.0) == 0) code = below;
  return std::max(-one, std::min(one, code)) / one;
}

// How far what Fixed makes of `v` may lie from it where `v`, to which a multiple of `weight` was added, is
// off by `off`, beyond that itself: a step where it may be rounded to the neighbour. The last bits of a
// double are off too, but for powers of two, whose products are exact.
double RoundingJump(double v, double weight, double off, int bits) {
  int exponent = 0;
  const bool exact = std::fabs(std::frexp(weight, &exponent)) == 0.5;
  const double x = v * std::pow(2.0, bits), slack = exact ? 0 : 0x1p-44 * std::max(1.0, std::fabs(x));
  const double near = std::fabs(x - std::floor(x) - 0.5);
  const bool jumps = near < slack || (off > 0 && near <= off * std::pow(2.0, bits));
  return jumps ? std::ldexp(1.0, -bits) : 0;
}

// What a sum of several terms is allowed: one rounding, and what a sum in double loses.
std::pair<double, double> Total(double value, double absolute) {
  return {value, std::fabs(value) + std::ldexp(absolute, -28)};
}

void EvaluateSum(const Call& call) {
  const auto& p = std::any_cast<const WeightedSumParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    long double sum = 0, absolute = 0;
    double held = 0, off = 0, jumps = 0;
    for (size_t k = 0; k < p.weights.size(); ++k) {
      if (p.weights[k] == 0) continue;
      const double term = p.weights[k] * call.in[k].at(x, y, c);
      sum += static_cast<long double>(p.weights[k]) * call.in[k].at(x, y, c);
      absolute += std::fabs(term);
      if (p.bits == 0) continue;
      off += std::fabs(p.weights[k]) * call.Tolerance(static_cast<int>(k), x, y, c);
      jumps += RoundingJump(held + term, p.weights[k], off, p.bits);
      held = Fixed(held + term, p.bits);
    }
    if (jumps > 0) call.Undecided(x, y, c, jumps);
    return p.bits != 0 ? Rounded(held) : Total(static_cast<double>(sum), static_cast<double>(absolute));
  });
}

void EvaluateShiftAccumulate(const Call& call) {
  const auto& p = std::any_cast<const ShiftAccumulateParams&>(call.parameters);
  const Roi& w = call.in_specs[0].data_window;
  const double scale = KernelRange(p.taps, p.low, p.high).scale;
  ForEachSample(call, [&](int x, int y, int c) {
    long double sum = 0, absolute = 0;
    double held = 0, off = 0, jumps = 0;
    for (int j = 0; j < p.height; ++j) {
      for (int i = 0; i < p.width; ++i) {
        const double tap = p.taps[static_cast<size_t>(j * p.width + i)];
        if (tap == 0) continue;
        int sx = x + i - p.anchor_x, sy = y + j - p.anchor_y;
        const bool inside = Shown(sx, w.x0, w.x1, p.wrap) && Shown(sy, w.y0, w.y1, p.wrap);
        const double v = inside ? call.in[0].at(sx, sy, c) : 0;
        sum += static_cast<long double>(tap) * v;
        absolute += std::fabs(tap * v);
        if (p.bits == 0) continue;
        const double next = held + tap * scale * v;
        if (inside) off += std::fabs(tap * scale) * call.Tolerance(0, sx, sy, c);
        jumps += RoundingJump(next, tap * scale, off, p.bits);
        held = Fixed(next, p.bits);
      }
    }
    if (jumps > 0) call.Undecided(x, y, c, jumps / scale);
    return p.bits != 0 ? Rounded(held / scale)
                       : Total(static_cast<double>(sum), static_cast<double>(absolute));
  });
}
Roi ShiftedRegion(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const ShiftAccumulateParams&>(parameters);
  return Around(out, p.width, p.height, p.width, p.height, p.wrap);
}

}  // namespace

std::vector<Entry> AccumulateEntries() {
  return {
      {"accum", EvaluateSum},
      {"average", EvaluateSum},
      {"shiftaccum", EvaluateShiftAccumulate, ShiftedRegion},
      {"dof", EvaluateDepthOfField, DepthOfFieldRegion},
  };
}

}  // namespace tessera::reference
