// What the stage of a lookup is made from.
#ifndef TESSERA_OPS_LOOKUP_LOOKUP_STAGE_H_
#define TESSERA_OPS_LOOKUP_LOOKUP_STAGE_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/lookup/grid.h"

namespace tessera::ops {

struct LookupPlan {
  // One per four channels of the table, each with its mip levels (one level for the other filters).
  std::vector<std::vector<std::shared_ptr<const Grid>>> groups;
  LookupParams params;
  std::vector<int> axes;  // of the coordinate image: one per axis, then q when projective
  int dims = 0;
  int coordinate_channels = 0;
  Roi window;  // of the coordinate image
};

std::unique_ptr<graph::TileStage> MakeLookupStage(const LookupPlan& plan);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_LOOKUP_STAGE_H_
