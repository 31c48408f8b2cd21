// Stages of the lookups that are point operations: a 3-D table of colours, a 1-D table for each channel.
#ifndef TESSERA_OPS_LOOKUP_POINT_STAGES_H_
#define TESSERA_OPS_LOOKUP_POINT_STAGES_H_

#include <memory>

#include "base/stage.h"
#include "ops/lookup/grid.h"

namespace tessera::ops {

// Planes R, G, B through a whole grid of three dimensions, plane 3 untouched.
std::unique_ptr<graph::PointStage> MakeTable3DStage(std::shared_ptr<const Grid> grid);

// Plane p through the whole 1-D grid of one channel grids[p], untouched where that is null.
std::unique_ptr<graph::PointStage> MakeTables1DStage(const std::shared_ptr<const Grid> (&grids)[4]);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_POINT_STAGES_H_
