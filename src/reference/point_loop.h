// The reference's one loop over samples, and the scale of a single rounding.
#ifndef TESSERA_REFERENCE_POINT_LOOP_H_
#define TESSERA_REFERENCE_POINT_LOOP_H_

#include <algorithm>
#include <cmath>
#include <utility>

#include "reference/reference.h"

namespace tessera::reference {

// u times this is half of the smallest subnormal step: below it a rounding error no longer shrinks with the
// value.
inline constexpr double kSmallestScale = 0x1p-126;

// f(x, y, channel) -> {value, scale} for each sample of the result.
template <class F>
void ForEachSample(const Call& call, F f) {
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < call.out.channels; ++c) {
        const std::pair<double, double> result = f(x, y, c);
        call.out.at(x, y, c) = result.first;
        if (call.scale != nullptr) call.scale->at(x, y, c) = std::max(result.second, kSmallestScale);
      }
    }
  }
}

// A value whose error is one rounding of itself.
inline std::pair<double, double> Rounded(double value) { return {value, std::fabs(value)}; }

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_POINT_LOOP_H_
