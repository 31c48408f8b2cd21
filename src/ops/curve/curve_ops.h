// Registry rows of the curve family: transfer functions, powers, the pixel-transfer pipeline.
#ifndef TESSERA_OPS_CURVE_CURVE_OPS_H_
#define TESSERA_OPS_CURVE_CURVE_OPS_H_

#include <string>

#include "ops/registry.h"

namespace tessera::ops {

OpInfo CurveInfo();
OpInfo PowerConstantInfo();
OpInfo TransferInfo();

// The colour space of an image that was in `space` before a curve of --curve, empty where it has no name.
std::string SpaceAfterCurve(const std::string& curve, double exponent, bool inverse,
                            const std::string& space);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_OPS_H_
