// What is averaged from environment maps: lobes and their tables, filtered mirrors, conversions, on every
// target.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/environments.h"
#include "support/refusal.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/ops/environment.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace test;
constexpr double kPi = std::numbers::pi;

class EnvironmentTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(Targets, EnvironmentTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST_P(EnvironmentTest, LobesAverageWithPowersOfTheCosine) {
  // Constant 1 stays 1; a sky of L = max(y, 0) has the diffuse average (cos a + 1)^2/... known in closed form
  // at the pole: integral of cos^2 over the hemisphere over pi = 2/3, and for exponent e: (e+1)/(e+2).
  for (const Map map : {Map::kLatLong, Map::kCube, Map::kSphere, Map::kDualParabolic}) {
    int w, h;
    SizeOf(map, 48, &w, &h);
    const Image sky = MapOf(map, w, h, 1, [](const Vector3& d, int) { return std::max(d[1], 0.0); });
    const Image white = MapOf(map, w, h, 1, [](const Vector3&, int) { return 1.0; });
    for (const double e : {1.0, 10.0, 100.0}) {
      EnvironmentParams p = Along(map, e);
      p.table = 24;
      EXPECT_NEAR(Seen(sky, {{0, 1, 0}}, p)[0], (e + 1) / (e + 2), 8e-3) << e;
      EXPECT_NEAR(Seen(white, {{0.3, -2, 1}}, p)[0], 1, 1e-6) << e;
      p.table = -1;
      EXPECT_NEAR(Seen(sky, {{0, 1, 0}}, p)[0], (e + 1) / (e + 2), 4e-3) << e;
    }
    // Diffuse light of half a sky, L = 1 above: (1 + cos of the tilt)/2.
    const Image dome = MapOf(map, w, h, 1, [](const Vector3& d, int) { return d[1] > 0 ? 1.0 : 0.0; });
    for (const double tilt : {0.0, 0.5, 1.5, 2.5}) {
      const Vector3 n = {std::sin(tilt), std::cos(tilt), 0};
      EXPECT_NEAR(Seen(dome, {n}, Along(map, 1))[0], (1 + std::cos(tilt)) / 2, 1e-2) << tilt;
    }
  }
}

TEST_P(EnvironmentTest, LobeTablesStayWithinAPerCentOfTheExactSum) {
  const Image map = NoiseMap(128, 64, 2);
  const std::vector<Vector3> directions = RandomDirections(60, 3);
  for (const double e : {1.0, 7.5, 60.0, 200.0}) {
    EnvironmentParams p = Along(Map::kLatLong, e);
    const std::vector<float> table = Seen(map, directions, p);
    p.table = -1;
    const std::vector<float> exact = Seen(map, directions, p);
    double worst = 0;
    for (size_t i = 0; i < directions.size(); ++i)
      worst = std::max<double>(worst, std::fabs(table[i] - exact[i]));
    EXPECT_LE(worst, 0.01) << e;
  }
  // A lobe narrower than the texels sees the nearest one instead of nothing.
  const Image coarse = NoiseMap(8, 4, 3);
  EnvironmentParams p = Along(Map::kLatLong, 10000);
  p.table = -1;
  for (const float v : Seen(coarse, directions, p)) EXPECT_GT(v, 0);
}

TEST_P(EnvironmentTest, ConversionKeepsDirectionsAndEnergy) {
  // To every projection and back: the value of a smooth map in random directions.
  const auto smooth = [](const Vector3& d, int) { return 0.5 + 0.3 * d[0] * d[1] + 0.2 * d[2]; };
  for (const Map from : {Map::kLatLong, Map::kCube, Map::kSphere, Map::kDualParabolic}) {
    int fw, fh;
    SizeOf(from, 128, &fw, &fh);
    const Image source = MapOf(from, fw, fh, 1, smooth);
    for (const Map to : kMaps) {
      int w, h;
      SizeOf(to, 64, &w, &h);
      EnvironmentConvertParams p;
      p.from = from, p.to = to, p.width = w, p.height = h;
      const Image converted = Render(ConvertEnvironment(FromImage(source), p));
      const std::vector<Vector3> directions = RandomDirections(300, 11);
      const std::vector<float> seen = Seen(converted, directions, Along(to));
      for (size_t i = 0; i < directions.size(); ++i) {
        const Vector3 d = Normalized(directions[i]);
        if ((to == Map::kParabolic && d[2] < 0) ||
            ((to == Map::kSphere || from == Map::kSphere) && d[2] < -0.8))
          continue;
        EXPECT_NEAR(seen[i], smooth(d, 0), 4e-3) << static_cast<int>(from) << " " << static_cast<int>(to);
      }
    }
  }
}

TEST_P(EnvironmentTest, ConversionAveragesWhatLiesUnderAPixel) {
  // White noise reduced 8 times: the variance falls as that of the mean of 64 texels, where one lookup would
  // keep it.
  const Image noise = NoiseMap(512, 256, 4);
  const auto deviation = [&](int samples) {
    EnvironmentConvertParams p;
    p.from = p.to = Map::kLatLong;
    p.width = 64, p.height = 32, p.samples = samples;
    const Image got = Render(ConvertEnvironment(FromImage(noise), p));
    double sum = 0, square = 0, n = 0;
    for (int y = 8; y < 24; ++y) {
      for (int x = 0; x < 64; ++x)
        sum += got.at<float>(x, y), square += double{got.at<float>(x, y)} * got.at<float>(x, y), ++n;
    }
    return std::sqrt(square / n - sum / n * sum / n);
  };
  EXPECT_NEAR(deviation(0), std::sqrt(1.0 / 12) / 8, 0.006);
  EXPECT_GT(deviation(1), 0.1);
}

// Normals of a sphere that fills a picture of n x n pixels, 0 outside.
Image Ball(int n, double radius = 1) {
  const Image image(ImageSpec(n, n, 3));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const double u = ((2 * x + 1.0) / n - 1) / radius, v = (1 - (2 * y + 1.0) / n) / radius,
                   q = u * u + v * v;
      if (q >= 1) continue;
      const double normal[] = {u, v, std::sqrt(1 - q)};
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(normal[c]);
    }
  }
  return image;
}
EnvironmentParams Filtered(Map map) {
  EnvironmentParams p;
  p.map = map;
  p.filter = EnvironmentFilter::kMip;
  return p;
}

TEST_P(EnvironmentTest, AFilteredMirrorShowsTheMeanOfWhatAPixelSees) {
  // White noise, every texel seen by hundredth parts of a pixel: bilinear lookups are noise, means are calm
  // and right.
  const Image map = NoiseMap(1024, 512, 7);
  const Node normals = FromImage(Ball(24));
  EnvironmentParams sharp;
  const auto deviation = [&](const EnvironmentParams& p) {
    const Image got = Render(Environment(normals, FromImage(map), p));
    double sum = 0, square = 0, count = 0;
    for (int y = 6; y < 18; ++y) {
      for (int x = 6; x < 18; ++x)
        sum += got.at<float>(x, y), square += got.at<float>(x, y) * got.at<float>(x, y), ++count;
    }
    EXPECT_NEAR(sum / count, 0.5, 0.05);
    return std::sqrt(square / count - sum / count * sum / count);
  };
  EXPECT_GT(deviation(sharp), 0.15);
  EXPECT_LT(deviation(Filtered(Map::kLatLong)), 0.03);
}

TEST_P(EnvironmentTest, FilteringLeavesAloneWhatIsSeenFromNear) {
  const Image map = NoiseMap(16, 8, 9);
  const Node normals = FromImage(Ball(150, 1.4));
  EnvironmentParams sharp;
  const Image a = Render(Environment(normals, FromImage(map), sharp));
  const Image b = Render(Environment(normals, FromImage(map), Filtered(Map::kLatLong)));
  for (int y = 0; y < 150; ++y) {
    for (int x = 0; x < 150; ++x) ASSERT_NEAR(a.at<float>(x, y), b.at<float>(x, y), 1e-6f) << x << "," << y;
  }
}

TEST_P(EnvironmentTest, FootprintsAreOneSidedAtObjectsEdges) {
  // Two facets side by side, and a lone pixel: every pixel's own facet is flat, so nothing is averaged.
  Image normals(ImageSpec(9, 3, 3));
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 6; ++x)
      normals.at<float>(x, y, 0) = x < 3 ? 0.5f : -0.5f, normals.at<float>(x, y, 2) = 1;
  }
  normals.at<float>(7, 1, 1) = 0.3f, normals.at<float>(7, 1, 2) = 1;
  for (const Map map : kMaps) {
    SCOPED_TRACE(static_cast<int>(map));
    int w, h;
    SizeOf(map, 64, &w, &h);
    const Node picture = FromImage(NoiseMap(w, h, 3));
    EnvironmentParams sharp;
    sharp.map = map;
    const Image a = Render(Environment(FromImage(normals), picture, sharp));
    const Image b = Render(Environment(FromImage(normals), picture, Filtered(map)));
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 9; ++x) EXPECT_NEAR(a.at<float>(x, y), b.at<float>(x, y), 1e-6f) << x << "," << y;
    }
    // Rising steadily, both sides count; the last pixel before the edge has one.
    Image bent(ImageSpec(40, 1, 3));
    for (int x = 0; x < 20; ++x) {
      bent.at<float>(x, 0, 0) = static_cast<float>(std::sin(0.05 * x)),
                           bent.at<float>(x, 0, 2) = static_cast<float>(std::cos(0.05 * x));
    }
    for (int x = 20; x < 40; ++x) bent.at<float>(x, 0, 1) = 0.5f, bent.at<float>(x, 0, 2) = 1;
    const Image c = Render(Environment(
        FromImage(bent), FromImage(MapOf(map, w, h, 1, [](const Vector3& d, int) { return d[0]; })),
        Filtered(map)));
    // What is behind a single parabolic map is 0, and so averages with it.
    for (int x = 0; x < (map == Map::kParabolic ? 12 : 20); ++x) {
      EXPECT_NEAR(c.at<float>(x, 0), std::sin(0.1 * x), 0.03) << x;
    }
  }
}

TEST_P(EnvironmentTest, FilteredConstantsStayAndATextureShowsTheSame) {
  for (const Map map : kMaps) {
    SCOPED_TRACE(static_cast<int>(map));
    int w, h;
    SizeOf(map, 40, &w, &h);
    const Image grey = MapOf(map, w, h, 1, [](const Vector3&, int) { return 0.7; });
    const Image ball = Ball(20);
    const Image got = Render(Environment(FromImage(ball), FromImage(grey), Filtered(map)));
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 20; ++x) {
        const bool hit = ball.at<float>(x, y, 2) != 0, behind = map == Map::kParabolic && hit;
        // A single parabolic map has nothing behind, which averages reach.
        if (behind) {
          EXPECT_LE(got.at<float>(x, y), 0.7f + 1e-6f);
        } else {
          EXPECT_NEAR(got.at<float>(x, y), hit ? 0.7f : 0.0f, 1e-6f) << x << "," << y;
        }
      }
    }
    const Image noise = NoiseMap(w, h, 5);
    const Image own = Render(Environment(FromImage(ball), FromImage(noise), Filtered(map)));
    const EnvironmentTexture texture(noise, map, 0, 0, EnvironmentFilter::kMip);
    const Image shared = Render(Environment(FromImage(ball), texture));
    EXPECT_EQ(std::memcmp(own.view().data, shared.view().data, 20 * 20 * 4), 0);
  }
  EnvironmentParams p = Filtered(Map::kLatLong);
  p.lobe = 10;
  EXPECT_THAT(Refusal([&] { Environment(FromImage(Ball(4)), FromImage(NoiseMap(8, 4, 1)), p); }),
              ::testing::HasSubstr("filter=mip"));
}

TEST_P(EnvironmentTest, TheWidestFootprintMixesTheMeansOfACubesFaces) {
  // Neighbours that look in opposite directions see the cube of one texel a face. A map that shows the
  // direction itself: a face's mean is m along its axis, found here by adding its directions up.
  double m = 0, weight = 0;
  for (int j = 0; j < 400; ++j) {
    for (int i = 0; i < 400; ++i) {
      const double s = (i + 0.5) / 400, t = (j + 0.5) / 400, r = 1 / std::sqrt(1 + s * s + t * t);
      m += r * r * r * r, weight += r * r * r;
    }
  }
  m /= weight;
  const std::vector<Vector3> directions = RandomDirections(60, 8);
  std::vector<Vector3> normals;
  for (const Vector3& d : directions) normals.insert(normals.end(), {d, {-d[0], -d[1], -d[2]}, {0, 0, 0}});
  for (const Map map : {Map::kSphere, Map::kDualParabolic, Map::kLatLong, Map::kCube}) {
    SCOPED_TRACE(static_cast<int>(map));
    EnvironmentParams p = Filtered(map);
    p.direction = EnvironmentDirection::kNormal;
    int w, h;
    SizeOf(map, 64, &w, &h);
    const Image picture =
        MapOf(map, w, h, 3, [](const Vector3& d, int c) { return d[static_cast<size_t>(c)]; });
    const Image got = Render(Environment(FromImage(Vectors(normals)), FromImage(picture), p));
    for (size_t i = 0; i < directions.size(); ++i) {
      const Vector3& d = directions[i];
      // From the face's middle to where it meets its neighbours: 0 to 1/2 of their texels.
      size_t major = 0;
      for (size_t k = 1; k < 3; ++k) major = std::fabs(d[k]) > std::fabs(d[major]) ? k : major;
      const size_t a = (major + 1) % 3, b = (major + 2) % 3;
      const double f = std::fabs(d[a] / d[major]) / 2, g = std::fabs(d[b] / d[major]) / 2, corner = f * g / 3;
      double expected[3];
      expected[major] = (1 - f) * (1 - g) + corner, expected[a] = f * (1 - g) + corner;
      expected[b] = (1 - f) * g + corner;
      for (size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(got.at<float>(static_cast<int>(3 * i), 0, static_cast<int>(c)),
                    std::copysign(m * expected[c], d[c]), 0.02)
            << i << "," << c;
      }
    }
  }
}

TEST_P(EnvironmentTest, FootprintsOfAnyWidthAreWithinTheirBound) {
  for (const Map map : kMaps) {
    for (const int n : {1, 2, 5, 18}) {
      int w, h;
      SizeOf(map, n, &w, &h);
      const Node picture = FromImage(NoiseMap(w, h, 6));
      for (const double step : {0.01, 0.1, 0.3, 0.8, 1.7, 3.0}) {
        Image normals(ImageSpec(9, 7, 3));
        for (int y = 0; y < 7; ++y) {
          for (int x = 0; x < 9; ++x) {
            const double along = step * (x + 0.3), up = 0.6 * step * (y - 2.7);
            normals.at<float>(x, y, 0) = static_cast<float>(std::sin(along) * std::cos(up));
            normals.at<float>(x, y, 1) = static_cast<float>(std::sin(up));
            normals.at<float>(x, y, 2) = static_cast<float>(std::cos(along) * std::cos(up));
          }
        }
        EnvironmentParams p = Filtered(map);
        p.direction = EnvironmentDirection::kNormal;
        const VerifyReport report = Verify(Environment(FromImage(normals), picture, p));
        EXPECT_EQ(report.samples, 63);
        EXPECT_TRUE(report.within_bound)
            << static_cast<int>(map) << " " << n << " " << step << ": " << report.Summary();
      }
    }
  }
}

TEST_P(EnvironmentTest, HalfFloatTexelsAreHeldAsSuchWithTheSameResult) {
  const Image map = Render(FromImage(NoiseMap(64, 32, 2)), PixelType::kHalf);
  const Image floats = Render(FromImage(map), PixelType::kFloat);
  std::vector<Vector3> directions = RandomDirections(3000, 4);
  // Next to the poles, whose means are no half floats, too.
  for (int k = 0; k < 300; ++k)
    directions.push_back({1e-3 * k * std::cos(k), k % 2 ? 1.0 : -1.0, 1e-3 * k * std::sin(k)});
  const Node vectors = FromImage(Vectors(directions));
  EnvironmentParams p = Along(Map::kLatLong);
  const Image own = Render(Environment(vectors, FromImage(floats), p), PixelType::kFloat);
  const Image held =
      Render(Environment(vectors, EnvironmentTexture(map, Map::kLatLong), p), PixelType::kFloat);
  EXPECT_EQ(std::memcmp(own.view().data, held.view().data, directions.size() * 4), 0);
}

TEST(LobeTables, AreMadeOnceForAMapAndAgainForAnother) {
  EnvironmentParams p;
  p.lobe = 20;
  const Image ball = Ball(8), map = NoiseMap(32, 16, 3);
  const Image first = Render(Environment(FromImage(ball), FromImage(map), p));
  const size_t entries = Context::Default().Use().entries;
  const Image again = Render(Environment(FromImage(ball), FromImage(map), p));
  EXPECT_EQ(Context::Default().Use().entries, entries);
  EXPECT_EQ(std::memcmp(first.view().data, again.view().data, 8 * 8 * 4), 0);
  map.at<float>(5, 7) += 0.25f;
  const Image other = Render(Environment(FromImage(ball), FromImage(map), p));
  EXPECT_EQ(Context::Default().Use().entries, entries + 1);
  EXPECT_NE(std::memcmp(first.view().data, other.view().data, 8 * 8 * 4), 0);
  // What was kept is what is made.
  Context::Default().Release();
  const Image made = Render(Environment(FromImage(ball), FromImage(map), p));
  EXPECT_EQ(std::memcmp(made.view().data, other.view().data, 8 * 8 * 4), 0);
}

}  // namespace
}  // namespace tessera
