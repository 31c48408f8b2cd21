// Kernels that find places: depths of another kind, points from depths, points through a matrix, fog's table
// axes.
#ifndef TESSERA_OPS_SHADE_PLACE_KERNEL_H_
#define TESSERA_OPS_SHADE_PLACE_KERNEL_H_

#include <memory>

#include "base/stage.h"
#include "tessera/camera.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

// Rays of the pixels of a frame: origin and direction at (x, y) are [0] + x [1] + y [2].
struct PixelRays {
  double origin[3][3], direction[3][3];
};
PixelRays RaysOf(const Camera& camera, const Roi& window);

struct DepthPlan {
  DepthParams params;
  PixelRays rays;
};
std::unique_ptr<graph::PointStage> MakeDepthStage(const DepthPlan& plan);
std::unique_ptr<graph::PointStage> MakePositionStage(const DepthPlan& plan);

struct TransformPlan {
  double matrix[16];
  bool divide = false;
};
std::unique_ptr<graph::PointStage> MakeTransformStage(const TransformPlan& plan);

// R,G,B of the result: distance * scale, (y - low) * height_scale, `constant`.
struct FogAxesPlan {
  double eye[3], distance_scale, low, height_scale, constant;
};
std::unique_ptr<graph::PointStage> MakeFogAxesStage(const FogAxesPlan& plan);

// NaN where the same plane of input 1 is not positive.
std::unique_ptr<graph::PointStage> MakeMaskStage();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_PLACE_KERNEL_H_
