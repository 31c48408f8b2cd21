// Layout of a tile: planes one after the other, rows padded to whole vectors.
#include "base/tile.h"

#include "base/block.h"

namespace tessera::base {

Tile::Tile(Arena& arena, const Roi& roi, int channels) : roi_(roi), channels_(channels) {
  stride_ = (roi.width() + kGroupPixels - 1) / kGroupPixels * kGroupPixels;
  // A stride that is a multiple of 4 KB makes the rows of a window compete for the same cache sets.
  if (stride_ % 1024 == 0) stride_ += kGroupPixels;
  data_ = arena.Allocate<float>(static_cast<size_t>(stride_) * roi.height() * channels);
}

}  // namespace tessera::base
