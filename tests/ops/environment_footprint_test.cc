// Mirrors filtered over the shape of what a pixel reflects: against the mean of many samples, seams, edges,
// what is seen from near, bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "support/environments.h"
#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/environment.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace test;
using testing::ExpectSameBits, testing::OnEveryTarget;
using ::testing::HasSubstr;
using Filter = EnvironmentFilter;

constexpr Filter kBoth[] = {Filter::kTrilinear, Filter::kEwa};
constexpr double kPi = std::numbers::pi;

// Normals of a ball that is larger than the picture's height; 0 beside it.
Image Ball(int width, int height, double radius) {
  const Image image(ImageSpec(width, height, 3));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = ((2 * x + 1.0) / width - 1) / radius,
                   v = (1 - (2 * y + 1.0) / height) / radius * height / width, q = u * u + v * v;
      if (q >= 1) continue;
      const double normal[] = {u, v, std::sqrt(1 - q)};
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(normal[c]);
    }
  }
  return image;
}
EnvironmentParams With(Map map, Filter filter, int anisotropy = 16) {
  EnvironmentParams p;
  p.map = map, p.filter = filter, p.anisotropy = anisotropy;
  return p;
}
// Squares of 7.5 degrees.
double Checker(const Vector3& d, int) {
  const double longitude = std::atan2(d[0], d[2]) / kPi * 24, latitude = std::asin(d[1]) / kPi * 24;
  return (static_cast<int>(std::floor(longitude)) + static_cast<int>(std::floor(latitude)) + 100) % 2 == 0
             ? 0.9
             : 0.05;
}

TEST(EnvironmentFootprintTest, ABallsRimIsNearTheMeanOfManySamples) {
  // Towards the rim a pixel reflects long, thin parts of the map.
  constexpr int kSide = 96, kFine = 16;
  for (const Map map : {Map::kLatLong, Map::kCube, Map::kOctahedral}) {
    int w, h;
    SizeOf(map, 512, &w, &h);
    const Node picture = FromImage(MapOf(map, w, h, 1, Checker));
    const Image fine = Render(Environment(FromImage(Ball(kSide * kFine, kSide * kFine, 0.95)), picture,
                                          With(map, Filter::kBilinear)));
    const Image normals = Ball(kSide, kSide, 0.95);
    const auto error = [&](Filter filter, int anisotropy) {
      const Image got = Render(Environment(FromImage(normals), picture, With(map, filter, anisotropy)));
      double sum = 0, count = 0;
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          // Whole pixels of the ball.
          const double u = std::fabs(2 * x + 1.0 - kSide) + 1, v = std::fabs(2 * y + 1.0 - kSide) + 1;
          if (std::hypot(u, v) > 0.95 * kSide) continue;
          double truth = 0;
          for (int k = 0; k < kFine * kFine; ++k)
            truth += fine.at<float>(x * kFine + k % kFine, y * kFine + k / kFine) / double{kFine * kFine};
          sum += std::pow(got.at<float>(x, y) - truth, 2), ++count;
        }
      }
      const double rms = std::sqrt(sum / count);
      std::printf("map %d filter %d aniso %2d: %.4f\n", static_cast<int>(map), static_cast<int>(filter),
                  anisotropy, rms);
      return rms;
    };
    const double bilinear = error(Filter::kBilinear, 1), mip = error(Filter::kMip, 1),
                 four = error(Filter::kTrilinear, 4), eight = error(Filter::kTrilinear, 8),
                 ewa = error(Filter::kEwa, 16);
    EXPECT_LT(mip, bilinear);
    EXPECT_LT(four, 0.8 * mip);
    EXPECT_LE(eight, 1.02 * four);
    EXPECT_LT(ewa, 0.8 * mip);
  }
}

TEST(EnvironmentFootprintTest, WhatIsSeenFromNearHasTheBitsOfBilinear) {
  OnEveryTarget([&] {
    for (const Map map : kMaps) {
      int w, h;
      SizeOf(map, 8, &w, &h);
      const Node normals = FromImage(Ball(70, 70, 1.6)), picture = FromImage(NoiseMap(w, h, 9));
      const Image plain = Render(Environment(normals, picture, With(map, Filter::kBilinear)));
      for (const Filter filter : kBoth)
        ExpectSameBits(Render(Environment(normals, picture, With(map, filter))), plain);
    }
  });
}

TEST(EnvironmentFootprintTest, NoSeamShowsWhereTheMapsEndsMeet) {
  // Around -z, where longitude jumps from 180 to -180 degrees, against the same turned to the map's middle.
  const auto noise = [](const Vector3& d, int) {
    return 0.5 + 0.25 * std::sin(60 * d[0] + 3 * d[1]) + 0.25 * std::sin(50 * d[1] + 1);
  };
  const Image map = MapOf(Map::kLatLong, 512, 256, 1, noise);
  const Image turned = MapOf(Map::kLatLong, 512, 256, 1, [&](const Vector3& d, int c) {
    return noise({-d[0], d[1], -d[2]}, c);
  });
  Image normals(ImageSpec(48, 32, 3));
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      normals.at<float>(x, y, 0) = static_cast<float>(x - 23.5) * 0.03f;
      normals.at<float>(x, y, 1) = static_cast<float>(y - 15.5) * 0.002f;
      normals.at<float>(x, y, 2) = -1;
    }
  }
  for (const Filter filter : kBoth) {
    EnvironmentParams p = With(Map::kLatLong, filter);
    p.direction = EnvironmentDirection::kNormal;
    const Image seam = Render(Environment(FromImage(normals), FromImage(map), p));
    p.matrix = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
    const Image middle = Render(Environment(FromImage(normals), FromImage(turned), p));
    double most = 0;
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 48; ++x)
        most = std::max(most, double{std::fabs(seam.at<float>(x, y) - middle.at<float>(x, y))});
    }
    std::printf("seam: %.5f\n", most);
    EXPECT_LT(most, 0.01);
  }
}

TEST(EnvironmentFootprintTest, ObjectsEdgesCountOneSide) {
  // Two facets side by side, and a lone pixel: every pixel's own facet is flat, so nothing is averaged.
  Image normals(ImageSpec(9, 3, 3));
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 6; ++x)
      normals.at<float>(x, y, 0) = x < 3 ? 0.5f : -0.5f, normals.at<float>(x, y, 2) = 1;
  }
  normals.at<float>(7, 1, 1) = 0.3f, normals.at<float>(7, 1, 2) = 1;
  for (const Map map : kMaps) {
    int w, h;
    SizeOf(map, 64, &w, &h);
    const Node picture = FromImage(NoiseMap(w, h, 3));
    const Image plain = Render(Environment(FromImage(normals), picture, With(map, Filter::kBilinear)));
    for (const Filter filter : kBoth)
      ExpectSameBits(Render(Environment(FromImage(normals), picture, With(map, filter))), plain);
  }
}

TEST(EnvironmentFootprintTest, StaysWithinItsBoundAndAConstantStays) {
  for (const Map map : kMaps) {
    SCOPED_TRACE(static_cast<int>(map));
    int w, h;
    SizeOf(map, 48, &w, &h);
    const Image grey = MapOf(map, w, h, 1, [](const Vector3&, int) { return 0.7; });
    const Image ball = Ball(24, 24, 0.9);
    for (const Filter filter : kBoth) {
      for (const int anisotropy : {1, 3, 16, 64}) {
        const EnvironmentParams p = With(map, filter, anisotropy);
        const Image got = Render(Environment(FromImage(ball), FromImage(grey), p));
        for (int y = 0; y < 24 && map != Map::kParabolic; ++y) {
          for (int x = 0; x < 24; ++x) {
            EXPECT_NEAR(got.at<float>(x, y), ball.at<float>(x, y, 2) != 0 ? 0.7f : 0.0f, 1e-6f)
                << x << "," << y;
          }
        }
        const VerifyReport report = Verify(Environment(FromImage(ball), FromImage(NoiseMap(w, h, 2)), p));
        EXPECT_TRUE(report.within_bound) << report.max_error;
      }
    }
  }
  // Neighbours that look in opposite directions; maps of a texel.
  const Node opposite =
      FromImage(Vectors({{0, 0, 1}, {0, 0, -1}, {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-1, 0, 0}}));
  for (const int n : {1, 2, 64}) {
    for (const Filter filter : kBoth) {
      EnvironmentParams p = With(Map::kLatLong, filter);
      p.direction = EnvironmentDirection::kNormal;
      EXPECT_TRUE(Verify(Environment(opposite, FromImage(NoiseMap(2 * n, n, 4)), p)).within_bound) << n;
    }
  }
}

TEST(EnvironmentFootprintTest, RefusesWhatItCannot) {
  const Node normals = FromImage(Ball(4, 4, 1)), map = FromImage(NoiseMap(8, 4, 1));
  EnvironmentParams p = With(Map::kLatLong, Filter::kEwa);
  p.lobe = 10;
  EXPECT_THAT(Refusal([&] { Environment(normals, map, p); }), HasSubstr("filter=ewa with gloss"));
  p.lobe = 0, p.anisotropy = 65;
  EXPECT_THAT(Refusal([&] { Environment(normals, map, p); }), HasSubstr("anisotropy 65, expected 1 to 64"));
}

}  // namespace
}  // namespace tessera
