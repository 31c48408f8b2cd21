// Point stages of tangent frames and combined normals.
#ifndef TESSERA_OPS_BUMP_FRAME_H_
#define TESSERA_OPS_BUMP_FRAME_H_

#include <memory>

#include "base/stage.h"
#include "tessera/ops/bump.h"

namespace tessera::ops {

std::unique_ptr<graph::PointStage> MakeTangentStage(const TangentNormalsParams& params);
std::unique_ptr<graph::PointStage> MakeSurfaceStage(const SurfaceBumpParams& params);
std::unique_ptr<graph::PointStage> MakeCombineStage(const CombineNormalsParams& params);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_BUMP_FRAME_H_
