// Correlation with large kernels by Fourier transforms of square blocks.
#ifndef TESSERA_OPS_FILTER_FFT_FFT_H_
#define TESSERA_OPS_FILTER_FFT_FFT_H_

#include <cstddef>
#include <vector>

namespace tessera::ops {

// A kernel ready for blocks of size x size pixels, of which all but its own width and height less 1 are
// results.
struct FftKernel {
  template <class T>
  struct Spectrum {
    std::vector<T> twiddles;  // cos, sin of -2 pi j / size
    // At frequency (k, l), 0 < k < size / 2, in row l of the transform's own order and column k, scaled.
    std::vector<T> re, im;
    // At the frequencies (0, l) and (size / 2, l), l in its natural order up to size / 2.
    struct Edge {
      T re[2], im[2];
    };
    std::vector<Edge> edges;
  };
  int size = 0, width = 0, height = 0;
  std::vector<int> row_of;  // where the transform leaves a frequency
  Spectrum<float> single;
  Spectrum<double> precise;
  double sum = 0;  // of the weights

  int step_x() const { return size - width + 1; }
  int step_y() const { return size - height + 1; }
};
FftKernel MakeFftKernel(int width, int height, const std::vector<double>& weights);
// Scratch floats that FftFunctions::channel wants.
size_t FftScratchFloats(const FftKernel& kernel);

// One channel of a block of size x size pixels, its first tap at `in`, samples `step` floats apart.
struct FftBlock {
  const float* in;
  ptrdiff_t in_stride;
  int step;
};
// Up to four channels of results [x0, x1) x [y0, y1) of a block, in rows of `size` floats; the pixel of
// (x0, y0) is at `out`, samples `step` floats apart.
struct FftResults {
  const float* plane[4];
  int channels, x0, y0, x1, y1;
  float* out;
  ptrdiff_t out_stride;
  int step;
};

// The kernels of one instruction set, chosen when a stage is made. Every channel of every block is
// transformed by itself, so that its bits are its own affair. The block's mean is taken out and put back.
// |error| <= 16 u times the root of the sum of squared weights times that of the squared deviations of the
// block. That would bury the dark beside a bright light: where a sample deviates by more than 16 times the
// mean magnitude, or where floats might overflow, the transform is in double, and |error| <= u |result| +
// 2^-48 times those roots. A channel that is the same everywhere is exact.
struct FftFunctions {
  // Rows [y0, y1) of step_x results to `results`, in rows of `size` floats. False, and no results, where a
  // sample is not finite: it would reach all of the block.
  bool (*channel)(const FftKernel& kernel, const FftBlock& block, int y0, int y1, float* results,
                  float* scratch);
  void (*interleave)(const FftResults& results, int size);
};
FftFunctions ChooseFft();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FFT_FFT_H_
