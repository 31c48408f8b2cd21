// From the images that a user has to what the streamline kernels follow.
#ifndef TESSERA_OPS_FLOW_PREPARE_H_
#define TESSERA_OPS_FLOW_PREPARE_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/flow/lines.h"

namespace tessera::ops::flow {

// Lines and the memory behind them.
struct Prepared {
  Lines lines;
  std::shared_ptr<std::byte> uv, texture, mask, cells, reach;
  float longest = 0;  // the longest vector, as stored; 0 when there is none
  double mean = 0.5;  // of the texture, as far as it is known
  // Where a map is stretched: what the first component shrinks by in each row, to be as long as it was given.
  std::vector<float> shrink;
  float longest_shown = 0;  // the longest vector after that

  // |f| over its largest value at a pixel, from 0 to 1.
  float SizeAt(int x, int y) const;
  // Octaves by which the noise's spots at a pixel are larger (LicMagnitude::kNoise).
  int SpotLevelAt(int x, int y) const;
  // Whether the vector there is 0, or as good as.
  bool IsStill(int x, int y) const;
};

// The weights of the taps: forward 1 to taps, backward 1 to taps, and the centre; their number is the same.
struct LicWeights {
  std::vector<double> forward, backward;
  double centre = 1;
};
LicWeights WeightsOf(const LicParams& params);
// Number of taps each way that weigh anything.
int TapsOf(const LicParams& params);
// Contrast::kRescale: what deviations from the mean are multiplied by where lines have 0 to TapsOf taps each
// way, for noise with spots of so many pixels.
std::vector<float> ContrastsOf(const LicParams& params, int spot);

// `field`: float, interleaved, at least two channels; its alpha channel or -1. `image`: the texture, or
// without data for the library's own noise. `window`: the result's pixels.
Prepared Prepare(const LicParams& params, const ConstImageView& field, int alpha, const ConstImageView& image,
                 const Roi& window, const graph::Workers& workers);

}  // namespace tessera::ops::flow

#endif  // TESSERA_OPS_FLOW_PREPARE_H_
