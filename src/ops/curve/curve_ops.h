// Registry rows of the curve family: transfer functions, powers, the pixel-transfer pipeline.
#ifndef TESSERA_OPS_CURVE_CURVE_OPS_H_
#define TESSERA_OPS_CURVE_CURVE_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo CurveInfo();
OpInfo PowerConstantInfo();
OpInfo TransferInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_OPS_H_
