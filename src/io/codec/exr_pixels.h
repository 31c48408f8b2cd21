// Pixels as chunks of EXR files have them: rows of channels one behind the other (OpenEXR, "OpenEXR File
// Layout"), and the order of bytes that goes into zip.
#ifndef TESSERA_IO_CODEC_EXR_PIXELS_H_
#define TESSERA_IO_CODEC_EXR_PIXELS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tessera/image.h"

namespace tessera::io {

// Where each of a chunk's channels, in the file's order, is among a pixel's: its place in bytes, or -1 for
// none.
using ExrPlaces = std::vector<ptrdiff_t>;

// A row of `chunk`, every channel `width` samples of `sample` bytes (2 or 4), to pixels and back.
void ExrRowToPixels(const uint8_t* row, const ExrPlaces& places, size_t sample, size_t width,
                    std::byte* pixels, ptrdiff_t pixel_stride);
void PixelsToExrRow(const std::byte* pixels, ptrdiff_t pixel_stride, const ExrPlaces& places, size_t sample,
                    size_t width, uint8_t* row);

// Bytes of even places before those of odd ones, then each as its difference from the one before, plus 128;
// and back.
void ExrZipOrder(std::span<const uint8_t> from, uint8_t* to);
void ExrUnzipOrder(std::span<uint8_t> scrambled, uint8_t* to);  // overwrites what it is given

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_EXR_PIXELS_H_
