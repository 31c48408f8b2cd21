// A surface's vectors as a picture's: the kernel of a row.
#ifndef TESSERA_OPS_FLOW_SURFACE_FIELD_H_
#define TESSERA_OPS_FLOW_SURFACE_FIELD_H_

#include <cstddef>

namespace tessera::ops::flow {

// Rows and columns of positions that are read around a pixel.
inline constexpr int kSurfaceReach = 2;
// Floats that may be read and written beyond the end of a row.
inline constexpr ptrdiff_t kSurfaceSlack = 16;

struct SurfaceSetup {
  double edge = 3;              // squared; 0: none
  bool by_camera = false;       // vectors through the matrix, else by the positions' differences
  double matrix[16] = {};       // world to clip
  double across = 0, down = 0;  // pixels per unit of clip coordinates
};

// Planes of a row, x, y and z: of positions with `stride` to the rows above and below. What is not there is
// NaN.
struct SurfaceRow {
  const float *position[3], *vector[3], *normal[3];
  ptrdiff_t stride;
  int count;
  float *x, *y, *known;  // of the result
};

using SurfaceFunction = void (*)(const SurfaceSetup&, const SurfaceRow&);
SurfaceFunction ChooseSurfaceFunction();

}  // namespace tessera::ops::flow

#endif  // TESSERA_OPS_FLOW_SURFACE_FIELD_H_
