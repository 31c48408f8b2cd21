// What the tests of filters share: flat and random pictures, every target, refusals, differences.
#ifndef TESSERA_TESTS_SUPPORT_FILTERS_H_
#define TESSERA_TESTS_SUPPORT_FILTERS_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "support/every_target.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"

namespace tessera::testing {

inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
inline constexpr float kInf = std::numeric_limits<float>::infinity();
inline constexpr Wrap kBorders[] = {Wrap::kBlack,  Wrap::kClamp,     Wrap::kRepeat,
                                    Wrap::kMirror, Wrap::kMirror101, Wrap::kRenormalize};

inline Image Flat(int width, int height, int channels, float value) {
  const Image image(ImageSpec(width, height, channels));
  float* p = reinterpret_cast<float*>(image.view().data);
  std::fill_n(p, static_cast<size_t>(width) * height * channels, value);
  return image;
}
// The values of Picture; the display window is the data window.
inline Image Random(int width, int height, int channels, uint32_t seed = 1) {
  const Image values = Picture({0, 0, width, height}, channels, PixelType::kFloat, seed);
  const Image image(ImageSpec(width, height, channels));
  const auto* const from = reinterpret_cast<const float*>(values.view().data);
  std::copy_n(from, static_cast<size_t>(width) * height * channels,
              reinterpret_cast<float*>(image.view().data));
  return image;
}
template <class F>
std::string Refusal(F build) {
  try {
    build();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}
inline double LargestDifference(const Image& a, const Image& b) {
  double largest = 0;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < a.spec().channel_count(); ++c) {
        const double d = std::fabs(double{a.at<float>(x, y, c)} - double{b.at<float>(x, y, c)});
        if (!(d <= largest)) largest = d;
      }
    }
  }
  return largest;
}
inline bool SameBits(const Image& a, const Image& b) {
  return a.spec().data_window == b.spec().data_window &&
         std::memcmp(a.view().data, b.view().data,
                     static_cast<size_t>(a.spec().data_window.pixels()) * a.spec().channels.size() * 4) == 0;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_FILTERS_H_
