// Kernels of whole numbers, and what their sums of codes are rounded to.
#ifndef TESSERA_TESTS_SUPPORT_WHOLE_KERNELS_H_
#define TESSERA_TESTS_SUPPORT_WHOLE_KERNELS_H_

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "tessera/ops/filter.h"

namespace tessera::testing {

// Whole weights and what their sum is divided by.
struct Whole {
  int width, height;
  std::vector<int64_t> weights;
  int64_t divisor;
};

inline Whole Constant(int width, int height) {
  return {width, height, std::vector<int64_t>(static_cast<size_t>(width) * static_cast<size_t>(height), 1),
          int64_t{width} * height};
}

inline Whole RandomKernel(int width, int height, int lowest) {
  Whole k{width, height, {}, 0};
  std::mt19937 random(static_cast<uint32_t>(width * 1000 + height));
  for (int i = 0; i < width * height; ++i) {
    k.weights.push_back(lowest + static_cast<int64_t>(random() % static_cast<uint32_t>(9 - lowest)));
    k.divisor += k.weights.back();
  }
  return k;
}

inline Kernel KernelOf(const Whole& k) {
  return {k.width, k.height, (k.width - 1) / 2, (k.height - 1) / 2, 1, {k.weights.begin(), k.weights.end()}};
}

// sum / divisor to the nearest integer, half to even.
inline int64_t Quotient(int64_t sum, int64_t divisor) {
  if (divisor < 0) sum = -sum, divisor = -divisor;
  int64_t q = sum / divisor, rest = sum % divisor;
  if (rest < 0) rest += divisor, --q;
  if (2 * rest > divisor || (2 * rest == divisor && q % 2 != 0)) ++q;
  return q;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_WHOLE_KERNELS_H_
