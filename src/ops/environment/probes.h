// What a pixel's reflection covers of the sphere, and the lookups over it.
#ifndef TESSERA_OPS_ENVIRONMENT_PROBES_H_
#define TESSERA_OPS_ENVIRONMENT_PROBES_H_

#include "ops/environment/mips.h"
#include "ops/geometry/pixel_footprint.h"

namespace tessera::ops {

// Of the middle row's pixels, with those above and below; about their unit directions.
void FindReflectionProbes(const EnvironmentMips& mips, ProbeFilter filter, int anisotropy,
                          const MirrorRow& above, const MirrorRow& row, const MirrorRow& below, int count,
                          PixelProbes* probes);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_PROBES_H_
