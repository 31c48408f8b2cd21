// Reference of means weighted by likeness: every pixel of the window by the formula, in double.
#include "tessera/ops/restore.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

constexpr double kLeastExponent = 100;  // of two: smaller weights are none

struct Weights {
  const Call& call;
  Wrap wrap;
  std::vector<int> compared;

  Weights(const Call& c, Wrap w) : call(c), wrap(w) {
    const ImageSpec& spec = c.in_specs[0];
    for (int k = 0; k < spec.channel_count() && compared.size() < 3; ++k) {
      if (k != spec.alpha) compared.push_back(k);
    }
    if (compared.empty()) compared = {0};
  }
  double At(int x, int y, int c) const {
    const Roi& window = call.in_specs[0].data_window;
    const bool shown = Shown(x, window.x0, window.x1, wrap) && Shown(y, window.y0, window.y1, wrap);
    return shown ? call.in[0].at(x, y, c) : 0;
  }
  double SquaredDistance(int x, int y, int i, int j) const {
    double sum = 0;
    for (const int c : compared) sum += std::pow(At(i, j, c) - At(x, y, c), 2);
    return sum;
  }
};

// The mean over all within `reach`, of weights 2^-exponent(i, j), and the mean difference from the centre
// with lost(exponent): what those weights lose.
template <class Exponent, class Lost>
void Mean(const Call& call, const Weights& weights, int reach, Exponent exponent, Lost lost) {
  const Roi& o = call.out.roi;
  for (int y = o.y0; y < o.y1; ++y) {
    for (int x = o.x0; x < o.x1; ++x) {
      call.Check();
      const auto n = static_cast<size_t>(call.out.channels);
      std::vector<double> sum(n), off(n);
      double total = 0;
      for (int j = y - reach; j <= y + reach; ++j) {
        for (int i = x - reach; i <= x + reach; ++i) {
          const double e = exponent(x, y, i, j);
          if (!(e < kLeastExponent)) continue;
          const double w = std::exp2(-e);
          total += w;
          for (size_t c = 0; c < n; ++c) {
            const double v = weights.At(i, j, static_cast<int>(c));
            sum[c] += w * v;
            off[c] += w * std::fabs(v - weights.At(x, y, static_cast<int>(c))) * lost(e);
          }
        }
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        const double centre = call.in[0].at(x, y, c);
        const bool moves = total > 0 && std::isfinite(centre);
        const double v = moves ? sum[k] / total : centre;
        call.out.at(x, y, c) = v;
        if (call.scale == nullptr) continue;
        // What the double sum itself rounds is far below.
        const double scale = std::fabs(v) + (moves ? off[k] / total : 0);
        call.scale->at(x, y, c) = std::max(scale, kSmallestScale);
      }
    }
  }
}

void EvaluateBilateral(const Call& call) {
  const auto& p = std::any_cast<const BilateralParams&>(call.parameters);
  const Weights weights(call, p.wrap);
  const int radius = static_cast<int>(std::ceil(2 * p.sigma));
  const double log2e = 1 / std::log(2.0);
  Mean(
      call, weights, radius,
      [&](int x, int y, int i, int j) {
        const double apart = std::pow(i - x, 2) + std::pow(j - y, 2);
        return log2e * (apart / (2 * p.sigma * p.sigma) +
                        weights.SquaredDistance(x, y, i, j) / (2 * p.range * p.range));
      },
      [&](double e) { return 2 * radius + 9 + 8 * e; });
}
Roi BilateralInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const BilateralParams&>(parameters);
  const int r = static_cast<int>(std::ceil(2 * p.sigma));
  return Around(out, r, r, r, r, p.wrap);
}

void EvaluatePatches(const Call& call) {
  const auto& p = std::any_cast<const NonLocalMeansParams&>(call.parameters);
  const Weights weights(call, p.wrap);
  const int half = p.patch / 2;
  const double log2e = 1 / std::log(2.0), h = p.strength * p.sigma;
  const double samples = double{1} * p.patch * p.patch * static_cast<double>(weights.compared.size());
  Mean(
      call, weights, p.search / 2,
      [&](int x, int y, int i, int j) {
        double sum = 0;
        for (int v = -half; v <= half; ++v) {
          for (int u = -half; u <= half; ++u) sum += weights.SquaredDistance(x + u, y + v, i + u, j + v);
        }
        const double over = sum / samples - 2 * p.sigma * p.sigma;
        return log2e * (over < 0 ? 0 : over / (h * h));
      },
      [&](double e) { return 2 * p.search + 9 + (9 + 2 * p.patch) * (e + 3 / (p.strength * p.strength)); });
}
Roi PatchesInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const NonLocalMeansParams&>(parameters);
  const int r = p.patch / 2 + p.search / 2;
  return Around(out, r, r, r, r, p.wrap);
}

// ---- Levels by the picture itself ----

void EvaluateAutoLevels(const Call& call) {
  const auto& p = std::any_cast<const AutoLevelsParams&>(call.parameters);
  const ImageD& in = call.in[0];
  const std::vector<int> colors = Weights(call, Wrap::kClamp).compared;
  const auto n = static_cast<size_t>(in.channels);
  struct Ends {
    double low = 0, high = 0, off = 0;
  };
  std::vector<Ends> ends(n);  // equal: the channel stays
  for (size_t k = 0; k < colors.size(); ++k) {
    std::vector<double> sorted;
    double off = 0;
    for (int y = in.roi.y0; y < in.roi.y1; ++y) {
      for (int x = in.roi.x0; x < in.roi.x1; ++x) {
        for (size_t other = 0; other < colors.size(); ++other) {
          if (p.apart && other != k) continue;
          const double v = in.at(x, y, colors[other]);
          if (std::isfinite(v)) sorted.push_back(v);
          off = std::max(off, call.Tolerance(0, x, y, colors[other]));
        }
      }
    }
    Ends e{0, 1, off};
    if (!sorted.empty()) {
      std::sort(sorted.begin(), sorted.end());
      const auto last = static_cast<double>(sorted.size() - 1);
      e.low = sorted[static_cast<size_t>(std::floor(p.low * last))];
      e.high = sorted[sorted.size() - 1 - static_cast<size_t>(std::floor(p.high * last))];
    }
    ends[static_cast<size_t>(colors[k])] = e;
  }
  ForEachSample(call, [&](int x, int y, int c) {
    const double v = in.at(x, y, c);
    const Ends& e = ends[static_cast<size_t>(c)];
    // Whether there are two ends at all hangs on samples that are not exact.
    if (e.off > 0 && std::fabs(e.high - e.low) <= 4 * e.off) call.Undecided(x, y, c, kUnknownJump);
    if (!(e.low < e.high)) return Rounded(v);
    const double level = (v - e.low) / (e.high - e.low);
    return Rounded(p.clamp && level < 0 ? 0 : p.clamp && level > 1 ? 1 : level);
  });
}
Roi AutoLevelsInput(const std::any&, int, const Roi&) { return kEverywhere; }

}  // namespace

std::vector<Entry> RestoreEntries() {
  return {{"autolevels", EvaluateAutoLevels, AutoLevelsInput},
          {"bilateral", EvaluateBilateral, BilateralInput},
          {"nlmeans", EvaluatePatches, PatchesInput}};
}

}  // namespace tessera::reference
