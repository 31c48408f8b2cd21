// Registry rows of the flow family: pictures of vector fields.
#ifndef TESSERA_OPS_FLOW_FLOW_OPS_H_
#define TESSERA_OPS_FLOW_FLOW_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo LicInfo();
OpInfo EqualizeInfo();
OpInfo SurfaceFieldInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FLOW_FLOW_OPS_H_
