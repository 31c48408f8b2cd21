// Spreading of pixels over a row that an aperture's steps make of them: the inner loop of depth of field.
#ifndef TESSERA_OPS_ACCUMULATE_SCATTER_KERNEL_H_
#define TESSERA_OPS_ACCUMULATE_SCATTER_KERNEL_H_

#include "ops/accumulate/aperture.h"

namespace tessera::ops {

// Sums start anew at every multiple of this column, so that a pixel's do not depend on the tile, and what is
// left of large values that have been taken away again goes no farther.
inline constexpr int kScatterBlock = 64;

// Cells of one row and one layer, `samples` doubles each. A cell is what its pixel has more than the pixel to
// its left, at the left end of a block all that it has.
struct ScatterRow {
  double* cells = nullptr;  // at column `begin`, which is the left end of a block
  int begin = 0, end = 0;
  int samples = 0;
};

// Pixels [x0, x1) of one source row within one block, of one level; `values` at x0, `samples` floats each.
struct ScatterRun {
  const float* values = nullptr;
  int x0 = 0, x1 = 0;
  ApertureRow weights;
};

using ScatterFunction = void (*)(const ScatterRow&, const ScatterRun&);

// For the SIMD target of this moment.
ScatterFunction ChooseScatter();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_SCATTER_KERNEL_H_
