// Registry rows of the geometry family: resize, mip, zoom, shift, warp, st_warp, distort, what
// moves pixels and windows.
#ifndef TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_
#define TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_

#include <string>

#include "ops/registry.h"
#include "tessera/ops/arrangement.h"

namespace tessera::ops {

OpInfo ResizeInfo();
OpInfo MipInfo();
OpInfo ZoomInfo();
OpInfo ShiftInfo();
OpInfo WarpInfo();
OpInfo StWarpInfo();
OpInfo DistortInfo();
OpInfo FlipInfo();
OpInfo FlopInfo();
OpInfo Rotate90Info();
OpInfo Rotate180Info();
OpInfo Rotate270Info();
OpInfo TransposeInfo();
OpInfo CircularShiftInfo();
OpInfo TileableInfo();
OpInfo ReorientInfo();
OpInfo OriginInfo();
OpInfo OriginOffsetInfo();
OpInfo FullSizeInfo();
OpInfo FullPixelsInfo();
OpInfo CropToFullInfo();
OpInfo RotateInfo();
OpInfo ResampleInfo();
OpInfo FitInfo();
OpInfo PasteInfo();
OpInfo MosaicInfo();

// Where something goes: +X+Y. Throws Error about `subject`.
Offset ParseOffset(const std::string& subject, const std::string& text);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_GEOMETRY_OPS_H_
