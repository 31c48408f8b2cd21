// Pictures of every pixel type for tests, ordinary or full of hard values; packed and unpacked in plain C++.
#ifndef TESSERA_TESTS_SUPPORT_PICTURES_H_
#define TESSERA_TESTS_SUPPORT_PICTURES_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>

#include "tessera/image.h"
#include "verify/pixels.h"

namespace tessera::testing {

// Storage conversions without the library's kernels: doubles to codes of a type.
inline uint16_t HalfOf(float v) {
  const uint32_t sign = std::signbit(v) ? 0x8000 : 0;
  if (std::isnan(v)) return static_cast<uint16_t>(sign | 0x7e00);
  const float a = std::fabs(v);
  if (a >= 65520.0f) return static_cast<uint16_t>(sign | 0x7c00);
  int exponent = 0;
  std::frexp(a, &exponent);
  const int shift = std::max(exponent - 11, -24);
  const auto steps = static_cast<uint32_t>(std::nearbyint(std::ldexp(a, -shift)));
  const uint32_t bits = a == 0 ? 0 : steps + (static_cast<uint32_t>(shift + 24) << 10);
  return static_cast<uint16_t>(sign | bits);
}

inline void StoreSample(const ImageView& view, int x, int y, int c, float v) {
  std::byte* const at = view.At(x, y, c);
  const auto code = [&](double steps) {
    return std::nearbyint(std::clamp<double>(std::isnan(v) ? 0 : v, 0, 1) * steps);
  };
  switch (view.type) {
    case PixelType::kUint8:
      *reinterpret_cast<uint8_t*>(at) = static_cast<uint8_t>(code(255));
      break;
    case PixelType::kUint16:
      *reinterpret_cast<uint16_t*>(at) = static_cast<uint16_t>(code(65535));
      break;
    case PixelType::kHalf:
      *reinterpret_cast<uint16_t*>(at) = HalfOf(v);
      break;
    case PixelType::kFloat:
      *reinterpret_cast<float*>(at) = v;
      break;
  }
}

enum class Content { kOrdinary, kSpecial };

// Values of both signs and above 1; kSpecial strews NaN, infinities, zeros, subnormals and huge values among
// them.
inline Image Picture(const Roi& window, int channels, PixelType type, uint32_t seed,
                     Content content = Content::kOrdinary) {
  ImageSpec spec(window.width(), window.height(), channels, type);
  spec.data_window = window;
  spec.display_window = Roi{-2, -3, 70, 20};
  const Image image(spec);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-0.75f, 1.75f);
  const float specials[] = {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity(),
                            0.0f,
                            -0.0f,
                            1e-40f,
                            -1e-45f,
                            3.4e38f,
                            -3.4e38f,
                            1.0f};
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < channels; ++c) {
        float v = value(random);
        if (content == Content::kSpecial && random() % 3 == 0) v = specials[random() % std::size(specials)];
        StoreSample(image.view(), x, y, c, v);
      }
    }
  }
  return image;
}

// The same picture in float: the nearest float of every sample, which is what unpacking promises.
inline Image Unpacked(const Image& image) {
  ImageSpec spec = image.spec();
  spec.type = PixelType::kFloat;
  const Image result(spec);
  const Roi& w = spec.data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < spec.channel_count(); ++c) {
        float& to = result.at<float>(x, y, c);
        switch (image.spec().type) {
          case PixelType::kUint8:
            to = static_cast<float>(image.at<uint8_t>(x, y, c) / 255.0);
            break;
          case PixelType::kUint16:
            to = static_cast<float>(image.at<uint16_t>(x, y, c) / 65535.0);
            break;
          case PixelType::kHalf:
            to = static_cast<float>(verify::HalfToDouble(image.at<uint16_t>(x, y, c)));
            break;
          case PixelType::kFloat:
            to = image.at<float>(x, y, c);
            break;
        }
      }
    }
  }
  return result;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_PICTURES_H_
