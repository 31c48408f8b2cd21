// Depth of field by layers: the stage.
#ifndef TESSERA_OPS_ACCUMULATE_LENS_LAYERS_H_
#define TESSERA_OPS_ACCUMULATE_LENS_LAYERS_H_

#include <memory>

#include "base/stage.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops {

// Inputs are the image and the depth, of the same data window; `picture` is the aperture's, or null.
std::unique_ptr<graph::TileStage> MakeLensLayersStage(const DepthOfFieldParams& params, const Roi& window,
                                                      const ConstImageView* picture);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_LENS_LAYERS_H_
