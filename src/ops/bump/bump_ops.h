// Registry rows of the bump family: normalmap, bump, tangentnormals, surfacebump, combinenormals.
#ifndef TESSERA_OPS_BUMP_BUMP_OPS_H_
#define TESSERA_OPS_BUMP_BUMP_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo HeightNormalsInfo();
OpInfo BumpInfo();
OpInfo HeightOcclusionInfo();
OpInfo HeightCurvatureInfo();
OpInfo TangentNormalsInfo();
OpInfo SurfaceBumpInfo();
OpInfo CombineNormalsInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_BUMP_BUMP_OPS_H_
