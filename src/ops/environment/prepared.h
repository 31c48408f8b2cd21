// Environment maps ready to be looked up: padded faces, lobes' tables or samples; made for a render, or once
// for many.
#ifndef TESSERA_OPS_ENVIRONMENT_PREPARED_H_
#define TESSERA_OPS_ENVIRONMENT_PREPARED_H_

#include <memory>
#include <mutex>
#include <vector>

#include "ops/environment/atlas.h"
#include "ops/environment/lobe.h"
#include "ops/environment/mips.h"
#include "tessera/ops/environment.h"

namespace tessera::ops {

struct PreparedEnvironment {
  // Four channels each; samples where the lobe is summed for every pixel. None for an empty picture.
  std::vector<std::shared_ptr<const EnvironmentAtlas>> atlases;
  std::vector<std::shared_ptr<const LobeSamples>> samples;
  std::vector<std::shared_ptr<const EnvironmentMips>> mips;  // one for every atlas, or none
  bool empty = true;

  // `kept`: for many renders, so that half floats are held as such.
  PreparedEnvironment(const ConstImageView& picture, const EnvironmentParams& params, bool kept,
                      const graph::Workers& workers);
};

}  // namespace tessera::ops

namespace tessera {

struct EnvironmentTexture::Data {
  Image picture;  // float
  EnvironmentParams params;
  mutable std::once_flag once;
  mutable std::shared_ptr<const ops::PreparedEnvironment> prepared;

  // By the first render that needs it.
  std::shared_ptr<const ops::PreparedEnvironment> Prepared(const graph::Workers& workers) const;
};

}  // namespace tessera

#endif  // TESSERA_OPS_ENVIRONMENT_PREPARED_H_
