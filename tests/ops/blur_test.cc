// Gaussians and boxes of any size: the realised kernel, borders, seams, values that are not finite, flat
// lines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "ops/filter/gauss/recursive.h"
#include "support/filters.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace tessera::testing;

// ---- Gaussian ----

TEST(GaussianTest, RealisedKernelIsWithinItsL1Bound) {
  for (const double sigma : {2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 200.0}) {
    const ops::RecursiveGaussian g = ops::MakeRecursiveGaussian(sigma);
    const int length = static_cast<int>(12 * sigma) + 10;
    const std::vector<double> response = g.Response(length);
    double sum = 1, error = 0, dc = 0, second = 0;
    for (int n = 1; n < length; ++n) sum += 2 * std::exp(-0.5 * n * n / (sigma * sigma));
    for (int n = 0; n < length; ++n) {
      const double r = response[static_cast<size_t>(n)], times = n == 0 ? 1 : 2;
      error += times * std::fabs(r - std::exp(-0.5 * n * n / (sigma * sigma)) / sum);
      dc += times * r;
      second += times * r * n * n;
    }
    EXPECT_LT(error, 2e-5) << sigma;
    EXPECT_NEAR(dc, 1, 1.2e-7) << sigma;
    EXPECT_NEAR(std::sqrt(second) / sigma, 1, 1e-4) << sigma;
  }
}

// The Gaussian sum over a row, in double.
double GaussianAt(const Image& image, int x, double sigma, Wrap wrap) {
  const int n = image.spec().width(), radius = static_cast<int>(std::ceil(7 * sigma));
  double sum = 0, weights = 0;
  for (int d = -radius; d <= radius; ++d) {
    const double w = std::exp(-0.5 * d * d / (sigma * sigma));
    int v = x + d;
    const int period = wrap == Wrap::kRepeat ? n : wrap == Wrap::kMirror ? 2 * n : std::max(1, 2 * n - 2);
    const bool inside = v >= 0 && v < n;
    if (wrap == Wrap::kClamp) {
      v = std::min(std::max(v, 0), n - 1);
    } else if (!inside && wrap != Wrap::kBlack && wrap != Wrap::kRenormalize) {
      v = (v % period + period) % period;
      if (v >= n) v = wrap == Wrap::kMirror ? period - 1 - v : period - v;
    }
    if (wrap == Wrap::kRenormalize && !inside) continue;
    weights += w;
    if (wrap == Wrap::kBlack && !inside) continue;
    sum += w * image.at<float>(v, 0);
  }
  return sum / weights;
}

TEST(GaussianTest, BordersAreAsExactAsTheMiddle) {
  for (const int width : {1, 2, 64, 1000}) {
    // An impulse at the edge and one inside.
    Image image = Flat(width, 1, 1, 0);
    image.at<float>(0, 0) = 1;
    if (width > 40) image.at<float>(40, 0) = 0.5f;
    for (const Wrap wrap : kBorders) {
      for (const double sigma : {3.0, 20.0, 200.0}) {
        const GaussianParams p{
            .sigma_x = sigma, .sigma_y = 0, .wrap = wrap, .method = FilterMethod::kRecursive};
        OnEveryTarget([&] {
          const Image result = Render(GaussianBlur(FromImage(image), p));
          for (int x = 0; x < width; x += x < 20 || x > width - 20 ? 1 : 37) {
            // Renormalising divides by the weight inside, and what is wrong with it.
            const double bound = wrap == Wrap::kRenormalize ? 4e-5 : 2e-5;
            ASSERT_NEAR(result.at<float>(x, 0), GaussianAt(image, x, sigma, wrap), bound)
                << "sigma " << sigma << " border " << static_cast<int>(wrap) << " at " << x << " of "
                << width;
          }
        });
      }
    }
  }
}

TEST(GaussianTest, WideImagesShowNoSeam) {
  Image image = Random(20000, 2, 1);
  const GaussianParams p{.sigma_x = 200, .sigma_y = 0};
  const Node node = GaussianBlur(FromImage(image), p);
  const Image whole = Render(node);
  for (const int tile : {128, 1000, 4096}) {
    EXPECT_TRUE(SameBits(
        whole, Render(node, PixelType::kFloat, {.threads = 2, .tile_width = tile, .tile_height = 1})));
  }
  for (int x = 0; x < 20000; x += 997)
    EXPECT_NEAR(whole.at<float>(x, 0), GaussianAt(image, x, 200, Wrap::kClamp), 3e-5);
}

TEST(GaussianTest, NotANumberReachesItsNeighboursOnly) {
  Image image = Flat(400, 40, 1, 1);
  image.at<float>(200, 20) = kNaN;
  image.at<float>(50, 5) = kInf;
  const Image result = Render(
      GaussianBlur(FromImage(image), {.sigma_x = 4, .sigma_y = 4, .method = FilterMethod::kRecursive}));
  EXPECT_TRUE(std::isnan(result.at<float>(200, 20)));
  EXPECT_EQ(result.at<float>(50, 5), kInf);
  EXPECT_NEAR(result.at<float>(300, 20), 1, 1e-6);
  EXPECT_NEAR(result.at<float>(120, 20), 1, 1e-6);
}

TEST(GaussianTest, SigmaZeroIsTheIdentityAndATinyOneNearlySo) {
  const Image image = Random(33, 17, 4);
  EXPECT_TRUE(SameBits(Render(GaussianBlur(FromImage(image), 0)), image));
  EXPECT_LT(LargestDifference(Render(GaussianBlur(FromImage(image), 1e-3)), image), 1e-7);
}

TEST(GaussianTest, LongZeroTailsAreZeroOrTiny) {
  Image image = Flat(4000, 8, 4, 0);
  image.at<float>(20, 0, 0) = 1;
  const Image result = Render(
      GaussianBlur(FromImage(image), {.sigma_x = 3, .sigma_y = 3, .method = FilterMethod::kRecursive}));
  EXPECT_LT(std::fabs(result.at<float>(3999, 7, 0)), 1e-30f);
}

// ---- Box ----

TEST(BoxTest, IsExactOverALongRow) {
  Image image = Random(100000, 1, 1);
  const Image result =
      Render(BoxBlur(FromImage(image), {.width = 41, .height = 1, .method = FilterMethod::kRecursive}));
  for (int x = 20; x < 99980; x += 7) {
    double sum = 0, scale = 0;
    for (int d = -20; d <= 20; ++d)
      sum += image.at<float>(x + d, 0), scale += std::fabs(image.at<float>(x + d, 0));
    ASSERT_NEAR(result.at<float>(x, 0), sum / 41, 0x1p-23 * scale / 41) << x;
  }
}

// The sample shown at v on [0, n), or none.
bool Shown(int& v, int n, Wrap wrap) {
  if (v >= 0 && v < n) return true;
  switch (wrap) {
    case Wrap::kClamp:
      v = std::clamp(v, 0, n - 1);
      return true;
    case Wrap::kRepeat:
      v = (v % n + n) % n;
      return true;
    case Wrap::kMirror:
    case Wrap::kMirror101: {
      const int period = wrap == Wrap::kMirror ? 2 * n : std::max(1, 2 * n - 2);
      v = (v % period + period) % period;
      if (v >= n) v = wrap == Wrap::kMirror ? period - 1 - v : period - v;
      return true;
    }
    default:
      return false;
  }
}

TEST(BoxTest, IsTheMeanRoundedOnceWithEveryBorderAndNumberOfChannels) {
  struct Case {
    int width, height, channels, box_width, box_height;
  };
  for (const Case& k : {Case{83, 61, 4, 41, 41}, Case{37, 29, 1, 11, 10}, Case{40, 9, 3, 1, 33},
                        Case{300, 7, 5, 255, 2}, Case{1, 1, 4, 12, 13}, Case{2100, 3, 4, 13, 1}}) {
    const Image image = Random(k.width, k.height, k.channels);
    for (const Wrap wrap : kBorders) {
      const Node node = BoxBlur(
          FromImage(image),
          {.width = k.box_width, .height = k.box_height, .wrap = wrap, .method = FilterMethod::kRecursive});
      const Image result = Render(node);
      EXPECT_TRUE(SameBits(result, Render(node, PixelType::kFloat, {.threads = 2})));
      OnEveryTarget([&] { EXPECT_TRUE(SameBits(result, Render(node))); });
      for (int y = 0; y < k.height; y += 3) {
        for (int x = 0; x<k.width; x += k.width> 200 ? 41 : 3) {
          const int c = (x + y) % k.channels;
          double sum = 0, scale = 0;
          int inside = 0;
          for (int j = 0; j < k.box_height; ++j) {
            for (int i = 0; i < k.box_width; ++i) {
              int sx = x + i - (k.box_width - 1) / 2, sy = y + j - (k.box_height - 1) / 2;
              if (!Shown(sx, k.width, wrap) || !Shown(sy, k.height, wrap)) continue;
              sum += image.at<float>(sx, sy, c), scale += std::fabs(image.at<float>(sx, sy, c)), ++inside;
            }
          }
          const double taps = wrap == Wrap::kRenormalize ? inside : k.box_width * k.box_height;
          ASSERT_NEAR(result.at<float>(x, y, c), sum / taps, 0x1.01p-24 * scale / taps)
              << "border " << static_cast<int>(wrap) << " at " << x << "," << y;
        }
      }
    }
  }
}

// Sums on a grid that suits the brightest samples would show in the dark ones: there they are taken by
// blocks.
TEST(BoxTest, IsRightToALastPlaceWhereBrightnessesMeet) {
  const int width = 700, height = 150, box_width = 31, box_height = 21;
  Image image = Random(width, height, 2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // Darker by 2^60 from left to right and by 2^70 from top to bottom, zeros, a dark band, a bright one.
      float scale = std::ldexp(1.0f, -x * 60 / width - y * 70 / height);
      if (x / 50 % 3 == 2) scale = 0;
      if (y >= 60 && y < 100) scale = x % 90 < 4 ? 1e-30f : 0;
      if (y >= 128) scale *= 0x1p100f;
      for (int c = 0; c < 2; ++c) image.at<float>(x, y, c) = std::fabs(image.at<float>(x, y, c)) * scale;
    }
  }
  OnEveryTarget([&] {
    const Image result = Render(BoxBlur(FromImage(image), {box_width, box_height}));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; x += 3) {
        long double sum = 0;
        for (int j = -10; j <= 10; ++j) {
          for (int i = -15; i <= 15; ++i) {
            sum += image.at<float>(std::clamp(x + i, 0, width - 1), std::clamp(y + j, 0, height - 1), 1);
          }
        }
        const auto mean = static_cast<float>(sum / (box_width * box_height));
        ASSERT_NEAR(result.at<float>(x, y, 1), mean, std::nextafter(mean, 2 * mean + 1e-45f) - mean)
            << x << "," << y;
      }
    }
  });
}

TEST(BoxTest, ASpikeLeavesNoTrace) {
  for (const float spike : {60000.0f, 1e30f, kInf, kNaN}) {
    Image image = Flat(300, 60, 4, 1e-3f);
    image.at<float>(100, 30, 2) = spike;
    OnEveryTarget([&] {
      const Image result = Render(BoxBlur(FromImage(image), {31, 21}));
      for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 300; ++x) {
          const bool under = std::abs(x - 100) <= 15 && std::abs(y - 30) <= 10;
          if (under) continue;
          ASSERT_NEAR(result.at<float>(x, y, 2), 1e-3f, 2.4e-10) << x << "," << y << " after " << spike;
        }
      }
      if (!std::isfinite(spike)) {
        EXPECT_EQ(std::isnan(result.at<float>(110, 25, 2)), std::isnan(spike));
        EXPECT_FALSE(std::isfinite(result.at<float>(110, 25, 2)));
      }
    });
  }
}

// ---- What is not finite ----

// As far as sums reach, not as far as a double could tell a weight from 0: the reference agrees, also where
// another operation follows.
TEST(GaussianTest, WhatIsNotFiniteIsVerified) {
  const Image image = Random(70, 50, 2);
  image.at<float>(30, 20, 0) = kNaN;
  image.at<float>(50, 40, 0) = std::numeric_limits<float>::infinity();
  for (const double sigma : {0.06, 0.25, 0.3, 1.0, 2.0, 4.0, 17.0}) {
    const Node blurred = GaussianBlur(FromImage(image), sigma);
    for (const Node& node : {blurred, Convolve(blurred, NamedKernel("gaussian"))}) {
      const VerifyReport report = Verify(node, PixelType::kFloat, {.samples = 1});
      EXPECT_TRUE(report.within_bound) << sigma << ": " << report.Summary();
      EXPECT_EQ(report.undecided, 0) << sigma << ": " << report.Summary();
    }
  }
}

}  // namespace
}  // namespace tessera
