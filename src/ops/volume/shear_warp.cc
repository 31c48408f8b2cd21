// Shear-warp (Lacroute and Levoy 1994): every slice is shifted, for perspective cameras scaled too, and not
// resampled along the rays; blocks of voxels that are transparent and pixels that are opaque are skipped; one
// warp brings the sheared picture to the screen.
#include "ops/volume/shear_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/arena.h"
#include "base/block.h"
#include "ops/volume/prepare.h"

namespace tessera::ops::volume {
namespace {

class ShearWarpStage final : public graph::WholeStage {
 public:
  ShearWarpStage(VolumeDrawPointer draw, const graph::Workers& workers) : draw_(std::move(draw)) {
    Prepare(*draw_, MiddleDepth(*draw_), workers, prepared_);
    const RaySet& rays = prepared_.medium.rays;
    Sheared& s = sheared_;
    s.medium = &prepared_.medium;
    s.size = draw_->volume.spec().size;
    s.deep = prepared_.medium.axis;
    s.right = s.deep == 0 ? 1 : 0;
    s.down = s.deep == 2 ? 1 : 2;
    s.perspective = rays.perspective;
    const int slices = s.size[static_cast<size_t>(s.deep)];
    const double along = rays.direction[s.deep][0];
    s.backward = along < 0;
    s.shear_right = rays.direction[s.right][0] / along;
    s.shear_down = rays.direction[s.down][0] / along;
    for (int a = 0; a < 3; ++a) {
      s.eye[a] = rays.origin[a][0] - static_cast<double>(rays.middle_depth) * rays.direction[a][0];
    }
    s.base = s.perspective && s.backward ? slices - 1 : 0;
    s.length = s.LengthOf({rays.direction[0][0], rays.direction[1][0], rays.direction[2][0]});
    // Every voxel, one beyond the outermost ones, of the first and the last slice is in the picture.
    const auto extent = [&](int axis, int& first) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const int k : {0, slices - 1}) {
        const Sheared::Slice slice = s.At(k);
        const double offset = axis == s.right ? slice.right : slice.down;
        low = std::min(low, (-1 - offset) / slice.scale);
        high = std::max(high, (s.size[static_cast<size_t>(axis)] - offset) / slice.scale);
      }
      first = static_cast<int>(std::floor(low));
      return static_cast<int>(std::ceil(high)) + 2 - first;
    };
    s.width = extent(s.right, s.right0);
    s.height = extent(s.down, s.down0);
    s.stride = s.width + kGroupPixels;
  }

  void Run(std::span<const ConstImageView>, const ImageView& out,
           const graph::Workers& workers) const override {
    const Sheared& s = sheared_;
    const size_t row_floats = static_cast<size_t>(s.stride) * 4;
    const auto memory =
        base::AllocateAligned(workers.context(), row_floats * static_cast<size_t>(s.height) * sizeof(float));
    auto* const picture = reinterpret_cast<float*>(memory.get());
    const CompositeSheared composite = FindCompositeSheared(draw_->volume.spec().type);
    const WarpSheared warp = FindWarpSheared();
    workers.For(s.height, [&](int64_t row, int) {
      composite(s, static_cast<int>(row), picture + static_cast<size_t>(row) * row_floats);
    });
    workers.For(out.roi.height(),
                [&](int64_t y, int) { warp(s, picture, out, out.roi.y0 + static_cast<int>(y)); });
  }

 private:
  VolumeDrawPointer draw_;
  Prepared prepared_;
  Sheared sheared_;
};

}  // namespace

double Sheared::LengthOf(const std::array<double, 3>& direction) const {
  double square = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double d = direction[a] * static_cast<double>(medium->rays.spacing[a]);
    square += d * d;
  }
  return std::sqrt(square) / std::fabs(direction[static_cast<size_t>(deep)]);
}

std::unique_ptr<graph::WholeStage> MakeShearWarp(VolumeDrawPointer draw, const graph::StageContext& context) {
  return std::make_unique<ShearWarpStage>(std::move(draw), context.workers);
}

}  // namespace tessera::ops::volume
