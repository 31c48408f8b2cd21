// The separable resampling of a tile: down the columns of several rows, then along the rows.
#ifndef TESSERA_OPS_GEOMETRY_RESAMPLE_KERNEL_H_
#define TESSERA_OPS_GEOMETRY_RESAMPLE_KERNEL_H_

#include "base/arena.h"
#include "ops/geometry/filters.h"
#include "tessera/image.h"

namespace tessera::ops {

// `in` holds every pixel that the taps of out.roi name; dense floats, as many channels as `out`. 64 bytes
// beyond the end of a row may be read.
struct ResampleJob {
  ConstImageView in;
  ImageView out;
  const AxisTaps& x;
  const AxisTaps& y;
  bool stream;
  base::Arena& scratch;
};
using ResampleFunction = void (*)(const ResampleJob&);

// For the SIMD target of this moment.
ResampleFunction ChooseResample();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_RESAMPLE_KERNEL_H_
