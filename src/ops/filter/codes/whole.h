// Window sums of bytes under small whole weights: exact in 16 bits.
#ifndef TESSERA_OPS_FILTER_CODES_WHOLE_H_
#define TESSERA_OPS_FILTER_CODES_WHOLE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ops/filter/window/sums.h"

namespace tessera::ops {

// Whole weights over a divisor whose sums of bytes fit in 16 bits.
struct WholeWindow {
  bool usable = false;
  int width = 1, height = 1;
  // A column times a row, or, where the row is empty, a column for every place along the row. As 16 bits:
  // what overflows on the way comes back.
  std::vector<uint16_t> columns, row;
  bool negative = false;  // sums may be below 0
  int divisor = 1;
  int shift = -1;           // divisor = 2^shift
  float inverse = 1;        // of the divisor
  bool multiplied = false;  // sums times the inverse round as the quotients do
};
// `weights`: whole numbers, row by row; not usable where they are too large or too many.
WholeWindow MakeWholeWindow(int width, int height, const std::vector<double>& weights, int divisor);

struct WholeStrip;
using WholeFunction = void (*)(const WholeWindow&, const WholeStrip&, uint8_t* out, ptrdiff_t out_stride);
// Of one instruction set, chosen when a stage is made.
WholeFunction ChooseWhole();

// Sums over the divisor, rounded half to even, from 0 to 255.
void RunWhole(WholeFunction run, const WholeWindow& window, const ByteTile& tile, base::Arena& scratch);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_WHOLE_H_
