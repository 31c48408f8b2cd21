// Registry rows of the accumulate family: weighted sums of images, shift and accumulate, depth of field.
#ifndef TESSERA_OPS_ACCUMULATE_ACCUMULATE_OPS_H_
#define TESSERA_OPS_ACCUMULATE_ACCUMULATE_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo AccumInfo();
OpInfo AverageInfo();
OpInfo ShiftAccumulateInfo();
OpInfo DepthOfFieldInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_ACCUMULATE_OPS_H_
