// Noise: published values, statistics of the specification, hard cases, and every option against the
// reference.
#include "tessera/ops/noise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/every_target.h"
#include "support/noise_values.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/texture.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using tessera::testing::At;
using tessera::testing::Gradient;
using tessera::testing::Values;
using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

VerifyOptions Sampled(int samples, int tile_size) {
  VerifyOptions options;
  options.samples = samples;
  options.tile_size = tile_size;
  return options;
}
RenderOptions Tiles() {
  RenderOptions options;
  options.threads = 3;
  options.tile_width = 17;
  options.tile_height = 13;
  return options;
}

// The options that the registry's examples leave out.
const std::pair<const char*, std::vector<const char*>> kCases[] = {
    {"white",
     {"freq=5 dims=3 z=-7.5", "freq=9 lattice=osl dims=3 offset=-3.5,4,2147483647",
      "freq=9 lattice=osl color=1 dims=4"}},
    {"value",
     {"octaves=6 dims=3 z=0.3 signed=1", "dims=1 freq=3", "freq=6 method=accumulate signed=1",
      "fade=cubic freq=200 octaves=2 period=8 color=1", "gradient=1 freq=3 dims=3"}},
    {"perlin",
     {"freq=60 fade=linear",
      "dims=4 w=0.3 z=1 freq=300 fade=cubic",
      "dims=1 signed=1",
      "octaves=24 lacunarity=2.01 offset=2147483646.5,-8388609,16777217 dims=3 gain=0.7",
      "turbulence=1 octaves=5 period=3,257,1 dims=3",
      "period=1",
      "period=256 dims=3 octaves=3",
      "sum=ridged octaves=3",
      "sum=ridged octaves=7 weights=1,-0.5,0,2 gradient=1",
      "sum=billow octaves=7 gain=0.8 bias=0.4",
      "sum=billow octaves=3 antialias=1 freq=40",
      "lattice=osl dims=3 offset=-3,5,8 octaves=2",
      "lattice=osl color=1",
      "lattice=osl dims=4 seed=4",
      "lattice=osl dims=1",
      "warp=0.7 dims=3 freq=4",
      "aspect=0.1 antialias=1 octaves=4 freq=50",
      "weights=1,-0.5,0,2 octaves=4 seed=4294967295",
      "slices=2 dims=3",
      "bias=0.3 contrast=0.8 octaves=3",
      "octaves=0",
      "octaves=64 dims=3 gain=1",
      "octaves=3 gain=1.5 lacunarity=1",
      "seed=-1 offset=8388608,-16777217",
      "freq=12 method=accumulate",
      "freq=9 method=accumulate dims=3 z=0.7 offset=-3.3,0.21",
      "freq=9 octaves=2 method=accumulate turbulence=1 period=5 fade=cubic",
      "freq=0",
      "pack=octaves octaves=4",
      "pack=octaves dims=3 octaves=9 turbulence=1 signed=1",
      "pack=normal dims=3 octaves=2 freq=3",
      "pack=normal signed=1 lattice=perlin freq=3",
      "lattice=perlin warp=0.7 freq=5",
      "lattice=perlin warp=-1.1 octaves=2 gradient=1 dims=3"}},
    {"simplex",
     {"octaves=3 freq=20", "dims=4 w=0.3 signed=1", "gradient=1 dims=3 freq=2",
      "offset=-1000000000.25,7.5 freq=11", "dims=1 freq=5", "lattice=osl freq=4",
      "lattice=osl dims=3 color=1", "lattice=osl dims=1 octaves=2",
      "lattice=osl dims=4 gradient=1 freq=3 offset=-7.5", "period=3 octaves=3",
      "period=5,1,2 dims=3 gradient=1 freq=9", "period=0,256 offset=-3.5,1000000", "dims=4 period=4",
      "period=7 dims=1 octaves=2"}},
    {"hash",
     {"", "lattice=osl color=1 dims=3 freq=8", "dims=1 seed=3 color=1", "dims=4 period=3 freq=16 w=0.5"}},
    {"cell",
     {"sum=billow octaves=3", "sum=ridged octaves=2", "dims=3 distance=f2-f1 z=0.2",
      "distance=f2 jitter=0.6 period=4 octaves=2", "dims=1", "dims=4 freq=2",
      "gradient=1 distance=f2-f1 freq=2"}},
    {"sparse",
     {"dims=3 density=1 freq=4 signed=1", "dims=1 density=8", "period=3 octaves=2 freq=6",
      "gradient=1 freq=2"}},
    {"spot", {"dims=3 z=0.4 density=1 signed=1", "gradient=1 stretch=2 angle=-60 freq=2"}},
    {"turbulence",
     {"seed=-5 octaves=3 stitch=1 basefreq=0.07", "basefreq=1.3 octaves=2", "octaves=0", "basefreq=0,0.2"}},
    {"fractalnoise", {"seed=2147483647 octaves=4 stitch=1 basefreq=0.013,0.2"}},
    {"fire", {"seed=3 time=1.5 freq=2 octaves=4", "time=2 layers=1 rise=-3 wind=0.7"}},
    {"gardner", {"terms=7 time=2 threshold=1 scale=0.02", "amplitude=0"}}};

// All of them on a window off the origin.
template <class F>
void ForEveryCase(F check) {
  ImageSpec spec(37, 19, 4);
  spec.data_window = {-5, 3, 32, 22};
  spec.display_window = {-2, -3, 70, 20};
  for (const auto& [name, examples] : kCases) {
    for (const char* const example : examples) {
      SCOPED_TRACE(std::string(name) + " " + example);
      const ops::OpInfo& op = *ops::FindOp(name);
      check(op.make({}, ops::ParseExample(op, example), &spec));
    }
  }
}

TEST(NoiseTest, EveryOptionIsWithinItsBound) {
  OnEveryTarget([&] {
    ForEveryCase([](const Node& node) {
      const VerifyReport report = Verify(node, PixelType::kFloat, Sampled(1, 24));
      EXPECT_TRUE(report.within_bound) << report.Summary();
    });
  });
}

TEST(NoiseTest, TargetsWithFusedMultiplyAddAgreeInEveryBit) {
  if (!testing::HasBothFusedTargets()) GTEST_SKIP() << "there are not both AVX2 and AVX-512";
  ForEveryCase([](const Node& node) {
    SetSimdTarget("AVX2");
    const std::vector<float> avx2 = Values(node);
    SetSimdTarget("AVX3");
    const std::vector<float> avx3 = Values(node, Tiles());
    EXPECT_EQ(std::memcmp(avx2.data(), avx3.data(), avx2.size() * sizeof(float)), 0);
  });
  SetSimdTarget("auto");
}

// A row of a cell a pixel must end with its tile: its neighbour may be finished already.
TEST(NoiseTest, TilesOfOneCellAPixelLeaveTheirNeighboursAlone) {
  const ops::OpInfo& op = *ops::FindOp("perlin");
  const ImageSpec spec(2048, 64, 1);
  const Node node = op.make({}, ops::ParseExample(op, "dims=3 octaves=2 freq=1024"), &spec);
  OnEveryTarget([&] {
    const std::vector<float> whole = Values(node);
    RenderOptions options;
    options.shuffle_tiles = true;
    options.tile_width = 32;
    options.tile_height = 16;
    EXPECT_TRUE(Values(node, options) == whole);
  });
}

TEST(NoiseTest, PositionImagesAreWithinTheirBound) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> value(-9, 9);
  const Image image(ImageSpec(31, 7, 4));
  auto* const data = reinterpret_cast<float*>(image.view().data);
  for (int i = 0; i < 31 * 7 * 4; ++i) data[i] = value(random);
  const Node position = FromImage(image);
  OnEveryTarget([&] {
    for (const char* const example :
         {"type=value dims=2 freq=2 period=3 octaves=2 signed=1", "type=simplex dims=3",
          "type=cell dims=2 distance=f2", "type=sparse dims=3 density=1",
          "type=spot dims=3 stretch=3 color=1 channels=3", "type=white dims=2 freq=4 lattice=osl",
          "lattice=perlin octaves=2 seed=3", "lattice=osl dims=2 offset=-7.5,1000000.25", "warp=0.5 dims=2",
          "gradient=1 channels=4", "pack=normal channels=5 octaves=2 freq=0.25",
          "pack=octaves channels=3 octaves=3 dims=2", "type=simplex dims=3 period=4,3,5 octaves=2 freq=0.5",
          "type=simplex lattice=osl color=1 channels=3", "type=hash lattice=osl",
          "turbulence=1 octaves=3 dims=3 freq=0.5", "dims=1 freq=2", "dims=4", "lattice=perlin warp=0.7"}) {
      SCOPED_TRACE(example);
      const ops::OpInfo& op = *ops::FindOp("noiseat");
      const Node node = op.make(std::vector{position}, ops::ParseExample(op, example), nullptr);
      const VerifyReport report = Verify(node, PixelType::kFloat, Sampled(1, 24));
      EXPECT_TRUE(report.within_bound) << report.Summary();
    }
  });
}

// Perlin's reference implementation, as published: https://mrl.cs.nyu.edu/~perlin/noise/ gives noise(3.14,
// 42, 7).
TEST(NoiseTest, PerlinsPublishedValuesBitForBit) {
  NoiseParams p = Gradient(3);
  p.lattice = NoiseLattice::kPerlin;
  p.frequency = 0;  // one cell per pixel, whose centre is at 1/2
  p.offset = {3.14 - 0.5, 42 - 0.5, 7, 0};
  OnEveryTarget([&] {
    EXPECT_EQ(Values(Noise(ImageSpec(1, 1, 1), p))[0], static_cast<float>(0.13691995878400012));
    // The cube's corners and the well-known symmetry of whole coordinates.
    EXPECT_THAT(At({0, 0, 0, 1, 2, 3, -1, 255, 256},
                   [&] {
                     NoiseParams q = p;
                     q.frequency = 1;
                     q.offset = {};
                     return q;
                   }()),
                ::testing::ElementsAre(0, 0, 0));
  });
}

// What OSL's own oslnoise.h returns: position, snoise of 1 to 4 coordinates, vsnoise, cellnoise of 1 to 4,
// vcellnoise.
TEST(NoiseTest, OslValues) {
  const std::vector<std::vector<float>> kPublished = {
      {0.300000012f, 1.70000005f, -2.5999999f, 0.449999988f, 0.348075002f, -0.646099925f, 0.4850972f,
       -0.140267476f, 0.4850972f, -0.096101366f, -0.208193034f, 0.582425833f, 0.842521071f, 0.35378167f,
       0.326216996f, 0.326216996f, 0.188326031f, 0.334100097f},
      {-3.25f, 8.125f, 100.699997f, -7.30000019f, 0.321166992f, -0.350140691f, -0.35591349f, -0.136816069f,
       -0.35591349f, 0.333586127f, 0.330513835f, 0.837130725f, 0.986186266f, 0.142759353f, 0.365597337f,
       0.73226738f, 0.55099529f, 0.554255068f},
      {12.5f, -0.100000001f, 3.9000001f, 2.20000005f, -0.75f, 0.663299084f, -0.100664474f, -0.0305428915f,
       -0.100664474f, 0.294563711f, 0.00416692905f, 0.760187447f, 0.91376698f, 0.359557718f, 0.725676417f,
       0.0267290324f, 0.846812904f, 0.725676417f},
  };
  OnEveryTarget([&] {
    for (const std::vector<float>& v : kPublished) {
      for (int dims = 1; dims <= 4; ++dims) {
        SCOPED_TRACE(dims);
        NoiseParams p = Gradient(dims);
        p.lattice = NoiseLattice::kOsl;
        const std::vector<float> position(v.begin(), v.begin() + dims);
        const auto d = static_cast<size_t>(dims);
        EXPECT_NEAR(At(position, p)[0], v[3 + d], 2e-6);
        p.kind = NoiseKind::kWhite;
        p.is_signed = false;
        EXPECT_NEAR(At(position, p)[0], v[10 + d], 1e-7);
        if (dims != 3) continue;
        p.output = NoiseOutput::kColor;
        EXPECT_THAT(At(position, p, 3),
                    ::testing::Pointwise(::testing::FloatNear(1e-7f), std::vector(v.begin() + 15, v.end())));
        p.kind = NoiseKind::kGradient;
        p.is_signed = true;
        EXPECT_THAT(At(position, p, 3), ::testing::Pointwise(::testing::FloatNear(2e-6f),
                                                             std::vector(v.begin() + 8, v.begin() + 11)));
      }
    }
  });
}

// The fourth channel, in codes, as librsvg 2.54 draws it: <feTurbulence seed="7" baseFrequency="0.03 0.07"
// numOctaves="4">.
TEST(NoiseTest, SvgValuesOfLibrsvg) {
  const struct {
    int x, y;
    double turbulence, fractal_noise;
  } kPublished[] = {
      {0, 0, 0, 128}, {17, 5, 58, 140}, {63, 40, 27, 114}, {120, 77, 57, 116}, {199, 99, 43, 129}};
  SvgTurbulenceParams p;
  p.seed = 7;
  p.base_frequency = {0.03, 0.07};
  p.octaves = 4;
  OnEveryTarget([&] {
    for (const bool fractal : {false, true}) {
      p.fractal_noise = fractal;
      const std::vector<float> v = Values(SvgTurbulence(ImageSpec(200, 100, 4), p));
      for (const auto& at : kPublished) {
        EXPECT_NEAR(v[static_cast<size_t>((at.y * 200 + at.x) * 4 + 3)] * 255,
                    fractal ? at.fractal_noise : at.turbulence, 0.51);
      }
    }
  });
}

// Stitched, the column beyond the frame is the first one.
TEST(NoiseTest, SvgStitchingTiles) {
  SvgTurbulenceParams p;
  p.base_frequency = {0.031, 0.07};
  p.octaves = 4;
  p.stitch = true;
  ImageSpec spec(200, 100, 4);
  spec.data_window = {0, 0, 201, 101};
  const std::vector<float> v = Values(SvgTurbulence(spec, p));
  for (size_t k = 0; k < 4; ++k) {
    for (size_t y = 0; y < 101; ++y) EXPECT_NEAR(v[(y * 201 + 200) * 4 + k], v[y * 201 * 4 + k], 1e-5);
    for (size_t x = 0; x < 201; ++x) EXPECT_NEAR(v[(100 * 201 + x) * 4 + k], v[x * 4 + k], 1e-5);
  }
}

// The same value to the bit on the far side of a period, on grids and at positions.
TEST(NoiseTest, PeriodsOfAnyLengthRepeat) {
  for (const int period : {1, 3, 256, 257}) {
    for (const NoiseKind kind :
         {NoiseKind::kValue, NoiseKind::kGradient, NoiseKind::kCell, NoiseKind::kSparse, NoiseKind::kWhite,
          NoiseKind::kSimplex, NoiseKind::kHash}) {
      SCOPED_TRACE(std::to_string(period) + " kind " + std::to_string(static_cast<int>(kind)));
      NoiseParams p = Gradient(2);
      p.kind = kind;
      p.period = {period, period, 0, 0};
      p.octaves = 3;
      const std::vector<float> here = {0.25f, 0.5f, 0.875f, 0.0f, 0.0f, 0.96875f};
      std::vector<float> there = here;
      for (size_t i = 0; i < there.size(); ++i)
        there[i] += static_cast<float>(i % 2 == 0 ? period : -2 * period);
      EXPECT_EQ(At(here, p), At(there, p));
      p.frequency = period;
      p.offset = {0.25, 7, 0, 0};
      const Node grid = Noise(ImageSpec(16, 4, 1), p);
      p.offset = {0.25 - 3.0 * period, 7.0 + period, 0, 0};
      EXPECT_EQ(Values(grid), Values(Noise(ImageSpec(16, 4, 1), p)));
    }
  }
  NoiseParams p = Gradient(2);
  p.period = {3, 0, 0, 0};
  p.octaves = 2;
  p.lacunarity = 2.5;
  EXPECT_THAT(Refusal([&] { Noise(ImageSpec(4, 4, 1), p); }), HasSubstr("lacunarity"));
}

TEST(NoiseTest, HardPositions) {
  NoiseParams p = Gradient(3);
  OnEveryTarget([&] {
    // Lattice points exactly, -0, negative integers, floats without a fraction.
    for (float v :
         At({0, 0, 0, -0.0f, 1, 2, -1, -2, -3, 8388608, -8388609, 16777218, 2147483648.0f, 3e38f, -1e20f},
            p)) {
      EXPECT_EQ(v, 0);
      EXPECT_FALSE(std::signbit(v));
    }
    EXPECT_THAT(At({kNaN, 0, 0.5f, 0.5f, kInf, 0.5f, 0.5f, 0.5f, -kInf}, p), ::testing::ElementsAre(0, 0, 0));
    // Both sides of a cell's edge.
    const std::vector<float> near = At(
        {2.9999998f, 0.3f, 0.7f, 3, 0.3f, 0.7f, 3.0000002f, 0.3f, 0.7f, -1e-30f, 0.3f, 0.7f, 0, 0.3f, 0.7f},
        p);
    EXPECT_NEAR(near[0], near[1], 2e-6);
    EXPECT_NEAR(near[1], near[2], 2e-6);
    EXPECT_NEAR(near[3], near[4], 1e-6);
    NoiseParams value = p;
    value.kind = NoiseKind::kValue;
    EXPECT_EQ(At({5, 6, 7}, value), At({5.0f, 6.0f, 7.0f}, value));
    NoiseParams none = p;
    none.octaves = 0;
    EXPECT_EQ(At({0.3f, 0.2f, 0.1f}, none)[0], 0);
  });
}

// The same fractions far away: noise is as fine at 2^31 as at 0.
TEST(NoiseTest, FarFromTheOriginNothingIsLost) {
  for (const double far : {2147483648.0, -2147483649.0, 16777217.0}) {
    NoiseParams p = Gradient(2);
    p.frequency = 3;
    p.offset = {far, far, 0, 0};
    const Node node = Noise(ImageSpec(97, 11, 1), p);
    const VerifyReport report = Verify(node, PixelType::kFloat, Sampled(2, 64));
    EXPECT_TRUE(report.within_bound) << report.Summary();
    const std::vector<float> v = Values(node);
    double step = 0;
    for (size_t x = 1; x < 97; ++x) step = std::max<double>(step, std::fabs(v[x] - v[x - 1]));
    EXPECT_LT(step, 0.1);
    EXPECT_GT(step, 1e-3);
  }
  // Positions in two floats.
  NoiseParams p = Gradient(2);
  const Image pair(ImageSpec(1, 1, 4));
  const float parts[] = {16777216.0f, 2147483648.0f, 0.375f, -0.25f};
  std::copy(parts, parts + 4, reinterpret_cast<float*>(pair.view().data));
  p.offset = {};
  p.low_parts = true;
  const float at = Values(NoiseAt(FromImage(pair), p))[0];
  NoiseParams q = Gradient(2);
  q.frequency = 0;
  q.offset = {16777216.375 - 0.5, 2147483647.75 - 0.5, 0, 0};
  EXPECT_NEAR(at, Values(Noise(ImageSpec(1, 1, 1), q))[0], 1e-6);
}

TEST(NoiseTest, PositionsInTwoPartsOfAnySize) {
  const Node sums = FromImage(testing::Picture({0, 0, 40, 20}, 4, PixelType::kFloat, 3));
  const Node parts = MulConstant(sums, {1000});  // both parts are large
  NoiseParams p = Gradient(2);
  p.frequency = 3;
  // Twice as many channels as coordinates are no low parts unless they are said to be.
  EXPECT_EQ(Values(NoiseAt(parts, p)), Values(NoiseAt(SelectChannels(parts, "0,1"), p)));
  p.low_parts = true;
  const VerifyReport report = Verify(NoiseAt(parts, p), PixelType::kFloat, Sampled(4, 20));
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_NE(Values(NoiseAt(parts, p)), Values(NoiseAt(SelectChannels(parts, "0,1,0,1"), p)));
  const Node more = AppendChannels(parts, SelectChannels(parts, "0"));
  EXPECT_EQ(Values(NoiseAt(more, p)), Values(NoiseAt(parts, p)));
  EXPECT_THAT(Refusal([&] { NoiseAt(SelectChannels(parts, "0,1,2"), p); }),
              ::testing::HasSubstr("low parts"));
}

TEST(NoiseTest, SlopesAreDerivatives) {
  for (const NoiseKind kind :
       {NoiseKind::kValue, NoiseKind::kGradient, NoiseKind::kSimplex, NoiseKind::kSparse, NoiseKind::kSpot}) {
    SCOPED_TRACE(static_cast<int>(kind));
    NoiseParams p = Gradient(3);
    p.kind = kind;
    p.stretch = 2;
    p.angle = 25;
    const std::vector<float> value_at = {0.4f, 1.7f, -2.3f};
    p.output = NoiseOutput::kGradient;
    const std::vector<float> slope = At(value_at, p, 4);
    p.output = NoiseOutput::kValue;
    for (size_t a = 0; a < 3; ++a) {
      std::vector<float> more = value_at, less = value_at;
      more[a] += 1.0f / 256;
      less[a] -= 1.0f / 256;
      EXPECT_NEAR(slope[a + 1], 128 * (At(more, p)[0] - At(less, p)[0]), 4e-3) << a;
    }
  }
}

// A slice between two lattice planes is their blend with the fade.
TEST(NoiseTest, ValueNoiseIsBlendedFromSlices) {
  NoiseParams p = Gradient(3);
  p.kind = NoiseKind::kValue;
  const auto slice = [&](double z) {
    p.offset[2] = z;
    return Values(Noise(ImageSpec(24, 24, 1), p));
  };
  const std::vector<float> low = slice(0), high = slice(1), middle = slice(0.3);
  const double t = 0.3, u = t * t * t * (t * (t * 6 - 15) + 10);
  for (size_t i = 0; i < low.size(); ++i) EXPECT_NEAR(middle[i], low[i] + u * (high[i] - low[i]), 1e-6);
}

TEST(NoiseTest, RefusalsNameTheParameter) {
  const ImageSpec spec(4, 4, 1);
  const auto refusal = [&](auto change) {
    NoiseParams p;
    change(p);
    return Refusal([&] { Noise(spec, p); });
  };
  EXPECT_THAT(refusal([](NoiseParams& p) { p.octaves = 10000; }),
              HasSubstr("octaves: found 10000, expected 0 to 64"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.frequency = kNaN; }), HasSubstr("freq"));
  // Octaves side by side need a channel each: those without one were 0, and nothing said so.
  const auto packed = [](int octaves, int channels) {
    return Refusal(
        [&] { Noise(ImageSpec(4, 4, channels), {.output = NoiseOutput::kOctaves, .octaves = octaves}); });
  };
  EXPECT_THAT(packed(1, 4), HasSubstr("found 1 octaves for 4 channels, expected octaves=4 or more"));
  EXPECT_EQ(packed(4, 4), "accepted");
  EXPECT_EQ(packed(1, 1), "accepted");
  EXPECT_THAT(Refusal([&] {
                NoiseAt(FromImage(Image(ImageSpec(2, 2, 3))),
                        {.output = NoiseOutput::kOctaves, .dims = 3, .octaves = 3}, 4);
              }),
              HasSubstr("expected octaves=4 or more"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.dims = 5; }), HasSubstr("dims"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.slices = 2; }), HasSubstr("slices: found 2"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.offset[2] = 1e20; }), HasSubstr("offset: found 1e+20"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.bias = 1; }), HasSubstr("bias"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.lattice = NoiseLattice::kPerlin, p.dims = 4; }),
              HasSubstr("lattice"));
  EXPECT_THAT(refusal([](NoiseParams& p) {
                p.kind = NoiseKind::kSimplex, p.period = {1 << 20, 4}, p.octaves = 2;
              }),
              HasSubstr("period"));
  EXPECT_THAT(refusal([](NoiseParams& p) {
                p.kind = NoiseKind::kSimplex, p.lattice = NoiseLattice::kOsl, p.period = {4, 4};
              }),
              HasSubstr("period"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.kind = NoiseKind::kHash, p.warp = 1; }), HasSubstr("warp"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.method = NoiseMethod::kAccumulate, p.frequency = 3; }),
              HasSubstr("pixels per cell"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.method = NoiseMethod::kAccumulate, p.kind = NoiseKind::kCell; }),
              HasSubstr("method"));
  EXPECT_THAT(Refusal([&] { NoiseAt(FromImage(Image(ImageSpec(2, 2, 1))), Gradient(3)); }),
              HasSubstr("found 1 channels"));
  EXPECT_THAT(Refusal([&] { Texture(spec, {.octaves = -1}); }), HasSubstr("octaves"));
  EXPECT_THAT(Refusal([&] { Texture(spec, {.layers = 4}); }), HasSubstr("layers: found 4"));
  EXPECT_THAT(Refusal([&] { Texture(spec, {.wind = kNaN}); }), HasSubstr("wind"));
  EXPECT_THAT(Refusal([&] { SvgTurbulence(spec, {.seed = kNaN}); }), HasSubstr("seed"));
}

}  // namespace
}  // namespace tessera
