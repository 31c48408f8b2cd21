// Fog: doc/maths/fog.md's checks and hard cases on every target, transmittance within its ULPs, the papers'
// tables.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "support/noise_values.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Values;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

class FogTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, FogTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

Node Pixels(const std::vector<float>& values, int channels) {
  const Image image(ImageSpec(static_cast<int>(values.size()) / channels, 1, channels));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return FromImage(image);
}
// White and black over the positions: T is the white's result, 1 - T the black's with white fog.
Node White(size_t count) { return Pixels(std::vector<float>(3 * count, 1.0f), 3); }
Node Black(size_t count) { return Pixels(std::vector<float>(3 * count, 0.0f), 3); }

std::vector<float> Positions(size_t count, float spread, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> d(-spread, spread);
  std::vector<float> p(3 * count);
  for (float& v : p) v = d(random);
  return p;
}
std::vector<float> Transmittance(const std::vector<float>& positions, FogParams p) {
  p.color = {0, 0, 0};
  const std::vector<float> v = Values(Fog(White(positions.size() / 3), Pixels(positions, 3), p));
  std::vector<float> t;
  for (size_t i = 0; i < v.size(); i += 3) t.push_back(v[i]);
  return t;
}
std::vector<float> Transmittance(const std::vector<float>& positions, LayerFogParams p) {
  p.color = {0, 0, 0};
  const std::vector<float> v = Values(LayerFog(White(positions.size() / 3), Pixels(positions, 3), p));
  std::vector<float> t;
  for (size_t i = 0; i < v.size(); i += 3) t.push_back(v[i]);
  return t;
}
double Ulps(float got, double exact) {
  const auto nearest = static_cast<float>(exact);
  const double ulp = std::max(std::fabs(std::nextafter(nearest, kInf) - nearest), 0x1p-149f);
  return std::fabs(got - exact) / ulp;
}

TEST_P(FogTest, TransmittanceIsWithinTwoUlps) {
  const std::vector<float> p = Positions(4096, 60, 1);
  for (const double density : {1e-9, 0.003, 0.1, 0.7}) {
    FogParams f;
    f.density = density;
    f.eye = {1.25, -3.5, 0.125};
    const std::vector<float> t = Transmittance(p, f);
    double worst = 0;
    for (size_t i = 0; i < t.size(); ++i) {
      const long double x = p[3 * i] - 1.25L, y = p[3 * i + 1] + 3.5L, z = p[3 * i + 2] - 0.125L;
      worst = std::max(
          worst, Ulps(t[i], static_cast<double>(std::exp(-density * std::sqrt(x * x + y * y + z * z)))));
    }
    EXPECT_LE(worst, 1.5) << density;
  }
}

TEST_P(FogTest, LayersAreWithinFourUlpsAndEqualHeightsAreExact) {
  std::vector<float> p = Positions(2048, 30, 2);
  // Heights equal to the eye's and barely off it, at a large height where naive differences are all noise.
  for (const float y : {1000.0f, std::nextafter(1000.0f, 2000.0f), 1000.0001f, 999.9f, 1000.25f}) {
    p.insert(p.end(), {3.0f, y, -4.0f});
  }
  LayerFogParams f;
  f.eye = {0.5, 1000, 0.25};
  f.layers = {{-40, 0.002}, {-5, 0.03}, {2, 0.001}, {999.5, 0.02}};
  const std::vector<float> t = Transmittance(p, f);
  for (size_t i = 0; i < t.size(); ++i) {
    const long double x = p[3 * i] - 0.5L, y = p[3 * i + 1] - 1000.0L, z = p[3 * i + 2] - 0.25L;
    long double sum = 0;
    const long double low = std::min<long double>(p[3 * i + 1], 1000),
                      high = std::max<long double>(p[3 * i + 1], 1000);
    for (size_t k = 0; k < 4; ++k) {
      const long double top = k < 3 ? std::min<long double>(high, f.layers[k + 1].height) : high;
      sum += f.layers[k].density * std::max(0.0L, top - std::max<long double>(low, f.layers[k].height));
    }
    const long double mean = high > low ? sum / (high - low) : 0.02L;
    EXPECT_LE(Ulps(t[i], static_cast<double>(std::exp(-mean * std::sqrt(x * x + y * y + z * z)))), 4) << i;
  }
}

TEST_P(FogTest, ProfilesAgreeWithQuadrature) {
  const std::vector<float> p = {3, 2.5f, 1, -2,   -1,  4,    0, 0.75f,      9,
                                1, 30,   1, 0.5f, -20, 0.5f, 2, 0.7500001f, 1};
  LayerFogParams e;
  e.profile = FogProfile::kExponential;
  e.exponential = {{0, 0.3, 1.5}, {-1, 0.05, 8}};
  e.eye = {0, 0.75, 0};
  LayerFogParams s;
  s.profile = FogProfile::kLinear;
  s.layers = {{-3, 0.1}, {0, 0.4}, {1, 0.05}, {4, 0.2}};
  s.eye = e.eye;
  for (const LayerFogParams& f : {e, s}) {
    const std::vector<float> t = Transmittance(p, f);
    for (size_t i = 0; i < t.size(); ++i) {
      const double x = p[3 * i], y = p[3 * i + 1], z = p[3 * i + 2];
      const double d = std::sqrt(x * x + (y - 0.75) * (y - 0.75) + z * z);
      double mean = 0;
      constexpr int kSteps = 400000;  // midpoint rule
      for (int k = 0; k < kSteps; ++k) mean += FogDensity(f, 0.75 + (y - 0.75) * (k + 0.5) / kSteps) / kSteps;
      EXPECT_NEAR(t[i], std::exp(-d * mean), 2e-6 * std::exp(-d * mean) + 1e-40) << i;
    }
  }
}

TEST_P(FogTest, EqualLayersAreUniformFogAndSwappingEndsChangesNothing) {
  const std::vector<float> p = Positions(512, 20, 3);
  LayerFogParams layers;
  layers.layers = {{-1000, 0.04}, {-3, 0.04}, {5, 0.04}};
  FogParams uniform;
  uniform.density = 0.04;
  const std::vector<float> a = Transmittance(p, layers), b = Transmittance(p, uniform);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_LE(std::fabs(a[i] / b[i] - 1), 3e-7);
  layers.layers = {{-7, 0.1}, {0.5, 0.01}, {6, 0.3}};
  EXPECT_DOUBLE_EQ(MeanFogDensity(layers, -3, 8), MeanFogDensity(layers, 8, -3));
  const double whole = 11 * MeanFogDensity(layers, -3, 8);
  EXPECT_NEAR(whole, 4 * MeanFogDensity(layers, -3, 1) + 7 * MeanFogDensity(layers, 1, 8), 1e-12);
  EXPECT_EQ(FogDensity(layers, 0.5), 0.01);  // a layer owns its lower bound
  EXPECT_EQ(FogDensity(layers, -7.5), 0);
}

TEST_P(FogTest, TwoFogsInARowAreOneOfBothDistances) {
  const std::vector<float> one = {1, 2, 3.5f, 0.25f, 20, 7}, other = {2, 0.5f, 1, 8, 3, 0.125f};
  FogParams f;
  f.distance = true, f.density = 0.2, f.color = {0.3, 0.6, 0.9};
  const auto three = [](const std::vector<float>& d) {
    std::vector<float> p;
    for (const float v : d) p.insert(p.end(), {v, v, v});
    return Pixels(p, 3);
  };
  std::vector<float> sum = one;
  for (size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
  const Node picture = Pixels(Positions(6, 2, 4), 3);
  const std::vector<float> twice = Values(Fog(Fog(picture, three(one), f), three(other), f));
  const std::vector<float> once = Values(Fog(picture, three(sum), f));
  for (size_t i = 0; i < once.size(); ++i) EXPECT_NEAR(once[i], twice[i], 4e-7);
}

TEST_P(FogTest, HardCases) {
  const std::vector<float> place = {0,    0, 0, kInf, 0,    0, kNaN, 0, 0,     0, 0, 1e30f,
                                    1e8f, 0, 0, 0,    kInf, 0, 0,    0, -kInf, 3, 4, 0};
  const std::vector<float> color = {-0.0f, 1e-40f, 7, 1, 2, 3, kNaN, 5, 6, 1, 2, 3,
                                    1,     2,      3, 4, 5, 6, 1,    2, 3, 1, 2, 3};
  FogParams f;
  f.density = 1e-3, f.color = {0.25, 0.5, 0.75};
  const std::vector<float> v = Values(Fog(Pixels(color, 3), Pixels(place, 3), f));
  // At the eye: the colour's own bits.
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(std::bit_cast<uint32_t>(v[c]), std::bit_cast<uint32_t>(color[c]));
  // Endless, 1e30 and 1e8 units away: the fog's colour exactly.
  for (const size_t i : {1, 3, 4, 5, 6}) {
    EXPECT_EQ(v[3 * i], 0.25f) << i;
    EXPECT_EQ(v[3 * i + 2], 0.75f) << i;
  }
  // No place: the pixel passes.
  EXPECT_TRUE(std::isnan(v[6]));
  EXPECT_EQ(v[7], 5);
  EXPECT_NEAR(v[21], std::exp(-0.005) + 0.25 * (1 - std::exp(-0.005)), 1e-7);

  // Density 1e30 hides all but the eye; density 0 is the input.
  f.density = 1e30;
  EXPECT_EQ(Values(Fog(Pixels(color, 3), Pixels(place, 3), f))[21], 0.25f);
  f.density = 0;
  EXPECT_EQ(Values(Fog(Pixels(color, 3), Pixels(place, 3), f))[23], 3);
  f.density = 1e-3, f.distance = true;
  const std::vector<float> depth = {-5, -5, -5, -kInf, -kInf, -kInf};  // behind the camera: clear
  EXPECT_EQ(Values(Fog(White(2), Pixels(depth, 3), f)), std::vector<float>(6, 1.0f));

  // Thin fog adds what it must: 1 - T without cancellation.
  f.density = 1e-9, f.color = {1, 1, 1};
  const float thin = Values(Fog(Black(1), Pixels({1, 1, 1}, 3), f))[0];
  EXPECT_NEAR(thin / 1e-9, 1, 2e-7);
  // A bright light behind thick fog.
  f.density = 1, f.color = {0, 0, 0};
  EXPECT_NEAR(Values(Fog(Pixels({1e8f, 0, 0}, 3), Pixels({18.420681f, 0, 0}, 3), f))[0], 1, 2e-6);
  for (const double bad : {-1.0, HUGE_VAL, std::nan("")}) {
    f.density = bad;
    EXPECT_THROW(Fog(White(1), White(1), f), Error);
  }
  // One channel is a distance, no position.
  f.distance = false;
  f.density = 1;
  const Node scalar = Pixels({2}, 1);
  EXPECT_THROW(Fog(White(1), scalar, f), Error);
  f.distance = true;
  EXPECT_NO_THROW(Fog(White(1), scalar, f));
  LayerFogParams layers;
  layers.layers = {{0, 0.1}, {0, 0.2}};
  EXPECT_THROW(LayerFog(White(1), White(1), layers), Error);
  layers.layers = {{0, -0.1}};
  EXPECT_THROW(LayerFog(White(1), White(1), layers), Error);
}

TEST_P(FogTest, LinearFogMayBeAStepOrReversed) {
  FogParams f;
  f.mode = FogMode::kLinear, f.distance = true;
  std::vector<float> p;
  for (const float d : {0.0f, 1.0f, 2.0f, 3.0f, kInf}) p.insert(p.end(), {d, d, d});
  f.start = f.end = 2;
  EXPECT_EQ(Transmittance(p, f), (std::vector<float>{1, 1, 0, 0, 0}));
  f.start = 3, f.end = 1;
  EXPECT_EQ(Transmittance(p, f), (std::vector<float>{0, 0, 0.5f, 1, 1}));
  f.start = 1, f.end = 3;
  EXPECT_EQ(Transmittance(p, f), (std::vector<float>{1, 1, 0.5f, 0, 0}));
}

TEST_P(FogTest, AGreyIsTheRedOfItsColors) {
  const Node grey = Pixels({0.1f, 0.6f, 2}, 1),
             color = Pixels({0.1f, 0.1f, 0.1f, 0.6f, 0.6f, 0.6f, 2, 2, 2}, 3);
  const Node position = Pixels(Positions(3, 60, 8), 3);
  LayerFogParams layers;
  layers.layers = {{-5, 0.1}, {10, 0.01}};
  const auto red = [](const Node& n) {
    const std::vector<float> v = Values(n);
    return std::vector<float>{v[0], v[3], v[6]};
  };
  EXPECT_EQ(Values(Fog(grey, position, {})), red(Fog(color, position, {})));
  EXPECT_EQ(Values(LayerFog(grey, position, layers)), red(LayerFog(color, position, layers)));
}

TEST_P(FogTest, AlphaIsKeptAndScalesTheFog) {
  FogParams f;
  f.density = 0.5, f.color = {1, 1, 1};
  const std::vector<float> v = Values(Fog(Pixels({0, 0, 0, 0.25f}, 4), Pixels({2, 0, 0}, 3), f));
  EXPECT_NEAR(v[0], 0.25 * (1 - std::exp(-1.0)), 1e-7);
  EXPECT_EQ(v[3], 0.25f);
}

TEST_P(FogTest, MaskLeavesBackgroundAloneAndThinsFogOfLights) {
  FogParams f;
  f.density = 0.5, f.color = {0, 0, 0};
  const Node place = Pixels({2, 0, 0, 2, 0, 0, 2, 0, 0}, 3);
  const std::vector<float> v = Values(Fog(White(3), place, f, {}, Pixels({0, 0.5f, kNaN}, 1)));
  EXPECT_EQ(v[0], 1);
  EXPECT_NEAR(v[3], std::exp(-0.5), 1e-7);
  EXPECT_EQ(v[6], 1);
}

TEST_P(FogTest, TurningTheCameraChangesNothing) {
  // The same world point on the axis and at the edge of a 90 degree view.
  const Camera ahead = Camera::Perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90, 1);
  const Camera turned = Camera::Perspective({0, 0, 0}, {1, 0, -1}, {0, 1, 0}, 90, 1);
  const Vector3 p = {0.3, -0.2, -7};
  for (const Camera& c : {ahead, turned}) {
    const auto clip = Transform(c.world_to_clip(), p);
    const double d = c.PlanarDepth(p) * c.DistancePerDepth(clip[0] / clip[3], clip[1] / clip[3]);
    EXPECT_NEAR(d, std::sqrt(0.3 * 0.3 + 0.04 + 49), 1e-12);
  }
}

// The papers' tables: the error of a linear look-up falls fourfold with every doubling.
TEST_P(FogTest, TablesConvergeToTheExactForm) {
  const std::vector<float> p = Positions(3000, 7, 6);
  LayerFogParams f;
  f.profile = FogProfile::kLinear;
  f.layers = SampleProfile([](double y) { return 0.1 * std::exp(-y * y / 20); }, -12, 12, 200);
  f.eye = {0, 1, 0};
  const std::vector<float> exact = Values(LayerFog(White(3000), Pixels(p, 3), f));
  const auto error = [&](FogTable form, int size, int bits) {
    FogTableParams t{form, size, 16, -8, 8, bits};
    const std::vector<float> v = Values(LayerFogByTable(White(3000), Pixels(p, 3), f, t));
    double worst = 0;
    for (size_t i = 0; i < v.size(); ++i) worst = std::max<double>(worst, std::fabs(v[i] - exact[i]));
    return worst;
  };
  for (const FogTable form : {FogTable::kMeanOfHeight, FogTable::kDistanceHeight}) {
    EXPECT_NEAR(error(form, 33, 0) / error(form, 65, 0), 4, 1.2);
  }
  EXPECT_LT(error(FogTable::kMeanOfHeight, 1024, 0), 1e-5);
  EXPECT_LT(error(FogTable::kDistanceHeightHeight, 64, 0), 2e-3);
  // 8 bits leave steps; 12 bits are sixteen times finer.
  const double eight = error(FogTable::kDistanceHeight, 256, 8),
               twelve = error(FogTable::kDistanceHeight, 256, 12);
  EXPECT_GT(eight, 1e-3);
  EXPECT_LT(eight, 2e-2);
  EXPECT_LT(twelve, eight / 6);
}

// Distances from the eye are places along the camera's rays, whichever command they are for.
TEST(FogCommandsTest, DistancesAreAsGoodAsPlanarDepths) {
  const std::string camera = " camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0";
  const auto make = [](const char* name, const std::vector<Node>& in, const std::string& words) {
    const ops::OpInfo& op = *ops::FindOp(name);
    return op.make(in, ops::ParseExample(op, words), nullptr);
  };
  ImageSpec spec(40, 30, 1, PixelType::kFloat);
  Image depths(spec);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x)
      *reinterpret_cast<float*>(depths.view().At(x, y)) = 1 + 0.1f * static_cast<float>((7 * x + 3 * y) % 50);
  }
  const Node planar = FromImage(depths);
  const Node distance = make("depth", {planar}, "from=planar to=euclidean" + camera);
  const Node color = FromImage(testing::Picture({0, 0, 40, 30}, 4, PixelType::kFloat, 3));
  for (const auto& [name, words] : {std::pair{"layerfog", "layers=-1,0.1,0,0.9,0.5,0"},
                                    std::pair{"fog", "density=0.3 color=height ramp=-1,1,0,0,2,0,0.5,1"}}) {
    const Image a = Render(make(name, {color, planar}, words + camera + " depth=planar"));
    const Image b = Render(make(name, {color, distance}, words + camera + " depth=euclidean"));
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        for (int c = 0; c < 4; ++c) ASSERT_NEAR(a.at<float>(x, y, c), b.at<float>(x, y, c), 2e-5) << name;
      }
    }
  }
  const auto refused = [&] {
    return make("fog", {color, color}, "mode=transmittance color=height ramp=-1,1,0,0,2,0,0.5,1");
  };
  EXPECT_THROW(refused(), Error);
}

}  // namespace
}  // namespace tessera
