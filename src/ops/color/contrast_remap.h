// What one plane goes through in a remap of contrast.
#ifndef TESSERA_OPS_COLOR_CONTRAST_REMAP_H_
#define TESSERA_OPS_COLOR_CONTRAST_REMAP_H_

#include <cstdint>

namespace tessera::ops {

struct PlaneRemap {
  enum class Kind : uint8_t { kLine, kSigmoid, kThreshold };
  Kind kind = Kind::kLine;
  float threshold = 0, low = 0, high = 1;  // kThreshold: low below the threshold, else high
  // t = scale x + bias; the sigmoid of it, less `black`, where there is one; times gain, plus offset.
  double scale = 1, bias = 0, black = 0, gain = 1, offset = 0;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COLOR_CONTRAST_REMAP_H_
