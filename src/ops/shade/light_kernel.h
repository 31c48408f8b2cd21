// What the kernels of light on positions are made from.
#ifndef TESSERA_OPS_SHADE_LIGHT_KERNEL_H_
#define TESSERA_OPS_SHADE_LIGHT_KERNEL_H_

#include <memory>

#include "base/stage.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

std::unique_ptr<graph::PointStage> MakeDiffuseLightStage(const LightSample& light);

struct SpotlightPlan {
  double eye[3], forward[3], x[4], y[4], w[4];  // rows of the light's clip matrix
  double color[3], attenuation[3];
  double exponent, cos_outer, cos_width;  // cos_width 0: no cone
  bool perspective, slide;
};
std::unique_ptr<graph::PointStage> MakeSpotlightStage(const SpotlightPlan& plan);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_LIGHT_KERNEL_H_
