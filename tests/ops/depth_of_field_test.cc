// Depth of field: layers held against views through many places of a lens; shapes, light, tiles, hard cases;
// and gathering.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// value(x, y, channel).
template <class F>
Image Filled(const Roi& window, int channels, F value) {
  ImageSpec spec(window.width(), window.height(), channels);
  spec.data_window = window;
  const Image image(spec);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = value(x, y, c);
    }
  }
  return image;
}

Image Constant(const Roi& window, float v) {
  return Filled(window, 1, [v](int, int, int) { return v; });
}

// Textured planes that stand upright before a lens, the nearest first. Seen through a place (u, v) of it a
// plane is moved by its own part of that, exactly.
struct Plane {
  double depth;
  bool (*covers)(double x, double y);
  double (*light)(double x, double y);
};
using Planes = std::vector<Plane>;

constexpr int kWidth = 160, kHeight = 120, kMargin = 16;
constexpr double kFocus = 4;

bool Everywhere(double, double) { return true; }
bool DiscAndBars(double x, double y) {
  return std::hypot(x - 85, y - 60) < 33 || std::fabs(x - 30) < 3 || std::fabs(x - 0.5 * y - 8) < 1;
}
bool Ball(double x, double y) { return std::hypot(x - 60, y - 60) < 25; }
bool Wall(double x, double y) { return x - 0.3 * y > 50 && y > 30; }
double Stripes(double x, double y) { return 0.5 + 0.25 * std::sin(0.35 * x) + 0.2 * std::cos(0.27 * y + 1); }
double Waves(double x, double y) {
  return 0.3 + 0.25 * std::sin(0.2 * (x + y)) * std::cos(0.5 * y - 0.1 * x);
}
double Lights(double x, double y) {
  const double u = std::remainder(x, 23), v = std::remainder(y - 4, 19);
  return 0.15 + 0.1 * std::sin(0.15 * x) + 6 * std::exp(-(u * u + v * v) / 3);
}

Image View(const Planes& planes, double aperture, double u, double v, const Image* depth = nullptr) {
  return Filled({0, 0, kWidth, kHeight}, 1, [&](int x, int y, int) {
    for (const Plane& plane : planes) {
      const double shift = aperture * (1 / kFocus - 1 / plane.depth);
      const double px = x + shift * u, py = y + shift * v;
      if (!plane.covers(px, py)) continue;
      if (depth != nullptr) depth->at<float>(x, y) = static_cast<float>(plane.depth);
      return static_cast<float>(plane.light(px, py));
    }
    return 0.0f;
  });
}

// The mean of views through places that lie evenly on the lens.
Image ManyViews(const Planes& planes, double aperture, int count) {
  const Image sum(ImageSpec(kWidth, kHeight, 1));
  for (int k = 0; k < count; ++k) {
    const double r = std::sqrt((k + 0.5) / count), t = k * std::numbers::pi * (3 - std::sqrt(5.0));
    const Image view = View(planes, aperture, r * std::cos(t), r * std::sin(t));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        sum.at<float>(x, y) += view.at<float>(x, y) / static_cast<float>(count);
    }
  }
  return sum;
}

double Rms(const Image& a, const Image& b) {
  double sum = 0;
  for (int y = kMargin; y < kHeight - kMargin; ++y) {
    for (int x = kMargin; x < kWidth - kMargin; ++x)
      sum += std::pow(a.at<float>(x, y) - b.at<float>(x, y), 2);
  }
  return std::sqrt(sum / ((kWidth - 2 * kMargin) * (kHeight - 2 * kMargin)));
}

// One picture against 256 views, beside what the mean of 16 views is off by. 16 views cost sixteen renders
// and show sixteen ghosts of each light.
TEST(LensLayersTest, OnePictureIsHeldAgainstViewsThroughTheLens) {
  const Planes scenes[] = {{{2, DiscAndBars, Stripes}, {kFocus, Everywhere, Waves}},
                           {{kFocus, DiscAndBars, Stripes}, {12, Everywhere, Lights}},
                           {{2, Ball, Stripes}, {kFocus, Wall, Waves}, {16, Everywhere, Lights}}};
  const char* const names[] = {"near before sharp", "sharp before far", "near, sharp and far"};
  for (size_t s = 0; s < std::size(scenes); ++s) {
    for (const double radius : {3.0, 8.0, 14.0}) {
      SCOPED_TRACE(std::string(names[s]) + ", radius " + std::to_string(radius));
      const double aperture = radius / (s == 1 ? 1 / kFocus - 1.0 / 12 : 1.0 / 2 - 1 / kFocus);
      const Image depth(ImageSpec(kWidth, kHeight, 1)), color = View(scenes[s], aperture, 0, 0, &depth);
      const Image truth = ManyViews(scenes[s], aperture, 256);
      DepthOfFieldParams p{kFocus, aperture, 16};
      const Image layers = Render(DepthOfField(FromImage(color), FromImage(depth), p));
      p.method = DepthOfFieldMethod::kGather;
      const Image gathered = Render(DepthOfField(FromImage(color), FromImage(depth), p));
      const double sixteen = Rms(ManyViews(scenes[s], aperture, 16), truth);
      std::printf("%-20s radius %4.1f: sharp %.4f, gathered %.4f, layers %.4f, 16 views %.4f\n", names[s],
                  radius, Rms(color, truth), Rms(gathered, truth), Rms(layers, truth), sixteen);
      constexpr double kMost[][3] = {{0.011, 0.015, 0.021}, {0.021, 0.023, 0.021}, {0.045, 0.044, 0.038}};
      const size_t column = radius == 3 ? 0 : radius == 8 ? 1 : 2;
      EXPECT_LT(Rms(layers, truth), kMost[s][column]);
      EXPECT_LT(Rms(layers, truth), Rms(gathered, truth));
    }
  }
}

// A near disc, out of focus, before a sharp plane: its edge is soft on both sides, and what is sharp is not.
TEST(LensLayersTest, NearObjectsGetSoftEdgesOverWhatIsSharp) {
  const Roi window{-7, 3, 90, 70};
  const auto near = [](int x, int y) { return std::hypot(x - 40, y - 36) < 16; };
  const Image color = Filled(window, 2, [&](int x, int y, int c) {
    return near(x, y) ? 1.0f : c == 0 ? 0.0f : 0.25f + 0.01f * static_cast<float>((x * 7 + y * 3) % 11);
  });
  const Image depth = Filled(window, 1, [&](int x, int y, int) { return near(x, y) ? 1.0f : 2.0f; });
  OnEveryTarget([&] {
    const Image out = Render(DepthOfField(FromImage(color), FromImage(depth), {2, 12, 8}));  // radius 6
    for (int y = window.y0; y < window.y1; ++y) {
      float before = -1;
      for (int x = window.x0; x < window.x1; ++x) {
        const double distance = std::hypot(x - 40, y - 36);
        const float share = out.at<float>(x, y, 0);
        if (distance > 24) {
          ASSERT_EQ(out.at<float>(x, y, 1), color.at<float>(x, y, 1)) << x << "," << y;
        }
        if (distance < 9) {
          ASSERT_NEAR(share, 1, 1e-6) << x << "," << y;
        }
        if (y == 36 && x <= 40) {
          ASSERT_GE(share, before - 1e-6) << x;
          before = share;
        }
      }
    }
    // Half of it at its edge; some of it outside, where gathering had none.
    EXPECT_NEAR((out.at<float>(24, 36, 0) + out.at<float>(23, 36, 0) + out.at<float>(25, 36, 0)) / 3, 0.45,
                0.1);
    EXPECT_GT(out.at<float>(20, 36, 0), 0.05);
    EXPECT_LT(out.at<float>(28, 36, 0), 0.95);
  });
}

TEST(LensLayersTest, NothingFarIsDrawnOverWhatIsSharpAndNear) {
  const Roi window{0, 0, 64, 40};
  const Image color = Filled(window, 3, [](int x, int y, int c) {
    return x < 30 ? 0.25f + 0.5f * static_cast<float>((x + y + c) % 2) : x == 34 && y == 20 ? 1000.0f : 0.1f;
  });
  const Image depth = Filled(window, 1, [](int x, int, int) { return x < 30 ? 2.0f : kInf; });
  OnEveryTarget([&] {
    const Image out = Render(DepthOfField(FromImage(color), FromImage(depth), {2, 20, 12}));
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 30; ++x) {
        for (int c = 0; c < 3; ++c)
          ASSERT_EQ(out.at<float>(x, y, c), color.at<float>(x, y, c)) << x << "," << y;
      }
    }
    EXPECT_GT(out.at<float>(31, 20, 0), 2);
  });
}

std::vector<DepthOfFieldParams> Shapes(double focus, double aperture, double most) {
  DepthOfFieldParams disc{focus, aperture, most}, hexagon = disc, triangle = disc;
  hexagon.shape = triangle.shape = ApertureShape::kPolygon;
  triangle.blades = 3, triangle.rotation = 31;
  return {disc, hexagon, triangle};
}

Node Heart() {
  return FromImage(Filled({-3, 2, 8, 11}, 2, [](int x, int y, int c) {
    return c == 1 ? -5 : x == 0 && y == 4 ? kNaN : static_cast<float>((x + 3) * 2 + y) / 30;
  }));
}

TEST(LensLayersTest, LightIsConservedAndConstantsStay) {
  const Roi window{0, 0, 90, 90};
  const Image point = Filled(window, 1, [](int x, int y, int) { return x == 44 && y == 45 ? 3.0f : 0.0f; });
  const Image grey = Filled(window, 2, [](int, int, int c) { return c == 0 ? 0.1f : 1e-30f; });
  std::mt19937 random(3);
  const Image rough =
      Filled(window, 1, [&](int, int, int) { return 0.4f + 1e-3f * static_cast<float>(random() % 2000); });
  for (const double aperture : {0.3, 0.8, 3.0, 8.7, 14.0}) {
    SCOPED_TRACE(aperture);
    for (const float z : {0.5f, kInf}) {
      std::vector<Node> points, greys;
      for (const DepthOfFieldParams& p : Shapes(1, aperture, 40)) {
        points.push_back(DepthOfField(FromImage(point), FromImage(Constant(window, z)), p));
        greys.push_back(DepthOfField(FromImage(grey), FromImage(rough), p));
      }
      points.push_back(
          DepthOfField(FromImage(point), FromImage(Constant(window, z)), Heart(), {1, aperture, 40}));
      greys.push_back(DepthOfField(FromImage(grey), FromImage(rough), Heart(), {1, aperture, 40}));
      for (size_t i = 0; i < points.size(); ++i) {
        SCOPED_TRACE(i);
        const Image spread = Render(points[i]);
        double sum = 0;
        for (int y = 0; y < 90; ++y) {
          for (int x = 0; x < 90; ++x) sum += spread.at<float>(x, y);
        }
        EXPECT_NEAR(sum, 3, 3e-6);
        ExpectSameBits(Render(greys[i]), grey);
      }
    }
  }
}

// A point of light is a picture of the opening: upright behind the focus, turned by half a turn before it.
TEST(LensLayersTest, PointsOfLightShowTheOpening) {
  const Roi window{0, 0, 41, 41};
  const Image point = Filled(window, 1, [](int x, int y, int) { return x == 20 && y == 20 ? 1.0f : 0.0f; });
  const auto at = [&](float z, const DepthOfFieldParams& p) {
    return Render(DepthOfField(FromImage(point), FromImage(Constant(window, z)), p));
  };
  DepthOfFieldParams p{2, 16, 20};  // radius 8 at 1 and at infinity
  const Image disc = at(1, p);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) {
      const double r = std::hypot(x - 20, y - 20), full = 1 / (64 * std::numbers::pi);
      if (r < 6.8 || r > 9) {
        ASSERT_NEAR(disc.at<float>(x, y), r < 8 ? full : 0, 1e-8) << x << "," << y;
      }
      ASSERT_NEAR(disc.at<float>(x, y), disc.at<float>(40 - x, y), 1e-9);
    }
  }
  p.shape = ApertureShape::kPolygon, p.blades = 3, p.rotation = 90;  // a corner up
  const Image up = at(kInf, p), down = at(1, p);
  EXPECT_GT(up.at<float>(20, 13), 0);
  EXPECT_EQ(up.at<float>(20, 26), 0);
  EXPECT_GT(up.at<float>(15, 23), 0);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) ASSERT_NEAR(up.at<float>(x, y), down.at<float>(40 - x, 40 - y), 1e-9);
  }
  // A picture of 8 x 16 pixels: as large as the disc. Pixels lie half of one off: means of four.
  const Image opening = Filled({0, 0, 8, 16}, 1, [](int x, int y, int) { return static_cast<float>(x + y); });
  for (const float z : {kInf, 1.0f}) {
    const Image out = Render(
        DepthOfField(FromImage(point), FromImage(Constant(window, z)), FromImage(opening), {2, 16, 20}));
    const int sign = z == 1 ? -1 : 1;
    for (int y = -7; y <= 7; ++y) {
      for (int x = -3; x <= 3; ++x) {
        ASSERT_NEAR(out.at<float>(20 + sign * x, 20 + sign * y), (x + 3.5 + y + 7.5) / 1408, 1e-8)
            << x << "," << y;
      }
    }
  }
}

// Depths of every kind side by side, in a window that begins before 0: every method and shape within its
// bound and with the same bits from every tile.
TEST(LensLayersTest, TilesAndThreadsDoNotMatter) {
  const Roi window{-37, -5, 120, 23};
  const Node color = FromImage(testing::Picture(window, 3, PixelType::kFloat, 6));
  std::mt19937 random(3);
  const Image depth = Filled(window, 1, [&](int x, int y, int) {
    if (random() % 50 == 0) return random() % 2 ? kInf : kNaN;
    if (y > 12) return 0.3f + 0.01f * static_cast<float>(x + 40);  // a floor
    return (x / 9 + y / 7) % 3 == 0 ? 0.4f
           : x % 17 == 0            ? 0.2f
                                    : 1.5f + 0.1f * static_cast<float>(random() % 3);
  });
  std::vector<Node> nodes;
  for (DepthOfFieldParams p : Shapes(0.8, 5, 11)) {
    nodes.push_back(DepthOfField(color, FromImage(depth), p));
    p.max_radius = 1.3;
    nodes.push_back(DepthOfField(color, FromImage(depth), p));
  }
  nodes.push_back(DepthOfField(color, FromImage(depth), Heart(), {0.8, 4, 9}));
  for (size_t i = 0; i < nodes.size(); ++i) {
    SCOPED_TRACE(i);
    OnEveryTarget([&] {
      const Image whole = Render(nodes[i]);
      for (const auto& [w, h] : {std::array{1, 7}, {13, 4}, {64, 3}}) {
        ExpectSameBits(
            whole, Render(nodes[i], PixelType::kFloat, {.threads = 2, .tile_width = w, .tile_height = h}));
      }
      const VerifyReport report = Verify(nodes[i], PixelType::kFloat, {.samples = 1, .tile_size = 11});
      EXPECT_TRUE(report.within_bound) << report.Summary();
    });
  }
}

TEST(LensLayersTest, WhatIsNotFiniteStaysWhereItHasWeight) {
  const Roi window{0, 0, 100, 40};
  const Image clean = testing::Picture(window, 2, PixelType::kFloat, 8);
  const Image dirty = Filled(window, 2, [&](int x, int y, int c) {
    if (y != 20 || c != 0) return clean.at<float>(x, y, c);
    return x == 15 ? kNaN : x == 40 ? kInf : x == 70 ? 1e30f : clean.at<float>(x, y, c);
  });
  const Node depth = FromImage(Constant(window, 1));
  OnEveryTarget([&] {
    const Image a = Render(DepthOfField(FromImage(clean), depth, {2, 10, 8}));  // radius 5
    const Image b = Render(DepthOfField(FromImage(dirty), depth, {2, 10, 8}));
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 100; ++x) {
        ASSERT_EQ(a.at<float>(x, y, 1), b.at<float>(x, y, 1));
        const double nan = std::hypot(x - 15, y - 20), inf = std::hypot(x - 40, y - 20);
        if (nan < 4.5) {
          ASSERT_TRUE(std::isnan(b.at<float>(x, y, 0))) << x << "," << y;
        }
        if (inf < 4.5) {
          ASSERT_EQ(b.at<float>(x, y, 0), kInf) << x << "," << y;
        }
        if (nan > 6 && inf > 6 && (x < 64 || y < 14 || y > 26)) {
          ASSERT_EQ(a.at<float>(x, y, 0), b.at<float>(x, y, 0)) << x << "," << y;
        }
      }
    }
  });
}

TEST(LensLayersTest, WrongValuesAreNamed) {
  const Roi window{0, 0, 8, 8};
  const Node c = FromImage(Constant(window, 1)), d = FromImage(Constant(window, 3));
  DepthOfFieldParams p{1, 1, 4};
  p.blades = 2;
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, p); }), HasSubstr("2 blades, expected 3 to 16"));
  p = {1, 1, 4}, p.rotation = kInf;
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, p); }), HasSubstr("rotation of inf"));
  p = {1, 1, 4}, p.shape = ApertureShape::kPicture;
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, p); }), HasSubstr("expected it as the third image"));
  p = {1, 1, 4}, p.method = DepthOfFieldMethod::kGather;
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, c, p); }), HasSubstr("shape for gathering"));
  // A picture that lets no light through is a disc.
  const Node black = FromImage(Constant(window, -1));
  ExpectSameBits(Render(DepthOfField(c, d, black, {1, 2, 4})), Render(DepthOfField(c, d, {1, 2, 4})));
}

DepthOfFieldParams Gathered(double focus, double aperture, double most) {
  return {focus, aperture, most, 0, DepthOfFieldMethod::kGather};
}

TEST(GatheredDepthOfFieldTest, SharpStaysSharpAndEnergyIsKept) {
  // A bright far point on a dark far plane; the left half is in focus.
  const Image color(ImageSpec(64, 33, 4)), depth(ImageSpec(64, 33, 1));
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool far = x >= 24;
      depth.at<float>(x, y) = x == 5 && y == 5 ? kNaN : far ? kInf : 2.0f;
      for (int c = 0; c < 4; ++c)
        color.at<float>(x, y, c) = x == 44 && y == 16 ? 100.0f : far ? 0.25f : 0.75f;
    }
  }
  OnEveryTarget([&] {
    const Image blurred = Render(DepthOfField(FromImage(color), FromImage(depth), Gathered(2, 10, 8)));
    for (int y = 0; y < 33; ++y) {
      for (int x = 0; x < 24; ++x) ASSERT_EQ(blurred.at<float>(x, y, 0), 0.75f) << x << "," << y;
    }
    double energy = 0;
    for (int y = 8; y < 25; ++y) {
      for (int x = 36; x < 53; ++x) energy += blurred.at<float>(x, y, 1) - 0.25;
    }
    EXPECT_NEAR(energy, 99.75, 1.0);
    EXPECT_LT(blurred.at<float>(44, 16, 0), 2.0f);
    EXPECT_EQ(blurred.at<float>(44, 3, 0), 0.25f);
  });
  const Node c = FromImage(color), d = FromImage(depth);
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, {0}); }), HasSubstr("above 0"));
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, {1, 1, 129}); }), HasSubstr("0 to 128"));
  EXPECT_THAT(Refusal([&] { DepthOfField(c, d, {1, 1, 1, 2}); }), HasSubstr("depth channel 2"));
}

// Radii between whole and half pixels reach neighbours in the corners, from every tile.
TEST(GatheredDepthOfFieldTest, DiscsReachAsFarAsTheirRadiusSays) {
  const Roi window{0, 0, 40, 13};
  const Node color = FromImage(testing::Picture(window, 2, PixelType::kFloat, 5));
  const Image depth(ImageSpec(40, 13, 1));
  for (int y = 0; y < 13; ++y) {
    for (int x = 0; x < 40; ++x) depth.at<float>(x, y) = x < 20 ? 1.0f : 2.0f;
  }
  for (const double radius : {0.9, 1.3, 2.4, 5.2}) {
    SCOPED_TRACE(radius);
    const Node blurred = DepthOfField(color, FromImage(depth), Gathered(1e30, 100, radius));
    OnEveryTarget([&] {
      const VerifyReport report = Verify(blurred, PixelType::kFloat, {.samples = 1, .tile_size = 13});
      EXPECT_TRUE(report.within_bound) << report.Summary();
      const Image whole = Render(blurred);
      ExpectSameBits(whole,
                     Render(blurred, PixelType::kFloat, {.threads = 1, .tile_width = 3, .tile_height = 2}));
    });
  }
}

// A small disc in a tile of its own gets the same bits as beside large ones.
TEST(GatheredDepthOfFieldTest, LargerDiscsElsewhereInATileDoNotMatter) {
  const Roi window{0, 0, 60, 9};
  const Node color = FromImage(testing::Picture(window, 3, PixelType::kFloat, 6));
  const Image depth(ImageSpec(60, 9, 1));
  std::mt19937 random(3);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 60; ++x) depth.at<float>(x, y) = 0.5f + 1e-3f * static_cast<float>(random() % 1000);
  }
  const Node blurred = DepthOfField(color, FromImage(depth), Gathered(0.8, 4, 5));
  OnEveryTarget([&] {
    const Image whole = Render(blurred);
    for (const int side : {1, 4, 17}) {
      ExpectSameBits(
          whole, Render(blurred, PixelType::kFloat, {.threads = 1, .tile_width = side, .tile_height = side}));
    }
  });
}

TEST(GatheredDepthOfFieldTest, ThousandsOfNeighboursStayWithinTheBound) {
  const Roi window{0, 0, 96, 96};
  const Node color = FromImage(testing::Picture(window, 2, PixelType::kFloat, 5));
  const Image depth(ImageSpec(96, 96, 1));
  std::mt19937 random(7);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      depth.at<float>(x, y) = std::ldexp(static_cast<float>(random() % 4096 + 1), -12);
    }
  }
  const Node blurred = DepthOfField(color, FromImage(depth), Gathered(0.5, 300, 40));
  OnEveryTarget([&] {
    const VerifyReport report = Verify(blurred, PixelType::kFloat, {.samples = 1, .tile_size = 16});
    EXPECT_TRUE(report.within_bound) << report.Summary();
  });
}

}  // namespace
}  // namespace tessera
