// Vector fields and what tests measure of the lines that follow them.
#ifndef TESSERA_TESTS_SUPPORT_FIELDS_H_
#define TESSERA_TESTS_SUPPORT_FIELDS_H_

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/flow.h"
#include "tessera/render.h"

namespace tessera::testing {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
inline constexpr double kPi = std::numbers::pi;

using Flow = std::function<std::pair<double, double>(double x, double y)>;

// Pixel (x, y) holds the vector at (x, y): pixel centres are whole numbers here.
inline Image FieldOf(int width, int height, const Flow& flow) {
  const Image image(ImageSpec(width, height, 2));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto [u, v] = flow(x, y);
      image.at<float>(x, y, 0) = static_cast<float>(u), image.at<float>(x, y, 1) = static_cast<float>(v);
    }
  }
  return image;
}
inline Image Constant(int width, int height, double u, double v) {
  return FieldOf(width, height, [=](double, double) { return std::pair(u, v); });
}
// An image of random numbers in [0, 1], or of what a function says.
inline Image Texture(int width, int height, int channels = 1, uint32_t seed = 1) {
  const Image image(ImageSpec(width, height, channels));
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0, 1);
  auto* p = reinterpret_cast<float*>(image.view().data);
  for (int i = 0; i < width * height * channels; ++i) p[i] = value(random);
  return image;
}
inline Image Coordinates(int width, int height) {
  const Image image(ImageSpec(width, height, 2));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<float>(x, y, 0) = static_cast<float>(x), image.at<float>(x, y, 1) = static_cast<float>(y);
    }
  }
  return image;
}
inline Image Lines(const Image& texture, const Image& field, const LicParams& p) {
  return Render(Lic(FromImage(texture), FromImage(field), p));
}
// Where the lines end: coordinates under a kernel that is only its last tap forward.
inline Image EndPoints(const Image& field, LicParams p) {
  const int taps = static_cast<int>(std::lround(p.length / p.step));
  p.kernel = LicKernel::kUser;
  p.weights.assign(static_cast<size_t>(2 * taps + 1), 0.0);
  p.weights.back() = 1;
  p.linear = true;
  const Roi w = field.spec().data_window;
  return Lines(Coordinates(w.width(), w.height()), field, p);
}
inline std::string Refusal(const std::function<void()>& build) {
  try {
    build();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}
inline double Variance(const Image& image, int margin) {
  const Roi w = Inflate(image.spec().data_window, -margin, -margin);
  double sum = 0, squares = 0;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      const double v = image.at<float>(x, y);
      sum += v, squares += v * v;
    }
  }
  const auto n = static_cast<double>(w.pixels());
  return squares / n - sum / n * (sum / n);
}
// A stream function of a few waves: its lines close, turn and pass saddles.
inline std::pair<double, double> Swirls(double x, double y) {
  return {std::cos(y / 23) + 0.4 * std::cos(x / 31), std::sin(x / 19) + 0.4 * std::sin(y / 37)};
}
inline std::pair<double, double> Circle(double x, double y) { return {-(y - 63.5), x - 63.5}; }

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_FIELDS_H_
