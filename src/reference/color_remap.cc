// Reference of remaps of values: contrast by black and white, and the logarithmic range.
#include <any>
#include <cmath>
#include <utility>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/color.h"

namespace tessera::reference {

// The entry "contrast" where its parameters are these.
void EvaluateContrastRemap(const Call& call) {
  const auto& p = std::any_cast<const ContrastRemapParams&>(call.parameters);
  const auto entry = [](const std::vector<double>& list, int c) {
    return c < static_cast<int>(list.size()) ? list[static_cast<size_t>(c)] : list.back();
  };
  bool bent = false;
  for (const double slope : p.scontrast) bent = bent || slope != 1;
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    const double v = call.in[0].at(x, y, c), black = entry(p.black, c), white = entry(p.white, c),
                 low = entry(p.min, c), high = entry(p.max, c), slope = entry(p.scontrast, c),
                 middle = entry(p.sthresh, c);
    if (black == white) {
      const double limit = double{static_cast<float>(black)}, reach = call.Tolerance(0, x, y, c);
      if (reach > 0 && std::fabs(v - limit) <= reach) call.Undecided(x, y, c, std::fabs(high - low));
      return Rounded(v < limit ? low : high);
    }
    const double r = (v - black) / (white - black);
    const double span = high - low;
    if (!bent || slope == 0) {
      const double terms = (std::fabs(v) + std::fabs(black)) / std::fabs(white - black) * std::fabs(span);
      return {low + r * span, terms + std::fabs(low)};
    }
    const auto sigmoid = [&](double at) { return 1 / (1 + std::exp(slope * (middle - at))); };
    const double at_black = sigmoid(0), rise = sigmoid(1) - at_black;
    const double result = low + (sigmoid(r) - at_black) / rise * span;
    return {result, std::fabs(result) + (std::fabs(span / rise) + std::fabs(low)) * 0x1p-20};
  });
}

namespace {

// Published as floats.
constexpr double kJoin = 0.18000000715255737, kA = -0.54576885700225830078, kB = 0.18351669609546661377,
                 kC = 284.3577880859375, kJump = 3.1e-8;  // by how much the pieces miss each other

double Compressed(double v) {
  return std::fabs(v) <= kJoin ? v : std::copysign(kA + kB * std::log(kC * std::fabs(v) + 1), v);
}
double Expanded(double v) {
  return std::fabs(v) <= kJoin ? v : std::copysign((std::exp((std::fabs(v) - kA) / kB) - 1) / kC, v);
}

bool IsDepthName(const std::string& name) { return name == "Z" || name == "z"; }

template <double (*map)(double)>
void EvaluateRange(const Call& call) {
  const auto& p = std::any_cast<const RangeParams&>(call.parameters);
  const auto kept = [&](int c) {
    return c == call.out_spec.alpha || IsDepthName(call.out_spec.channels[static_cast<size_t>(c)]) ||
           (p.luma && c >= 3);
  };
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    const double v = call.in[0].at(x, y, c);
    if (kept(c)) return {v, 0};
    if (!p.luma) {
      if (std::fabs(std::fabs(v) - kJoin) <= call.Tolerance(0, x, y, c)) call.Undecided(x, y, c, kJump);
      return Rounded(map(v));
    }
    const double weights[3] = {double{0.21264f}, double{0.71517f}, double{0.07219f}};
    double luma = 0, size = 0, reach = 0;
    for (int k = 0; k < 3; ++k) {
      const double term = weights[k] * call.in[0].at(x, y, k);
      luma += term, size += std::fabs(term), reach += weights[k] * call.Tolerance(0, x, y, k);
    }
    reach += 1e-15 * size;
    if (std::fabs(luma) <= reach) call.Undecided(x, y, c, std::fabs(v));
    if (std::fabs(std::fabs(luma) - kJoin) <= reach) call.Undecided(x, y, c, std::fabs(v / kJoin) * kJump);
    return Rounded(luma > 0 ? v * (map(luma) / luma) : 0 * v);
  });
}

}  // namespace

std::vector<Entry> ColorRemapEntries() {
  return {{"rangecompress", EvaluateRange<Compressed>}, {"rangeexpand", EvaluateRange<Expanded>}};
}

}  // namespace tessera::reference
