// Weighted sums over a window on dense interleaved float rows: any kernel directly, or columns then rows.
#ifndef TESSERA_OPS_FILTER_FIR_FIR_H_
#define TESSERA_OPS_FILTER_FIR_FIR_H_

#include <cstddef>
#include <vector>

#include "base/arena.h"

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

// Sum over terms of: down `column`, then along `row`; no zero weights.
struct SeparableWindow {
  struct Term {
    std::vector<float> column, row;
  };
  int width = 1, height = 1;  // of the window
  std::vector<Term> terms;    // all of that size
};

// A rectangle of samples. `in` points at the window's first tap of the first output sample; strides in
// floats; rows of `in` may be read up to 16 floats beyond the last tap of the last sample. `stream`: write
// around the cache where addresses are aligned.
struct FirTile {
  const float* in = nullptr;
  ptrdiff_t in_stride = 0;
  float* out = nullptr;
  ptrdiff_t out_stride = 0;
  int floats = 0, rows = 0;  // of the output
  int channels = 1;          // floats per pixel
  bool stream = false;
};

// The kernels of one instruction set, chosen when a stage is made.
struct FirFunctions {
  using Direct = void (*)(const DirectWindow& window, const FirTile& tile);
  struct Separable {
    size_t (*scratch_floats)(const SeparableWindow& window, const FirTile& tile);
    void (*run)(const SeparableWindow& window, const FirTile& tile, float* scratch);
  };
  Direct direct;
  Separable separable;
};
FirFunctions::Direct ChooseDirect();
FirFunctions::Separable ChooseSeparable();

// What computes the sums of tiles in floats: the products, where there are any, or every tap.
struct FloatSums {
  const FirFunctions& functions;
  const DirectWindow& direct;
  const SeparableWindow& separable;
  base::Arena& scratch;

  void operator()(const FirTile& tile) const;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FIR_FIR_H_
