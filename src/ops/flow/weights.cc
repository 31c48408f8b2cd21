// The weights of a line's taps.
#include <cmath>
#include <numbers>

#include "ops/flow/prepare.h"

namespace tessera::ops::flow {

int TapsOf(const LicParams& params) {
  if (params.kernel == LicKernel::kUser) return static_cast<int>(params.weights.size() / 2);
  const double taps = params.integrator == LicIntegrator::kCell ? params.length : params.length / params.step;
  return static_cast<int>(std::lround(taps));
}

LicWeights WeightsOf(const LicParams& params) {
  const int taps = TapsOf(params);
  const auto weight = [&](int i) {
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

}  // namespace tessera::ops::flow
