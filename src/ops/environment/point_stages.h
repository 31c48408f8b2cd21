// Point stages of the environment family: what is done to normals, and lighting.
#ifndef TESSERA_OPS_ENVIRONMENT_POINT_STAGES_H_
#define TESSERA_OPS_ENVIRONMENT_POINT_STAGES_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "tessera/ops/environment.h"

namespace tessera::ops {

// n' = normalise(reflect(matrix (in_scale n + in_bias))), result = out_scale n' + out_bias.
struct NormalsSetup {
  double in_scale = 1, in_bias = 0, out_scale = 1, out_bias = 0;
  double matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  bool turned = false, reflected = false, normalize = true;
  double view[3] = {0, 0, 1};
};
std::unique_ptr<graph::PointStage> MakeNormalsStage(const NormalsSetup& setup);

// A light with unit directions.
struct PhongSetup {
  PhongParams params;
  bool positions = false;
  double light[3] = {};       // as given
  double halfway[3] = {};     // of a distant light and viewer; 0: no highlight
  double spot_cosine = -2;    // above: inside of the cone
  std::vector<double> table;  // powers at i / (size - 1), or empty
};
std::unique_ptr<graph::PointStage> MakePhongStage(const PhongSetup& setup);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_POINT_STAGES_H_
