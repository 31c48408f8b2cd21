// What lies hidden beneath the edge of a near surface, guessed from the farther one beside it.
#ifndef TESSERA_OPS_ACCUMULATE_HIDDEN_H_
#define TESSERA_OPS_ACCUMULATE_HIDDEN_H_

#include <cstdint>

#include "base/arena.h"
#include "model/defocus.h"
#include "tessera/image.h"

namespace tessera::ops {

// Defocus of a region's pixels, row by row.
struct DefocusPlanes {
  Roi roi;
  float* shift = nullptr;
  int16_t* level = nullptr;
  int16_t* layer = nullptr;

  static DefocusPlanes Make(const Roi& roi, base::Arena& scratch);
  ptrdiff_t Index(int x, int y) const {
    return static_cast<ptrdiff_t>(y - roi.y0) * roi.width() + (x - roi.x0);
  }
};

// For every pixel of `hidden.roi`: level and layer of what is beneath it, level -1 for nothing, and its
// `channels` values at the start of `samples` floats each. Reads `reach` pixels around; `all` and `color`
// contain those of them that are in the image.
void FindHidden(const DefocusPlanes& all, const ConstImageView& color, int reach, int samples,
                const DefocusPlanes& hidden, float* values, base::Arena& scratch);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_HIDDEN_H_
