// JPEG files at a fraction of their sides, by libjpeg: fewer coefficients of every block, so fewer pixels.
#ifndef TESSERA_IO_CODEC_JPEG_READ_H_
#define TESSERA_IO_CODEC_JPEG_READ_H_

#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/bytes.h"
#include "graph/source.h"

namespace tessera::io {

// A progressive file without the scans that its pixels at 1/8 do not depend on: a file of its own with the
// same header. Nothing for other files.
std::optional<base::Bytes> CoarseJpeg(std::span<const uint8_t> bytes);

struct JpegHeader {
  OIIO::ImageSpec spec;  // OpenImageIO's
  bool plain = false;    // libjpeg's pixels are what OpenImageIO would read: grey or RGB, not CMYK
  bool ends = false;     // JpegEnds
};
// Nothing where OpenImageIO is to open the file itself. As it opens a progressive one it unpacks it to its
// end; here it is given a coarse one.
std::optional<JpegHeader> ReadJpegHeader(const std::string& file);

// Whether an end marker follows the first scan. libjpeg paints the rest of a truncated file grey without an
// error.
bool JpegEnds(std::span<const std::byte> bytes);

// What a file of that spec is divided by so that no side is below `least`: 8, 4, 2, or 1.
int JpegDivisor(const OIIO::ImageSpec& spec, int least_width, int least_height);

// Divides the spec's sides, rounding up.
void DivideSides(OIIO::ImageSpec& spec, int divisor);

// Rows of channels [first, last); `spec` is the divided one. Throws Error for a file that is another by now,
// and, as it is read, for one that is damaged.
std::unique_ptr<graph::RowReader> OpenReducedJpeg(const std::string& file, const OIIO::ImageSpec& spec,
                                                  int divisor, int first, int last);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_JPEG_READ_H_
