// The lens family: places by the formulas in double, distortion there and back, folds refused, vignettes,
// grain's statistics.
#include "tessera/ops/lens.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/every_target.h"
#include "tessera/error.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::OnEveryTarget;

constexpr int kWidth = 160, kHeight = 100;
const double kUnit = std::hypot(kWidth, kHeight) / 2;

// Its value is linear in the place, so that what was read says where it was read.
Node Places() {
  Image image(ImageSpec(kWidth, kHeight, 3));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.at<float>(x, y, 0) = static_cast<float>(x) / 256;
      image.at<float>(x, y, 1) = static_cast<float>(y) / 256;
      image.at<float>(x, y, 2) = 0.5f;
    }
  }
  return FromImage(image);
}

struct Point {
  double x, y;
};
Point Brown(const LensParams& p, Point v) {
  const double q = v.x * v.x + v.y * v.y, f = 1 + q * (p.k[0] + q * (p.k[1] + q * p.k[2]));
  return {v.x * f + 2 * p.p[0] * v.x * v.y + p.p[1] * (q + 2 * v.x * v.x),
          v.y * f + p.p[0] * (q + 2 * v.y * v.y) + 2 * p.p[1] * v.x * v.y};
}
Point Division(const LensParams& p, Point v) {
  const double f = 1 / (1 + p.k[0] * (v.x * v.x + v.y * v.y));
  return {v.x * f, v.y * f};
}

// Where pixel (x, y) was read, against `from`; pixels that were read beyond the picture aside.
template <typename F>
void ExpectPlaces(const LensParams& p, const F& from, double tolerance) {
  const Node node = Lens(Places(), p);
  OnEveryTarget([&] {
    const Image got = Render(node);
    int seen = 0;
    for (int y = 0; y < kHeight; y += 3) {
      for (int x = 0; x < kWidth; x += 3) {
        const double cx = p.centre[0] * kWidth, cy = p.centre[1] * kHeight;
        const Point at = from(Point{(x + 0.5 - cx) / kUnit, (y + 0.5 - cy) / kUnit});
        const double u = at.x * kUnit + cx - 0.5, v = at.y * kUnit + cy - 0.5;
        if (u < 3 || v < 3 || u > kWidth - 4 || v > kHeight - 4) continue;
        ++seen;
        ASSERT_NEAR(got.at<float>(x, y, 0) * 256, u, tolerance) << x << "," << y;
        ASSERT_NEAR(got.at<float>(x, y, 1) * 256, v, tolerance) << x << "," << y;
      }
    }
    EXPECT_GT(seen, 800);
    EXPECT_TRUE(Verify(node).within_bound);
  });
}

TEST(LensTest, TakenAwayByBrownsFormula) {
  const LensParams p{
      .k = {0.08, -0.01, 0.003}, .p = {0.004, -0.003}, .centre = {0.48, 0.53}, .filter = "triangle"};
  ExpectPlaces(
      p, [&](Point v) { return Brown(p, v); }, 2e-3);
}

TEST(LensTest, AppliedByItsInverse) {
  const LensParams p{.k = {0.08, -0.01}, .p = {0.004, -0.003}, .apply = true, .filter = "triangle"};
  const auto inverse = [&](Point v) {
    Point r = v;
    for (int i = 0; i < 200; ++i) {
      const Point d = Brown(p, r);
      r = {r.x - (d.x - v.x) / 1.5, r.y - (d.y - v.y) / 1.5};
    }
    return r;
  };
  ExpectPlaces(p, inverse, 3e-3);
}

TEST(LensTest, DivisionBothWays) {
  LensParams p{.model = LensModel::kDivision, .k = {-0.1}, .apply = true, .filter = "triangle"};
  ExpectPlaces(
      p, [&](Point v) { return Division(p, v); }, 2e-3);
  p.apply = false;
  ExpectPlaces(
      p,
      [&](Point v) {  // s = 2 r / (1 + sqrt(1 - 4 k r^2))
        const double f = 2 / (1 + std::sqrt(1 - 4 * p.k[0] * (v.x * v.x + v.y * v.y)));
        return Point{v.x * f, v.y * f};
      },
      2e-3);
}

TEST(LensTest, FactorsAreInverses) {
  for (const LensModel model : {LensModel::kBrown, LensModel::kDivision}) {
    LensParams away{.model = model, .k = {-0.07}}, on = away;
    on.apply = true;
    for (double r = 0; r < 1.3; r += 0.1) {
      const double s = r * LensFactor(away, r);
      EXPECT_NEAR(s * LensFactor(on, s), r, 1e-12) << r;
    }
  }
}

TEST(LensTest, WhatFoldsIsRefused) {
  EXPECT_THROW(Lens(Places(), {.k = {-0.5}}), Error);  // r - r^3 / 2 turns at 0.82
  EXPECT_THROW(Lens(Places(), {.k = {-0.5}, .apply = true}), Error);
  // r - 0.15 r^3 turns at 1.49, where it is 0.994: corners have no point of the picture.
  const Image corners = Render(Lens(Places(), {.k = {-0.15}, .apply = true}));
  EXPECT_EQ(corners.at<float>(0, 0, 2), 0);
  EXPECT_NEAR(corners.at<float>(kWidth / 2, kHeight / 2, 2), 0.5, 1e-6);
  EXPECT_THROW(Lens(Places(), {.model = LensModel::kDivision, .k = {1.5}}), Error);
  EXPECT_THROW(Lens(Places(), {.model = LensModel::kDivision, .k = {0.1, 0.1}}), Error);
  EXPECT_THROW(Lens(Places(), {.k = {1000}}), Error);
}

TEST(LensTest, RedAndBlueMoveOutwards) {
  const Node node = Aberration(Places(), {.red = 2, .blue = -3});
  const Image got = Render(node);
  // At the right of the middle row, 70 pixels from the centre: red comes from further inside.
  const double distance = 150.5 - 80;
  EXPECT_NEAR(got.at<float>(150, 50, 0) * 256, 80 + distance / (1 + 2 / kUnit) - 0.5, 2e-3);
  EXPECT_EQ(got.at<float>(150, 50, 1) * 256, 50);
  EXPECT_NEAR(got.at<float>(150, 50, 2), 0.5, 1e-6);
  EXPECT_TRUE(Verify(node).within_bound);
  EXPECT_THROW(Aberration(Places(), {.red = kUnit}), Error);
  EXPECT_THROW(Aberration(FromImage(Image(ImageSpec(4, 4, 2))), {.red = 1}), Error);
}

TEST(LensTest, VignetteIsTheCosinesFourthPower) {
  const Node white = Constant(ImageSpec(kWidth, kHeight, 4), {.color = {1, 1, 1, 1}});
  const Image got = Render(Vignette(white, {.strength = 0.7}));
  const Image back = Render(Vignette(Vignette(white, {.strength = 0.7}), {.strength = 0.7, .remove = true}));
  for (int y = 0; y < kHeight; y += 7) {
    for (int x = 0; x < kWidth; x += 7) {
      const double r = std::hypot(x + 0.5 - kWidth / 2, y + 0.5 - kHeight / 2) / kUnit;
      EXPECT_NEAR(got.at<float>(x, y, 0), std::pow(std::cos(std::atan(std::sqrt(0.7) * r)), 4), 1e-6);
      EXPECT_EQ(got.at<float>(x, y, 3), 1);
      EXPECT_NEAR(back.at<float>(x, y, 1), 1, 1e-6);
    }
  }
}

TEST(LensTest, GrainHasItsDeviation) {
  for (const double size : {0.0, 1.5, 6.0}) {
    for (const double level : {0.5, 0.1, 1.0}) {
      const Node flat = Constant(ImageSpec(512, 512, 3), {.color = {level, level, level}});
      const Image got = Render(Grain(flat, {.strength = 0.05, .size = size, .seed = 3}));
      double sum = 0, squares = 0;
      for (int y = 0; y < 512; ++y) {
        for (int x = 0; x < 512; ++x) {
          const double v = got.at<float>(x, y, 1) - level;
          ASSERT_EQ(got.at<float>(x, y, 0), got.at<float>(x, y, 2));
          sum += v, squares += v * v;
        }
      }
      const double n = 512.0 * 512, want = 0.05 * 4 * level * (1 - level);
      EXPECT_NEAR(std::sqrt(squares / n), want, 0.05 * want + 1e-7) << size << " " << level;
      EXPECT_NEAR(sum / n, 0, 0.03 * want + 1e-7);
    }
  }
  const Node flat = Constant(ImageSpec(32, 32, 3), {.color = {0.5}});
  const Image color = Render(Grain(flat, {.strength = 0.05, .color = true}));
  EXPECT_NE(color.at<float>(5, 5, 0), color.at<float>(5, 5, 1));
}

}  // namespace
}  // namespace tessera
