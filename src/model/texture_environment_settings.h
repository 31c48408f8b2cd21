// What a texture environment keeps: its parameters, and what the texture has. Read by its reference.
#ifndef TESSERA_MODEL_TEXTURE_ENVIRONMENT_SETTINGS_H_
#define TESSERA_MODEL_TEXTURE_ENVIRONMENT_SETTINGS_H_

#include "tessera/ops/texture_environment.h"

namespace tessera::ops {

struct TextureEnvironmentSettings {
  TextureEnvironmentParams params;
  bool texture_colors = true, texture_alpha = true;
};

}  // namespace tessera::ops

#endif  // TESSERA_MODEL_TEXTURE_ENVIRONMENT_SETTINGS_H_
