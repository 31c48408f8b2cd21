// The weights of a line's taps.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ops/flow/prepare.h"

namespace tessera::ops::flow {

int TapsOf(const LicParams& params) {
  if (params.kernel == LicKernel::kUser) return static_cast<int>(params.weights.size() / 2);
  const double taps = params.integrator == LicIntegrator::kCell ? params.length : params.length / params.step;
  const int all = static_cast<int>(std::lround(taps));
  // Windows are 0 at the length: the tap there is none.
  const bool window = params.kernel == LicKernel::kTent || params.kernel == LicKernel::kHann ||
                      params.kernel == LicKernel::kRipple;
  return window ? std::max(0, all - 1) : all;
}

LicWeights WeightsOf(const LicParams& params) {
  const int taps = TapsOf(params);
  const auto weight = [&](int i) {
    if (taps == 0 && params.kernel != LicKernel::kUser) return 1.0;
    const double share = static_cast<double>(i) / (taps + 1), turn = 2 * std::numbers::pi;
    const double hann = 0.5 * (1 + std::cos(turn / 2 * share));
    switch (params.kernel) {
      case LicKernel::kBox:
        break;
      case LicKernel::kTent:
        return 1 - std::fabs(share);
      case LicKernel::kHann:
        return hann;
      case LicKernel::kRamp:  // what comes from upstream fades: the picture brightens along the field
        return 0.5 * (1 - share);
      case LicKernel::kRipple:
        return hann * 0.5 * (1 + std::cos(turn * (params.waves * share / 2 + params.phase)));
      case LicKernel::kUser:
        return params.weights[static_cast<size_t>(taps + i)];
    }
    return 1.0;
  };
  LicWeights w;
  w.centre = weight(0);
  for (int i = 1; i <= taps; ++i) w.forward.push_back(weight(i)), w.backward.push_back(weight(-i));
  return w;
}

namespace {

// Correlation of the texture's values `apart` pixels from each other along an axis.
double Correlation(const LicParams& params, int spot, double apart) {
  const bool filtered = !params.with_image && params.noise == LicNoise::kFiltered;
  // 1 2 1 on itself: 1 4 6 4 1.
  static constexpr double kWhite[] = {1, 0, 0, 0}, kFiltered[] = {1, 4.0 / 6, 1.0 / 6, 0};
  const double cells = apart / spot;
  if (cells >= 3) return 0;
  const auto i = static_cast<size_t>(cells);
  const double* const at = filtered ? kFiltered : kWhite;
  return at[i] + (cells - static_cast<double>(i)) * (at[i + 1] - at[i]);
}

}  // namespace

std::vector<float> ContrastsOf(const LicParams& params, int spot) {
  const LicWeights w = WeightsOf(params);
  const int taps = TapsOf(params);
  const double step = params.integrator == LicIntegrator::kCell ? 1 : params.step;
  const auto at = [&](int i) {
    return i == 0 ? w.centre : (i > 0 ? w.forward : w.backward)[static_cast<size_t>(std::abs(i) - 1)];
  };
  std::vector<double> near;  // correlations, as far as there are any
  for (int k = 0; k <= 2 * taps; ++k) {
    near.push_back((k == 0 ? 1 : 2) * Correlation(params, spot, k * step));
    if (near.back() == 0) break;
  }
  std::vector<float> factors;
  double sum = 0, variance = 0;
  // What a tap adds: itself with those already there, from -n (which n - 1 then has) to n.
  const auto add = [&](int i, int low, int high) {
    sum += at(i), variance += at(i) * at(i) * near[0];
    for (int k = 1; k < static_cast<int>(near.size()); ++k) {
      const double correlation = near[static_cast<size_t>(k)];
      if (i - k >= low && i - k <= high) variance += at(i) * at(i - k) * correlation;
      if (i + k >= low && i + k <= high) variance += at(i) * at(i + k) * correlation;
    }
  };
  for (int n = 0; n <= taps; ++n) {
    add(n, 1 - n, n - 1);
    if (n > 0) add(-n, 1 - n, n);
    const double factor = variance > 0 ? params.gain * sum / std::sqrt(variance) : 1;
    factors.push_back(static_cast<float>(std::max(1.0, factor)));
  }
  return factors;
}

}  // namespace tessera::ops::flow
