// What the reference of line integral convolution knows about its kernel: taps, weights, what they leave of a
// noise's contrast.
#ifndef TESSERA_REFERENCE_FLOW_WEIGHTS_H_
#define TESSERA_REFERENCE_FLOW_WEIGHTS_H_

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tessera/ops/flow.h"

namespace tessera::reference::flow {

inline int Taps(const LicParams& p) {
  if (p.kernel == LicKernel::kUser) return static_cast<int>(p.weights.size()) / 2;
  const long all = std::lround(p.integrator == LicIntegrator::kCell ? p.length : p.length / p.step);
  // Tent, Hann and ripple are 0 at the length.
  const bool ends_before =
      p.kernel == LicKernel::kTent || p.kernel == LicKernel::kHann || p.kernel == LicKernel::kRipple;
  return static_cast<int>(ends_before && all > 0 ? all - 1 : all);
}

inline double Weight(const LicParams& p, int i) {
  if (Taps(p) == 0 && p.kernel != LicKernel::kUser) return 1;
  const double s = i / (Taps(p) + 1.0), pi = std::numbers::pi;
  switch (p.kernel) {
    case LicKernel::kBox:
      return 1;
    case LicKernel::kTent:
      return 1 - std::fabs(s);
    case LicKernel::kHann:
      return std::pow(std::cos(pi * s / 2), 2);
    case LicKernel::kRamp:
      return (1 - s) / 2;
    case LicKernel::kRipple:
      return std::pow(std::cos(pi * s / 2), 2) * (1 + std::cos(pi * p.waves * s + 2 * pi * p.phase)) / 2;
    case LicKernel::kUser:
      return p.weights[static_cast<size_t>(Taps(p) + i)];
  }
  return 1;
}

// By what deviations from the mean grow where lines have `taps` taps each way: the variance of the weighted
// mean, pair by pair.
inline double ContrastOf(const LicParams& p, int taps, int spot) {
  const double step = p.integrator == LicIntegrator::kCell ? 1 : p.step;
  const bool filtered = !p.with_image && p.noise == LicNoise::kFiltered;
  const auto correlation = [&](double cells) {
    const auto binomial = [](double a) { return std::max(0.0, 1 - std::fabs(a)); };
    double c = binomial(cells);
    if (filtered) c += (4 * binomial(cells - 1) + binomial(cells - 2)) / 6;
    return c;
  };
  double sum = 0, variance = 0;
  for (int i = -taps; i <= taps; ++i) {
    sum += Weight(p, i);
    const int far = static_cast<int>(3 * spot / step) + 1;
    for (int j = std::max(-taps, i - far); j <= std::min(taps, i + far); ++j)
      variance += Weight(p, i) * Weight(p, j) * correlation(std::abs(i - j) * step / spot);
  }
  return variance > 0 ? std::max(1.0, p.gain * sum / std::sqrt(variance)) : 1;
}

}  // namespace tessera::reference::flow

#endif  // TESSERA_REFERENCE_FLOW_WEIGHTS_H_
