// The Gaussian as a recursive filter: three pairs of complex poles, causal and anticausal sums in parallel.
#ifndef TESSERA_OPS_FILTER_GAUSS_RECURSIVE_H_
#define TESSERA_OPS_FILTER_GAUSS_RECURSIVE_H_

#include <vector>

#include "base/stage.h"
#include "ops/filter/lines/extend.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// Coefficients for one sigma. A pair of poles p and its conjugate is run as
//   v' = decay v - step u + x,   u' = u + step v',   decay = |p|^2, step = |1 - p|,
// which keeps its accuracy in float32 for poles near 1, where the direct form diverges; one step of the
// causal sum gives forward_v v' + forward_u u', one of the anticausal sum backward_v v + backward_u u before
// it takes x.
struct RecursiveGaussian {
  static constexpr int kPairs = 3;
  float decay[kPairs], step[kPairs], forward_v[kPairs], forward_u[kPairs], backward_v[kPairs],
      backward_u[kPairs];
  int warm_up = 0;  // samples after which a start from nothing is forgotten

  // The impulse response at distance n, as the coefficients realise it, in double.
  std::vector<double> Response(int length) const;
};
RecursiveGaussian MakeRecursiveGaussian(double sigma);

// The sum of the weights that lie inside an axis of `length` pixels, for each of them.
std::vector<double> WeightsInside(const RecursiveGaussian& gaussian, int length);

using GaussianTracksFunction = void (*)(const RecursiveGaussian&, const TrackBlock&, bool rgba_rows,
                                        const AxisBorder&, const float* scale, float* scratch);
// Of one instruction set, chosen when a stage is made.
GaussianTracksFunction ChooseGaussianTracks();

// Filters the dense float image `in` into `out` (same window; may be the same pixels), rows by `x`, columns
// by `y`; null leaves an axis alone, but not both. Samples must be finite.
void RunRecursive(GaussianTracksFunction tracks, const RecursiveGaussian* x, const RecursiveGaussian* y,
                  const ConstImageView& in, const ImageView& out, Wrap wrap, double border_value,
                  const graph::Workers& workers);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_GAUSS_RECURSIVE_H_
