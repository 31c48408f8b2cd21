// Registry rows of the generate family: images made from nothing.
#ifndef TESSERA_OPS_GENERATE_GENERATE_OPS_H_
#define TESSERA_OPS_GENERATE_GENERATE_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo ConstantInfo();
OpInfo CreateInfo();
OpInfo CheckerInfo();
OpInfo RampInfo();
OpInfo FillInfo();
OpInfo AddNoiseInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GENERATE_GENERATE_OPS_H_
