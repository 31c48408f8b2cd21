// Registry rows of colour management: LUT files, colour spaces, displays, looks.
#ifndef TESSERA_OCIO_OCIO_OPS_H_
#define TESSERA_OCIO_OCIO_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo LutInfo();
OpInfo ColorConvertInfo();
OpInfo OcioDisplayInfo();
OpInfo OcioLookInfo();
OpInfo OcioFileTransformInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OCIO_OCIO_OPS_H_
