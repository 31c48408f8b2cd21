// Layout of a tile: rows padded to whole vectors.
#include "base/tile.h"

#include "base/block.h"

namespace tessera::base {

ImageView NewTile(Arena& arena, const Roi& roi, int channels, PixelType type) {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  constexpr ptrdiff_t kVector = 4 * kGroupPixels, kPage = 4096;
  ptrdiff_t row = (bytes * roi.width() * channels + kVector - 1) / kVector * kVector;
  // A stride that is a multiple of 4 KB makes the rows of a window compete for the same cache sets.
  if (row % kPage == 0) row += kVector;
  auto* const data = arena.Allocate<std::byte>(static_cast<size_t>(row * roi.height() + kReadMargin));
  return {data, roi, channels, type, bytes, bytes * channels, row};
}

}  // namespace tessera::base
