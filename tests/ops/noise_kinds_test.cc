// Noise that others define or that is packed: Open Shading Language's values, simplex noise around periods,
// packings of stored noise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/noise_values.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/shaped_spots.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using tessera::testing::At;
using tessera::testing::Gradient;
using tessera::testing::Values;
using testing::OnEveryTarget;

// What OSL 1.14's own headers return at a position of up to four coordinates: values of 1 to 4 dimensions,
// and colours of 3.
struct OslValues {
  std::vector<float> position;
  std::vector<float> simplex, simplex_color;
  std::vector<float> hash, hash_color;
  std::vector<float> periodic_perlin, periodic_cell, periodic_hash;  // periods 3, 4, 5, 6
};
const std::vector<OslValues> kOsl = {
    {{0.300000012f, 1.70000005f, -2.5999999f, 0.449999988f},
     {-0.245098889f, -0.0409611762f, 0.0545014739f, -0.128233835f},
     {0.0545014739f, 0.505345285f, 0.508151948f},
     {0.141322255f, 0.6030339f, 0.116643079f, 0.701398849f},
     {0.488335669f, 0.232367039f, 0.970231175f},
     {0.348075002f, -0.646099925f, -0.0791227147f, 0.313557655f},
     {0.582425833f, 0.842521071f, 0.434176505f, 0.649232626f},
     {0.141322255f, 0.6030339f, 0.268530965f, 0.216697514f}},
    {{-3.25f, 8.125f, 100.699997f, -7.30000019f},
     {-0.357506126f, 0.578395307f, 0.26768446f, -0.199091867f},
     {0.26768446f, -0.525140107f, 0.237285286f},
     {0.858058989f, 0.593887806f, 0.400011569f, 0.571285665f},
     {0.0942844376f, 0.770132482f, 0.488467604f},
     {-0.491455078f, 0.371174991f, 0.222745314f, 0.443142563f},
     {0.874585748f, 0.233181193f, 0.6973719f, 0.247647017f},
     {0.941475034f, 0.170827448f, 0.409244537f, 0.673529267f}},
    {{-0.100000001f, 12.5f, 3.9000001f, 2.20000005f},
     {0.137903631f, 0.0248126239f, 0.0788092911f, 0.100200526f},
     {0.0788092911f, -0.47583133f, 0.0791962817f},
     {0.358913541f, 0.346461594f, 0.850989699f, 0.862670958f},
     {0.879288614f, 0.450511187f, 0.079936482f},
     {-0.164124638f, 0.59544003f, 0.108208045f, 0.495293796f},
     {0.874585748f, 0.233181193f, 0.706511855f, 0.539996088f},
     {0.29974401f, 0.978853166f, 0.387639195f, 0.517187595f}},
};

TEST(NoiseKinds, OslSimplexHashAndPeriodicValues) {
  OnEveryTarget([&] {
    for (const OslValues& v : kOsl) {
      for (int dims = 1; dims <= 4; ++dims) {
        SCOPED_TRACE(::testing::Message() << v.position[0] << " dims " << dims);
        const std::vector<float> position(v.position.begin(), v.position.begin() + dims);
        const auto d = static_cast<size_t>(dims - 1);
        NoiseParams p = Gradient(dims);
        p.lattice = NoiseLattice::kOsl;
        p.kind = NoiseKind::kSimplex;
        EXPECT_NEAR(At(position, p)[0], v.simplex[d], 2e-5);  // OSL's offsets are float differences
        NoiseParams hash = p;
        hash.kind = NoiseKind::kHash;
        hash.is_signed = false;
        EXPECT_NEAR(At(position, hash)[0], v.hash[d], 1e-7);
        if (dims == 3) {
          p.output = hash.output = NoiseOutput::kColor;
          EXPECT_THAT(At(position, p, 3), ::testing::Pointwise(::testing::FloatNear(2e-5f), v.simplex_color));
          EXPECT_THAT(At(position, hash, 3), ::testing::Pointwise(::testing::FloatNear(1e-7f), v.hash_color));
          p.output = hash.output = NoiseOutput::kValue;
        }
        p.kind = NoiseKind::kGradient;
        p.period = {3, 4, 5, 6};
        EXPECT_NEAR(At(position, p)[0], v.periodic_perlin[d], 3e-6);
        hash.period = p.period;
        EXPECT_NEAR(At(position, hash)[0], v.periodic_hash[d], 1e-7);
        hash.kind = NoiseKind::kWhite;
        EXPECT_NEAR(At(position, hash)[0], v.periodic_cell[d], 1e-7);
      }
    }
  });
}

// Across the end of a period simplex noise is as smooth as elsewhere, in value and slope.
TEST(NoiseKinds, PeriodicSimplexHasNoSeam) {
  for (int dims = 1; dims <= 4; ++dims) {
    for (const std::array<int, 4> period :
         {std::array{1, 1, 1, 1}, {3, 3, 3, 3}, {4, 7, 0, 256}, {257, 2, 5, 0}}) {
      NoiseParams p = Gradient(dims);
      p.kind = NoiseKind::kSimplex;
      p.seed = 5;
      p.period = period;
      p.output = NoiseOutput::kGradient;
      double steepest = 0;
      for (int n = 0; n < 40; ++n) {
        for (int axis = 0; axis < dims; ++axis) {
          const int length =
              period[static_cast<size_t>(axis)] != 0 ? period[static_cast<size_t>(axis)] : 1 << 20;
          if (length > 100000) continue;  // floats have no fine steps there
          std::vector<float> before;
          for (int a = 0; a < dims; ++a)
            before.push_back(static_cast<float>(std::fmod(0.37 * n + 0.61 * a + 0.13 * axis * n, 3.0)));
          std::vector<float> after = before;
          constexpr float kStep = 1.0f / 1024;
          before[static_cast<size_t>(axis)] = static_cast<float>(length) - kStep;
          after[static_cast<size_t>(axis)] = kStep;  // 2 steps further, around the period
          const std::vector<float> v0 = At(before, p, dims + 1), v1 = At(after, p, dims + 1);
          for (size_t c = 0; c < v0.size(); ++c)
            EXPECT_NEAR(v0[c], v1[c], 60 * 2 * kStep) << dims << " " << axis;
          const double slope = 0.5 * (v0[static_cast<size_t>(axis) + 1] + v1[static_cast<size_t>(axis) + 1]);
          EXPECT_NEAR((v1[0] - v0[0]) / (2 * kStep), slope, 2e-2) << dims << " " << axis;
          steepest = std::max(steepest, std::fabs(slope));
        }
      }
      if (period[0] > 1) {  // a period of one cell leaves no slope there
        EXPECT_GT(steepest, 0.01);
      }
    }
  }
}

// Simplex noise that repeats is as the endless one: same range and variance over all positions.
TEST(NoiseKinds, PeriodicSimplexHasTheSameStatistics) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> anywhere(0, 64);
  for (int dims = 2; dims <= 4; ++dims) {
    std::vector<float> positions(static_cast<size_t>(100000 * dims));
    for (float& v : positions) v = anywhere(random);
    NoiseParams p = Gradient(dims);
    p.kind = NoiseKind::kSimplex;
    const auto moments = [&](int period) {
      p.period = {period, period, period, period};
      double sum = 0, square = 0, largest = 0;
      for (const float v : At(positions, p)) {
        sum += v, square += v * v, largest = std::max<double>(largest, std::fabs(v));
      }
      return std::array{sum / 100000, square / 100000, largest};
    };
    const auto endless = moments(0), periodic = moments(64);
    EXPECT_NEAR(periodic[0], 0, 0.02);
    EXPECT_NEAR(periodic[1], endless[1], 0.06 * endless[1]) << dims;
    EXPECT_LE(periodic[2], 1);
    EXPECT_GT(periodic[2], 0.6);
  }
}

// The paper's packings: octaves side by side add up to the turbulence that one lookup would read; the
// gradient's direction in three channels is the slopes', with the density beside it.
TEST(NoiseKinds, PackingsOfABlock) {
  OnEveryTarget([] {
    NoiseParams p;
    p.dims = 3;
    p.frequency = 4;
    p.period = {4, 4, 4, 0};
    p.slices = 16;
    p.octaves = 4;
    const ImageSpec one(16, 256, 1), four(16, 256, 4);
    p.output = NoiseOutput::kOctaves;
    const std::vector<float> octaves = Values(Noise(four, p));
    p.output = NoiseOutput::kValue;
    p.sum = NoiseSum::kTurbulence;
    const std::vector<float> turbulence = Values(Noise(one, p));
    for (size_t i = 0; i < turbulence.size(); ++i) {
      double sum = 0;
      for (size_t c = 0; c < 4; ++c) sum += std::ldexp(std::fabs(octaves[4 * i + c]), -static_cast<int>(c));
      ASSERT_NEAR(sum, turbulence[i], 2e-6);
    }
    p.sum = NoiseSum::kFbm;
    p.octaves = 1;
    p.is_signed = false;
    p.output = NoiseOutput::kGradient;
    const std::vector<float> slopes = Values(Noise(four, p));
    p.output = NoiseOutput::kNormal;
    const std::vector<float> normal = Values(Noise(four, p));
    for (size_t i = 0; i < slopes.size(); i += 4) {
      const double length = std::hypot(slopes[i + 1], slopes[i + 2], slopes[i + 3]);
      if (length < 1e-3) continue;
      for (size_t a = 0; a < 3; ++a) ASSERT_NEAR(normal[i + a], 0.5 + 0.5 * slopes[i + 1 + a] / length, 1e-4);
      ASSERT_EQ(normal[i + 3], slopes[i]);
    }
    // Where there is no gradient the direction is 0, packed as 1/2.
    p.octaves = 0;
    const std::vector<float> none = Values(Noise(four, p));
    EXPECT_THAT(std::vector<float>(none.begin(), none.begin() + 4), ::testing::Each(0.5f));
  });
}

// Seven octaves of ridged noise used to be white in 8 bits, of billow black: a sum of sizes grows with the
// octaves. Whatever their number and weights, results now fill [0, 1], and never leave it.
TEST(NoiseKinds, SumsOfSizesFillTheRangeWhateverTheOctaves) {
  for (const NoiseSum sum : {NoiseSum::kRidged, NoiseSum::kBillow}) {
    for (const NoiseKind kind : {NoiseKind::kGradient, NoiseKind::kValue, NoiseKind::kSimplex}) {
      for (const double gain : {0.4, 0.5, 1.0}) {
        for (const int octaves : {1, 2, 4, 7}) {
          SCOPED_TRACE(std::to_string(static_cast<int>(sum)) + " " + std::to_string(static_cast<int>(kind)) +
                       " " + std::to_string(octaves) + " octaves of gain " + std::to_string(gain));
          NoiseParams p;
          p.kind = kind, p.sum = sum, p.octaves = octaves, p.gain = gain;
          p.is_signed = false;
          p.frequency = 24;
          const std::vector<float> v = Values(Noise(ImageSpec(256, 256, 1), p));
          double least = 1, most = 0, mean = 0;
          for (const float x : v) {
            least = std::min<double>(least, x), most = std::max<double>(most, x);
            mean += x / static_cast<double>(v.size());
          }
          EXPECT_GE(least, 0);
          EXPECT_LE(most, 1);
          EXPECT_GT(most - least, gain < 1 ? 0.5 : 0.25);
          // The mean is the octave's own, which every octave has.
          p.octaves = 1;
          double one = 0;
          for (const float x : Values(Noise(ImageSpec(256, 256, 1), p))) one += x / 65536.0;
          EXPECT_NEAR(mean, one, 0.03);
          // Signed, the sum itself.
          p.octaves = octaves;
          p.is_signed = true;
          const std::vector<float> raw = Values(Noise(ImageSpec(256, 256, 1), p));
          double weights = 0;
          for (int k = 0; k < octaves; ++k) weights += std::pow(gain, k);
          for (size_t i = 0; i < v.size(); i += 97) {
            const double share = raw[i] / weights;
            ASSERT_NEAR(v[i], sum == NoiseSum::kRidged ? share : 0.5 + 0.5 * share, 2e-6);
          }
        }
      }
    }
  }
}

// The specification's high-resolution filtering: sums of blocks equal direct evaluation at pixel centres, and
// on a constant lattice the windows are a partition of unity.
TEST(NoiseKinds, AccumulationEqualsDirectEvaluation) {
  OnEveryTarget([] {
    for (const NoiseKind kind : {NoiseKind::kValue, NoiseKind::kGradient}) {
      for (int dims = 2; dims <= 4; ++dims) {
        for (const int pixels : {1, 2, 5, 16, 40}) {
          SCOPED_TRACE(::testing::Message() << "dims " << dims << " pixels " << pixels);
          NoiseParams p;
          p.kind = kind;
          p.dims = dims;
          p.frequency = 200.0 / pixels;
          p.offset = {-7.3, 1000.9, 0.4, 0.8};
          const ImageSpec spec(200, 37, 1);
          const std::vector<float> direct = Values(Noise(spec, p));
          p.method = NoiseMethod::kAccumulate;
          const std::vector<float> summed = Values(Noise(spec, p));
          EXPECT_THAT(summed, ::testing::Pointwise(::testing::FloatNear(1e-6f), direct));
          RenderOptions tiles;
          tiles.tile_width = 17, tiles.tile_height = 13, tiles.threads = 3;
          EXPECT_EQ(Values(Noise(spec, p), tiles), summed);
        }
      }
    }
  });
}

// Positions from which the Jacobian is `xx, xy, yx, yy` everywhere.
Node Plane(int size, double xx, double xy, double yx, double yy) {
  const Image image(ImageSpec(size, size, 3));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      image.at<float>(x, y, 0) = static_cast<float>(xx * x + xy * y);
      image.at<float>(x, y, 1) = static_cast<float>(yx * x + yy * y);
      image.at<float>(x, y, 2) = 7;
    }
  }
  return FromImage(image);
}

TEST(NoiseKinds, SpotsOnASurface) {
  // Not stretched, or turned and scaled, they are spot noise.
  NoiseParams spot;
  spot.kind = NoiseKind::kSpot;
  spot.seed = 5;
  const std::vector<float> round = Values(Noise(ImageSpec(128, 128, 1), spot));
  for (const Node& position : {Plane(128, 1, 0, 0, 1), Plane(128, 0, -4, 4, 0)}) {
    EXPECT_THAT(Values(ShapedSpots(position, {.seed = 5})),
                ::testing::Pointwise(::testing::FloatNear(2e-6f), round));
  }
  // Stretched along x they are narrow along x: as kSpot's of that shape, whose axis is y.
  spot.stretch = 4;
  spot.angle = 90;
  EXPECT_THAT(Values(ShapedSpots(Plane(128, 4, 0, 0, 1), {.seed = 5})),
              ::testing::Pointwise(::testing::FloatNear(4e-6f), Values(Noise(ImageSpec(128, 128, 1), spot))));
  // On the surface both directions are alike although the texture is sheared: structure functions at equal
  // distances.
  ShapedSpotParams p;
  p.frequency = 64;
  const std::vector<float> v = Values(ShapedSpots(Plane(1024, 1, 0, 0, 4), p));
  const auto roughness = [&](size_t dx, size_t dy) {
    double sum = 0;
    for (size_t y = 0; y < 1000; ++y)
      for (size_t x = 0; x < 1000; ++x) sum += std::pow(v[y * 1024 + x] - v[(y + dy) * 1024 + x + dx], 2);
    return sum;
  };
  EXPECT_NEAR(roughness(4, 0) / roughness(0, 1), 1, 0.05);
  double square = 0;
  for (const float n : v) square += n * n;
  EXPECT_NEAR(square / static_cast<double>(v.size()), 1.0 / 9, 0.006);  // Campbell
  // A position without extent has no spots, and no NaN.
  for (const float n : Values(ShapedSpots(Plane(32, 1, 0, 0, 0), p))) EXPECT_EQ(n, 0);
  for (const float n : Values(ShapedSpots(Plane(32, std::nan(""), 0, 0, 1), p))) EXPECT_EQ(n, 0);
  // Cells a million times as wide as the image ask for no more than the image.
  for (const double frequency : {1e-3, 1e-6}) {
    for (const float n : Values(ShapedSpots(Plane(32, 1, 0, 0, 1), {.frequency = frequency, .density = 8})))
      EXPECT_TRUE(std::isfinite(n));
  }
}

}  // namespace
}  // namespace tessera
