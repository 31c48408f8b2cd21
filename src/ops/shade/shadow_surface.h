// The surfaces that a light's depths show: slopes, bends and twists of every texel, as its neighbours show
// them.
#ifndef TESSERA_OPS_SHADE_SHADOW_SURFACE_H_
#define TESSERA_OPS_SHADE_SHADOW_SURFACE_H_

#include <cstddef>
#include <memory>

#include "tessera/image.h"

namespace tessera::ops {

// By texel: slope and bend along the row, slope and bend along the column, twist.
struct SurfaceRow {
  static constexpr int kPlanes = 5;
  double* plane[kPlanes];
};

// Rows of depths, of which some texels around, and a vector beyond, can be read: nothing is hit beside the
// map.
class SurfaceKernel {
 public:
  virtual ~SurfaceKernel() = default;
  // Of `count` texels from `middle` on, by two texels around each. Planes are written by whole vectors.
  virtual void Surfaces(const float* middle, ptrdiff_t stride, int count, const SurfaceRow& to) const = 0;
  // How much deeper than a texel its own surface is within `reach` texels each way: as its neighbours
  // foretell, or as the map has it `around` it, where both ends foretell a part of that at least. So neither
  // curved nor rough surfaces shadow themselves, and the depths behind an edge are not taken for its own.
  // `next`: from a row's planes to the next row's. Where nothing is hit the result means nothing.
  virtual void Deeper(const float* middle, ptrdiff_t stride, int count, const SurfaceRow& here,
                      ptrdiff_t next, double reach, int around, float* scratch, double* deeper) const = 0;
};
std::unique_ptr<const SurfaceKernel> MakeSurfaceKernel();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_SHADOW_SURFACE_H_
