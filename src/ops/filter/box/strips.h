// Means over boxes in one sweep over strips: sums down a strip's columns, then along its rows.
#ifndef TESSERA_OPS_FILTER_BOX_STRIPS_H_
#define TESSERA_OPS_FILTER_BOX_STRIPS_H_

#include <algorithm>
#include <cstddef>

#include "base/stage.h"
#include "ops/filter/lines/extend.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// Boxes up to this side go through the strips; the sums of larger ones would not stay near.
inline constexpr int kLargestStripBox = 255;

inline constexpr int kBoxRows = 4;  // rows that go through together: the sums so far stay in registers

// A strip's columns for the results of whole blocks of rows, and where its sums are.
struct BoxStrip {
  ConstImageView in;
  ImageView out;
  int width = 1, height = 1;  // of the box
  const AxisBorder* x = nullptr;
  const AxisBorder* y = nullptr;
  int first = 0, count = 0;        // columns of the image, from 0
  int row_begin = 0, row_end = 0;  // rows of the image, from 0; row_begin is a multiple of `height`
  // One factor for all results, or (where not null) one per column and row.
  double factor = 1;
  const double* column_factors = nullptr;
  const double* row_factors = nullptr;
  float largest = 0;
  bool stream = false;

  int pixels() const { return count + width - 1; }
  // Samples of a row of the strip with whole lines of four pixels, and a pixel more.
  ptrdiff_t stride() const { return (ptrdiff_t{(count + 3) / 4 * 4 + width} * in.channels + 15) / 16 * 16; }
  // Rows that are kept where the strip reaches beyond the image: a window's and those that enter.
  int padded_rows() const { return height + kBoxRows; }
  // Ends of sums of a block's rows, sums so far, columns' sums, ends of sums along rows.
  size_t scratch_doubles() const {
    return static_cast<size_t>(stride()) * static_cast<size_t>(height + 1 + kBoxRows) +
           static_cast<size_t>(width) * kBoxRows * 4 + 8;
  }
  // Padded rows, one of what lies beyond the image, and results on their way.
  size_t scratch_floats() const {
    return static_cast<size_t>(stride()) * static_cast<size_t>(padded_rows() + 1 + kBoxRows);
  }
};

using BoxStripFunction = void (*)(const BoxStrip& strip, double* doubles, float* floats);
// Of one instruction set, chosen when a stage is made.
BoxStripFunction ChooseBoxStrip();

// As RunBox for sides up to kLargestStripBox. `largest`: 0, or the largest code of an integer image whose
// samples all are codes / largest; results then lie on the side of the code that the exact mean rounds to
// (half to even), as IntegerSums leaves them.
void RunBoxStrips(BoxStripFunction run, int width, int height, const ConstImageView& in, const ImageView& out,
                  Wrap wrap, double border_value, int largest, const graph::Workers& workers);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_BOX_STRIPS_H_
