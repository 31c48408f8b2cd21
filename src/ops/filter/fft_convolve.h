// Correlation with large kernels by Fourier transforms of square blocks.
#ifndef TESSERA_OPS_FILTER_FFT_CONVOLVE_H_
#define TESSERA_OPS_FILTER_FFT_CONVOLVE_H_

#include <cstddef>
#include <vector>

#include "base/arena.h"

namespace tessera::ops {

// A kernel ready for blocks of size x size pixels, of which all but its own width and height less 1 are
// results.
struct FftKernel {
  template <class T>
  struct Spectrum {
    std::vector<T> twiddles;  // cos, sin of -2 pi j / size
    std::vector<T> re, im;    // in the transform's own order, size x size, scaled by 1 / size^2
  };
  int size = 0, width = 0, height = 0;
  Spectrum<float> single;
  Spectrum<double> precise;
  double sum = 0;  // of the weights

  int step_x() const { return size - width + 1; }
  int step_y() const { return size - height + 1; }
};
FftKernel MakeFftKernel(int width, int height, const std::vector<double>& weights);
// Scratch floats that an FftFunction wants.
size_t FftScratchFloats(const FftKernel& kernel);

// step_x x step_y results from a block of size x size pixels of `channels` floats whose first tap is at `in`;
// writes the results [x0, x1) x [y0, y1) of them, (x0, y0) at `out`. A NaN or infinity anywhere in a block
// makes all of its channel NaN. Two channels go through each transform as the real and the imaginary part;
// the block's mean is taken out and put back. |error| <= 16 u times the root of the sum of squared weights
// times that of the squared deviations of the block. That would bury the dark beside a bright light: where a
// sample deviates by more than 16 times the mean magnitude of either channel the transform is in double, and
// |error| <= u |result| + 2^-48 times those roots. A channel that is the same everywhere is exact.
struct FftBlock {
  const float* in;
  ptrdiff_t in_stride;
  float* out;
  ptrdiff_t out_stride;
  int channels, x0, y0, x1, y1;
};
using FftFunction = void (*)(const FftKernel& kernel, const FftBlock& block, float* scratch);
// Of one instruction set, chosen when a stage is made.
FftFunction ChooseFft();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FFT_CONVOLVE_H_
