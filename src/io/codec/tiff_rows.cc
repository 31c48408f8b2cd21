// Differences are taken forwards and at once, sums from left to right.
#include "io/codec/tiff_rows.h"

#include <cstring>

namespace tessera::io {
namespace {

template <typename T>
void Differences(const T* from, size_t count, size_t distance, T* to) {
  for (size_t i = 0; i < count && i < distance; ++i) to[i] = from[i];
  for (size_t i = distance; i < count; ++i) to[i] = static_cast<T>(from[i] - from[i - distance]);
}

template <size_t kDistance, typename T>
void SumsOf(T* row, size_t count) {
  for (size_t i = kDistance; i < count; ++i) row[i] = static_cast<T>(row[i] + row[i - kDistance]);
}

template <typename T>
void Sums(T* row, size_t count, size_t distance) {
  switch (distance) {
    case 1:
      return SumsOf<1>(row, count);
    case 2:
      return SumsOf<2>(row, count);
    case 3:
      return SumsOf<3>(row, count);
    case 4:
      return SumsOf<4>(row, count);
    default:
      break;
  }
  for (size_t i = distance; i < count; ++i) row[i] = static_cast<T>(row[i] + row[i - distance]);
}

}  // namespace

void TiffPredict(TiffPredictor predictor, const uint8_t* from, size_t samples, size_t sample, size_t channels,
                 uint8_t* to) {
  if (predictor == TiffPredictor::kNone) {
    std::memcpy(to, from, samples * sample);
  } else if (predictor == TiffPredictor::kHorizontal && sample == 1) {
    Differences(from, samples, channels, to);
  } else if (predictor == TiffPredictor::kHorizontal) {
    Differences(reinterpret_cast<const uint16_t*>(from), samples, channels, reinterpret_cast<uint16_t*>(to));
  } else {
    // The highest bytes of all samples first; then differences of bytes, from the end on.
    for (size_t byte = 0; byte < sample; ++byte) {
      uint8_t* const plane = to + (sample - 1 - byte) * samples;
      for (size_t i = 0; i < samples; ++i) plane[i] = from[i * sample + byte];
    }
    for (size_t i = samples * sample; i-- > channels;) to[i] = static_cast<uint8_t>(to[i] - to[i - channels]);
  }
}

void TiffUnpredict(TiffPredictor predictor, uint8_t* row, size_t samples, size_t sample, size_t channels,
                   uint8_t* scratch) {
  if (predictor == TiffPredictor::kNone) return;
  if (predictor == TiffPredictor::kHorizontal) {
    if (sample == 1) {
      Sums(row, samples, channels);
    } else {
      Sums(reinterpret_cast<uint16_t*>(row), samples, channels);
    }
    return;
  }
  Sums(row, samples * sample, channels);
  std::memcpy(scratch, row, samples * sample);
  for (size_t byte = 0; byte < sample; ++byte) {
    const uint8_t* const plane = scratch + (sample - 1 - byte) * samples;
    for (size_t i = 0; i < samples; ++i) row[i * sample + byte] = plane[i];
  }
}

}  // namespace tessera::io
