// Normals transformed and packed, Phong's lighting by formula and by table: doc/maths/environment.md's checks
// and hard cases.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/environments.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/environment.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using namespace test;
constexpr double kPi = std::numbers::pi;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

class LightingTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(Targets, LightingTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

Vector3 At(const Image& image, int x) {
  return {image.at<float>(x, 0, 0), image.at<float>(x, 0, 1), image.at<float>(x, 0, 2)};
}
double Red(const Vector3& n, const PhongParams& p) {
  return At(Render(Phong(FromImage(Vectors({n})), p)), 0)[0];
}

TEST_P(LightingTest, NormalsStayPerpendicularUnderAnyMatrix) {
  // Tangents go with the matrix, normals with its inverse transpose.
  const Matrix4 m = {2, 0.3, 0, 5, 0, 0.5, -1, 6, 0.2, 0, 3, 7, 0, 0, 0, 1};
  NormalsParams p;
  p.matrix = m;
  for (const Vector3& n : RandomDirections(50, 1)) {
    const Vector3 turned = At(Render(TransformNormals(FromImage(Vectors({n})), p)), 0);
    const Vector3 tangent = Cross(n, {0.3, 0.5, 0.7});
    const Vector3 moved = {m[0] * tangent[0] + m[1] * tangent[1] + m[2] * tangent[2],
                           m[4] * tangent[0] + m[5] * tangent[1] + m[6] * tangent[2],
                           m[8] * tangent[0] + m[9] * tangent[1] + m[10] * tangent[2]};
    EXPECT_NEAR(Dot(turned, Normalized(moved)), 0, 1e-6);
    EXPECT_NEAR(Dot(turned, turned), 1, 1e-6);
  }
  p.matrix = Matrix4{1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_THROW(TransformNormals(FromImage(Vectors({{0, 0, 1}})), p), Error);
}

TEST_P(LightingTest, PackingHardCases) {
  NormalsParams pack, unpack;
  pack.pack = true, unpack.unpack = true;
  const Image packed = Render(
      TransformNormals(FromImage(Vectors({{0, 0, 0}, {0, 0, 9}, {1e-40, 0, 0}, {-3e38, 0, 0}})), pack));
  EXPECT_EQ(At(packed, 0), (Vector3{0.5, 0.5, 0.5}));
  EXPECT_EQ(At(packed, 1), (Vector3{0.5, 0.5, 1}));
  EXPECT_EQ(At(packed, 2), (Vector3{1, 0.5, 0.5}));
  EXPECT_EQ(At(packed, 3), (Vector3{0, 0.5, 0.5}));
  EXPECT_EQ(At(Render(TransformNormals(FromImage(Vectors({{0.5, 0.5, 0.5}})), unpack)), 0),
            (Vector3{0, 0, 0}));
  const Image lost =
      Render(TransformNormals(FromImage(Vectors({{kNaN, 0, 1}, {kInf, 0, 0}})), NormalsParams()));
  EXPECT_TRUE(std::isnan(lost.at<float>(0, 0, 0)));
  EXPECT_EQ(lost.at<float>(1, 0, 0), kInf);
  // Reflecting twice at the same normal is the identity: r of r.
  NormalsParams mirror;
  mirror.reflect = {{0.2, 0.3, 1}};
  const Vector3 n = {1, 2, 2}, v = Normalized({0.2, 0.3, 1});
  const Vector3 r = At(Render(TransformNormals(FromImage(Vectors({n})), mirror)), 0);
  EXPECT_NEAR(Dot(r, Normalized(n)), Dot(v, Normalized(n)), 1e-6);
  mirror.reflect = r;
  const Vector3 again = At(Render(TransformNormals(FromImage(Vectors({n})), mirror)), 0);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(again[c], v[c], 1e-6);
}

TEST_P(LightingTest, EveryCoefficientIsItsTerm) {
  const Vector3 n = {0.2, 0.1, 1}, unit = Normalized(n), l = Normalized({1, 1, 2});
  PhongParams p;
  p.light = {1, 1, 2}, p.exponent = 12, p.diffuse = {0, 0, 0};
  EXPECT_EQ(Red(n, p), 0);
  p.emission = {0.25, 0, 0};
  EXPECT_EQ(Red(n, p), 0.25);
  p.ambient = {0.5, 0, 0};
  EXPECT_EQ(Red(n, p), 0.75);
  p.emission = p.ambient = {0, 0, 0};
  p.diffuse = {2, 0, 0};
  EXPECT_NEAR(Red(n, p), 2 * Dot(unit, l), 1e-6);
  p.diffuse = {0, 0, 0}, p.specular = {3, 0, 0};
  const Vector3 s = Normalized({l[0], l[1], l[2] + 1});
  EXPECT_NEAR(Red(n, p), 3 * std::pow(Dot(unit, s), 12), 1e-5);
  p.highlight = Highlight::kReflection;
  EXPECT_NEAR(Red(n, p), 3 * std::pow(2 * unit[2] * Dot(unit, l) - l[2], 12), 1e-5);
}

TEST_P(LightingTest, HighlightHardCases) {
  PhongParams p;
  p.diffuse = {0, 0, 0}, p.specular = {1, 1, 1};
  EXPECT_EQ(Red({0, 0, 1}, p), 1);   // exponent 0
  EXPECT_EQ(Red({0, 0, -1}, p), 0);  // facing away: l.n <= 0
  EXPECT_EQ(Red({1, 0, 0}, p), 0);   // l.n = 0
  p.exponent = 10000;
  EXPECT_EQ(Red({0, 0, 5}, p), 1);
  EXPECT_EQ(Red({1, 0, 1}, p), 0);  // underflows
  p.light = {0, 0, -1};             // l + v = 0
  p.exponent = 1;
  EXPECT_EQ(Red({0, 0, -1}, p), 0);
  for (const Vector3& n : {Vector3{0, 0, 0}, Vector3{kNaN, 0, 1}, Vector3{0, kInf, 0}}) {
    p.emission = {1, 1, 1};
    EXPECT_EQ(Red(n, p), 0);
  }
}

TEST_P(LightingTest, PointLightsAndSpots) {
  const Node n = FromImage(Vectors({{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}));
  const Node at = FromImage(Vectors({{0, 0, 0}, {3, 0, 0}, {0, 0, 4}, {0, kNaN, 0}}));
  PhongParams p;
  p.light = {0, 0, 4}, p.point = true, p.attenuation = {1, 0.5, 0.25};
  Image got = Render(Phong(n, at, p));
  EXPECT_NEAR(got.at<float>(0, 0), 1 / (1 + 2 + 4.0), 1e-6);
  EXPECT_NEAR(got.at<float>(1, 0), 0.8 / (1 + 2.5 + 6.25), 1e-6);
  EXPECT_EQ(got.at<float>(2, 0), 0);  // at the light itself: no direction
  EXPECT_EQ(got.at<float>(3, 0), 0);
  p.attenuation = {0, 0, 0}, p.ambient = {1e-25, 0, 0};
  EXPECT_NEAR(Render(Phong(n, at, p)).at<float>(2, 0), 1e-5, 1e-9);  // the denominator is 1e-20 at least
  p.attenuation = {1, 0, 0}, p.ambient = {0, 0, 0};
  p.spot_direction = {0, 0, -1}, p.spot_cutoff = 30, p.spot_exponent = 3;
  got = Render(Phong(n, at, p));
  EXPECT_NEAR(got.at<float>(0, 0), 1, 1e-6);  // on the axis
  EXPECT_EQ(got.at<float>(1, 0), 0);          // 36.9 degrees
  p.spot_cutoff = 40;
  EXPECT_NEAR(Render(Phong(n, at, p)).at<float>(1, 0), 0.8 * std::pow(0.8, 3), 1e-6);
  // No cone: the cosine alone, SVG's default spot; nothing behind it; exponent 0 is no spot at all.
  p.spot_cutoff = 180, p.spot_exponent = 1;
  EXPECT_NEAR(Render(Phong(n, at, p)).at<float>(1, 0), 0.8 * 0.8, 1e-6);
  p.spot_direction = {0, 0, 1};
  EXPECT_EQ(Render(Phong(n, at, p)).at<float>(1, 0), 0);
  p.spot_exponent = 0;
  EXPECT_NEAR(Render(Phong(n, at, p)).at<float>(1, 0), 0.8, 1e-6);
}

TEST_P(LightingTest, DiffuseLightOverTheSphereIsPi) {
  double sum = 0;
  const int count = 20000;
  // A Fibonacci lattice covers the sphere evenly.
  std::vector<Vector3> n;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z), a = i * kPi * (3 - std::sqrt(5.0));
    n.push_back({r * std::cos(a), r * std::sin(a), z});
  }
  PhongParams p;
  p.light = {1, -2, 0.5};
  const Image got = Render(Phong(FromImage(Vectors(n)), p));
  for (int i = 0; i < count; ++i) sum += got.at<float>(i, 0);
  EXPECT_NEAR(sum / count * 4 * kPi, kPi, 1e-3);
}

// The 1-D table's error is e (e - 1)/(8 (N - 1)^2), and the papers' bits show.
TEST_P(LightingTest, PowerTablesErrAsTheSpecificationSays) {
  const std::vector<Vector3> n = [] {
    std::vector<Vector3> v;
    for (int i = 0; i < 4000; ++i) v.push_back({std::sin(i * 3e-4), 0, std::cos(i * 3e-4)});
    return v;
  }();
  struct Row {
    double exponent;
    int entries;
    double error;
  };
  for (const Row& row : {Row{50, 256, 4.3e-3}, Row{200, 256, 5.3e-2}, Row{200, 1024, 4.3e-3}}) {
    PhongParams p;
    p.diffuse = {0, 0, 0}, p.specular = {1, 1, 1}, p.exponent = row.exponent;
    p.highlight = Highlight::kReflection;
    const Image exact = Render(Phong(FromImage(Vectors(n)), p));
    p.table = row.entries;
    const Image table = Render(Phong(FromImage(Vectors(n)), p));
    double worst = 0;
    for (int i = 0; i < 4000; ++i)
      worst = std::max<double>(worst, std::fabs(exact.at<float>(i, 0) - table.at<float>(i, 0)));
    EXPECT_LE(worst, row.error * 1.3);
    EXPECT_GE(worst, row.error * 0.5);
    if (row.exponent == 50) {
      // Exponent 50 in 8 bits: doc/maths/bump.md counts four codes above one half.
      p.bits = 8;
      const Image coarse = Render(Phong(FromImage(Vectors(n)), p));
      std::vector<float> above;
      for (int i = 0; i < 4000; ++i) {
        if (coarse.at<float>(i, 0) > 0.5f) above.push_back(coarse.at<float>(i, 0));
      }
      std::sort(above.begin(), above.end());
      above.erase(std::unique(above.begin(), above.end()), above.end());
      EXPECT_EQ(above.size(), 4u);
    }
  }
}

// The highlight as a sphere map: doc/maths/environment.md's table of errors by size and exponent, bilinear.
TEST_P(LightingTest, HighlightMapsErrAsTheSpecificationSays) {
  std::vector<Vector3> directions;
  for (const Vector3& d : RandomDirections(60000, 5)) {
    if (Normalized(d)[2] > -0.9) directions.push_back(Normalized(d));
  }
  const Node n = FromImage(Vectors(directions));
  struct Row {
    int size;
    double e10, e50, e200;
  };
  for (const Row& row :
       {Row{64, 0.0097, 0.046, 0.148}, Row{128, 0.0024, 0.012, 0.046}, Row{256, 0.0006, 0.0029, 0.011}}) {
    for (const auto& [exponent, error] : {std::pair{10.0, row.e10}, {50.0, row.e50}, {200.0, row.e200}}) {
      const Vector3 light = {0, 0, 1};
      const Image map = PhongMap(EnvironmentMap::kSphere, row.size, row.size, light, exponent);
      EnvironmentParams p;
      p.map = EnvironmentMap::kSphere;
      p.direction = EnvironmentDirection::kNormal;
      const Image got = Render(Environment(n, FromImage(map), p));
      double worst = 0;
      for (size_t i = 0; i < directions.size(); ++i) {
        const double want = directions[i][2] > 0 ? std::pow(directions[i][2], exponent) : 0;
        worst = std::max(worst, std::fabs(got.at<float>(static_cast<int>(i), 0) - want));
      }
      EXPECT_LE(worst, error * 1.2) << row.size << " " << exponent;
      EXPECT_GE(worst, error * 0.2) << row.size << " " << exponent;
    }
  }
}

TEST_P(LightingTest, APhongTableOfVectorsErrsAsItSays) {
  const Vector3 light = Normalized({1, 1, 2});
  double last = 0;
  for (const int size : {16, 32, 64}) {
    const FunctionTable table = PhongTable(size, light, 10);
    // Four times as exact for twice the entries.
    if (last > 0) {
      EXPECT_NEAR(table.max_error / last, 0.25, 0.08) << size;
    }
    last = table.max_error;
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    std::vector<Vector3> v;
    while (v.size() < 2000) {
      // Normals of length 0.8 to 1 reflect to vectors of length 0.64 to 1.
      const Vector3 n = Normalized({normal(random), normal(random), std::fabs(normal(random))});
      const double length = 0.8 + 0.2 * static_cast<double>(random() >> 8) * 0x1p-24;
      v.push_back({length * n[0], length * n[1], length * n[2]});
    }
    const Node packed = TransformNormals(FromImage(Vectors(v)),
                                         {.reflect = Vector3{0, 0, 1}, .normalize = false, .pack = true});
    const Image got = Render(Lookup(packed, table.table));
    double worst = 0, square = 0;
    for (size_t i = 0; i < v.size(); ++i) {
      const Vector3 n = Normalized(v[i]), r = {2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1};
      const double error =
          std::fabs(got.at<float>(static_cast<int>(i), 0) - std::pow(std::max(Dot(r, light), 0.0), 10));
      worst = std::max(worst, error), square += error * error;
    }
    EXPECT_LE(worst, table.max_error * 1.05) << size;
    EXPECT_GE(worst, table.max_error * 0.2) << size;
    EXPECT_LE(std::sqrt(square / static_cast<double>(v.size())), 1.5 * table.rms_error) << size;
  }
  EXPECT_THAT(Refusal([&] { PhongTable(1, light, 10); }), HasSubstr("found size=1, expected 2 to 512"));
}

TEST(EnvironmentRefusalTest, NamesWhatIsWrong) {
  const Node normals = FromImage(Image(ImageSpec(4, 4, 3))), two = FromImage(Image(ImageSpec(4, 4, 2)));
  const Node map = FromImage(Image(ImageSpec(8, 4, 3)));
  EXPECT_THAT(Refusal([&] { Environment(two, map); }), HasSubstr("envmap"));
  EXPECT_THAT(Refusal([&] {
                Environment(normals, map, [] {
                  EnvironmentParams p;
                  p.map = EnvironmentMap::kCube;
                  return p;
                }());
              }),
              HasSubstr("expected a cube's shape"));
  EXPECT_THAT(Refusal([&] {
                Environment(normals, map, [] {
                  EnvironmentParams p;
                  p.matrix = Matrix4{};
                  return p;
                }());
              }),
              HasSubstr("envmap matrix"));
  EXPECT_THAT(Refusal([&] { Environment(normals, normals, map, {}); }), HasSubstr("without an eye"));
  EXPECT_THAT(Refusal([&] {
                Environment(normals, map, [] {
                  EnvironmentParams p;
                  p.view = {0, 0, 0};
                  return p;
                }());
              }),
              HasSubstr("expected finite numbers, not all 0"));
  EXPECT_THAT(Refusal([&] {
                Environment(normals, map, [] {
                  EnvironmentParams p;
                  p.lobe = -1;
                  return p;
                }());
              }),
              HasSubstr("gloss"));
  EXPECT_THAT(Refusal([&] { ConvertEnvironment(map, {}); }), HasSubstr("found a size of 0x0"));
}

TEST(LightingRefusalTest, NamesWhatIsWrong) {
  const Node n = FromImage(Vectors({{0, 0, 1}}));
  const auto refusal = [&](const PhongParams& p) { return Refusal([&] { Phong(n, p); }); };
  PhongParams p;
  p.point = true;
  EXPECT_THAT(refusal(p), HasSubstr("found a point light without positions"));
  p = {};
  p.exponent = -1;
  EXPECT_THAT(refusal(p), HasSubstr("found exponent=-1"));
  p = {};
  p.bits = 8;
  EXPECT_THAT(refusal(p), HasSubstr("bits without a table"));
  p = {};
  p.light = {0, 0, 0};
  EXPECT_THAT(refusal(p), HasSubstr("not all 0"));
}

}  // namespace
}  // namespace tessera
