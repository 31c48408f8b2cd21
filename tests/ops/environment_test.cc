// Environment maps: the accuracy row (1/1024 texel, continuity over seams and poles),
// doc/maths/environment.md's checks and hard cases, on every target.
#include "tessera/ops/environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "graph/op.h"
#include "support/environments.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/color.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
using namespace test;

class EnvironmentTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(Targets, EnvironmentTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST(EnvironmentMapTest, DirectionsAndPlacesAreInverse) {
  for (const Map map : kMaps) {
    SCOPED_TRACE(static_cast<int>(map));
    int w, h, checked = 0;
    SizeOf(map, 300, &w, &h);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int k = 0; k < 20000; ++k) {
      const double x = w * unit(random), y = h * unit(random);
      Vector3 d;
      double u, v;
      if (!DirectionOf(map, w, h, x, y, &d)) continue;
      EXPECT_NEAR(Dot(d, d), 1, 1e-14);
      // Places at an edge may come back on the neighbour.
      if (!PlaceOf(map, w, h, d, &u, &v) || std::hypot(u - x, v - y) > w / 3.0) continue;
      ASSERT_NEAR(u, x, 1e-6) << k;
      ASSERT_NEAR(v, y, 1e-6) << k;
      ++checked;
    }
    EXPECT_GT(checked, 15000 * (map == Map::kLatLong || map == Map::kCube ? 1 : kPi / 4 * 0.95));
  }
  double x, y;
  // The conventions, one by one.
  ASSERT_TRUE(PlaceOf(Map::kSphere, 2, 2, {0, 0, 1}, &x, &y));
  EXPECT_EQ(x, 1);
  EXPECT_EQ(y, 1);
  ASSERT_TRUE(PlaceOf(Map::kSphere, 2, 2, {0, 0, -1}, &x, &y));
  EXPECT_EQ(x, 2);
  EXPECT_EQ(y, 1);
  ASSERT_TRUE(PlaceOf(Map::kLatLong, 360, 180, {1, 0, 0}, &x, &y));
  EXPECT_NEAR(x, 90, 1e-12);
  EXPECT_NEAR(y, 90, 1e-12);
  ASSERT_TRUE(PlaceOf(Map::kLatLong, 360, 180, {0, 1, 0}, &x, &y));
  EXPECT_NEAR(y, 0, 1e-12);
  ASSERT_TRUE(PlaceOf(Map::kCube, 6, 1, {1, 0, -0.5}, &x, &y));  // +x: s runs along -z
  EXPECT_NEAR(x, 0.75, 1e-12);
  ASSERT_TRUE(PlaceOf(Map::kCube, 4, 3, {0, 1, 0}, &x, &y));  // a cross has +y above +z
  EXPECT_NEAR(x, 1.5, 1e-12);
  EXPECT_NEAR(y, 0.5, 1e-12);
  ASSERT_TRUE(PlaceOf(Map::kCube, 3, 4, {0, 0, -1}, &x, &y));
  EXPECT_NEAR(x, 1.5, 1e-12);
  EXPECT_NEAR(y, 3.5, 1e-12);
  EXPECT_FALSE(PlaceOf(Map::kParabolic, 2, 2, {0, 0, -1}, &x, &y));
  EXPECT_FALSE(PlaceOf(Map::kLatLong, 2, 2, {0, 0, 0}, &x, &y));
  EXPECT_THAT(Refusal([&] {
                PlaceOf(Map::kCube, 5, 1, {0, 0, 1}, &x, &y);
              }),
              HasSubstr("6:1, 1:6, 4:3 or 3:4"));
}

TEST(EnvironmentMapTest, SphereMapsHaveEqualAreas) {
  double mean[3] = {}, square[3] = {}, count = 0;
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 400; ++x) {
      Vector3 d;
      if (!DirectionOf(Map::kSphere, 400, 400, x + 0.5, y + 0.5, &d)) continue;
      for (size_t k = 0; k < 3; ++k) mean[k] += d[k], square[k] += d[k] * d[k];
      ++count;
    }
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(mean[k] / count, 0, 1e-3);
    EXPECT_NEAR(square[k] / count, 1.0 / 3, 1e-3);
  }
}

// The accuracy row: a map 16,384 texels wide (its fractions alone are looked at), whose texels count columns
// (or rows).
TEST_P(EnvironmentTest, PlacesAreRightWithinA1024thOfATexel) {
  constexpr int kWide = 16384;
  for (const Map map : {Map::kLatLong, Map::kSphere, Map::kCube}) {
    // A strip of a map: tall ones would not fit, and rows are found as columns are.
    const int w = kWide, h = map == Map::kCube ? kWide / 6 : 4, wide = map == Map::kCube ? 6 * h : w;
    const Image columns(ImageSpec(wide, h, 1));
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < wide; ++x) columns.at<float>(x, y) = static_cast<float>(x % 64);
    }
    std::vector<Vector3> directions;
    for (const Vector3& d : RandomDirections(4000, 17)) {
      double x, y;
      const Vector3 exact = {static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2])};
      ASSERT_TRUE(PlaceOf(map, wide, h, exact, &x, &y));
      // Not across the ramp's jumps, an edge, the blend at the rim, or a pole's rows.
      const double in_ramp = std::fmod(x, 64);
      if (in_ramp < 1 || in_ramp > 63 || (map == Map::kCube && std::fmod(x, h) > h - 1)) continue;
      if (map == Map::kSphere && std::hypot(2 * x / wide - 1, 2 * y / h - 1) > 0.49) continue;
      if (map == Map::kLatLong && (y < 0.5 || y > h - 0.5)) continue;
      directions.push_back(exact);
    }
    ASSERT_GT(directions.size(), 500u);
    const std::vector<float> seen = Seen(columns, directions, Along(map));
    double worst = 0;
    for (size_t i = 0; i < directions.size(); ++i) {
      double x, y;
      PlaceOf(map, wide, h, directions[i], &x, &y);
      worst = std::max(worst, std::fabs(seen[i] - (std::fmod(x, 64) - 0.5)));
    }
    EXPECT_LE(worst, 1.0 / 1024) << static_cast<int>(map);
  }
}

// Steps of 1e-5 over seams, edges, corners, the rim and poles change the value of a noise map by no more than
// the steepest slope allows.
TEST_P(EnvironmentTest, SeamsAndPolesAreContinuous) {
  for (const Map map : kMaps) {
    if (map == Map::kParabolic) continue;
    SCOPED_TRACE(static_cast<int>(map));
    int w, h;
    SizeOf(map, 32, &w, &h);
    const Image noise = NoiseMap(w, h, 5);
    const std::vector<Vector3> centres = {
        {0, 1, 0},   {0, -1, 0},  {0, 0, -1},    {0, 0, 1},     {1, 0, 0},    {0, 0.3, -1},
        {1, 1, 1},   {-1, 1, 1},  {1, -1, 1},    {1, 1, -1},    {-1, -1, -1}, {1, 0.2, 1},
        {0.2, 1, 1}, {1, 1, 0.1}, {-1, 0.4, -1}, {0.3, -1, -1}, {0.8, 0.6, 0}};
    constexpr double kStep = 1e-6;
    std::mt19937 random(9);
    std::normal_distribution<double> normal;
    for (const Vector3& centre : centres) {
      std::vector<Vector3> around;
      for (int k = 0; k < 200; ++k) {
        const double length = std::sqrt(Dot(centre, centre));
        around.push_back({centre[0] / length + kStep * normal(random),
                          centre[1] / length + kStep * normal(random),
                          centre[2] / length + kStep * normal(random)});
      }
      const std::vector<float> seen = Seen(noise, around, Along(map));
      const auto [low, high] = std::minmax_element(seen.begin(), seen.end());
      // On a sphere map's rim a texel is narrow: 1e-6 of an angle may pass sqrt-like through it.
      const double steepest = map == Map::kSphere && centre[2] < 0 && centre[0] == 0 ? 4e-3 : 4e-4;
      EXPECT_LE(*high - *low, steepest) << centre[0] << "," << centre[1] << "," << centre[2];
    }
  }
}

TEST_P(EnvironmentTest, ConstantMapsGiveConstantsAndResultsStayInRange) {
  for (const Map map : kMaps) {
    int w, h;
    SizeOf(map, 9, &w, &h);
    const Image flat = MapOf(map, w, h, 1, [](const Vector3&, int) { return 0.3; });
    Image peak = MapOf(map, w, h, 1, [](const Vector3& d, int) { return d[0] > 0.9 ? 1e8 : 0.0; });
    for (const Vector3& d : RandomDirections(500, 1)) {
      const bool behind = map == Map::kParabolic && d[2] < 0;
      EXPECT_NEAR(Seen(flat, {d}, Along(map))[0], behind ? 0 : 0.3, 1e-7);
      const float v = Seen(peak, {d}, Along(map))[0];
      EXPECT_GE(v, 0);
      EXPECT_LE(v, 1e8f);
      break;
    }
    for (const float v : Seen(peak, RandomDirections(2000, 2), Along(map))) {
      EXPECT_GE(v, 0);
      EXPECT_LE(v, 1e8f);
    }
  }
}

// A map of its own directions shows (r + 1)/2, and the error falls with the square of the size.
TEST_P(EnvironmentTest, DirectionsComeBack) {
  for (const Map map : {Map::kSphere, Map::kDualParabolic, Map::kLatLong, Map::kCube}) {
    double worst[2] = {};
    for (int k = 0; k < 2; ++k) {
      int w, h;
      SizeOf(map, 64 << k, &w, &h);
      const Image own =
          MapOf(map, w, h, 3, [](const Vector3& d, int c) { return (d[static_cast<size_t>(c)] + 1) / 2; });
      const std::vector<Vector3> directions = RandomDirections(5000, 4);
      const Image got = Render(Environment(FromImage(Vectors(directions)), FromImage(own), Along(map)));
      for (size_t i = 0; i < directions.size(); ++i) {
        const Vector3 d = Normalized(directions[i]);
        if (map == Map::kSphere && d[2] < -0.8) continue;
        for (size_t c = 0; c < 3; ++c) {
          const double error =
              std::fabs(got.at<float>(static_cast<int>(i), 0, static_cast<int>(c)) - (d[c] + 1) / 2);
          worst[k] = std::max(worst[k], error);
        }
      }
    }
    EXPECT_LE(worst[1], map == Map::kCube ? 1e-2 : 2e-3) << static_cast<int>(map);
    EXPECT_LE(worst[1], worst[0] * (map == Map::kCube ? 0.6 : 0.5)) << static_cast<int>(map);
  }
}

TEST_P(EnvironmentTest, MirrorsReflect) {
  // r = u - 2 (n.u) n; a surface facing the viewer shows the map's centre; r.n = v.n.
  const Image own =
      MapOf(Map::kLatLong, 512, 256, 3, [](const Vector3& d, int c) { return d[static_cast<size_t>(c)]; });
  std::vector<Vector3> normals = RandomDirections(300, 6), positions = RandomDirections(300, 7);
  normals[0] = {0, 0, 2};
  EnvironmentParams p;
  const Image plain = Render(Environment(FromImage(Vectors(normals)), FromImage(own), p));
  p.eye = {{0.5, -1, 2}};
  const Image seen =
      Render(Environment(FromImage(Vectors(normals)), FromImage(Vectors(positions)), FromImage(own), p));
  EXPECT_NEAR(plain.at<float>(0, 0, 2), 1, 1e-3);
  for (int i = 0; i < 300; ++i) {
    const Vector3 n = Normalized(normals[static_cast<size_t>(i)]);
    for (const bool with_eye : {false, true}) {
      const Vector3 at = positions[static_cast<size_t>(i)];
      const Vector3 v = with_eye ? Normalized({0.5 - at[0], -1 - at[1], 2 - at[2]}) : Vector3{0, 0, 1};
      for (size_t c = 0; c < 3; ++c) {
        const double want = 2 * Dot(n, v) * n[c] - v[c];
        EXPECT_NEAR((with_eye ? seen : plain).at<float>(i, 0, static_cast<int>(c)), want, 3e-3);
      }
    }
  }
  // A camera's rays: the same as positions on them.
  const Camera camera = Camera::Perspective({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, 1.5);
  const ImageSpec spec(30, 20, 3);
  const Image n(spec), at(spec);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) {
      const Camera::Ray ray = camera.PixelRay(spec.display_window, x, y);
      for (int c = 0; c < 3; ++c) {
        n.at<float>(x, y, c) =
            static_cast<float>(normals[static_cast<size_t>(x + y)][static_cast<size_t>(c)]);
        at.at<float>(x, y, c) = static_cast<float>(ray.origin[static_cast<size_t>(c)] +
                                                   3 * ray.direction[static_cast<size_t>(c)]);
      }
    }
  }
  EnvironmentParams rays;
  rays.camera = camera;
  const Image by_ray = Render(Environment(FromImage(n), FromImage(own), rays));
  const Image by_position = Render(Environment(FromImage(n), FromImage(at), FromImage(own), rays));
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) EXPECT_NEAR(by_ray.at<float>(x, y), by_position.at<float>(x, y), 1e-4);
  }
}

TEST_P(EnvironmentTest, ASphereMapAgainstTheComposedLookup) {
  // Orthographic viewer, unit normals facing it: s = n_x/2 + 1/2, t = n_y/2 + 1/2, by matrix and lookup.
  std::vector<Vector3> normals;
  for (const Vector3& d : RandomDirections(2000, 8)) {
    const Vector3 n = Normalized({d[0], d[1], std::fabs(d[2])});
    if (n[2] > 0.3) normals.push_back(n);
  }
  const Image map = NoiseMap(64, 64, 3), n = Vectors(normals);
  const Node st = ColorMatrix(FromImage(n), {.values = {0.5, 0, 0, 0, -0.5, 0, 0, 0, 1, 0.5, 0.5, 0}});
  const Image composed = Render(Lookup(st, FromImage(map), {.dims = 2}));
  EnvironmentParams p;
  p.map = Map::kSphere;
  const Image direct = Render(Environment(FromImage(n), FromImage(map), p));
  for (size_t i = 0; i < normals.size(); ++i) {
    EXPECT_NEAR(direct.at<float>(static_cast<int>(i), 0), composed.at<float>(static_cast<int>(i), 0), 2e-5);
  }
}

TEST_P(EnvironmentTest, BackgroundsAreZeroAndNothingSpreads) {
  Image map = MapOf(Map::kLatLong, 16, 8, 4, [](const Vector3&, int) { return 2.0; });
  const std::vector<Vector3> normals = {{0, 0, 0},    {kNaN, 0, 1},      {0, kInf, 0},   {0, 0, 1e-40},
                                        {3e38, 0, 1}, {1e-45, 1e-45, 0}, {0, 0, -3.4e38}};
  for (const Map kind : {Map::kLatLong, Map::kSphere}) {
    EnvironmentParams p;
    p.map = kind;
    p.fresnel = 0.5;
    const Image got = Render(Environment(FromImage(Vectors(normals)), FromImage(map), p));
    for (int i = 0; i < 7; ++i) {
      if (i < 3) {
        for (int c = 0; c < 4; ++c) EXPECT_EQ(got.at<float>(i, 0, c), 0) << i;
      } else {
        const float expected_fresnel = i == 3 || i == 6 ? 0.5f : 1.0f;
        if (kind == Map::kLatLong) {
          EXPECT_FLOAT_EQ(got.at<float>(i, 0, 0), 2 * expected_fresnel) << i;
          EXPECT_FLOAT_EQ(got.at<float>(i, 0, 3), 2) << i;  // alpha is the map's
        }
        EXPECT_TRUE(std::isfinite(got.at<float>(i, 0, 0)));
      }
    }
  }
  // A NaN texel is seen only where it has weight.
  map.at<float>(3, 3) = kNaN;
  Vector3 there, beside, far;
  ASSERT_TRUE(DirectionOf(Map::kLatLong, 16, 8, 3.5, 3.5, &there));
  ASSERT_TRUE(DirectionOf(Map::kLatLong, 16, 8, 4.2, 3.5, &beside));
  ASSERT_TRUE(DirectionOf(Map::kLatLong, 16, 8, 9.5, 3.5, &far));
  const std::vector<float> seen = Seen(map, {there, beside, far}, Along(Map::kLatLong));
  EXPECT_TRUE(std::isnan(seen[0]));
  EXPECT_TRUE(std::isnan(seen[1]));
  EXPECT_EQ(seen[2], 2.0f);
  // Averages leave it out.
  EXPECT_NEAR(Seen(map, {there}, Along(Map::kLatLong, 3))[0], 2, 1e-6);
}

TEST_P(EnvironmentTest, FresnelIsSchlicks) {
  const Image map = MapOf(Map::kLatLong, 8, 4, 1, [](const Vector3&, int) { return 1.0; });
  for (const double degrees : {0.0, 30.0, 60.0, 85.0}) {
    EnvironmentParams p;
    p.fresnel = 0.04;
    const double c = std::cos(degrees * kPi / 180), s = std::sin(degrees * kPi / 180);
    for (const double side : {1.0, -1.0}) {  // from behind as from the front
      p.view = {0, 0, 3};
      const Image got =
          Render(Environment(FromImage(Vectors({{5 * s, 0, side * 5 * c}})), FromImage(map), p));
      EXPECT_NEAR(got.at<float>(0, 0), 0.04 + 0.96 * std::pow(1 - c, 5), 1e-6);
    }
  }
}

TEST_P(EnvironmentTest, AFramebufferOfFewBitsShowsItsSteps) {
  const Image map =
      MapOf(Map::kSphere, 256, 256, 3, [](const Vector3& d, int c) { return d[static_cast<size_t>(c)]; });
  const auto worst = [&](int bits) {
    EnvironmentParams p;
    p.map = Map::kSphere;
    const std::vector<Vector3> normals = [] {
      std::vector<Vector3> v;
      for (const Vector3& d : RandomDirections(3000, 12))
        v.push_back(Normalized({d[0], d[1], 1 + std::fabs(d[2])}));
      return v;
    }();
    const Image exact = Render(Environment(FromImage(Vectors(normals)), FromImage(map), p));
    p.bits = bits;
    const Image got = Render(Environment(FromImage(Vectors(normals)), FromImage(map), p));
    double angle = 0;
    for (int i = 0; i < 3000; ++i) {
      Vector3 across = {};
      for (int c = 0; c < 3; ++c)
        across[static_cast<size_t>(c)] = got.at<float>(i, 0, c) - exact.at<float>(i, 0, c);
      angle = std::max(angle, std::sqrt(Dot(across, across)) * 180 / kPi);
    }
    return angle;
  };
  // doc/maths/environment.md: 8 bits turn reflections by up to 0.74 degrees.
  EXPECT_NEAR(worst(8), 0.68, 0.12);
  EXPECT_NEAR(worst(12), 0.68 / 16, 0.02);
}

}  // namespace
}  // namespace tessera
