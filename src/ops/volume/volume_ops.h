// Registry rows of the volume family.
#ifndef TESSERA_OPS_VOLUME_VOLUME_OPS_H_
#define TESSERA_OPS_VOLUME_VOLUME_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo VolumeInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_VOLUME_VOLUME_OPS_H_
