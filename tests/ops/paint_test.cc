// Brushes of any picture along a path, and the trails they make: where stamps lie, what one leaves, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/pictures.h"
#include "support/refusal.h"
#include "tessera/ops/outline.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing::Picture;

StampPathParams Line() {
  StampPathParams p;
  p.path = {{10, 20}, {10, 60}, {50, 60}};
  p.size = {8, 8};
  p.spacing = 0.5;
  return p;
}

TEST(PaintTest, StampsLieAlongThePath) {
  const std::vector<Stamp> stamps = StampsAlong(Line());
  ASSERT_EQ(stamps.size(), 21u);  // every 4 pixels of 80
  for (size_t k = 0; k < stamps.size(); ++k) {
    const double along = 4.0 * static_cast<double>(k);
    EXPECT_NEAR(stamps[k].x, along <= 40 ? 10 : along - 30, 1e-9);
    EXPECT_NEAR(stamps[k].y, along <= 40 ? 20 + along : 60, 1e-9);
    EXPECT_EQ(stamps[k].angle, 0);
  }
}

TEST(PaintTest, PressureFollowsTheStroke) {
  StampPathParams p = Line();
  p.size = {2, 8}, p.opacity = {0, 1}, p.follow = true, p.rotation = 5;
  const std::vector<Stamp> stamps = StampsAlong(p);
  ASSERT_EQ(stamps.size(), 20u);  // the first has no opacity
  for (size_t i = 0; i < stamps.size(); ++i) {
    const double share = static_cast<double>(i + 1) / 20;
    EXPECT_NEAR(stamps[i].size, 2 + 6 * share, 1e-9);
    EXPECT_NEAR(stamps[i].opacity, share, 1e-9);
    // Down the picture is clockwise of to the right.
    if (share == 0.5) continue;
    EXPECT_NEAR(stamps[i].angle, share < 0.5 ? 5 - 90 : 5, 1e-9);
  }
}

TEST(PaintTest, CurvesGoThroughTheirPoints) {
  StampPathParams p = Line();
  p.smooth = true, p.spacing = 0.01;
  for (const auto& [x, y] : p.path) {
    double nearest = 1e9;
    for (const Stamp& s : StampsAlong(p)) nearest = std::min(nearest, std::hypot(s.x - x, s.y - y));
    EXPECT_LT(nearest, 0.1);
  }
}

TEST(PaintTest, PuffsAreBornGrowAndDrift) {
  StampPathParams p;
  p.path = {{0, 0}, {100, 0}};
  p.size = {20, 10}, p.spacing = 0.5, p.time = 0.6, p.life = 0.4, p.drift = {0, -30};
  const std::vector<Stamp> stamps = StampsAlong(p);
  ASSERT_EQ(stamps.size(), 5u);  // born at .2, .3, .4, .5 and .6 of the path
  for (size_t i = 0; i < stamps.size(); ++i) {
    const double age = 1 - static_cast<double>(i) / 4;
    EXPECT_NEAR(stamps[i].x, 20 + 10 * static_cast<double>(i), 1e-9);
    EXPECT_NEAR(stamps[i].y, -30 * age, 1e-9);
    EXPECT_NEAR(stamps[i].size, 10 + 10 * age, 1e-9);
  }
}

// A stamp's jitter is its own, whichever others are there.
TEST(PaintTest, JitterBelongsToTheStamp) {
  StampPathParams p = Line();
  p.jitter_place = 0.5, p.jitter_rotation = 30, p.jitter_size = 0.5, p.jitter_opacity = 0.5, p.seed = 7;
  const std::vector<Stamp> all = StampsAlong(p);
  bool moved = false;
  for (const Stamp& s : all) {
    EXPECT_TRUE(s.size >= 4 && s.size <= 8 && s.opacity >= 0.5 && s.opacity <= 1 && std::fabs(s.angle) <= 30);
    moved = moved || std::fmod(s.x, 1) != 0;
  }
  EXPECT_TRUE(moved);
  p.time = 0.5;
  const std::vector<Stamp> some = StampsAlong(p);
  ASSERT_LT(some.size(), all.size());
  for (size_t i = 0; i < some.size(); ++i) {
    EXPECT_EQ(some[i].angle, all[i].angle);
    EXPECT_EQ(some[i].x, all[i].x);
  }
  p.seed = 8;
  EXPECT_NE(StampsAlong(p)[3].angle, some[3].angle);
}

// Size of the brush, in the middle of pixels: each takes one pixel of it.
TEST(PaintTest, AStampOfTheBrushsSizeIsTheBrush) {
  const Image base = Picture({0, 0, 40, 30}, 4, PixelType::kFloat, 1),
              brush = Picture({3, 2, 11, 10}, 4, PixelType::kFloat, 2);
  const Image out = Render(Paint(FromImage(base), FromImage(brush), {{20, 14, 8, 0, 0.5}}));
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool under = x >= 16 && x < 24 && y >= 10 && y < 18;
      for (int c = 0; c < 4; ++c) {
        const double b = base.at<float>(x, y, c);
        double right = b;
        if (under) {
          const int u = x - 16 + 3, v = y - 10 + 2;
          right = 0.5 * brush.at<float>(u, v, c) + (1 - 0.5 * brush.at<float>(u, v, 3)) * b;
        }
        ASSERT_NEAR(out.at<float>(x, y, c), right, 1e-6) << x << " " << y << " " << c;
      }
    }
  }
}

// A quarter turn counter-clockwise: what was on the right is above.
TEST(PaintTest, AnglesAreCounterClockwise) {
  Image brush{ImageSpec(9, 9, 1)};
  brush.at<float>(8, 4) = 1;
  const Image base{ImageSpec(9, 9, 3)};
  const Image out = Render(Paint(FromImage(base), FromImage(brush), {{4.5, 4.5, 9, 90, 1}}, {0.25, 0.5, 1}));
  EXPECT_NEAR(out.at<float>(4, 0, 0), 0.25, 1e-6);
  EXPECT_NEAR(out.at<float>(4, 0, 1), 0.5, 1e-6);
  EXPECT_NEAR(out.at<float>(4, 0, 2), 1, 1e-6);
  EXPECT_NEAR(out.at<float>(8, 4, 2), 0, 1e-6);
}

// What a mask leaves of itself is its area, however small the stamp.
TEST(PaintTest, SmallStampsKeepTheirMeanOpacity) {
  Image brush{ImageSpec(64, 64, 1)};
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) brush.at<float>(x, y) = (x / 3 + y / 3) % 2 == 0 ? 1.0f : 0.0f;
  }
  for (const double size : {16.0, 4.0, 1.0, 0.5}) {
    const Image out =
        Render(Paint(FromImage(Image{ImageSpec(40, 40, 1)}), FromImage(brush), {{20, 20, size}}));
    double sum = 0;
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) sum += out.at<float>(x, y);
    }
    EXPECT_NEAR(sum, 0.5 * size * size, 0.06 * size * size) << size;
  }
}

TEST(PaintTest, WithinBound) {
  StampPathParams p = Line();
  p.smooth = true, p.size = {3, 30}, p.opacity = {0.2, 0.9}, p.jitter_rotation = 90, p.jitter_place = 0.4;
  for (const int channels : {1, 3, 4}) {
    const Node base = FromImage(Picture({-4, 5, 66, 72}, channels, PixelType::kFloat, 3));
    const Node brush = FromImage(Picture({1, 1, 38, 22}, channels, PixelType::kFloat, 4));
    const VerifyReport report = Verify(Paint(base, brush, StampsAlong(p)));
    EXPECT_TRUE(report.within_bound) << report.max_error;
  }
}

TEST(PaintTest, Refusals) {
  const Node base = FromImage(Image{ImageSpec(4, 4, 3)}), brush = FromImage(Image{ImageSpec(4, 4, 2)});
  EXPECT_THAT(Refusal([&] { Paint(base, brush, {Stamp{}}); }),
              HasSubstr("expected as many, or a brush of one"));
  const Node mask = FromImage(Image{ImageSpec(4, 4, 1)});
  EXPECT_THAT(Refusal([&] {
                Paint(base, mask, {Stamp{}}, {1, 2});
              }),
              HasSubstr("found a color of 2 numbers"));
  EXPECT_THAT(Refusal([&] { Paint(base, mask, {{.opacity = 2}}); }), HasSubstr("opacity of a stamp 2"));
  StampPathParams p;
  p.path.clear();
  EXPECT_THAT(Refusal([&] { StampsAlong(p); }), HasSubstr("found no points"));
  p.path = {{0, 0}, {1e8, 0}};
  EXPECT_THAT(Refusal([&] { StampsAlong(p); }), HasSubstr("expected at most 100000"));
  p.path = {{0, NAN}};
  EXPECT_THAT(Refusal([&] { StampsAlong(p); }), HasSubstr("a coordinate of path"));
}

}  // namespace
}  // namespace tessera
