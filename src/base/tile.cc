// Layout of a tile: rows padded to whole vectors.
#include "base/tile.h"

#include "base/block.h"

namespace tessera::base {

ImageView NewTile(Arena& arena, const Roi& roi, int channels) {
  ptrdiff_t row =
      (static_cast<ptrdiff_t>(roi.width()) * channels + kGroupPixels - 1) / kGroupPixels * kGroupPixels;
  // A stride that is a multiple of 4 KB makes the rows of a window compete for the same cache sets.
  if (row % 1024 == 0) row += kGroupPixels;
  float* data = arena.Allocate<float>(static_cast<size_t>(row * roi.height() + kReadMargin / 4));
  return {reinterpret_cast<std::byte*>(data),
          roi,
          channels,
          PixelType::kFloat,
          4,
          ptrdiff_t{4} * channels,
          4 * row};
}

}  // namespace tessera::base
