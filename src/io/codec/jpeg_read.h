// JPEG files at a fraction of their sides, by libjpeg: fewer coefficients of every block, so fewer pixels.
#ifndef TESSERA_IO_CODEC_JPEG_READ_H_
#define TESSERA_IO_CODEC_JPEG_READ_H_

#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "graph/source.h"

namespace tessera::io {

// A progressive file without the scans that its pixels at 1/8 do not depend on: a file of its own with the
// same header. Nothing for other files.
std::optional<std::vector<uint8_t>> CoarseJpeg(std::span<const uint8_t> bytes);

// The header by OpenImageIO, which unpacks a progressive file to its end as it opens it, from a coarse one.
// False where that is no way.
bool ReadCoarseHeader(const std::string& file, OIIO::ImageSpec& spec);

// What a file of that spec is divided by so that no side is below `least`: 8, 4, 2, or 1.
int JpegDivisor(const OIIO::ImageSpec& spec, int least_width, int least_height);

// Whether pixels are what OpenImageIO would have read: grey or RGB, not CMYK. Looks at the header.
bool JpegIsPlain(const std::string& file, const OIIO::ImageSpec& spec);

// Divides the spec's sides, rounding up.
void DivideSides(OIIO::ImageSpec& spec, int divisor);

// Rows of channels [first, last); `spec` is the divided one. Throws Error for a file that is another by now,
// and, as it is read, for one that is damaged.
std::unique_ptr<graph::RowReader> OpenReducedJpeg(const std::string& file, const OIIO::ImageSpec& spec,
                                                  int divisor, int first, int last);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_JPEG_READ_H_
