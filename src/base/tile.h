// Float32 planes of a region: what window and gather kernels see. Rows are aligned and padded to whole vectors.
#ifndef TESSERA_BASE_TILE_H_
#define TESSERA_BASE_TILE_H_

#include "base/arena.h"
#include "tessera/image.h"
#include "tessera/roi.h"

namespace tessera::base {

class Tile {
 public:
  Tile() = default;
  // Memory comes from the arena and lives until its Reset.
  Tile(Arena& arena, const Roi& roi, int channels);

  const Roi& roi() const { return roi_; }
  int channels() const { return channels_; }
  ptrdiff_t stride() const { return stride_; }  // floats between rows; a multiple of 16
  // The row y (image coordinates) of a channel; element 0 is x = roi().x0. Up to stride() floats are readable.
  float* Row(int channel, int y) const {
    return data_ + (static_cast<ptrdiff_t>(channel) * roi_.height() + (y - roi_.y0)) * stride_;
  }
  ImageView view() const {
    return {reinterpret_cast<std::byte*>(data_), roi_, channels_, PixelType::kFloat,
            stride_ * 4 * roi_.height(), 4, stride_ * 4};
  }

 private:
  float* data_ = nullptr;
  Roi roi_;
  int channels_ = 0;
  ptrdiff_t stride_ = 0;
};

}  // namespace tessera::base

#endif  // TESSERA_BASE_TILE_H_
