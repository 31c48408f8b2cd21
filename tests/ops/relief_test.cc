// Occlusion and curvature of heights whose answers are known; textures made to repeat.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "support/every_target.h"
#include "support/refusal.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/bump.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing::OnEveryTarget;

template <class F>
Image Heights(int size, F height) {
  Image image(ImageSpec(size, size, 1));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) image.at<float>(x, y, 0) = static_cast<float>(height(x, y));
  }
  return image;
}

TEST(ReliefTest, AWallHidesHalfTheSkyAndOpenGroundNothing) {
  // A wall that is as good as endless on the right of column 31.
  const Image wall = Heights(64, [](int x, int) { return x > 31 ? 1e6 : 0; });
  const Image slope = Heights(64, [](int x, int) { return 0.5 * x; });
  OnEveryTarget([&] {
    const Image open = Render(HeightToOcclusion(FromImage(wall), {.radius = 8, .directions = 64}));
    EXPECT_EQ(open.at<float>(10, 32, 0), 1);
    EXPECT_EQ(open.at<float>(40, 32, 0), 1);
    // Of 64 rays 31 meet it; those along it do not.
    EXPECT_NEAR(open.at<float>(31, 32, 0), 33.0 / 64, 1e-6);
    // A plane's horizon uphill is its own slope in that direction: the mean of 1/(1 + g^2 cos^2) over that
    // half.
    double expected = 0;
    for (int k = 0; k < 10000; ++k) {
      const double c = std::cos(2 * std::numbers::pi * (k + 0.5) / 10000);
      expected += (c > 0 ? 1 / (1 + 0.25 * c * c) : 1) / 10000;
    }
    const Image tilted = Render(HeightToOcclusion(FromImage(slope), {.radius = 16, .directions = 64}));
    EXPECT_NEAR(tilted.at<float>(32, 32, 0), expected, 0.01);
  });
}

TEST(ReliefTest, NoHeightHidesNothing) {
  Image image = Heights(16, [](int x, int y) { return x * y % 5; });
  image.at<float>(8, 8, 0) = std::numeric_limits<float>::quiet_NaN();
  const Image open = Render(HeightToOcclusion(FromImage(image)));
  EXPECT_EQ(open.at<float>(8, 8, 0), 1);
  for (int x = 0; x < 16; ++x) EXPECT_GT(open.at<float>(x, 7, 0), 0) << x;
}

TEST(ReliefTest, ASphereIsCurvedByItsRadius) {
  constexpr double kRadius = 200;
  const auto sphere = [](double sign) {
    return Heights(33, [sign](int x, int y) {
      return sign * std::sqrt(kRadius * kRadius - (x - 16) * (x - 16) - (y - 16) * (y - 16)) + 1000;
    });
  };
  OnEveryTarget([&] {
    for (const double sign : {1.0, -1.0}) {
      const Node heights = FromImage(sphere(sign));
      const Image mean = Render(HeightToCurvature(heights)),
                  gaussian = Render(HeightToCurvature(heights, {.output = CurvatureOutput::kGaussian})),
                  packed = Render(HeightToCurvature(heights, {.gain = 40, .pack = true}));
      // Heights of a thousand have steps of 2^-14, and there are four of them in a second difference.
      constexpr double kStep = 0x1p-13;
      for (const int x : {4, 16, 27}) {
        EXPECT_NEAR(mean.at<float>(x, 12, 0), sign / kRadius, 2 * kStep) << x;
        EXPECT_NEAR(gaussian.at<float>(x, 12, 0), 1 / (kRadius * kRadius), 4 * kStep / kRadius) << x;
        EXPECT_FLOAT_EQ(packed.at<float>(x, 12, 0), 0.5f + 20 * mean.at<float>(x, 12, 0)) << x;
      }
    }
    const Image plane =
        Render(HeightToCurvature(FromImage(Heights(16, [](int x, int y) { return 3 * x - 2 * y; }))));
    EXPECT_EQ(plane.at<float>(8, 8, 0), 0);
  });
}

TEST(ReliefTest, ATextureMeetsItselfAndItsMiddleStays) {
  const Image image = Heights(64, [](int x, int y) { return std::sin(0.05 * x + 0.3) + 0.03 * y; });
  const Image tile = Render(Tileable(FromImage(image)));
  double inside = 0, seam = 0, before = 0;
  for (int k = 0; k < 64; ++k) {
    for (int i = 1; i < 64; ++i) {
      inside = std::max({inside, std::fabs(double{tile.at<float>(i, k, 0)} - tile.at<float>(i - 1, k, 0)),
                         std::fabs(double{tile.at<float>(k, i, 0)} - tile.at<float>(k, i - 1, 0))});
    }
    seam = std::max({seam, std::fabs(double{tile.at<float>(0, k, 0)} - tile.at<float>(63, k, 0)),
                     std::fabs(double{tile.at<float>(k, 0, 0)} - tile.at<float>(k, 63, 0))});
    before = std::max(before, std::fabs(double{image.at<float>(k, 0, 0)} - image.at<float>(k, 63, 0)));
  }
  EXPECT_GT(before, 1.5);
  EXPECT_LT(seam, inside);
  EXPECT_LT(seam, 0.06);
  for (int y = 17; y < 47; ++y) {
    for (int x = 17; x < 47; ++x)
      ASSERT_EQ(tile.at<float>(x, y, 0), image.at<float>(x, y, 0)) << x << "," << y;
  }
  // One axis alone.
  const Image across = Render(Tileable(FromImage(image), {.y = false}));
  EXPECT_NEAR(across.at<float>(0, 5, 0), across.at<float>(63, 5, 0), 0.06);
  for (int x = 17; x < 47; ++x) ASSERT_EQ(across.at<float>(x, 0, 0), image.at<float>(x, 0, 0)) << x;
  // Of a pixel there is nothing to fade.
  Image one(ImageSpec(1, 1, 1));
  one.at<float>(0, 0, 0) = 0.25f;
  EXPECT_EQ(Render(Tileable(FromImage(one))).at<float>(0, 0, 0), 0.25f);
}

TEST(ReliefTest, WhatCannotBeIsRefused) {
  const Node image = FromImage(Heights(8, [](int x, int) { return x; }));
  EXPECT_THAT(Refusal([&] { HeightToOcclusion(image, {.radius = 0}); }), HasSubstr("found radius=0"));
  EXPECT_THAT(Refusal([&] { HeightToOcclusion(image, {.directions = 65}); }), HasSubstr("expected 4 to 64"));
  EXPECT_THAT(Refusal([&] { HeightToCurvature(image, {.gain = 1e7}); }), HasSubstr("found gain="));
  EXPECT_THAT(Refusal([&] { Tileable(image, {.blend = 0.6}); }), HasSubstr("expected 0.01 to 0.5"));
}

}  // namespace
}  // namespace tessera
