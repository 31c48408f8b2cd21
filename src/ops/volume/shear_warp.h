// Shear-warp: what its kernels are given, and the stage.
#ifndef TESSERA_OPS_VOLUME_SHEAR_WARP_H_
#define TESSERA_OPS_VOLUME_SHEAR_WARP_H_

#include <array>
#include <memory>

#include "graph/op.h"
#include "model/volume_settings.h"
#include "ops/volume/march.h"

namespace tessera::ops::volume {

// The sheared picture. Axes: `deep` along which slices are stacked, `right` and `down` within them. Its
// pixels are the voxels of the slice at `base`, which is 0 for parallel cameras and the nearest one for
// others: farther ones shrink.
struct Sheared {
  const MediumArgs* medium = nullptr;
  std::array<int, 3> size = {};  // voxels
  int deep = 2, right = 0, down = 1;
  bool perspective = false;
  bool backward = false;                   // the first slice is the last one
  double shear_right = 0, shear_down = 0;  // parallel: voxels a slice
  double eye[3] = {0, 0, 0}, base = 0;     // perspective: voxels
  int right0 = 0, down0 = 0, width = 0, height = 0;
  double length = 0;  // parallel: world units of a ray within a slice
  int stride = 0;     // pixels from row to row in memory; whole vectors fit

  // A ray through (right, down) of the picture meets slice k at offset + scale * place.
  struct Slice {
    double right, down, scale;
  };
  Slice At(int k) const {
    if (!perspective) return {shear_right * k, shear_down * k, 1};
    const double scale = (k - eye[deep]) / (base - eye[deep]);
    return {eye[right] * (1 - scale), eye[down] * (1 - scale), scale};
  }
  // World units of a way along a direction in voxels, from one slice to the next.
  double LengthOf(const std::array<double, 3>& direction) const;
};

// One row of the sheared picture, R, G, B, A pixels, through all slices, front to back.
using CompositeSheared = void (*)(const Sheared& sheared, int row, float* line);
// Row y of the result from the sheared picture.
using WarpSheared = void (*)(const Sheared& sheared, const float* picture, const ImageView& out, int y);
CompositeSheared FindCompositeSheared(PixelType type);
WarpSheared FindWarpSheared();

std::unique_ptr<graph::WholeStage> MakeShearWarp(VolumeDrawPointer draw, const graph::StageContext& context);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_SHEAR_WARP_H_
