// The Gaussian at a quarter of the resolution: decimate, blur, interpolate.
#ifndef TESSERA_OPS_FILTER_GAUSS_DECIMATED_H_
#define TESSERA_OPS_FILTER_GAUSS_DECIMATED_H_

#include <memory>

#include "base/stage.h"
#include "graph/little_memory.h"
#include "ops/filter/gauss/recursive.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// The kernels of one instruction set, chosen when a stage is made.
struct DecimatedFunctions {
  void (*decimate_rows)(const float* const* rows, int floats, float* out);
  void (*decimate_pixels)(const float* in, int channels, int count, float* out);
  void (*interpolate_rows)(const float* const* rows, int phase, int floats, float* out);
  void (*interpolate_pixels)(const float* in, int channels, int width, float* out, bool stream);
  GaussianTracksFunction tracks;
};
DecimatedFunctions ChooseDecimated();

// Both sigmas from 16 on; any border but kRenormalize. The image is reduced by 4 with
// the fourth power of a box (13 taps, variance 5), blurred recursively with variance (sigma^2 - 10) / 16, and
// enlarged with the same 13 taps, which sum to 1 for every position. L1 distance from the sampled Gaussian
// below 1e-4 from sigma 16 on. `in` and `out` are dense float images of one window. Samples must be finite.
void RunDecimated(const DecimatedFunctions& functions, double sigma_x, double sigma_y,
                  const ConstImageView& in, const ImageView& out, Wrap wrap, double border_value,
                  const graph::Workers& workers);

// The same, bit for bit, with rows as they come, at a sixteenth of the image's memory; null for borders that
// are made of rows elsewhere.
std::unique_ptr<graph::RowsStage> MakeDecimatedRows(double sigma_x, double sigma_y, const ImageSpec& image,
                                                    Wrap wrap, double border_value, Context& context);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_GAUSS_DECIMATED_H_
