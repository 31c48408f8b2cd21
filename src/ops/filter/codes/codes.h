// Window sums over integer pixels: codes times weights in double, rounded once.
#ifndef TESSERA_OPS_FILTER_CODES_CODES_H_
#define TESSERA_OPS_FILTER_CODES_CODES_H_

#include <vector>

#include "ops/filter/window/sums.h"

namespace tessera::ops {

// A correlation's weights as they are, made ready for blocks of output rows: every column of weights lies
// between zeros, so that each row of samples serves every row of a block.
struct CodesWindow {
  static constexpr int kPadding = 3;  // zeros before and behind a column
  int width = 0, height = 0;
  std::vector<double> columns;  // one padded column per column of the window; separable: the one column
  std::vector<double> row;      // of a separable window

  const double* column(int dx) const {
    return columns.data() + ptrdiff_t{dx} * (height + 2 * kPadding) + kPadding;
  }
};
CodesWindow MakeCodesWindow(int width, int height, const std::vector<double>& weights);
CodesWindow MakeCodesWindow(const std::vector<double>& column, const std::vector<double>& row);

// Weights that are not whole numbers leave ties by their own roundings, by less than this.
inline constexpr double kTieOfCodes = 1e-8;

inline constexpr double kWholeCode = 0.005;  // farther from a whole number a float is no code
inline constexpr int kCodeBlock = 16;        // samples that go through together

// The kernels of one instruction set, chosen when a stage is made.
struct CodesFunctions {
  // The codes of `count` samples, what is no code as 0; whether all are, as far as a float can tell. Null:
  // none are kept. Whole blocks are written.
  bool (*to_codes)(const float* samples, int count, int largest, float* codes);
  // Sums of a tile of codes as floats that the sink rounds as it would round the exact sums. `sums`: scratch
  // memory, kPadding + 1 rows of `stride`; rows may be read to the end of a block.
  void (*sum)(const CodesWindow& window, int largest, const FloatTile& codes, double* sums, ptrdiff_t stride);
};
CodesFunctions ChooseCodes();

// An exact result in codes as a sample that the sink rounds as it would round the result, half to even: moved
// by no more than its last two bits.
float SettledSample(double exact, double largest);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_CODES_H_
