// What the tests of compositing share: premultiplied pictures, every target, rows of samples.
#ifndef TESSERA_TESTS_SUPPORT_COMPOSITE_H_
#define TESSERA_TESTS_SUPPORT_COMPOSITE_H_

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "tessera/error.h"
#include "tessera/ops/composite.h"
#include "tessera/render.h"

namespace tessera::testing {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInf = std::numeric_limits<float>::infinity();

// Random premultiplied RGBA pixels; one in eight opaque, one in eight clear.
inline Image Premultiplied(int width, int height, uint32_t seed) {
  const Image image(ImageSpec(width, height, 4));
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const uint32_t kind = random() % 8;
      const float alpha = kind == 0 ? 0.0f : kind == 1 ? 1.0f : value(random);
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = alpha * value(random);
      image.at<float>(x, y, 3) = alpha;
    }
  }
  return image;
}
inline Image PremultipliedBytes(int width, int height, uint32_t seed) {
  const Image image(ImageSpec(width, height, 4, PixelType::kUint8));
  std::mt19937 random(seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const uint32_t alpha = random() & 255;
      for (int c = 0; c < 3; ++c) image.at<uint8_t>(x, y, c) = static_cast<uint8_t>(random() % (alpha + 1));
      image.at<uint8_t>(x, y, 3) = static_cast<uint8_t>(alpha);
    }
  }
  return image;
}
// A row of pixels with these channels.
inline Image Row(const std::vector<std::string>& channels, const std::vector<float>& values) {
  const int n = static_cast<int>(channels.size());
  ImageSpec spec(static_cast<int>(values.size()) / n, 1, n);
  spec.channels = channels;
  spec.alpha = spec.ChannelIndex("A");
  const Image image(spec);
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return image;
}
inline std::vector<float> Values(const Node& node) {
  const Image image = Render(node);
  const auto* data = reinterpret_cast<const float*>(image.view().data);
  return {data, data + image.spec().data_window.pixels() * image.spec().channel_count()};
}
inline double LargestDifference(const Image& a, const Image& b) {
  const std::vector<float> va = Values(FromImage(a)), vb = Values(FromImage(b));
  EXPECT_EQ(va.size(), vb.size());
  double largest = 0;
  for (size_t i = 0; i < va.size(); ++i) {
    const double d = std::fabs(double{va[i]} - double{vb[i]});
    if (!(d <= largest)) largest = d;
  }
  return largest;
}
inline double Difference(const Node& a, const Node& b) { return LargestDifference(Render(a), Render(b)); }
template <class F>
std::string Refusal(F build) {
  try {
    build();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}
inline Node Mode(const Node& s, const Node& d, BlendMode mode) { return Blend(s, d, {.mode = mode}); }

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_COMPOSITE_H_
