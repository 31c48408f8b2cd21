// Rows of pixels as chunks of an EXR file, one behind the other.
#ifndef TESSERA_IO_CODEC_EXR_PACK_H_
#define TESSERA_IO_CODEC_EXR_PACK_H_

#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/bytes.h"
#include "io/codec/exr_pixels.h"

namespace tessera::io {

// Chunks with their heads. Memory stays for the next ones.
struct ExrChunks {
  base::Bytes bytes;  // the first `used` of them
  size_t used = 0;
  std::vector<size_t> sizes;  // of each chunk

  void Clear() { used = 0, sizes.clear(); }
  // So many further bytes, whatever they hold.
  uint8_t* Grow(size_t size) {
    if (bytes.size() < used + size) bytes.resize(used + size);
    used += size;
    return bytes.data() + used - size;
  }
};

// One thread at a time.
class ExrPacker {
 public:
  virtual ~ExrPacker() = default;
  // Whole chunks of rows from y on, or what is left at the image's end. Throws Error where they cannot be
  // packed.
  virtual void Pack(std::span<const uint8_t* const> rows, int y, ExrChunks& chunks) = 0;
};

// `spec`: as OpenImageIO writes it; `places`: as in exr_pixels.h; `level`: of libdeflate, or 0 for none at
// all.
std::unique_ptr<ExrPacker> MakeExrPacker(const OIIO::ImageSpec& spec, const ExrPlaces& places,
                                         size_t chunk_rows, int level);
// For compressions of OpenEXR's own: what it writes is taken out of a file in memory. `asked`: what
// OpenImageIO was given for the whole image, of which it does not tell how lossy a compression is to be.
std::unique_ptr<ExrPacker> MakeExrLibraryPacker(const OIIO::ImageSpec& spec, const OIIO::ImageSpec& asked,
                                                size_t chunk_rows);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_EXR_PACK_H_
