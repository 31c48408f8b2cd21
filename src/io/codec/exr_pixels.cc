// Loops over samples, for the two sizes that they have.
#include "io/codec/exr_pixels.h"

#include <cstring>

namespace tessera::io {
namespace {

template <size_t kSample>
void Scatter(const uint8_t* from, size_t width, std::byte* to, ptrdiff_t stride) {
  for (size_t x = 0; x < width; ++x, from += kSample, to += stride) std::memcpy(to, from, kSample);
}

template <size_t kSample>
void Gather(const std::byte* from, ptrdiff_t stride, size_t width, uint8_t* to) {
  for (size_t x = 0; x < width; ++x, from += stride, to += kSample) std::memcpy(to, from, kSample);
}

}  // namespace

void ExrRowToPixels(const uint8_t* row, const ExrPlaces& places, size_t sample, size_t width,
                    std::byte* pixels, ptrdiff_t pixel_stride) {
  for (const ptrdiff_t place : places) {
    if (place >= 0) (sample == 2 ? Scatter<2> : Scatter<4>)(row, width, pixels + place, pixel_stride);
    row += sample * width;
  }
}

void PixelsToExrRow(const std::byte* pixels, ptrdiff_t pixel_stride, const ExrPlaces& places, size_t sample,
                    size_t width, uint8_t* row) {
  for (const ptrdiff_t place : places) {
    (sample == 2 ? Gather<2> : Gather<4>)(pixels + place, pixel_stride, width, row);
    row += sample * width;
  }
}

void ExrZipOrder(std::span<const uint8_t> from, uint8_t* to) {
  const size_t size = from.size(), half = (size + 1) / 2;
  const uint8_t* bytes = from.data();
  uint8_t *even = to, *odd = to + half;
  if (size == 0) return;
  // Differences at once: of a half's first byte, from the last of the half before.
  even[0] = bytes[0];
  for (size_t i = 1; i < half; ++i) even[i] = static_cast<uint8_t>(bytes[2 * i] - bytes[2 * i - 2] + 128);
  if (size < 2) return;
  odd[0] = static_cast<uint8_t>(bytes[1] - bytes[2 * half - 2] + 128);
  for (size_t i = 1; i < size / 2; ++i)
    odd[i] = static_cast<uint8_t>(bytes[2 * i + 1] - bytes[2 * i - 1] + 128);
}

void ExrUnzipOrder(std::span<uint8_t> scrambled, uint8_t* to) {
  const size_t size = scrambled.size(), half = (size + 1) / 2;
  uint8_t* bytes = scrambled.data();
  for (size_t i = 1; i < size; ++i) bytes[i] = static_cast<uint8_t>(bytes[i - 1] + bytes[i] - 128);
  for (size_t i = 0; i < size / 2; ++i) {
    to[2 * i] = bytes[i];
    to[2 * i + 1] = bytes[half + i];
  }
  if (size % 2 != 0) to[size - 1] = bytes[half - 1];
}

}  // namespace tessera::io
