// Registry rows of the noise family, and the parameters' words that its commands share.
#ifndef TESSERA_OPS_NOISE_NOISE_OPS_H_
#define TESSERA_OPS_NOISE_NOISE_OPS_H_

#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/ops/noise.h"

namespace tessera::ops {

OpInfo WhiteNoiseInfo();
OpInfo ValueNoiseInfo();
OpInfo GradientNoiseInfo();
OpInfo SimplexNoiseInfo();
OpInfo CellNoiseInfo();
OpInfo SparseNoiseInfo();
OpInfo SpotNoiseInfo();
OpInfo HashNoiseInfo();
OpInfo GaborNoiseInfo();
OpInfo NoiseAtInfo();
OpInfo ShapedSpotsInfo();
OpInfo SvgTurbulenceInfo();
OpInfo SvgFractalNoiseInfo();
OpInfo SvgTurbulenceAtInfo();
OpInfo CloudsInfo();
OpInfo MarbleInfo();
OpInfo WoodInfo();
OpInfo FireInfo();
OpInfo SmokeInfo();
OpInfo RipplesInfo();
OpInfo GardnerInfo();

// The registry name of a kind's generator.
const char* NoiseName(NoiseKind kind);
// Modifiers of a kind's commands, and the parameters that they make.
std::vector<ParamInfo> NoiseModifiers(NoiseKind kind);
NoiseParams NoiseArguments(NoiseKind kind, const Arguments& arguments);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_NOISE_OPS_H_
