// What an environment lookup keeps: its parameters, and the map where that is not an input. Read by its
// reference.
#ifndef TESSERA_MODEL_ENVIRONMENT_SETTINGS_H_
#define TESSERA_MODEL_ENVIRONMENT_SETTINGS_H_

#include "tessera/ops/environment.h"

namespace tessera::ops {

struct EnvironmentSettings {
  EnvironmentParams params;
  Image picture;  // float; without channels: the last input is the map
  bool FromInput() const { return picture.spec().channels.empty(); }
};

}  // namespace tessera::ops

#endif  // TESSERA_MODEL_ENVIRONMENT_SETTINGS_H_
