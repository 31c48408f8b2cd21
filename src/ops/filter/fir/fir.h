// Weighted sums over a window on dense interleaved float rows: any kernel directly, or columns then rows.
#ifndef TESSERA_OPS_FILTER_FIR_FIR_H_
#define TESSERA_OPS_FILTER_FIR_FIR_H_

#include <memory>
#include <vector>

#include "ops/filter/window/sums.h"

namespace tessera::ops {

// Weights of a correlation: the sample at column dx (in pixels), row dy of the window is multiplied by
// weights[dy * width + dx]. Zero weights take no part.
struct DirectWindow {
  int width = 1, height = 1;
  std::vector<float> weights;
  // Zero-sum kernels: differences from this tap's sample are summed, so that flat images give exactly 0.
  bool centered = false;
  int center_x = 0, center_y = 0;

  // Runs of non-zero weights down a column; grouped by dx modulo 4, the order of summation.
  struct Run {
    int dx, dy_begin, dy_end;
  };
  std::vector<Run> runs[4];
  bool dense = false;  // no zero weight
};
DirectWindow MakeDirectWindow(int width, int height, std::vector<float> weights);
std::unique_ptr<const WindowSums> MakeDirectSums(const DirectWindow& window);

// Sum over terms of: down `column`, then along `row`; no zero weights.
struct SeparableWindow {
  struct Term {
    std::vector<float> column, row;
  };
  int width = 1, height = 1;  // of the window
  std::vector<Term> terms;    // all of that size
};
std::unique_ptr<const WindowSums> MakeSeparableSums(const SeparableWindow& window);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FIR_FIR_H_
