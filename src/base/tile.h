// Pixels of a region in a worker's memory, interleaved: what window and gather kernels see.
#ifndef TESSERA_BASE_TILE_H_
#define TESSERA_BASE_TILE_H_

#include "base/arena.h"
#include "tessera/image.h"
#include "tessera/roi.h"

namespace tessera::base {

// A dense tile: rows start on vector boundaries, and kReadMargin bytes beyond their ends may be read. The
// memory comes from the arena and lives until its Reset.
ImageView NewTile(Arena& arena, const Roi& roi, int channels, PixelType type = PixelType::kFloat);

// The same in memory of somebody else, of at least TileBytes.
ImageView TileAt(std::byte* data, const Roi& roi, int channels, PixelType type = PixelType::kFloat);
size_t TileBytes(const Roi& roi, int channels, PixelType type = PixelType::kFloat);

}  // namespace tessera::base

#endif  // TESSERA_BASE_TILE_H_
