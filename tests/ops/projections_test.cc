// Lenses' pictures and the octahedral map: places by their definitions, conversions against formulas of
// directions, seams, edges, rotations, filtering; on every target.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "ops/environment/projection.h"
#include "support/environments.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/environment.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace test;
using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;

class ProjectionsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(Targets, ProjectionsTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

struct Lens {
  Map map;
  double field_of_view;
  double half_width;  // of the picture, in focal lengths, by hand
};
const Lens kLenses[] = {
    {Map::kPerspective, 90, 1},
    {Map::kPerspective, 120, std::sqrt(3.0)},
    {Map::kEquidistant, 180, kPi / 2},
    {Map::kEquidistant, 360, kPi},
    {Map::kEquisolid, 180, std::sqrt(2.0)},
    {Map::kEquisolid, 360, 2},
    {Map::kStereographic, 180, 2},
    {Map::kStereographic, 240, 2 * std::sqrt(3.0)},
    {Map::kOrthographic, 180, 1},
    {Map::kOrthographic, 60, 0.5},
    {Map::kCylinder, 360, kPi},
    {Map::kCylinder, 100, kPi * 5 / 18},
};

// A direction by its angle from +z, and about it from the right, -x, towards +y.
Vector3 Polar(double angle, double about) {
  return {-std::sin(angle) * std::cos(about), std::sin(angle) * std::sin(about), std::cos(angle)};
}
double RadiusOf(Map map, double angle) {
  switch (map) {
    case Map::kPerspective:
      return std::tan(angle);
    case Map::kEquisolid:
      return 2 * std::sin(angle / 2);
    case Map::kStereographic:
      return 2 * std::tan(angle / 2);
    case Map::kOrthographic:
      return std::sin(angle);
    default:
      return angle;
  }
}

TEST(LensPlaces, AreThoseOfTheFormulas) {
  for (const Lens& lens : kLenses) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(lens.map) << " " << lens.field_of_view);
    const int w = 640, h = 400;
    const double focal = w / 2.0 / lens.half_width;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0, 1);
    int seen = 0, missed = 0;
    for (int k = 0; k < 4000; ++k) {
      const double angle = kPi * unit(random), about = 2 * kPi * unit(random),
                   length = std::exp(unit(random));
      Vector3 d = Polar(angle, about);
      double right = RadiusOf(lens.map, angle) * std::cos(about),
             up = RadiusOf(lens.map, angle) * std::sin(about);
      if (lens.map == Map::kCylinder) right = std::atan2(-d[0], d[2]), up = d[1] / std::hypot(d[0], d[2]);
      const bool reach = (lens.map != Map::kPerspective && lens.map != Map::kOrthographic) || angle < kPi / 2;
      const double u = w / 2.0 + focal * right, v = h / 2.0 - focal * up;
      for (double& c : d) c *= length;
      double x, y;
      const bool there = PlaceOf(lens.map, w, h, d, &x, &y, lens.field_of_view);
      ASSERT_EQ(there, reach && u > 0 && u < w && v > 0 && v < h) << u << "," << v;
      ++(there ? seen : missed);
      if (!there) continue;
      ASSERT_NEAR(x, u, 1e-9);
      ASSERT_NEAR(y, v, 1e-9);
      Vector3 back;
      ASSERT_TRUE(DirectionOf(lens.map, w, h, x, y, &back, lens.field_of_view));
      for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(back[c], d[c] / length, 1e-7);
    }
    EXPECT_GT(seen, 100);
    if (lens.field_of_view < 360) {
      EXPECT_GT(missed, 100);
    }
  }
}

TEST(LensPlaces, AtTheAxisBehindItAndBeyondTheReach) {
  double x, y;
  Vector3 d;
  for (const Lens& lens : kLenses) {
    ASSERT_TRUE(PlaceOf(lens.map, 9, 5, {0, 0, 2}, &x, &y, lens.field_of_view));
    EXPECT_EQ(x, 4.5);
    EXPECT_EQ(y, 2.5);
    ASSERT_TRUE(DirectionOf(lens.map, 9, 5, 4.5, 2.5, &d, lens.field_of_view));
    EXPECT_EQ(d, (Vector3{0, 0, 1}));
    // What is half a field of view to the right lies on the right edge.
    const double edge = lens.field_of_view / 360 * kPi;
    if (PlaceOf(lens.map, 9, 5, Polar(edge * (1 - 1e-12), 0), &x, &y, lens.field_of_view))
      EXPECT_NEAR(x, 9, 1e-6);
    // Not a number, straight behind or along the cylinder's axis.
    PlaceOf(lens.map, 9, 5, {0, 0, -1}, &x, &y, lens.field_of_view);
    PlaceOf(lens.map, 9, 5, {0, 1, 0}, &x, &y, lens.field_of_view);
    EXPECT_TRUE(std::isfinite(x) && std::isfinite(y));
  }
  EXPECT_FALSE(PlaceOf(Map::kPerspective, 9, 5, {0, 0, -1}, &x, &y));
  EXPECT_FALSE(PlaceOf(Map::kPerspective, 9, 5, {1, 0, 0}, &x, &y));
  EXPECT_FALSE(PlaceOf(Map::kStereographic, 9, 5, {0, 0, -1}, &x, &y));
  EXPECT_FALSE(PlaceOf(Map::kCylinder, 9, 5, {0, 1, 0}, &x, &y));
  EXPECT_TRUE(PlaceOf(Map::kEquidistant, 9, 9, {0, 0, -1}, &x, &y, 360));
  EXPECT_TRUE(PlaceOf(Map::kEquisolid, 9, 9, {0, 0, -1}, &x, &y, 360));
  // Corners beyond the reach have no direction, those of a perspective picture have.
  EXPECT_FALSE(DirectionOf(Map::kEquidistant, 9, 9, 0.5, 0.5, &d, 360));
  EXPECT_FALSE(DirectionOf(Map::kEquisolid, 9, 9, 0.5, 0.5, &d, 360));
  EXPECT_FALSE(DirectionOf(Map::kOrthographic, 9, 9, 0.5, 0.5, &d, 180));
  EXPECT_TRUE(DirectionOf(Map::kPerspective, 9, 9, 0.5, 0.5, &d));
  EXPECT_TRUE(DirectionOf(Map::kStereographic, 9, 9, 0.5, 0.5, &d, 300));
}

TEST(LensPlaces, FieldsOfViewThatNoPictureHasAreRefused) {
  double x, y;
  const auto refusal = [&](Map map, double degrees) {
    return Refusal([&] { PlaceOf(map, 9, 9, {0, 0, 1}, &x, &y, degrees); });
  };
  EXPECT_THAT(
      refusal(Map::kPerspective, 180),
      HasSubstr("found field_of_view=180, expected more than 0, up to 179.99 degrees of perspective"));
  EXPECT_THAT(refusal(Map::kStereographic, 360), HasSubstr("up to 359.99 degrees"));
  EXPECT_THAT(refusal(Map::kOrthographic, 181), HasSubstr("up to 180 degrees"));
  EXPECT_THAT(refusal(Map::kEquidistant, -1), HasSubstr("more than 0, up to 360"));
  EXPECT_THAT(refusal(Map::kLatLong, 90), HasSubstr("latlong, which shows all directions"));
}

TEST(SolidAngles, OfWholePicturesAreThoseOfWhatTheyShow) {
  const auto sum = [](Map map, int w, int h, double field_of_view) {
    const ops::MapLayout layout = ops::LayoutOf("test", map, w, h, field_of_view);
    double total = 0;
    for (int j = 0; j < h; ++j) {
      for (int i = 0; i < w; ++i) total += ops::TexelSolidAngle(layout, i, j);
    }
    return total;
  };
  EXPECT_NEAR(sum(Map::kOctahedral, 300, 300, 0), 4 * kPi, 1e-3);
  EXPECT_NEAR(sum(Map::kEquidistant, 400, 400, 360), 4 * kPi, 2e-3);
  EXPECT_NEAR(sum(Map::kEquisolid, 400, 400, 360), 4 * kPi, 2e-2);
  EXPECT_NEAR(sum(Map::kPerspective, 300, 300, 90), 4 * kPi / 6, 1e-4);  // a face of a cube
  EXPECT_NEAR(sum(Map::kStereographic, 300, 300, 180), 6.96336, 1e-3);   // by a sum of its own
  EXPECT_NEAR(sum(Map::kOrthographic, 800, 800, 180), 2 * kPi, 0.1);
  // All around, up and down to 45 degrees.
  EXPECT_NEAR(sum(Map::kCylinder, 628, 200, 360), 4 * kPi * std::sin(std::atan(200 / 628.0 * kPi)), 1e-3);
}

double Smooth(const Vector3& d) { return 0.5 + 0.3 * d[0] * d[1] + 0.2 * d[2] - 0.1 * d[1] * d[1] * d[2]; }

TEST_P(ProjectionsTest, ASmoothSphereIsTheFormulaInEveryProjection) {
  const Image sky = MapOf(Map::kLatLong, 512, 256, 1, [](const Vector3& d, int) { return Smooth(d); });
  for (const Lens& lens : kLenses) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(lens.map) << " " << lens.field_of_view);
    EnvironmentConvertParams p;
    p.to = lens.map, p.to_field_of_view = lens.field_of_view, p.width = 61, p.height = 47;
    const Image got = Render(ConvertEnvironment(FromImage(sky), p));
    double worst = 0;
    for (int y = 0; y < 47; ++y) {
      for (int x = 0; x < 61; ++x) {
        const double right = (x + 0.5 - 30.5) / 30.5 * lens.half_width,
                     up = (23.5 - y - 0.5) / 30.5 * lens.half_width, radius = std::hypot(right, up);
        double angle = 0;
        // By bisection of the formula: no inverse of ours.
        double low = 0,
               high = lens.map == Map::kPerspective || lens.map == Map::kOrthographic ? kPi / 2 : kPi;
        for (int k = 0; k < 60; ++k) {
          angle = (low + high) / 2;
          (RadiusOf(lens.map, angle) < radius ? low : high) = angle;
        }
        Vector3 d = Polar(angle, std::atan2(up, right));
        if (lens.map == Map::kCylinder) {
          d = Normalized({-std::sin(right), up, std::cos(right)});
        } else if (RadiusOf(lens.map, angle) < radius - 1e-6) {
          // Part of the pixel may be within reach.
          if (RadiusOf(lens.map, angle) < radius - 3 * lens.half_width / 61)
            EXPECT_EQ(got.at<float>(x, y), 0);
          continue;
        } else if (angle > 0.9 * high) {
          continue;  // a pixel is a large part of a sphere there
        }
        worst = std::max(worst, std::fabs(got.at<float>(x, y) - Smooth(d)));
      }
    }
    EXPECT_LT(worst, lens.map == Map::kStereographic || lens.map == Map::kOrthographic ? 8e-3 : 4e-3);
  }
}

TEST_P(ProjectionsTest, ThereAndBackIsTheSameSphere) {
  const Image sky = MapOf(Map::kLatLong, 256, 128, 1, [](const Vector3& d, int) { return Smooth(d); });
  std::vector<Lens> all(std::begin(kLenses), std::end(kLenses));
  all.push_back({Map::kOctahedral, 0, 0});
  for (const Lens& lens : all) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(lens.map) << " " << lens.field_of_view);
    EnvironmentConvertParams p;
    p.to = lens.map, p.to_field_of_view = lens.field_of_view, p.width = 256, p.height = 256;
    p.rotation = {25, -40, 70};
    const Node there = ConvertEnvironment(FromImage(sky), p);
    std::swap(p.from, p.to), std::swap(p.from_field_of_view, p.to_field_of_view);
    std::swap(p.from_rotation, p.rotation);
    p.height = 128;
    const Image back = Render(ConvertEnvironment(there, p));
    int seen = 0;
    for (int y = 2; y < 126; ++y) {
      for (int x = 0; x < 256; ++x) {
        Vector3 d;
        ASSERT_TRUE(DirectionOf(Map::kLatLong, 256, 128, x + 0.5, y + 0.5, &d));
        // Away from the picture's edges, and from where little is left of a direction.
        const Matrix4 turn = Transposed(ViewRotation({25, -40, 70}));
        const auto v = Transform(turn, d);
        const double angle = std::acos(std::clamp(v[2], -1.0, 1.0));
        if (lens.map != Map::kOctahedral) {
          double u, w;
          if (!PlaceOf(lens.map, 256, 256, {v[0], v[1], v[2]}, &u, &w, lens.field_of_view)) continue;
          if (std::min({u, w, 256 - u, 256 - w}) < 6 || angle > kPi * 0.9) continue;
          if (lens.map == Map::kOrthographic && angle > 1.4) continue;
        }
        ++seen;
        ASSERT_NEAR(back.at<float>(x, y), Smooth(d), 4e-3) << x << "," << y;
      }
    }
    EXPECT_GT(seen, 1000);
  }
}

TEST_P(ProjectionsTest, ViewsTurnRightUpAndClockwise) {
  // What is half way to the right (-x), up (+y), and in front.
  const auto value = [](const Vector3& d, int c) { return d[static_cast<size_t>(c)]; };
  const Node sky = FromImage(MapOf(Map::kLatLong, 256, 128, 3, value));
  const auto middle = [&](const YawPitchRoll& turn, int dx, int dy) {
    EnvironmentConvertParams p;
    p.to = Map::kPerspective, p.width = p.height = 65, p.rotation = turn;
    const Image got = Render(ConvertEnvironment(sky, p));
    return Vector3{got.at<float>(32 + dx, 32 + dy, 0), got.at<float>(32 + dx, 32 + dy, 1),
                   got.at<float>(32 + dx, 32 + dy, 2)};
  };
  const auto expect = [](const Vector3& got, const Vector3& wanted) {
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(got[k], wanted[k], 2e-3);
  };
  const double half = std::sqrt(0.5);
  expect(middle({0, 0, 0}, 0, 0), {0, 0, 1});
  expect(middle({90, 0, 0}, 0, 0), {-1, 0, 0});
  expect(middle({0, 45, 0}, 0, 0), {0, half, half});
  expect(middle({90, 45, 0}, 0, 0), {-half, half, 0});
  expect(middle({180, 0, 123}, 0, 0), {0, 0, -1});
  // Rolled a quarter clockwise: what was on the right, -x, is above.
  const double far = 30 / 32.5, length = std::hypot(1, far);
  expect(middle({0, 0, 90}, 0, -30), {-far / length, 0, 1 / length});
  expect(middle({0, 0, 0}, 30, 0), {-far / length, 0, 1 / length});
  // A whole number of columns.
  EnvironmentConvertParams p;
  p.to = Map::kLatLong, p.width = 256, p.height = 128, p.rotation = {90, 0, 0};
  const Image noise = NoiseMap(256, 128, 1);
  const Image turned = Render(ConvertEnvironment(FromImage(noise), p));
  for (int y = 1; y < 127; ++y) {
    for (int x = 0; x < 256; ++x)
      ASSERT_NEAR(turned.at<float>(x, y), noise.at<float>((x + 64) % 256, y), 1e-4);
  }
  // Where a picture looked and where it is looked at from are each other's inverse.
  p.rotation = p.from_rotation = {33, -21, 150};
  const Image same = Render(ConvertEnvironment(FromImage(noise), p));
  for (int y = 1; y < 127; ++y) {
    for (int x = 0; x < 256; ++x)
      ASSERT_NEAR(same.at<float>(x, y), noise.at<float>(x, y), 1e-4) << x << "," << y;
  }
}

TEST_P(ProjectionsTest, SeamsDoNotShow) {
  // A step of a thousandth across every seam moves noise by little: the octahedral square's folds, a
  // cylinder's ends.
  const Image square = NoiseMap(32, 32, 5), tape = NoiseMap(64, 20, 6);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k < 400; ++k) {
    const double a = unit(random), b = unit(random), hair = 1e-4;
    std::vector<Vector3> pairs = {{hair, a, -std::fabs(b)},
                                  {-hair, a, -std::fabs(b)},
                                  {a, hair, -std::fabs(b)},
                                  {a, -hair, -std::fabs(b)},
                                  {a, b, hair},
                                  {a, b, -hair}};
    const std::vector<float> seen = Seen(square, pairs, Along(Map::kOctahedral));
    const double moved = 32 * 2 * hair * 1.5 / (std::fabs(a) + std::fabs(b) + hair);
    for (size_t i = 0; i < 6; i += 2)
      ASSERT_NEAR(seen[i], seen[i + 1], 4 * moved) << i << " " << a << " " << b;
    EnvironmentParams p = Along(Map::kCylinder);
    p.field_of_view = 360;
    const std::vector<float> ends = Seen(tape, {{hair, a, -1}, {-hair, a, -1}}, p);
    if (std::fabs(a) < 0.9) ASSERT_NEAR(ends[0], ends[1], 4 * 64 * hair);
  }
}

TEST_P(ProjectionsTest, APictureEndsAtItsEdgesAlphaToo) {
  const Image white(ImageSpec(40, 20, 4));
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 4; ++c) white.at<float>(x, y, c) = 1;
    }
  }
  EnvironmentConvertParams p;
  p.from = Map::kPerspective, p.from_field_of_view = 90;
  p.to = Map::kLatLong, p.width = 180, p.height = 90, p.from_rotation = {120, 10, 0};
  const Image got = Render(ConvertEnvironment(FromImage(white), p));
  double covered = 0;
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 180; ++x) {
      const float v = got.at<float>(x, y, 3);
      ASSERT_TRUE(v >= 0 && v <= 1.000001f);
      for (int c = 0; c < 3; ++c) ASSERT_EQ(got.at<float>(x, y, c), v);
      const double latitude = (45 - y - 0.5) / 90 * kPi;
      covered += v * std::cos(latitude) * kPi / 90 * kPi / 90;
    }
  }
  // Its solid angle: 4 atan(a b / sqrt(1 + a^2 + b^2)) of half sides 1 and 1/2.
  EXPECT_NEAR(covered, 4 * std::atan(0.5 / 1.5), 0.01);
}

TEST_P(ProjectionsTest, WhatLiesUnderAPixelIsAveraged) {
  // White noise into fewer pixels: the deviation is that of the mean of as many texels, for every pair whose
  // middle texels have the ratio 8.
  const auto deviation = [](const Image& got) {
    double sum = 0, square = 0, count = 0;
    const int w = got.spec().width(), h = got.spec().height();
    for (int y = h / 2 - 6; y < h / 2 + 6; ++y) {
      for (int x = w / 2 - 6; x < w / 2 + 6; ++x) {
        const double v = got.at<float>(x, y);
        sum += v, square += v * v, ++count;
      }
    }
    return std::sqrt(square / count - sum / count * sum / count);
  };
  for (const Lens& lens : kLenses) {
    if (lens.map == Map::kStereographic && lens.field_of_view > 200) continue;
    SCOPED_TRACE(testing::Message() << static_cast<int>(lens.map) << " " << lens.field_of_view);
    EnvironmentConvertParams p;
    p.from = lens.map, p.from_field_of_view = lens.field_of_view;
    p.to = Map::kPerspective, p.to_field_of_view = 40, p.width = p.height = 40;
    // Texels per focal length in the result's middle and the map's.
    const double result = 20 / std::tan(kPi / 9);
    const int size = static_cast<int>(std::lround(8 * result * 2 * lens.half_width));
    const Image noise = NoiseMap(size, size, 9);
    EXPECT_NEAR(deviation(Render(ConvertEnvironment(FromImage(noise), p))), std::sqrt(1.0 / 12) / 8, 0.008);
  }
}

TEST_P(ProjectionsTest, TheGridsErrorOnASharpTestPattern) {
  // Against sixteen times as many lookups: rings of eight texels a wave, reduced 1 to 4 times.
  const int n = 512;
  const Image rings(ImageSpec(n, n, 1));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      rings.at<float>(x, y) = static_cast<float>(
          0.5 + 0.5 * std::cos(2 * kPi / 8 * std::hypot(x + 0.5 - n / 2.0, y + 0.5 - n / 2.0)));
    }
  }
  for (const int width : {64, 128, 256}) {
    EnvironmentConvertParams p;
    p.from = Map::kEquidistant, p.to = Map::kPerspective, p.to_field_of_view = 100;
    p.width = p.height = width, p.rotation = {20, 10, 5};
    const Image fast = Render(ConvertEnvironment(FromImage(rings), p));
    p.samples = 32;
    const Image dense = Render(ConvertEnvironment(FromImage(rings), p));
    double square = 0, worst = 0;
    for (int y = 0; y < width; ++y) {
      for (int x = 0; x < width; ++x) {
        const double e = std::fabs(fast.at<float>(x, y) - dense.at<float>(x, y));
        square += e * e, worst = std::max(worst, e);
      }
    }
    RecordProperty("rms_" + std::to_string(width), std::to_string(std::sqrt(square / width / width)));
    EXPECT_LT(std::sqrt(square / width / width), 0.008);
    EXPECT_LT(worst, 0.045);
  }
}

TEST_P(ProjectionsTest, ConversionsAreWithinTheirBound) {
  const Image noise = NoiseMap(60, 60, 3);
  const Map all[] = {Map::kLatLong,   Map::kOctahedral,    Map::kPerspective,  Map::kEquidistant,
                     Map::kEquisolid, Map::kStereographic, Map::kOrthographic, Map::kCylinder};
  int n = 0;
  for (const Map from : all) {
    for (const Map to : all) {
      EnvironmentConvertParams p;
      p.from = from, p.to = to, p.width = 23, p.height = 19;
      p.rotation = {37.0 * n, 11.0 * n, 5.0 * n}, p.from_rotation = {0, 7.0 * n, 0}, ++n;
      const VerifyReport report = Verify(ConvertEnvironment(FromImage(noise), p));
      EXPECT_TRUE(report.within_bound)
          << static_cast<int>(from) << " " << static_cast<int>(to) << ": " << report.Summary();
    }
  }
}

// Few and large pixels, whose edges look opposite ways, and a lens that sees little of what lies between.
TEST_P(ProjectionsTest, APixelOfHalfASphereSeesASmallPicture) {
  EnvironmentConvertParams p;
  p.from = Map::kEquidistant, p.to = Map::kDualParabolic, p.width = 3, p.height = 29;
  p.from_field_of_view = 13.2;
  p.matrix = {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1};
  const Node seen = ConvertEnvironment(FromImage(NoiseMap(13, 1, 3)), p);
  const VerifyReport report = Verify(seen);
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_GT(Render(seen).at<float>(0, 14, 0), 0.f);
}

// 1e30 degrees are an angle like others.
TEST_P(ProjectionsTest, LargeAnglesAreTurnsToo) {
  EnvironmentConvertParams p;
  p.from = Map::kLatLong, p.to = Map::kOctahedral, p.width = p.height = 16;
  p.rotation = {-0.8419, 1e30, 1e9}, p.from_rotation = {1e30, 7, -1e15};
  const VerifyReport report = Verify(ConvertEnvironment(FromImage(NoiseMap(20, 10, 3)), p));
  EXPECT_TRUE(report.within_bound) << report.Summary();
}

TEST_P(ProjectionsTest, GlossAndFilteredMirrorsReadThemToo) {
  const auto sky = [](const Vector3& d, int) { return std::max(d[1], 0.0); };
  const Image map = MapOf(Map::kOctahedral, 96, 96, 1, sky);
  EnvironmentParams p = Along(Map::kOctahedral, 10);
  p.table = -1;
  EXPECT_NEAR(Seen(map, {{0, 1, 0}}, p)[0], 11.0 / 12, 4e-3);
  const Image probe = [&] {
    const Image image(ImageSpec(96, 96, 1));
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 96; ++x) {
        Vector3 d;
        if (DirectionOf(Map::kEquidistant, 96, 96, x + 0.5, y + 0.5, &d, 360))
          image.at<float>(x, y) = static_cast<float>(sky(d, 0));
      }
    }
    return image;
  }();
  p.map = Map::kEquidistant, p.field_of_view = 360;
  EXPECT_NEAR(Seen(probe, {{0, 1, 0}}, p)[0], 11.0 / 12, 4e-3);
  p.lobe = 0, p.table = 0, p.filter = EnvironmentFilter::kMip;
  const std::vector<Vector3> row = {{0, 0.1, 1}, {0, 0.12, 1}, {0, 0.14, 1}};
  EXPECT_NEAR(Seen(probe, row, p)[1], 0.12 / std::hypot(1, 0.12), 5e-3);
  const EnvironmentTexture texture(probe, Map::kEquidistant, 0, 0, EnvironmentFilter::kBilinear, 360);
  EnvironmentParams along;
  along.direction = EnvironmentDirection::kNormal;
  EXPECT_NEAR(Render(Environment(FromImage(Vectors({{0, 1, -1}})), texture, along)).at<float>(0, 0),
              std::sqrt(0.5), 1e-2);
}

}  // namespace
}  // namespace tessera
