// Window sums over integer pixels, correctly rounded: which of the ways of this room suits a kernel.
#ifndef TESSERA_OPS_FILTER_CODES_CODE_SUMS_H_
#define TESSERA_OPS_FILTER_CODES_CODE_SUMS_H_

#include <memory>
#include <vector>

#include "ops/filter/window/sums.h"

namespace tessera::ops {

// What is known of a kernel and of its sums in floats.
struct CodeKernel {
  int width = 1, height = 1;
  std::vector<double> weights;      // row by row; none where that would be too many
  std::vector<double> column, row;  // where they are one product
  bool by_columns = false;          // floats are summed by columns and rows
  double error = 0;                 // of a float result, for samples in [0, 1]
};
// Sums of floats that are codes / largest: results lie on the side of the code that the exact sum rounds to,
// half to even. Samples that are no codes are the work of operations before: results that see one stay as
// `floats`, which sums them, leaves them.
std::unique_ptr<const WindowSums> MakeCodeSums(PixelType type, const CodeKernel& kernel,
                                               std::unique_ptr<const WindowSums> floats);

// Whether all samples are codes / the largest code of an image of integers.
class CodesTest {
 public:
  explicit CodesTest(PixelType type);
  bool operator()(const float* samples, int count) const;

 private:
  PixelType type_;
  bool (*bytes_)(float largest, float near, const float* samples, int count, int padded, float* codes);
  bool (*words_)(const float* samples, int count, int largest, float* codes);
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_CODE_SUMS_H_
