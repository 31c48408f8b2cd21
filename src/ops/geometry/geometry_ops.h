// Registry rows of the geometry family: resize, mip, zoom, shift, warp, st_warp, distort.
#ifndef TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_
#define TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo ResizeInfo();
OpInfo MipInfo();
OpInfo ZoomInfo();
OpInfo ShiftInfo();
OpInfo WarpInfo();
OpInfo StWarpInfo();
OpInfo DistortInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_
