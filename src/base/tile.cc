// Layout of a tile: rows padded to whole vectors.
#include "base/tile.h"

#include "base/block.h"

namespace tessera::base {
namespace {

ptrdiff_t RowBytes(const Roi& roi, int channels, PixelType type) {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  constexpr ptrdiff_t kVector = 4 * kGroupPixels, kPage = 4096;
  ptrdiff_t row = (bytes * roi.width() * channels + kVector - 1) / kVector * kVector;
  // A stride that is a multiple of 4 KB makes the rows of a window compete for the same cache sets.
  if (row % kPage == 0) row += kVector;
  return row;
}

}  // namespace

size_t TileBytes(const Roi& roi, int channels, PixelType type) {
  return static_cast<size_t>(RowBytes(roi, channels, type) * roi.height() + kReadMargin);
}

ImageView TileAt(std::byte* data, const Roi& roi, int channels, PixelType type) {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  return {data, roi, channels, type, bytes, bytes * channels, RowBytes(roi, channels, type)};
}

ImageView NewTile(Arena& arena, const Roi& roi, int channels, PixelType type) {
  return TileAt(arena.Allocate<std::byte>(TileBytes(roi, channels, type)), roi, channels, type);
}

}  // namespace tessera::base
