// A picture with depth as a surface: every pixel a quadrilateral in space, apart from its neighbours where
// depths jump. What another camera sees of it.
#ifndef TESSERA_OPS_SHADE_DEPTH_MESH_H_
#define TESSERA_OPS_SHADE_DEPTH_MESH_H_

#include <cstdint>
#include <span>
#include <vector>

#include "base/stage.h"
#include "tessera/camera.h"
#include "tessera/image.h"
#include "tessera/ops/reproject.h"

namespace tessera::ops {

class DepthMesh {
 public:
  // `depth`: one channel or more, of which the first is planar depth from params.from, whose frame is
  // `from_frame`; the pixels stay as long as the mesh. `to_frame`: where params.to shows it.
  DepthMesh(const ConstImageView& depth, const Roi& from_frame, const Roi& to_frame,
            const ReprojectParams& params, const graph::Workers& workers);

  // What a place of the result sees: a pixel of the picture, -1 for nothing, and where within it.
  struct Hit {
    double depth;  // planar, from params.to
    double u, v;   // in pixels of the picture
    int32_t x, y;  // the pixel
  };
  // The nearest surface at samples x samples places of every pixel of `roi`: hits[(row * width + column) *
  // samples^2 + ...], rows of places from above.
  void Rasterize(const Roi& roi, std::span<Hit> hits) const;

  // Whether two pixels are of one surface.
  bool Joined(int x0, int y0, int x1, int y1) const;
  const Roi& window() const { return depth_.roi; }

 private:
  struct Corner {
    Vector3 world;
    double x, y, w;  // in the result's pixels, and the divisor
  };
  static constexpr int kBlock = 16;  // pixels along a side of what is looked at together

  bool Valid(int x, int y, float* depth) const;
  double CornerDepth(int x, int y, int corner_x, int corner_y) const;
  // False where there is no surface, or some of it is behind the result's eye.
  bool QuadOf(int x, int y, Corner (&corners)[4]) const;
  // Pixels of the result that four corners may touch; empty where none.
  Roi BoundsOf(const Corner (&corners)[4]) const;
  bool Faces(const Corner& a, const Corner& b, const Corner& c) const;
  void Triangle(const Corner& a, const Corner& b, const Corner& c, int x, int y, const Roi& roi,
                std::span<Hit> hits) const;

  ConstImageView depth_;
  Roi from_frame_, to_frame_;
  ReprojectParams params_;
  int columns_ = 0, rows_ = 0;  // of blocks
  std::vector<Roi> blocks_;     // what each may touch of the result
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_DEPTH_MESH_H_
