// The restore family: edges kept, noise taken away, flat bits kept, what is not finite stays, bands smoothed.
#include "tessera/ops/restore.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/every_target.h"
#include "support/refusal.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

// Left half dark, right half bright, with noise; alpha of its own.
Image Step(double noise, int width = 48, int height = 32) {
  ImageSpec spec(width, height, 4);
  spec.alpha = 3;
  Image image(spec);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, noise);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c)
        image.at<float>(x, y, c) =
            static_cast<float>((x < width / 2 ? 0.2 : 0.8) + (noise > 0 ? normal(random) : 0));
      image.at<float>(x, y, 3) = x % 2 == 0 ? 1.0f : 0.5f;
    }
  }
  return image;
}

// Root of the mean square off the step, and the least step across the edge.
struct Left {
  double noise = 0, edge = 1;
};
Left LeftOf(const Image& image) {
  const Roi& w = image.spec().data_window;
  Left left;
  for (int y = 0; y < w.height(); ++y) {
    for (int x = 0; x < w.width(); ++x)
      left.noise += std::pow(image.at<float>(x, y, 1) - (x < w.width() / 2 ? 0.2 : 0.8), 2);
    left.edge = std::min(
        left.edge, double{image.at<float>(w.width() / 2, y, 1)} - image.at<float>(w.width() / 2 - 1, y, 1));
  }
  left.noise = std::sqrt(left.noise / static_cast<double>(w.pixels()));
  return left;
}

TEST(RestoreTest, NoiseGoesAndTheEdgeStays) {
  constexpr double kNoise = 0.04;
  const Image noisy = Step(kNoise);
  OnEveryTarget([&] {
    const Left bilateral = LeftOf(Render(Bilateral(FromImage(noisy), {.sigma = 2, .range = 0.2})));
    EXPECT_LT(bilateral.noise, kNoise / 2.5);
    EXPECT_GT(bilateral.edge, 0.5);
    const Left patches = LeftOf(Render(NonLocalMeans(FromImage(noisy), {.sigma = kNoise})));
    EXPECT_LT(patches.noise, kNoise / 4);
    EXPECT_GT(patches.edge, 0.5);
  });
}

TEST(RestoreTest, ALargeRangeIsAGaussianOfTheWindow) {
  const Image noisy = Step(0.05);
  const Image blurred = Render(Bilateral(FromImage(noisy), {.sigma = 1.5, .range = 1e5}));
  for (const int x : {5, 24, 40}) {
    double sum = 0, weight = 0;
    for (int j = -3; j <= 3; ++j) {
      for (int i = -3; i <= 3; ++i) {
        const double w = std::exp(-(i * i + j * j) / 4.5);
        sum += w * noisy.at<float>(x + i, 16 + j, 0), weight += w;
      }
    }
    EXPECT_NEAR(blurred.at<float>(x, 16, 0), sum / weight, 1e-6) << x;
  }
}

TEST(RestoreTest, FlatPartsKeepTheirBits) {
  const Image flat = Step(0);
  OnEveryTarget([&] {
    for (const Node& node :
         {Bilateral(FromImage(flat), {.range = 0.01}), NonLocalMeans(FromImage(flat), {.sigma = 0.01})}) {
      const Image same = Render(node);
      for (int x = 0; x < 48; ++x) {
        for (int c = 0; c < 3; ++c) ASSERT_EQ(same.at<float>(x, 7, c), flat.at<float>(x, 7, c)) << x;
      }
      // Alpha goes with the colours' weights.
      EXPECT_GT(same.at<float>(6, 7, 3), 0.6f);
      EXPECT_LT(same.at<float>(6, 7, 3), 0.9f);
    }
  });
}

TEST(RestoreTest, WhatIsNotFiniteStaysWhereItIs) {
  for (const float value : {kNaN, kInf, -kInf}) {
    Image image = Step(0.02);
    image.at<float>(12, 12, 1) = value;
    OnEveryTarget([&] {
      for (const Node& node :
           {Bilateral(FromImage(image)), NonLocalMeans(FromImage(image), {.sigma = 0.1})}) {
        const Image result = Render(node);
        for (int y = 0; y < 32; ++y) {
          for (int x = 0; x < 48; ++x) {
            for (int c = 0; c < 3; ++c) {
              const bool own = x == 12 && y == 12 && c == 1;
              ASSERT_EQ(std::isfinite(result.at<float>(x, y, c)), !own) << x << "," << y << "," << c;
            }
          }
        }
        const VerifyReport report = Verify(node);
        EXPECT_TRUE(report.within_bound) << report.Summary();
      }
    });
  }
}

TEST(RestoreTest, BandsBecomeARamp) {
  // A slope of an eighth of a code per pixel, stored in eight bits.
  Image image(ImageSpec(256, 8, 1));
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 256; ++x) image.at<float>(x, y, 0) = static_cast<float>(std::round(x / 8.0) / 255);
  }
  const auto roughest = [](const Image& ramp) {
    double most = 0;
    for (int x = 40; x < 216; ++x) most = std::max(most, std::fabs(ramp.at<float>(x, 4, 0) - x / 8.0 / 255));
    return most * 255;
  };
  EXPECT_GT(roughest(image), 0.4);
  EXPECT_LT(roughest(Render(Deband(FromImage(image), {.radius = 4, .threshold = 0.012}))), 0.15);
  // An edge is none of a gradient's.
  const Image step = Step(0);
  const Image kept = Render(Deband(FromImage(step)));
  for (int x = 0; x < 48; ++x) {
    EXPECT_NEAR(kept.at<float>(x, 3, 0), step.at<float>(x, 3, 0), 1e-7) << x;
    EXPECT_EQ(kept.at<float>(x, 3, 3), step.at<float>(x, 3, 3)) << x;
  }
}

TEST(RestoreTest, LevelsAreThePicturesOwn) {
  // 101 samples from 0.2 to 0.7, in every channel another place; one that is not finite takes no part.
  ImageSpec spec(102, 1, 4);
  spec.alpha = 3;
  Image image(spec);
  for (int x = 0; x < 102; ++x) {
    for (int c = 0; c < 3; ++c) image.at<float>(x, 0, c) = static_cast<float>(0.1 * c + 0.2 + 0.003 * x);
    image.at<float>(x, 0, 3) = 0.5f;
  }
  image.at<float>(101, 0, 1) = kNaN;
  const auto level = [&](const AutoLevelsParams& p, int x, int c) {
    return Render(AutoLevels(FromImage(image), p)).at<float>(x, 0, c);
  };
  // In common: from red's first to blue's last.
  EXPECT_NEAR(level({.low = 0, .high = 0}, 0, 0), 0, 1e-6);
  EXPECT_NEAR(level({.low = 0, .high = 0}, 101, 2), 1, 1e-6);
  EXPECT_NEAR(level({.low = 0, .high = 0}, 50, 1), 0.25 / 0.503, 1e-6);
  // Each by its own, a tenth cut off at either end: ranks 10 and 90 of 101.
  EXPECT_NEAR(level({.low = 0.1, .high = 0.1, .apart = true}, 50, 1), 0.5, 1e-6);
  EXPECT_EQ(level({.low = 0.1, .high = 0.1, .apart = true}, 5, 1), 0);
  EXPECT_NEAR(level({.low = 0.1, .high = 0.1, .apart = true, .clamp = false}, 5, 1), -5 / 80.0, 1e-6);
  EXPECT_EQ(level({.low = 0.1, .high = 0.1, .apart = true}, 95, 1), 1);
  EXPECT_TRUE(std::isnan(level({}, 101, 1)));
  EXPECT_EQ(level({}, 3, 3), 0.5f);
  // One value alone stays.
  Image flat(ImageSpec(3, 2, 3));
  for (int i = 0; i < 18; ++i) flat.at<float>(i / 3 % 3, i / 9, i % 3) = 0.3f;
  EXPECT_EQ(Render(AutoLevels(FromImage(flat))).at<float>(1, 1, 1), 0.3f);
}

TEST(RestoreTest, WhatCannotBeIsRefused) {
  const Node image = FromImage(Step(0));
  EXPECT_THAT(Refusal([&] { Bilateral(image, {.sigma = 0}); }),
              HasSubstr("found sigma=0, expected 0.1 to 20"));
  EXPECT_THAT(Refusal([&] { Bilateral(image, {.range = -1}); }), HasSubstr("found range=-1"));
  EXPECT_THAT(Refusal([&] { NonLocalMeans(image, {.patch = 4}); }),
              HasSubstr("found patch=4, expected an odd"));
  EXPECT_THAT(Refusal([&] { NonLocalMeans(image, {.search = 65}); }), HasSubstr("expected 3 to 63"));
  EXPECT_THAT(Refusal([&] { NonLocalMeans(image, {.sigma = 0}); }), HasSubstr("found sigma=0"));
  EXPECT_THAT(Refusal([&] { AutoLevels(image, {.high = 0.5}); }), HasSubstr("expected 0 to 0.49"));
  EXPECT_THAT(Refusal([&] { Deband(image, {.radius = 128}); }), HasSubstr("expected 1 to 127"));
}

}  // namespace
}  // namespace tessera
