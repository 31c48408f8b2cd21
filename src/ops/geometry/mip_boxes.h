// All levels of a mip chain of boxes in one pass over the picture.
#ifndef TESSERA_OPS_GEOMETRY_MIP_BOXES_H_
#define TESSERA_OPS_GEOMETRY_MIP_BOXES_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/geometry/filters.h"
#include "tessera/image.h"

namespace tessera::ops {

// A level: where it lies in the result, and what its pixels are of the source's.
struct MipLevel {
  Roi window;
  AxisTaps x, y;
};

// Whether every result of an axis is the mean of the sources it takes.
bool IsOfBoxes(const AxisTaps& taps);

// Of levels whose axes are of boxes: the source, the levels, zeros where there is nothing. Sums are in
// double, rounded once. `largest`: the largest code of an integer image, or 0; means of two by two pixels are
// then as ResampleJob says.
std::unique_ptr<graph::WholeStage> MakeMipBoxes(std::vector<MipLevel> levels, const Roi& source, int largest);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_MIP_BOXES_H_
