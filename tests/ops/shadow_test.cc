// Shadows and projected light: doc/maths/shadow.md's checks and hard cases on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "ops/shade/aov_inputs.h"
#include "support/apply.h"
#include "support/noise_values.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/shade.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Values;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

class ShadowTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, ShadowTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

Node Points(const std::vector<float>& xyz) {
  const Image image(ImageSpec(static_cast<int>(xyz.size()) / 3, 1, 3));
  std::memcpy(image.view().data, xyz.data(), xyz.size() * sizeof(float));
  return FromImage(image);
}
// A map of n x n depths m(s, t), t downwards.
Node Map(int n, const std::function<double(double, double)>& m, PixelType type = PixelType::kFloat) {
  const Image image(ImageSpec(n, n, 1));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) image.at<float>(x, y) = static_cast<float>(m((x + 0.5) / n, (y + 0.5) / n));
  }
  return type == PixelType::kFloat ? FromImage(image) : FromImage(Render(FromImage(image), type));
}
// Clip space that makes a position its own (s, t, r): s = x, t = y downwards, r = z.
const Matrix4 kOwn = {2, 0, 0, -1, 0, -2, 0, 1, 0, 0, 2, -1, 0, 0, 0, 1};

float One(const Node& map, const ShadowParams& p, float x, float y, float z) {
  return Values(Shadow(Points({x, y, z}), map, p))[0];
}

TEST_P(ShadowTest, NoAcneOnATiltedPlane) {
  // dr/ds = .3, dr/dt = .1, seen at every place between the texels; map and receiver are the same plane.
  const auto plane = [](double s, double t) { return 0.25 + 0.3 * s + 0.1 * t; };
  constexpr int kSide = 397;
  std::vector<float> points;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float s = (x + 0.37f) / kSide, t = (y + 0.61f) / kSide;
      points.insert(points.end(), {s, t, static_cast<float>(plane(s, t))});
    }
  }
  const auto dark = [&](const Node& map, ShadowParams p) {
    p.light = kOwn;
    double sum = 0;
    for (const float v : Values(Shadow(Points(points), map, p))) sum += 1 - v;
    return sum / (kSide * kSide);
  };
  for (const int n : {64, 256}) {
    const Node exact = Map(n, plane), coarse = Map(n, plane, PixelType::kUint8);
    ShadowParams none, slope;
    none.bias = 0;
    slope.bias = (0.3 + 0.1) / 2 / n * (1 + 1e-5);
    EXPECT_NEAR(dark(exact, none), 0.5, 0.02) << n;
    EXPECT_EQ(dark(exact, slope), 0) << n;
    EXPECT_GT(dark(coarse, slope), 0.02) << n;  // the map's own steps remain
    slope.bias += 1.0 / 255;
    EXPECT_EQ(dark(coarse, slope), 0) << n;
    // Chosen from the map.
    for (const Node& map : {exact, coarse}) {
      EXPECT_EQ(dark(map, {}), 0) << n;
      for (const int size : {3, 4, 5}) {
        ShadowParams box;
        box.size = size;
        EXPECT_LT(dark(map, box), 1e-4) << n << " " << size;
      }
      ShadowParams bilinear;
      bilinear.filter = ShadowFilter::kBilinear;
      EXPECT_LT(dark(map, bilinear), 1e-4) << n;
    }
  }
}

TEST_P(ShadowTest, AutomaticBiasDoesNotDetachShadows) {
  // An occluder 0.02 above the floor still shadows it.
  const Node map = Map(256, [](double s, double) { return s < 0.5 ? 0.48 : 0.5; });
  ShadowParams p;
  p.light = kOwn, p.size = 3;
  EXPECT_EQ(One(map, p, 0.3f, 0.5f, 0.5f), 0);
  EXPECT_EQ(One(map, p, 0.7f, 0.5f, 0.5f), 1);
}

// Narrow bars above a floor, level and tilted: what is under them stays dark, however few texels they are
// wide.
TEST_P(ShadowTest, BarsOfAFewTexelsDoNotLeak) {
  constexpr int kSide = 64;
  for (const double tilt : {0.0, 0.15}) {
    for (const int wide : {1, 2, 3, 4, 6, 9}) {
      const Node map = Map(kSide, [&](double s, double t) {
        const int x = static_cast<int>(s * kSide) - 30;
        return (x >= 0 && x < wide ? 0.3 : 0.6) + tilt * (s + 0.5 * t - 0.75);
      });
      for (const int size : {1, 3, 5}) {
        ShadowParams p;
        p.light = kOwn, p.size = size;
        // Where all taps are on the bar.
        for (int x = 30 + size / 2; x < 30 + wide - size / 2; ++x) {
          const float s = (static_cast<float>(x) + 0.5f) / kSide;
          EXPECT_EQ(One(map, p, s, 0.5f, static_cast<float>(0.6 + tilt * (s + 0.25 - 0.75))), 0)
              << wide << " wide, size " << size << ", tilt " << tilt << ", column " << x;
        }
      }
    }
  }
}

TEST_P(ShadowTest, WeightsAreExactlyKOverN) {
  // Left half occluded: a 3x3 box slides over the edge.
  const Node map = Map(64, [](double s, double) { return s < 0.5 ? 0.2 : 1.0; });
  for (const int n : {2, 3, 5, 8}) {
    ShadowParams p;
    p.light = kOwn, p.bias = 0, p.size = n;
    for (int k = -4; k <= 4; ++k) {
      const float s = (32 + k + (n % 2 == 1 ? 0.5f : 0.0f)) / 64;
      const int first = 32 + k - n / 2, lit = std::min(std::max(first + n - 32, 0), n);
      EXPECT_EQ(One(map, p, s, 0.5f, 0.6f), static_cast<float>(lit * n) / static_cast<float>(n * n))
          << n << " " << k;
    }
  }
}

TEST_P(ShadowTest, BilinearEqualsNearestAtTexelCentresAndIsAStepOfDepth) {
  std::mt19937 random(5);
  std::vector<float> texels(16 * 16);
  for (float& v : texels) v = std::uniform_real_distribution<float>(0, 0.99f)(random);
  const Node map = Map(
      16, [&](double s, double t) { return texels[static_cast<size_t>(int(t * 16) * 16 + int(s * 16))]; });
  std::vector<float> points;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) points.insert(points.end(), {(x + 0.5f) / 16, (y + 0.5f) / 16, 0.5f});
  }
  ShadowParams nearest, bilinear;
  nearest.light = bilinear.light = kOwn;
  nearest.bias = bilinear.bias = 0;
  bilinear.filter = ShadowFilter::kBilinear;
  EXPECT_EQ(Values(Shadow(Points(points), map, nearest)), Values(Shadow(Points(points), map, bilinear)));
  const Node flat = Map(8, [](double, double) { return 0.5; });
  EXPECT_EQ(One(flat, bilinear, 0.41f, 0.37f, 0.5f), 1);  // r == m: lit
  EXPECT_EQ(One(flat, bilinear, 0.41f, 0.37f, std::nextafter(0.5f, 1.0f)), 0);
}

TEST_P(ShadowTest, DarkerMapsMultiplyAndBiasOnlyLightens) {
  std::mt19937 random(6);
  const auto noise = [&] { return std::uniform_real_distribution<float>(0, 1)(random); };
  std::vector<float> a(64), b(64), points;
  for (float& v : a) v = noise();
  for (float& v : b) v = noise();
  for (int i = 0; i < 500; ++i) points.insert(points.end(), {noise(), noise(), noise()});
  const auto map = [&](auto f) {
    return Map(8, [&](double s, double t) {
      const auto i = static_cast<size_t>(int(t * 8) * 8 + int(s * 8));
      return f(a[i], b[i]);
    });
  };
  ShadowParams p;
  p.light = kOwn, p.bias = 0.01;
  const auto visible = [&](const Node& m) { return Values(Shadow(Points(points), m, p)); };
  const auto both = visible(map([](float x, float y) { return std::min(x, y); }));
  const auto first = visible(map([](float x, float) { return x; })),
             second = visible(map([](float, float y) { return y; }));
  for (size_t i = 0; i < both.size(); ++i) EXPECT_EQ(both[i], first[i] * second[i]);
  p.bias = 0.05;
  const auto lighter = visible(map([](float x, float) { return x; }));
  for (size_t i = 0; i < both.size(); ++i) EXPECT_GE(lighter[i], first[i]);
}

TEST_P(ShadowTest, HardCases) {
  const Node map = Map(8, [](double s, double) { return s < 0.5 ? 0.25 : double(kNaN); });
  ShadowParams p;
  p.light = kOwn, p.bias = 0;
  EXPECT_EQ(One(map, p, 0.25f, 0.5f, 0.25f), 1);  // the occluder itself
  EXPECT_EQ(One(map, p, 0.25f, 0.5f, 0.5f), 0);
  EXPECT_EQ(One(map, p, 0.25f, 0.5f, -3), 1);    // before the near plane
  EXPECT_EQ(One(map, p, 0.25f, 0.5f, 1.5f), 1);  // beyond the far plane
  EXPECT_EQ(One(map, p, 0.75f, 0.5f, 0.5f), 1);  // the map is NaN there
  EXPECT_EQ(One(map, p, kNaN, 0.5f, 0.5f), 1);
  EXPECT_EQ(One(map, p, -0.5f, 0.5f, 0.5f), 1);  // beside the map
  EXPECT_EQ(One(map, p, 1e30f, 0.5f, 0.5f), 1);
  EXPECT_EQ(One(map, p, kInf, 0.5f, 0.5f), 1);
  p.dark_outside = true;
  EXPECT_EQ(One(map, p, -0.5f, 0.5f, 0.5f), 0);
  p.size = 3;
  EXPECT_EQ(One(map, p, -0.01f, 0.5f, 0.1f), 1.0f / 3);  // one of three columns is inside
  p = {};
  p.bias = 0;
  p.light = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -0.2, 0, 0, -1, 0};  // looks down -z
  EXPECT_EQ(One(map, p, 0, 0, 2), 0);                               // behind the light
  EXPECT_EQ(One(map, p, 0, 0, 0), 0);                               // w = 0
  EXPECT_EQ(One(Map(1, [](double, double) { return 0.5; }), {kOwn, 0}, 0.1f, 0.9f, 0.6f), 0);
  Matrix4 singular = kOwn;
  singular[10] = singular[11] = 0;
  EXPECT_THROW(Shadow(Points({0, 0, 0}), map, {singular, 0}), Error);
  EXPECT_THROW(Shadow(map, map, {kIdentity4, 0}), Error);  // no positions: one channel
}

// Positions of 1e7 with details of 1e-3: what the floats hold is judged exactly.
TEST_P(ShadowTest, HugePositionsAreJudgedAsStored) {
  const Camera light = Camera::Parallel({1e7, 100, 2e6}, {1e7, 0, 2e6}, {0, 0, -1}, 40, 1, 1, 200);
  const Node map = Map(64, [](double, double) { return 0.5; });
  ShadowParams p;
  p.light = light.world_to_clip(), p.bias = 0;
  std::vector<float> points;
  std::vector<float> expected;
  // r = 1/2 lies 100.5 below the eye, at y = -0.5.
  for (int i = -50; i <= 50; ++i) {
    const float y = -0.5f + 1e-3f * static_cast<float>(i) + 1e-4f;
    points.insert(points.end(), {1e7f + static_cast<float>(i % 7), y, 2e6f + static_cast<float>(i % 5)});
    expected.push_back(y >= -0.5f ? 1.0f : 0.0f);
  }
  EXPECT_EQ(Values(Shadow(Points(points), map, p)), expected);
}

TEST_P(ShadowTest, SquareOccluderCastsItsShadowWithinATexel) {
  constexpr int kSize = 256;
  // A square of [-1,1]^2 at height 1 under a light at height 4: on the floor its shadow is 4/3 as large.
  const Camera light = Camera::Perspective({0, 4, 0}, {0, 0, 0}, {0, 0, -1}, 90, 1, 0.5, 8);
  const Roi window{0, 0, kSize, kSize};
  const Image depths(ImageSpec(kSize, kSize, 1));
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Camera::Ray ray = light.PixelRay(window, x, y);
      const double square = (1 - ray.origin[1]) / ray.direction[1], floor = -ray.origin[1] / ray.direction[1];
      const double px = ray.origin[0] + square * ray.direction[0],
                   pz = ray.origin[2] + square * ray.direction[2];
      const double t = std::fabs(px) <= 1 && std::fabs(pz) <= 1 ? square : floor;
      const auto clip = Transform(light.world_to_clip(),
                                  {ray.origin[0] + t * ray.direction[0], ray.origin[1] + t * ray.direction[1],
                                   ray.origin[2] + t * ray.direction[2]});
      depths.at<float>(x, y) = static_cast<float>((clip[2] / clip[3] + 1) / 2);
    }
  }
  ShadowParams p;
  p.light = light.world_to_clip();
  const double texel = 8.0 / kSize;  // on the floor
  for (const double edge : {-4.0 / 3, 4.0 / 3}) {
    const double inside = edge * (1 - texel), outside = edge * (1 + texel);
    EXPECT_EQ(One(FromImage(depths), p, static_cast<float>(inside), 0, 0.3f), 0) << edge;
    EXPECT_EQ(One(FromImage(depths), p, static_cast<float>(outside), 0, 0.3f), 1) << edge;
    EXPECT_EQ(One(FromImage(depths), p, 0.3f, 0, static_cast<float>(inside)), 0) << edge;
    EXPECT_EQ(One(FromImage(depths), p, 0.3f, 0, static_cast<float>(outside)), 1) << edge;
  }
}

TEST_P(ShadowTest, SoftShadowIsTheMeanAndItsPenumbraALine) {
  // Half-plane occluder x < 0 at height 1, light of width 0.5 at height 3, receiver at 0: penumbra 0.5 * 1
  // / 2.
  constexpr int kLights = 64, kSize = 512;
  std::vector<Node> maps;
  std::vector<Matrix4> lights;
  for (int k = 0; k < kLights; ++k) {
    const double x = 0.5 * ((k + 0.5) / kLights - 0.5);
    const Camera light = Camera::Perspective({x, 3, 0}, {x, 0, 0}, {0, 0, -1}, 90, 1, 0.5, 8);
    lights.push_back(light.world_to_clip());
    const double near = 0.5 * (Transform(light.world_to_clip(), {x, 1, 0})[2] / 2 + 1);
    maps.push_back(Map(kSize, [&](double s, double) { return x + (2 * s - 1) * 2 < 0 ? near : 1.0; }));
  }
  std::vector<float> points;
  for (int i = -40; i <= 40; ++i) points.insert(points.end(), {0.005f * static_cast<float>(i), 0, 0});
  const std::vector<float> v = Values(SoftShadow(Points(points), maps, lights, {}));
  for (int i = -40; i <= 40; ++i) {
    const double expected = std::min(std::max(0.005 * i / 0.25 + 0.5, 0.0), 1.0);
    EXPECT_NEAR(v[static_cast<size_t>(i + 40)], expected, 0.06) << i;
  }
  // A light without area is a hard shadow, bit for bit.
  const std::vector<Node> same(5, maps[0]);
  const std::vector<Matrix4> one(5, lights[0]);
  ShadowParams hard;
  hard.light = lights[0];
  EXPECT_EQ(Values(SoftShadow(Points(points), same, one, {})), Values(Shadow(Points(points), maps[0], hard)));
}

// Shares of nine are not halves: float positions give float shadows, half ones half.
TEST_P(ShadowTest, ResultsAreOfTheInputsType) {
  ShadowParams p;
  p.light = kOwn, p.size = 3;
  const Node map = Map(8, [](double s, double) { return s < 0.5 ? 0.2 : 0.9; });
  const Node points = Points({0.5f, 0.5f, 0.5f});
  EXPECT_EQ(Shadow(points, map, p).spec().type, PixelType::kFloat);
  const float lit = Values(Shadow(points, map, p))[0];
  EXPECT_TRUE(lit > 0 && lit < 1) << lit;
  EXPECT_NEAR(lit * 9, std::round(lit * 9), 1e-5) << lit;
  const Node half = FromImage(Render(points, PixelType::kHalf));
  EXPECT_EQ(Shadow(half, map, p).spec().type, PixelType::kHalf);
}

// Positions and depths are found by their names.
TEST_P(ShadowTest, AovsAreFoundByName) {
  const Node points = Points({0.25f, 0.5f, 0.5f, 0.75f, 0.5f, 0.5f});
  const Node map = Map(8, [](double s, double) { return s < 0.5 ? 0.2 : 0.9; });
  ImageSpec spec(2, 1, 9);
  spec.channels = {"R", "G", "B", "N.x", "N.y", "N.z", "P.x", "P.y", "P.z"};
  const Image all(spec);
  const std::vector<float> p = Values(points);
  for (int x = 0; x < 2; ++x) {
    for (int c = 0; c < 9; ++c)
      all.at<float>(x, 0, c) = c < 6 ? 9.0f + c : p[static_cast<size_t>(3 * x + c - 6)];
  }
  ShadowParams s;
  s.light = kOwn;
  EXPECT_EQ(Values(Shadow(PositionsOf(FromImage(all)), map, s)), Values(Shadow(points, map, s)));
  EXPECT_EQ(Values(NormalsOf(FromImage(all))), (std::vector<float>{12, 13, 14, 12, 13, 14}));
  EXPECT_EQ(Values(NormalsOf(points)), p);  // X,Y,Z of an image without names of normals
}

// A file of AOVs is a map by its planar depths and its camera; what a single channel holds is said.
TEST_P(ShadowTest, MapsMayHoldDepthsOfAnyKind) {
  for (const Camera& light : {Camera::Perspective({2, 3, 4}, {0, 0, 0}, {0, 1, 0}, 40, 1, 0.5, 30),
                              Camera::Parallel({2, 3, 4}, {0, 0, 0}, {0, 1, 0}, 4, 1, -1, 30)}) {
    constexpr int kSize = 32;
    ImageSpec spec(kSize, kSize, 1);
    light.ToMetadata(spec);
    const Image window(spec), planar(spec), euclidean(spec);
    ImageSpec aovs = spec;
    aovs.channels = {"R", "G", "B", "Z"};
    const Image file(aovs);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit;
    std::vector<float> points;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const auto clip = ClipOfPixel(spec.data_window, x, y);
        const bool hit = x % 7 != 3;
        const double depth = hit ? 3 + 4 * unit(random) : double{kInf};
        const auto p = Transform(light.world_to_clip(), light.PointAt(clip[0], clip[1], hit ? depth : 5));
        window.at<float>(x, y) = hit ? static_cast<float>(0.5 * (p[2] / p[3] + 1)) : 1.0f;
        planar.at<float>(x, y) = file.at<float>(x, y, 3) = static_cast<float>(depth);
        euclidean.at<float>(x, y) = static_cast<float>(depth * light.DistancePerDepth(clip[0], clip[1]));
        // Well before or behind the surface, so that no rounding decides.
        const Vector3 at = light.PointAt(clip[0], clip[1], hit ? depth + (x % 2 != 0 ? 0.25 : -0.25) : 6);
        for (const double v : at) points.push_back(static_cast<float>(v));
      }
    }
    const Node places = Points(points);
    const auto lit = [&](const Image& map, const std::string& words) {
      return Values(testing::Apply({"shadow", words + " bias=0.0001"}, {places, FromImage(map)}));
    };
    const std::vector<float> want = lit(window, "");
    EXPECT_GT(std::count(want.begin(), want.end(), 0.0f), 300);
    EXPECT_GT(std::count(want.begin(), want.end(), 1.0f), 300);
    EXPECT_EQ(lit(file, ""), want);
    EXPECT_EQ(lit(planar, "depth=planar"), want);
    EXPECT_EQ(lit(euclidean, "depth=euclidean"), want);
    EXPECT_EQ(
        Values(testing::Apply({"softshadow", "2 bias=0.0001"}, {places, FromImage(file), FromImage(file)})),
        want);
    // A matrix that says nothing of depths has no planes.
    Matrix4 flat = light.world_to_clip();
    if (!light.perspective()) continue;
    std::string words = "light=";
    for (size_t k = 0; k < 16; ++k)
      words += (k > 0 ? "," : "") + std::to_string(k / 4 == 2 ? (k == 11) : flat[k]);
    EXPECT_THROW(lit(file, words), Error);
  }
}

TEST_P(ShadowTest, SlidesAndSpots) {
  SpotlightParams p;
  p.light = Camera::Perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90, 1, 0.1, 100);
  p.color = {2, 3, 4};
  const Node white = Map(4, [](double, double) { return 1.0; });
  const std::vector<float> v =
      Values(Spotlight(Points({0, 0, -2, 0, 0, 2, 1.9f, 0, -2, 2.5f, 0, -2, kNaN, 0, -1}), p));
  EXPECT_EQ(std::vector<float>(v.begin(), v.begin() + 3), (std::vector<float>{2, 3, 4}));
  EXPECT_EQ(v[3], 0);  // behind
  EXPECT_EQ(v[6], 2);
  EXPECT_EQ(v[9], 0);  // beside the frame
  EXPECT_EQ(v[12], 0);
  EXPECT_EQ(Values(Spotlight(Points({0.1f, 0.2f, -2, 0, 0, 2}), p, white)),
            (std::vector<float>{2, 3, 4, 0, 0, 0}));
  // Beyond its frame a slide is dark, however bright its edge; on the frame's last points it shines.
  EXPECT_EQ(Values(Spotlight(Points({1.99f, 0, -2, 2.01f, 0, -2, 0, -2.01f, -2, 40, 0, -2}), p, white)),
            (std::vector<float>{2, 3, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
  // A slide's left half is on the left.
  const Node half = Map(4, [](double s, double) { return s < 0.5 ? 1.0 : 0.0; });
  const std::vector<float> sides = Values(Spotlight(Points({-1, 0, -2, 1, 0, -2}), p, half));
  EXPECT_EQ(sides[0], 2);
  EXPECT_EQ(sides[3], 0);
  p.attenuation = {0, 0, 1}, p.exponent = 2, p.color = {1, 1, 1};
  EXPECT_NEAR(Values(Spotlight(Points({1, 0, -2}), p))[0], 1 / 5.0 * (4 / 5.0), 1e-7);
  p.attenuation = {0, 0, 0};
  EXPECT_TRUE(std::isfinite(Values(Spotlight(Points({0, 0, -1}), p))[0]));
}

TEST_P(ShadowTest, DiffuseLightFollowsItsFormulaAndIsLimitedNearTheLight) {
  const LightSample light{{0, 2, 0}, {0, -1, 0}, 0.5};
  const Node up = Points({0, 1, 0});
  EXPECT_NEAR(Values(DiffuseLight(Points({0, 0, 0}), up, light))[0], 0.5 / M_PI / 4, 1e-8);
  EXPECT_NEAR(Values(DiffuseLight(Points({2, 0, 0}), up, light))[0], 0.5 / M_PI * 0.5 / 8, 1e-8);
  EXPECT_EQ(Values(DiffuseLight(Points({0, 3, 0}), up, light))[0], 0);
  EXPECT_NEAR(Values(DiffuseLight(Points({0, 1.9999f, 0}), up, light))[0], 1 / M_PI, 1e-6);
  EXPECT_EQ(Values(DiffuseLight(Points({0, 2, 0}), up, light))[0], 0);
}

}  // namespace
}  // namespace tessera
