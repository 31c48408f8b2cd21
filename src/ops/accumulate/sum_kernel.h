// Rows of weighted sums in double or in fixed point: what accumulation and shift-and-accumulate share.
#ifndef TESSERA_OPS_ACCUMULATE_SUM_KERNEL_H_
#define TESSERA_OPS_ACCUMULATE_SUM_KERNEL_H_

#include <cmath>
#include <cstdint>
#include <span>

namespace tessera::ops {

// out[i] = factor * sum over k of weight[k] * row[k][i], `count` floats; no weight is 0. `bits` other than 0:
// the sum is held in fixed point with that many binary places, rounded and saturated after every image.
struct SumJob {
  std::span<const float* const> rows;
  std::span<const double> weights;
  float* out = nullptr;
  int64_t count = 0;
  double factor = 1;
  int bits = 0;
  bool stream = false;
};
using SumFunction = void (*)(const SumJob&);

// For the SIMD target of this moment.
SumFunction ChooseSum();

// A number as a fixed-point buffer with `bits` binary places keeps it.
inline double FixedPoint(double value, int bits) {
  if (std::isnan(value)) return 0;
  const double one = std::ldexp(1.0, bits);
  const double code = std::nearbyint(value * one);
  return (code > one ? one : code < -one ? -one : code) / one;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_SUM_KERNEL_H_
