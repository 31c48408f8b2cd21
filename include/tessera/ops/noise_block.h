// The samples of a block of noise, as the march and its reference read them.
#ifndef TESSERA_OPS_NOISE_BLOCK_H_
#define TESSERA_OPS_NOISE_BLOCK_H_

#include <cstdint>
#include <memory>

#include "tessera/ops/hypertexture.h"

namespace tessera {

// Sample (x, y, z) of channel c lies at ((z + 1) * slice + (y + 1) * row + x + 1) * channels + c, x, y, z
// from -1 to size + 1: one periodic sample before and two behind, at positions (x + 1/2) / size of the block.
struct NoiseBlock::Data {
  NoiseContent content = NoiseContent::kNoise;
  int size = 0, channels = 1;
  int row = 0, slice = 0;               // in texels
  std::shared_ptr<uint16_t[]> samples;  // 32 bytes beyond the end may be read
  // Of blocks of one channel, for the march: at each texel its own sample, the next along y, along z, and
  // along both, so that the eight corners of a cell are 16 bytes in a row.
  std::shared_ptr<uint16_t[]> cells;
  float scale = 1, bias = 0;     // value = scale * code + bias
  double slopes[3] = {0, 0, 0};  // largest |difference| of neighbours along an axis times size, channel 0
  double low = 0, high = 0;      // of channel 0
  double mean = 0;               // of channel 0
};

}  // namespace tessera

#endif  // TESSERA_OPS_NOISE_BLOCK_H_
