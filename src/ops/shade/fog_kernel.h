// What the fog kernels are made from: one law of transmittance and where its inputs are.
#ifndef TESSERA_OPS_SHADE_FOG_KERNEL_H_
#define TESSERA_OPS_SHADE_FOG_KERNEL_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

// Heights from `bottom` up to `top` (either may be infinite) with density base + slope * (y - bottom); where
// bottom is infinite the slope is 0.
struct FogSegment {
  double bottom, top, base, slope;
};

struct FogPlan {
  FogMode mode = FogMode::kExp;
  double density = 1, start = 0, end = 1;
  float color[3] = {};
  double eye[3] = {};
  bool distance = false;  // plane 0 of the position image is the distance
  int color_input = -1, mask_input = -1;
  bool layered = false;
  std::vector<FogSegment> segments;           // FogProfile::kConstant, kLinear
  std::vector<ExponentialLayer> exponential;  // FogProfile::kExponential
  double density_at_eye = 0;                  // of the segments
};

std::unique_ptr<graph::PointStage> MakeFogStage(const FogPlan& plan);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_FOG_KERNEL_H_
