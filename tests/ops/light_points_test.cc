// Small lights: what they sum to wherever they lie, how they fade, where a camera shows them, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/refusal.h"
#include "tessera/ops/outline.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

Image Drawn(const LightPointsParams& p, int side = 64) {
  return Render(LightPoints(ImageSpec(side, side, 4), p));
}
double Sum(const Image& image, int channel) {
  double sum = 0;
  const Roi& w = image.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) sum += image.at<float>(x, y, channel);
  }
  return sum;
}
LightPointsParams One(double x, double y, double size, LightShape shape) {
  LightPointsParams p;
  p.lights = {{{x, y, 1}, {1, 0.5, 0.25}, size}};
  p.shape = shape, p.fade = 1e-3;
  return p;
}

TEST(LightPointsTest, ALightIsItsAreaWhereverItLies) {
  for (const LightShape shape : {LightShape::kDisc, LightShape::kGaussian}) {
    for (const double size : {0.01, 0.3, 0.999, 1.0, 1.7, 2.0, 5.5, 16.0}) {
      for (const auto& [x, y] : {std::pair(32.0, 32.0), std::pair(32.5, 32.5), std::pair(31.77, 32.31),
                                 std::pair(32.5, 32.0), std::pair(30.999, 33.125)}) {
        const Image image = Drawn(One(x, y, size, shape));
        const double area = kPi / 4 * size * size;
        EXPECT_NEAR(Sum(image, 0), area, 2e-5 * area) << size << " at " << x << "," << y;
        EXPECT_NEAR(Sum(image, 2), area / 4, 1e-5 * area);
      }
    }
  }
}

TEST(LightPointsTest, PixelsHaveTheirShareOfTheDisc) {
  const double size = 7.3, cx = 20.3, cy = 19.9;
  const Image image = Drawn(One(cx, cy, size, LightShape::kDisc), 40);
  constexpr int kSide = 200;
  for (int y = 12; y < 28; ++y) {
    for (int x = 12; x < 28; ++x) {
      int inside = 0;
      for (int k = 0; k < kSide * kSide; ++k) {
        const double dx = x + (k % kSide + 0.5) / kSide - cx, dy = y + (k / kSide + 0.5) / kSide - cy;
        inside += dx * dx + dy * dy < size * size / 4;
      }
      ASSERT_NEAR(image.at<float>(x, y, 3), inside / double{kSide * kSide}, 1e-3) << x << "," << y;
    }
  }
}

// Whether a light shrinks or fades, the picture has a times its light.
TEST(LightPointsTest, LightFollowsTheAttenuation) {
  for (const LightShape shape : {LightShape::kDisc, LightShape::kGaussian}) {
    for (const double distance : {0.0, 1.0, 3.0, 7.0, 20.0, 90.0}) {
      LightPointsParams p = One(32.3, 31.6, 8, shape);
      p.attenuation = {1, 0.05, 0.03}, p.fade = 2, p.lights[0].place[2] = distance;
      const double a = 1 / (1 + 0.05 * distance + 0.03 * distance * distance);
      const ShownLight shown = ShownLights(ImageSpec(64, 64, 4), p)[0];
      EXPECT_NEAR(shown.size, std::max(2.0, 8 * std::sqrt(a)), 1e-12);
      EXPECT_LE(shown.alpha, 1);
      EXPECT_NEAR(Sum(Drawn(p), 0), a * kPi / 4 * 64, 1e-4 * a * 64) << distance;
    }
  }
}

TEST(LightPointsTest, NearOnesLieOverFarOnes) {
  LightPointsParams p;
  p.lights = {{{20, 20, 1}, {1, 0, 0}, 10}, {{20, 20, 5}, {0, 1, 0}, 20}};
  Image image = Drawn(p, 40);
  EXPECT_EQ(image.at<float>(20, 20, 0), 1);
  EXPECT_EQ(image.at<float>(20, 20, 1), 0);
  EXPECT_EQ(image.at<float>(20, 27, 1), 1);
  p.adds = true;
  image = Drawn(p, 40);
  EXPECT_EQ(image.at<float>(20, 20, 0), 1);
  EXPECT_EQ(image.at<float>(20, 20, 1), 1);
  EXPECT_EQ(image.at<float>(20, 20, 3), 1);
}

TEST(LightPointsTest, ACameraPlacesThem) {
  LightPointsParams p;
  p.camera = Camera::Perspective({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 90, 2);
  p.attenuation = {0, 0, 1};
  p.lights = {{{1, 0.5, 0}, {1, 1, 1}, 8}, {{0, 0, 5}, {1, 1, 1}, 8}, {{0, 0, 2}, {1, 1, 1}, 8}};
  const std::vector<ShownLight> shown = ShownLights(ImageSpec(200, 100, 4), p);
  ASSERT_EQ(shown.size(), 2u) << "what lies behind the camera is not seen";
  // Four units away, 100 pixels show eight units.
  EXPECT_NEAR(shown[0].x, 100 + 12.5, 1e-9);
  EXPECT_NEAR(shown[0].y, 50 - 6.25, 1e-9);
  const double distance = std::sqrt(16 + 1.25);
  EXPECT_NEAR(shown[0].distance, distance, 1e-9);
  EXPECT_NEAR(shown[0].size, 8 / distance, 1e-9);
  EXPECT_NEAR(shown[1].size, 4, 1e-9);
}

TEST(LightPointsTest, WithinBound) {
  for (const LightShape shape : {LightShape::kDisc, LightShape::kGaussian}) {
    for (const bool adds : {false, true}) {
      LightPointsParams p;
      p.shape = shape, p.adds = adds, p.attenuation = {0.3, 0.1, 0.02};
      for (int k = 0; k < 60; ++k) {
        p.lights.push_back({{std::fmod(k * 13.7, 70) - 3, std::fmod(k * 5.31, 50) - 3, k * 0.4},
                            {k % 3 - 0.5, 0.01 * k, 3},
                            std::fmod(k * 0.77, 21)});
      }
      const VerifyReport report = Verify(LightPoints(ImageSpec(64, 44, 4), p));
      EXPECT_TRUE(report.within_bound) << report.max_error;
      EXPECT_EQ(report.undecided, 0);
    }
  }
}

TEST(LightPointsTest, Refusals) {
  const ImageSpec spec(8, 8, 4);
  LightPointsParams p = One(1, 1, 1, LightShape::kDisc);
  p.attenuation = {0, 0, 0};
  EXPECT_THAT(Refusal([&] { LightPoints(spec, p); }), HasSubstr("found attenuation 0,0,0"));
  p = One(1, 1, -1, LightShape::kDisc);
  EXPECT_THAT(Refusal([&] { LightPoints(spec, p); }), HasSubstr("found size -1"));
  p = One(NAN, 1, 1, LightShape::kDisc);
  EXPECT_THAT(Refusal([&] { LightPoints(spec, p); }), HasSubstr("a coordinate"));
  p = One(1, 1, 1, LightShape::kDisc);
  p.fade = 0;
  EXPECT_THAT(Refusal([&] { LightPoints(spec, p); }), HasSubstr("found fade 0"));
}

}  // namespace
}  // namespace tessera
