// Shading parameters together with which optional images an operation has: what ops and their reference
// share.
#ifndef TESSERA_MODEL_SHADE_SETTINGS_H_
#define TESSERA_MODEL_SHADE_SETTINGS_H_

#include "tessera/ops/shade.h"

namespace tessera::ops {

// Of fog and layered fog; inputs beyond the position image, -1 for none.
struct FogSettings {
  FogParams fog;
  bool layered = false;
  LayerFogParams layers;
  int color_input = -1, mask_input = -1;
};

// Of the axes of a fog table: distance / distance, (y - low) / (high - low), the same of the eye's height.
struct FogAxesSettings {
  Vector3 eye = {};
  double distance = 1, low = 0, high = 1;
};

// Of a shadow; the map's and positions' precision as errors, relative to 1 and to the value.
struct ShadowSettings {
  ShadowParams shadow;
  double map_step = 0, position_step = 0;
};

struct SpotlightSettings {
  SpotlightParams light;
  bool slide = false;
};

// Of the last step of a solid texture: what its inputs beyond colour and p are.
struct SolidSettings {
  SolidParams solid;
  int table_channels = 0;
  int octaves = 0;         // given one by one
  bool footprint = false;  // the last two inputs are the pixel's footprint in the solid
  double mean = 0;         // of an octave that fades
};

}  // namespace tessera::ops

#endif  // TESSERA_MODEL_SHADE_SETTINGS_H_
