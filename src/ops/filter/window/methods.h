// The ways to compute weighted sums over a window, one row each, and the choice among them.
#ifndef TESSERA_OPS_FILTER_WINDOW_METHODS_H_
#define TESSERA_OPS_FILTER_WINDOW_METHODS_H_

#include <span>

#include "tessera/ops/filter.h"

namespace tessera::ops {

// What the choice looks at.
struct WindowShape {
  enum Of { kKernel, kGaussian, kBox } of = kKernel;
  int width = 1, height = 1;  // of a kernel or a box
  double taps = 1;            // of a kernel: weights that are not 0, on average of its planes
  // Columns times rows that have been found for the kernel, how many of them, and whether they are as good as
  // its weights: met within float rounding, and no weight is 0, where products would let a NaN through.
  int products = 0;
  bool met = false;
  double sigma = 0, least_sigma = 0;  // of a Gaussian: the larger one, and the smaller one that is not 0
  bool both_axes = true, renormalizes = false;
};

struct MethodRow {
  FilterMethod method;
  const char* name;   // as method= has it
  const char* words;  // as --explain has it
  // Whether the result keeps the bounds of doc/accuracy.md, so that auto may take it.
  bool (*suits)(const WindowShape&);
  // Multiply-adds per sample, as far as they decide: measured on RGBA with AVX2.
  double (*cost)(const WindowShape&);
  // Of a kernel's float result: how often what a sample adds is rounded at most, weights included.
  double (*roundings)(const WindowShape&);
  const char* gaussian_error;  // L1 distance of a Gaussian from the sampled one
};
std::span<const MethodRow> Methods();
const MethodRow& MethodOf(FilterMethod method);
// Of those that suit the one with the least cost; of equal ones the first.
FilterMethod CheapestMethod(const WindowShape& shape);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_METHODS_H_
