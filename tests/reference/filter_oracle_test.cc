// References of filters against weights from elsewhere and direct sums.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/oracle.h"

namespace tessera {
namespace {

using testing::Command;
using testing::ReferenceOf;
using testing::Row;

std::vector<std::vector<float>> Impulse(int width, int at) {
  std::vector<std::vector<float>> pixels(static_cast<size_t>(width), {0.0f});
  pixels[static_cast<size_t>(at)] = {1.0f};
  return pixels;
}

// exp(-k^2 / (2 sigma^2)) over its sum, sigma 2.5, by mpmath with 30 digits: what
// scipy.ndimage.gaussian_filter1d convolves with where it is not truncated.
TEST(FilterOracle, GaussianWeights) {
  const double weights[9] = {0.15957691216057307,   0.14730805612132932,   0.1158766211045931,
                             0.077674421993285176,  0.044368333871782223,  0.021596386605275221,
                             0.0089578121179371587, 0.0031661806331919852, 0.00095363528058593702};
  const reference::ImageD found = ReferenceOf(Command("blur", "sigma=2.5", {Row(Impulse(61, 30))}));
  for (int k = -8; k <= 8; ++k) EXPECT_NEAR(found.at(30 + k, 0, 0), weights[std::abs(k)], 1e-9) << k;
}

// All pixels of a row of noise, the mirror image beyond its ends, summed directly.
TEST(FilterOracle, GaussianOfARow) {
  constexpr int kWidth = 50;
  constexpr double kSigma = 3.7;
  std::vector<std::vector<float>> row;
  for (int i = 0; i < kWidth; ++i) row.push_back({static_cast<float>(std::fmod(i * 0.754877666, 1.0))});
  const reference::ImageD found = ReferenceOf(Command("blur", "sigma=3.7 border=mirror", {Row(row)}));
  for (int x = 0; x < kWidth; ++x) {
    double sum = 0, total = 0;
    for (int k = -60; k <= 60; ++k) {
      const int i = ((x + k) % (2 * kWidth) + 2 * kWidth) % (2 * kWidth);
      const double w = std::exp(-0.5 * k * k / (kSigma * kSigma));
      sum += w * row[static_cast<size_t>(i < kWidth ? i : 2 * kWidth - 1 - i)][0], total += w;
    }
    EXPECT_NEAR(found.at(x, 0, 0), sum / total, 1e-8) << x;
  }
}

// Twice as wide: the impulse's neighbours show the filter at 1/4, 3/4, ... Cubics: Keys 1981 (a = -1/2),
// Mitchell and Netravali 1988 (B = C = 1/3), exact; Lanczos: sinc(t) sinc(t / 3) over its sum, by mpmath.
TEST(FilterOracle, ResizeFilters) {
  struct Filter {
    const char* name;
    double at[6];  // 1/4, 3/4, 5/4, 7/4, 9/4, 11/4
  };
  const Filter filters[] = {
      {"catmull-rom", {0.8671875, 0.2265625, -0.0703125, -0.0234375, 0, 0}},
      {"mitchell", {0.78211805555555556, 0.25607638888888889, -0.0234375, -0.014756944444444444, 0, 0}},
      {"triangle", {0.75, 0.25, 0, 0, 0, 0}},
      {"lanczos3",
       {0.89277077408532739, 0.27101056825707893, -0.13327463553596151, -0.067997263028551792,
        0.030112285361897659, 0.0073782708602093173}}};
  for (const Filter& f : filters) {
    const reference::ImageD found =
        ReferenceOf(Command("resize", std::string("22x1 filter=") + f.name, {Row(Impulse(11, 5))}));
    for (int k = 0; k < 6; ++k) {
      // Pixel X of the result lies at (X + 1/2) / 2 - 1/2: 11 + k is 1/4 + k / 2 behind 5.
      EXPECT_NEAR(found.at(11 + k, 0, 0), f.at[k], 1e-7) << f.name << " " << k;
      EXPECT_NEAR(found.at(10 - k, 0, 0), f.at[k], 1e-7) << f.name << " " << -k;
    }
  }
}

}  // namespace
}  // namespace tessera
