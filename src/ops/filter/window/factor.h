// Kernels as sums of products of a column and a row, and their weights as floats.
#ifndef TESSERA_OPS_FILTER_WINDOW_FACTOR_H_
#define TESSERA_OPS_FILTER_WINDOW_FACTOR_H_

#include <vector>

#include "tessera/ops/filter.h"

namespace tessera::ops {

struct Product {
  std::vector<double> column, row;  // the column's weights have an absolute sum of 1
};

struct Factors {
  std::vector<Product> terms;
  double residual =
      0;  // sum of |weight - sum of products|: times max |sample|, a bound of the result's error
  bool elementwise = false;  // every weight is met within 4 u of itself: as good as rounding it to float
};

// One plane as up to `most_terms` products, by cross approximation with full pivoting in double, the first
// one refined by alternating least squares. Stops when the weights are met within float rounding.
Factors Factorize(const Kernel& kernel, int plane, int most_terms);

// Weights as floats whose exact sum is that of the doubles but for half a unit of one of them, so that
// constant images stay constant: some go to the second nearest float, symmetric ones together. 0 stays 0.
std::vector<float> RoundWeights(const std::vector<double>& weights);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_FACTOR_H_
