// The stages of environment lookups: on planes, block by block, and on tiles.
#ifndef TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_STAGES_H_
#define TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_STAGES_H_

#include <memory>

#include "graph/op.h"
#include "ops/environment/prepared.h"

namespace tessera::ops {

struct EnvironmentStagePlan {
  const EnvironmentParams& params;
  bool positions = false;  // input 1 is where the normals are
  std::shared_ptr<const PreparedEnvironment> map;
};

// A map of three channels, or of four with alpha last, whose lookups need no neighbours: planes R, G, B, A.
std::unique_ptr<graph::PointStage> MakeEnvironmentPointStage(const EnvironmentStagePlan& plan,
                                                             const graph::StageContext& context);
// Any map, any filter.
std::unique_ptr<graph::TileStage> MakeEnvironmentTileStage(const EnvironmentStagePlan& plan,
                                                           const graph::StageContext& context);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_STAGES_H_
