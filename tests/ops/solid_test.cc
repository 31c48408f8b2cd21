// Solid textures: doc/maths/solid.md's checks and hard cases on every target.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "support/noise_values.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Values;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class SolidTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, SolidTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

Node Pixels(const std::vector<float>& values, int channels, int height = 1) {
  const Image image(ImageSpec(static_cast<int>(values.size()) / channels / height, height, channels));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return FromImage(image);
}
std::vector<float> Random(size_t n, float low, float high, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> d(low, high);
  std::vector<float> v(n);
  for (float& x : v) x = d(random);
  return v;
}
Node White(size_t count) { return Pixels(std::vector<float>(3 * count, 1.0f), 3); }
// A block of n^3 texels with color(x, y, z) at their centres in [0,1]^3: slices stacked along y.
template <class F>
Node Block(int n, int channels, F color) {
  const Image image(ImageSpec(n, n * n, channels));
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        for (int c = 0; c < channels; ++c) {
          image.at<float>(x, z * n + y, c) = color((x + 0.5f) / n, (y + 0.5f) / n, (z + 0.5f) / n, c);
        }
      }
    }
  }
  return FromImage(image);
}
TableLayout Slices(int n) {
  TableLayout layout;
  layout.slices = {n};
  return layout;
}

TEST_P(SolidTest, CoordinatesAreTheBoxAndRotateAboutItsCentre) {
  SolidParams p;
  p.low = {-1, 2, 10}, p.high = {3, 4, 10};  // flat along z
  EXPECT_EQ(Values(SolidCoordinates(Pixels({0, 3, 77}, 3), p)), (std::vector<float>{0.25f, 0.5f, 0.5f}));
  p.uniform = true;
  EXPECT_EQ(Values(SolidCoordinates(Pixels({0, 3, 10}, 3), p)), (std::vector<float>{0.25f, 0.25f, 0}));
  p = {};
  for (const double degrees : {0.0, 33.0, 90.0, -720.25}) {
    p.rotation = RotationAbout({1, -2, 0.5}, degrees);
    const std::vector<float> centre = Values(SolidCoordinates(Pixels({0.5f, 0.5f, 0.5f}, 3), p));
    for (const float c : centre) EXPECT_FLOAT_EQ(c, 0.5f);
  }
  // There and back again.
  const std::vector<float> points = Random(300, 0, 1, 1);
  p.rotation = RotationAbout({1, -2, 0.5}, 41);
  SolidParams back;
  back.rotation = RotationAbout({1, -2, 0.5}, -41);
  const std::vector<float> again = Values(SolidCoordinates(SolidCoordinates(Pixels(points, 3), p), back));
  for (size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(again[i], points[i], 2e-7);
  p.rotation = {2, 0, 0, 0, 1, 0, 0, 0, 1};
  EXPECT_THROW(SolidCoordinates(White(1), p), Error);
  EXPECT_THROW(SolidCoordinates(FromImage(Image(ImageSpec(2, 2, 1))), {}), Error);
}

TEST_P(SolidTest, HugeCoordinatesKeepTheirDetail) {
  SolidParams p;
  p.low = {1e7, 0, 0}, p.high = {1e7 + 8, 1, 1};
  const std::vector<float> v = Values(SolidCoordinates(Pixels({1e7f + 1, 0, 0, 1e7f + 7, 0, 0}, 3), p));
  EXPECT_EQ(v[0], 0.125f);
  EXPECT_EQ(v[3], 0.875f);
}

TEST_P(SolidTest, ABlockOfItsOwnCoordinatesGivesThePosition) {
  const std::vector<float> points = Random(3000, 1.0f / 16, 15.0f / 16, 2);
  const Node block = Block(8, 3, [](float x, float y, float z, int c) {
    return c == 0 ? x : c == 1 ? y : z;
  });
  SolidParams p;
  p.blend = SolidBlend::kReplace;
  const std::vector<float> v = Values(SolidTexture(White(1000), Pixels(points, 3), block, Slices(8), p));
  for (size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(v[i], points[i], 1e-6);
}

TEST_P(SolidTest, QuarterTurnsPermuteTexels) {
  const Node block = Block(4, 1, [](float x, float y, float z, int) { return x + 10 * y + 100 * z; });
  std::vector<float> centres;
  for (int k = 0; k < 64; ++k)
    centres.insert(centres.end(), {(k % 4 + 0.5f) / 4, (k / 4 % 4 + 0.5f) / 4, (k / 16 + 0.5f) / 4});
  SolidParams p;
  p.blend = SolidBlend::kReplace;
  p.lookup.filter = TableFilter::kNearest;
  p.rotation = RotationAbout({0, 0, 1}, 90);  // (x, y) to (-y, x)
  const std::vector<float> v = Values(SolidTexture(White(64), Pixels(centres, 3), block, Slices(4), p));
  for (size_t k = 0; k < 64; ++k) {
    const float x = centres[3 * k], y = centres[3 * k + 1], z = centres[3 * k + 2];
    EXPECT_EQ(v[3 * k], (1 - y) + 10 * x + 100 * z) << k;
  }
  // Turning the solid and turning the points the other way agree.
  p.lookup.filter = TableFilter::kLinear;
  const std::vector<float> points = Random(300, 0.3f, 0.7f, 3);
  const std::vector<float> turned = Values(SolidTexture(White(100), Pixels(points, 3), block, Slices(4), p));
  SolidParams still = p;
  still.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const Node moved = SolidCoordinates(Pixels(points, 3), p);
  EXPECT_EQ(turned, Values(SolidTexture(White(100), moved, block, Slices(4), still)));
}

TEST_P(SolidTest, BlendModes) {
  const Node table = Block(1, 4, [](float, float, float, int c) { return c == 3 ? 0.5f : 0.25f; });
  const Node color = Pixels({0.5f, 1, 2, 0.75f}, 4), place = Pixels({0.5f, 0.5f, 0.5f}, 3);
  const auto blended = [&](SolidBlend mode) {
    SolidParams p;
    p.blend = mode;
    return Values(SolidTexture(color, place, table, Slices(1), p));
  };
  EXPECT_EQ(blended(SolidBlend::kModulate), (std::vector<float>{0.375f, 0.75f, 1.5f, 0.75f}));
  EXPECT_EQ(blended(SolidBlend::kReplace), (std::vector<float>{0.1875f, 0.1875f, 0.1875f, 0.75f}));
  EXPECT_EQ(blended(SolidBlend::kOver), (std::vector<float>{0.4375f, 0.6875f, 1.1875f, 0.75f}));
  EXPECT_EQ(blended(SolidBlend::kAdd), (std::vector<float>{0.6875f, 1.1875f, 2.1875f, 0.75f}));
}

TEST_P(SolidTest, BackgroundKeepsItsBits) {
  const Node table = Block(2, 3, [](float x, float, float, int) { return x; });
  std::vector<float> place = Random(30, 0, 1, 4);
  const std::vector<float> color = Random(30, -1, 2, 5);
  for (const size_t i : {1, 5, 9}) place[3 * i + i % 3] = kNaN;
  for (const SolidKind kind : {SolidKind::kTable, SolidKind::kMarble, SolidKind::kWood, SolidKind::kNoise,
                               SolidKind::kContours, SolidKind::kHalftone}) {
    for (const bool detail : {false, true}) {
      SolidParams p;
      p.kind = kind, p.level_of_detail = detail, p.blend = SolidBlend::kReplace;
      const Node node = kind == SolidKind::kTable
                            ? SolidTexture(Pixels(color, 3), Pixels(place, 3), table, Slices(2), p)
                            : SolidTexture(Pixels(color, 3), Pixels(place, 3), p);
      const std::vector<float> v = Values(node);
      for (size_t i = 0; i < 30; ++i) {
        EXPECT_TRUE(std::isfinite(v[i])) << static_cast<int>(kind);
        if (i / 3 == 1 || i / 3 == 5 || i / 3 == 9) {
          EXPECT_EQ(v[i], color[i]) << static_cast<int>(kind);
        }
      }
    }
  }
}

TEST_P(SolidTest, EightBitPositionsGiveAtMost256Colours) {
  std::vector<float> exact, coarse;
  for (int i = 0; i < 4000; ++i) {
    const float x = static_cast<float>(i) / 3999;
    exact.insert(exact.end(), {x, 0.5f, 0.5f});
    coarse.insert(coarse.end(), {std::nearbyint(x * 255) / 255, 0.5f, 0.5f});
  }
  const Node block = Block(64, 1, [](float x, float, float, int) { return std::sin(20 * x); });
  SolidParams p;
  p.blend = SolidBlend::kReplace;
  const std::vector<float> a = Values(SolidTexture(White(4000), Pixels(exact, 3), block, Slices(64), p));
  const std::vector<float> b = Values(SolidTexture(White(4000), Pixels(coarse, 3), block, Slices(64), p));
  EXPECT_LE(std::set<float>(b.begin(), b.end()).size(), 256u);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_LE(std::fabs(a[i] - b[i]), 20.0f / 510 + 1e-5f);
}

TEST_P(SolidTest, DetailFinerThanThePixelsFades) {
  // A plane seen from so far that neighbours are a hundred noise cells apart: noise is grey.
  std::vector<float> place;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x)
      place.insert(place.end(), {30.1f * static_cast<float>(x), 30.1f * static_cast<float>(y), 0.3f});
  }
  SolidParams p;
  p.kind = SolidKind::kNoise, p.blend = SolidBlend::kReplace, p.level_of_detail = true;
  const std::vector<float> ones(3 * 1024, 1.0f);
  const std::vector<float> v = Values(SolidTexture(Pixels(ones, 3, 32), Pixels(place, 3, 32), p));
  for (const float x : v) EXPECT_NEAR(x, 0.5f, 1e-4);
  // Near by it is the same as without.
  for (size_t i = 0; i < place.size(); ++i) place[i] = i % 3 < 2 ? 0.3f + 1e-7f * place[i] : 0.3f;
  const std::vector<float> near = Values(SolidTexture(Pixels(ones, 3, 32), Pixels(place, 3, 32), p));
  p.level_of_detail = false;
  const std::vector<float> plain = Values(SolidTexture(Pixels(ones, 3, 32), Pixels(place, 3, 32), p));
  for (size_t i = 0; i < near.size(); ++i) EXPECT_NEAR(near[i], plain[i], 1e-6);
}

TEST_P(SolidTest, ContoursAreWhereTheyShouldBe) {
  std::vector<float> place;
  for (int i = 0; i < 1000; ++i)
    place.insert(place.end(), {0.3f, static_cast<float>(i) / 1000 + 0.00025f, 0.9f});
  SolidParams p;
  p.kind = SolidKind::kContours, p.blend = SolidBlend::kReplace, p.frequency = 5, p.width = 0.2;
  const std::vector<float> v = Values(SolidTexture(White(1000), Pixels(place, 3), p));
  for (size_t i = 0; i < 1000; ++i) {
    const double lines = place[3 * i + 1] * 5, off = std::fabs(lines - std::nearbyint(lines));
    EXPECT_EQ(v[3 * i], off < 0.1 ? 0.0f : 1.0f) << i;
  }
}

TEST_P(SolidTest, HalftoneKeepsTheTone) {
  for (const float tone : {0.1f, 0.37f, 0.8f}) {
    const std::vector<float> place = Random(3 * 40000, 0, 1, 7);
    SolidParams p;
    p.kind = SolidKind::kHalftone, p.blend = SolidBlend::kReplace, p.frequency = 7;
    double sum = 0;
    for (const float x :
         Values(SolidTexture(Pixels(std::vector<float>(3 * 40000, tone), 3), Pixels(place, 3), p)))
      sum += x;
    EXPECT_NEAR(sum / (3 * 40000), tone, 0.01);
  }
}

}  // namespace
}  // namespace tessera
