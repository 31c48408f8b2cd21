// Warps whose filters follow the footprint: what they keep, how near a floor towards the horizon comes to the
// mean of many samples, hard places, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr Wrap kWraps[] = {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror};

template <class F>
Image Filled(int width, int height, const F& value) {
  const Image image{ImageSpec(width, height, 3, PixelType::kFloat)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(value(x, y));
    }
  }
  return image;
}

// A floor of 128 by 128 pixels that repeats, its horizon at y = 10, turned by 30 degrees: result to picture.
constexpr double kSide = 128, kHorizon = 10;
void OnFloor(double x, double y, double* u, double* v) {
  const double q = (y - kHorizon) / (kSide - kHorizon), across = (x - kSide / 2) / q, along = 0.8 * kSide / q;
  const double cosine = std::sqrt(0.75), sine = 0.5;
  *u = cosine * across - sine * along + 64.3, *v = sine * across + cosine * along + 17.1;
}
// Its inverse, as the operation takes it: rows of the images of (u, v, 1) / q.
std::vector<double> FloorMatrix() {
  const double c = std::sqrt(0.75), s = 0.5, k = kSide - kHorizon, d = 0.8 * kSide;
  // (across, along) = (u - 64.3, v - 17.1) turned back; y = horizon + k d / along, x = side / 2 + across d /
  // along.
  const double across[3] = {c, s, -64.3 * c - 17.1 * s}, along[3] = {-s, c, 64.3 * s - 17.1 * c};
  std::vector<double> m;
  for (int i = 0; i < 3; ++i) {
    m.push_back(across[i] * d + kSide / 2 * along[i]);
    m.push_back((i == 2 ? k * d : 0) + kHorizon * along[i]);
    m.push_back(along[i]);
  }
  return m;
}
double Checker(double u, double v) {
  const auto cell = [](double at) { return static_cast<int64_t>(std::floor(at / 16)); };
  return (cell(u) + cell(v)) % 2 == 0 ? 0.9 : 0.05;
}

// Root of the mean square of what the rows under the horizon are off by from 16 x 16 samples per pixel.
double FloorError(const std::string& filter, int anisotropy) {
  const Image picture = Filled(128, 128, [](int x, int y) { return Checker(x + 0.5, y + 0.5); });
  WarpParams p{FloorMatrix(), filter, Wrap::kRepeat};
  p.anisotropy = anisotropy;
  const Image warped = Render(Warp(FromImage(picture), p));
  double sum = 0;
  int count = 0;
  for (int y = static_cast<int>(kHorizon) + 4; y < 128; ++y) {
    for (int x = 0; x < 128; ++x, ++count) {
      double truth = 0, u = 0, v = 0;
      for (int k = 0; k < 256; ++k) {
        OnFloor(x + (k % 16 + 0.5) / 16, y + (k / 16 + 0.5) / 16, &u, &v);
        truth += Checker(u, v) / 256;
      }
      const double off = warped.at<float>(x, y, 0) - truth;
      sum += off * off;
    }
  }
  return std::sqrt(sum / count);
}

TEST(FootprintTest, AFloorTowardsTheHorizonIsNearTheMeanOfManySamples) {
  const double mip = FloorError("trilinear", 1), four = FloorError("trilinear", 4),
               eight = FloorError("trilinear", 8), sixteen = FloorError("trilinear", 16),
               ewa = FloorError("ewa", 16), box = FloorError("triangle", 1);
  std::string all;
  for (const double v : {box, mip, four, eight, sixteen, ewa}) all += std::to_string(v) + " ";
  RecordProperty("rms of triangle, mip, 4, 8, 16, ewa", all);
  std::printf("rms of triangle, mip, 4, 8, 16, ewa: %s\n", all.c_str());
  EXPECT_LT(four, 0.6 * mip);
  EXPECT_LT(eight, 0.85 * four);
  EXPECT_LE(sixteen, eight);
  EXPECT_LT(ewa, 0.6 * mip);
  EXPECT_LT(ewa, 0.6 * box);
}

TEST(FootprintTest, WhatMovesWholePixelsKeepsBits) {
  const Image picture = testing::Picture({0, 0, 40, 40}, 3, PixelType::kFloat, 5);
  OnEveryTarget([&] {
    for (const char* const filter : {"trilinear", "ewa"}) {
      for (const Wrap wrap : kWraps) {
        ExpectSameBits(Render(Warp(FromImage(picture), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, filter, wrap})),
                       picture);
        // Twice a quarter turn about the middle, and a shift there and back inside.
        const WarpParams turn{{0, 1, 0, -1, 0, 0, 40, 0, 1}, filter, wrap};
        Node turned = FromImage(picture);
        for (int i = 0; i < 4; ++i) turned = Warp(FromImage(Render(turned)), turn);
        ExpectSameBits(Render(turned), picture);
      }
    }
  });
}

TEST(FootprintTest, AConstantStaysConstant) {
  const Image flat = Filled(100, 67, [](int, int) { return 0.7f; });
  for (const char* const filter : {"trilinear", "ewa"}) {
    for (const Wrap wrap : {Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
      for (const auto& m : std::vector<std::vector<double>>{{0.3, 0.1, 0, -0.1, 0.05, 0, 5, 5, 1},
                                                            {0.9, 0.2, 0, -0.1, 0.4, 0.01, 5, 5, 1},
                                                            {1e-6, 0, 0, 0, 1e-6, 0, 5, 5, 1},
                                                            {1e6, 0, 0, 0, 1e6, 0, 5, 5, 1}}) {
        const Image out = Render(Warp(FromImage(flat), {m, filter, wrap}));
        for (int y = 0; y < 67; ++y) {
          for (int x = 0; x < 100; ++x) {
            const float v = out.at<float>(x, y, 1);
            ASSERT_TRUE(v == 0 ? m[5] != 0 : std::fabs(v - 0.7f) < 1e-6f)
                << filter << " " << x << " " << y << " " << v;
          }
        }
      }
    }
  }
}

TEST(FootprintTest, HardPlaces) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const char* const filter : {"trilinear", "ewa"}) {
    for (const Wrap wrap : kWraps) {
      // One pixel; one row; w = 0 on a pixel's centre, below 0 above it; scales of a million.
      for (const auto& m : std::vector<std::vector<double>>{{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                                            {1, 0, 0, 0, 1, 0.5, 0, 0, 1},
                                                            {1e-6, 0, 0, 0, 1, 0, 0, 0, 1},
                                                            {1e6, 0, 0, 0, 1e-6, 0, 3, 0, 1},
                                                            {0.4, 0.3, 0.01, -0.2, 0.1, 0.2, 1, 1, 1}}) {
        for (const Roi& window : {Roi{0, 0, 1, 1}, Roi{-3, 2, 30, 3}, Roi{5, -7, 26, 24}}) {
          SCOPED_TRACE(std::string(filter) + " " + std::to_string(m[0]) + " " +
                       std::to_string(window.width()));
          const Image picture = testing::Picture(window, 3, PixelType::kFloat, 9);
          const Node warped = Warp(FromImage(picture), {m, filter, wrap});
          const VerifyReport report = Verify(warped);
          EXPECT_TRUE(report.within_bound) << report.max_error;
        }
      }
    }
    // NaN spreads as far as footprints that hold it.
    Image picture = Filled(64, 64, [](int, int) { return 0.5; });
    picture.at<float>(40, 40, 0) = nan;
    const Image half =
        Render(Warp(FromImage(picture), {{0.5, 0, 0, 0, 0.5, 0, 0, 0, 1}, filter, Wrap::kClamp}));
    EXPECT_TRUE(std::isnan(half.at<float>(20, 20, 0)));
    EXPECT_EQ(half.at<float>(20, 20, 1), 0.5f);
    EXPECT_EQ(half.at<float>(10, 20, 0), 0.5f);
    const Image same = Render(Warp(FromImage(picture), {{1, 0, 0, 0, 1, 0, 1, 0, 1}, filter, Wrap::kClamp}));
    EXPECT_TRUE(std::isnan(same.at<float>(41, 40, 0)));
    EXPECT_EQ(same.at<float>(40, 40, 0), 0.5f);
  }
}

TEST(FootprintTest, RefusesOtherAnisotropies) {
  const Node image = FromImage(Filled(4, 4, [](int, int) { return 0; }));
  for (const int n : {0, -1, 65}) {
    WarpParams p{{1, 0, 0, 0, 1, 0, 0.5, 0, 1}, "ewa"};
    p.anisotropy = n;
    try {
      Warp(image, p);
      ADD_FAILURE() << n;
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr("anisotropy " + std::to_string(n) + ", expected 1 to 64"));
    }
  }
}

}  // namespace
}  // namespace tessera
