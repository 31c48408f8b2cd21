// Where operations find normals and depths in files of AOVs; PositionsOf() of tessera/ops/shade.h likewise.
#ifndef TESSERA_OPS_SHADE_AOV_INPUTS_H_
#define TESSERA_OPS_SHADE_AOV_INPUTS_H_

#include "tessera/node.h"

namespace tessera {

// The normal AOV alone, X,Y,Z; the image itself where that is its first three channels, or where there is
// none.
Node NormalsOf(const Node& image);
// Whether an image holds a depth AOV among other AOVs.
bool IsAovFile(const ImageSpec& spec);
// The depth AOV as one channel Z, or else the first channel.
Node DepthsOf(const Node& image);

}  // namespace tessera

#endif  // TESSERA_OPS_SHADE_AOV_INPUTS_H_
