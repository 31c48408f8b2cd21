// The stage of every operation that resamples rows and columns apart: taps per axis, one kernel.
#ifndef TESSERA_OPS_GEOMETRY_SEPARABLE_H_
#define TESSERA_OPS_GEOMETRY_SEPARABLE_H_

#include <memory>
#include <vector>

#include "graph/op.h"
#include "ops/geometry/resample_kernel.h"

namespace tessera::ops {

// What a separable resampling is: where each axis of the result lies on the source.
struct SeparableMap {
  AxisMap x, y;
  const FilterKernel* filter = nullptr;
  Wrap wrap = Wrap::kClamp;
};

// A stage of one input whose samples are codes of the type (CodesOf) or floats, with as many channels in as
// out.
std::unique_ptr<graph::TileStage> MakeSeparableStage(const SeparableMap& map,
                                                     PixelType codes = PixelType::kFloat);

// The input's pixels with exactly the channels that the tile's result holds, copied only where they differ.
ConstImageView InputChannels(const graph::TileArgs& args, size_t k);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_SEPARABLE_H_
