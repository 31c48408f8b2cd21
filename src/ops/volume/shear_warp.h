// Shear-warp: slices composited in the volume's own frame, then one warp in two dimensions.
#ifndef TESSERA_OPS_VOLUME_SHEAR_WARP_H_
#define TESSERA_OPS_VOLUME_SHEAR_WARP_H_

#include <memory>

#include "graph/op.h"
#include "tessera/ops/volume_draw.h"

namespace tessera::ops::volume {

std::unique_ptr<graph::WholeStage> MakeShearWarp(base::VolumeDrawPointer draw,
                                                 const graph::StageContext& context);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_SHEAR_WARP_H_
