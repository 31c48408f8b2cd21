// The stage of every warp: input 0 whole, looked up at positions of a matrix or of input 1.
#ifndef TESSERA_OPS_GEOMETRY_GATHER_STAGE_H_
#define TESSERA_OPS_GEOMETRY_GATHER_STAGE_H_

#include <memory>
#include <string>

#include "graph/op.h"
#include "ops/geometry/gather.h"

namespace tessera::ops {

struct GatherSettings {
  GatherMap map;
  std::string filter;
  Wrap wrap_x = Wrap::kBlack, wrap_y = Wrap::kBlack;
  bool renormalize = false;
  int channel_x = 0, channel_y = 0;  // of input 1, where the map is from an image
};
std::unique_ptr<graph::TileStage> MakeGatherStage(const GatherSettings& settings,
                                                  const graph::StageContext& context);

// Throws Error unless the filter is known and separable.
void RequireWarpFilter(const std::string& subject, const std::string& name);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_GATHER_STAGE_H_
