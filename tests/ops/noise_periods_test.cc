// Periods of noise: one for each axis, and of each position's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/every_target.h"
#include "support/noise_values.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using tessera::testing::At;
using tessera::testing::Gradient;
using tessera::testing::OnEveryTarget;
using tessera::testing::Values;
using ::testing::HasSubstr;

constexpr NoiseKind kKinds[] = {NoiseKind::kWhite, NoiseKind::kValue,  NoiseKind::kGradient,
                                NoiseKind::kCell,  NoiseKind::kSparse, NoiseKind::kSpot,
                                NoiseKind::kHash,  NoiseKind::kSimplex};

// A row of pixels with so many channels each.
Node Row(const std::vector<float>& values, int channels) {
  const Image image(ImageSpec(static_cast<int>(values.size()) / channels, 1, channels));
  std::copy(values.begin(), values.end(), reinterpret_cast<float*>(image.view().data));
  return FromImage(image);
}

// Every axis repeats after its own period, to the bit, and not before; one without does not.
TEST(NoisePeriods, EveryAxisHasItsOwn) {
  std::vector<NoiseKind> kinds(std::begin(kKinds), std::end(kKinds));
  kinds.push_back(NoiseKind::kGabor);
  for (const NoiseKind kind : kinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    NoiseParams p = Gradient(3);
    p.kind = kind;
    p.octaves = 2;
    p.period = {4, 0, 7, 0};
    const std::vector<float> here = {0.25f, 0.5f, 0.875f, 3.125f, -2.5f, 6.25f, 1.0f, 9.75f, 0.0f};
    const auto moved = [&](float x, float y, float z) {
      std::vector<float> there = here;
      for (size_t i = 0; i < there.size(); i += 3) there[i] += x, there[i + 1] += y, there[i + 2] += z;
      return At(there, p);
    };
    const std::vector<float> v = At(here, p);
    EXPECT_EQ(moved(4, 0, 0), v);
    EXPECT_EQ(moved(0, 0, -7), v);
    EXPECT_EQ(moved(-8, 0, 14), v);
    EXPECT_NE(moved(2, 0, 0), v);
    EXPECT_NE(moved(0, 4, 0), v);
    EXPECT_NE(moved(0, 7, 0), v);
    EXPECT_NE(moved(0, 0, 4), v);
  }
}

// Where all positions have the same periods it is period=; where they differ, each position's own.
TEST(NoisePeriods, OfEveryPositionsOwn) {
  const std::vector<std::array<int, 3>> choices = {{3, 4, 5}, {1, 2, 0}, {256, 1, 9}, {0, 0, 0}};
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> positions, periods;
  for (int i = 0; i < 700; ++i) {
    for (int a = 0; a < 3; ++a) {
      positions.push_back(static_cast<float>(std::fmod(0.61803 * i * (a + 1), 19.0) - 7));
      const int own = choices[static_cast<size_t>(i / 5 % 4)][static_cast<size_t>(a)];
      // Rounded down; what is no period is none.
      const float none[] = {0, -3, kNaN, 0.99f, 1e9f};
      periods.push_back(own > 0 ? static_cast<float>(own) + 0.25f * static_cast<float>(a) : none[i % 5]);
    }
  }
  OnEveryTarget([&] {
    for (const NoiseLattice lattice : {NoiseLattice::kTessera, NoiseLattice::kOsl}) {
      for (const NoiseKind kind : kKinds) {
        const bool published =
            kind == NoiseKind::kGradient || kind == NoiseKind::kWhite || kind == NoiseKind::kHash;
        if (lattice == NoiseLattice::kOsl && !published) continue;
        SCOPED_TRACE(static_cast<int>(kind));
        NoiseParams p = Gradient(3);
        p.kind = kind, p.lattice = lattice, p.octaves = 2;
        if (kind != NoiseKind::kHash) p.warp = 0.3;
        const std::vector<float> own = Values(NoiseAt(Row(positions, 3), Row(periods, 3), p));
        for (size_t k = 0; k < choices.size(); ++k) {
          p.period = {choices[k][0], choices[k][1], choices[k][2], 0};
          const std::vector<float> one = At(positions, p);
          for (size_t i = 0; i < own.size(); ++i) {
            if (i / 5 % 4 != k) continue;
            ASSERT_EQ(own[i], one[i]) << i;
          }
        }
      }
    }
  });
}

// What OSL 1.14's pnoise returns for periods 3, 4, 5, as in noise_kinds_test; one channel is for all axes.
TEST(NoisePeriods, OslsValues) {
  NoiseParams p = Gradient(3);
  p.lattice = NoiseLattice::kOsl;
  const Node positions = Row({0.300000012f, 1.70000005f, -2.5999999f, -3.25f, 8.125f, 100.699997f}, 3);
  const std::vector<float> v = Values(NoiseAt(positions, Row({3, 4, 5, 3, 4, 5}, 3), p));
  NoiseParams all = p;
  all.period = {3, 4, 5, 0};
  EXPECT_EQ(v, Values(NoiseAt(positions, all)));
  EXPECT_NEAR(v[0], -0.0791227147f, 3e-6);
  EXPECT_NEAR(v[1], 0.222745314f, 3e-6);
  p.period = {6, 6, 6, 0};
  const std::vector<float> six = Values(NoiseAt(positions, p));
  p.period = {};
  EXPECT_EQ(Values(NoiseAt(positions, Row({6, 6}, 1), p)), six);
}

TEST(NoisePeriods, EveryOptionIsWithinItsBound) {
  const Roi window{-3, 2, 40, 12};
  const Node position = MulConstant(FromImage(testing::Picture(window, 4, PixelType::kFloat, 5)), {9});
  ImageSpec spec(43, 10, 4);
  spec.data_window = window;
  const Image periods(spec);
  for (int y = window.y0; y < window.y1; ++y)
    for (int x = window.x0; x < window.x1; ++x)
      for (int c = 0; c < 4; ++c) periods.at<float>(x, y, c) = static_cast<float>((x / 3 + 2 * y + c) & 7);
  const ops::OpInfo& op = *ops::FindOp("noiseat");
  VerifyOptions options;
  options.samples = 1, options.tile_size = 64;
  OnEveryTarget([&] {
    for (const char* const example :
         {"periods=1", "periods=1 dims=2 octaves=3 gradient=1 channels=3", "periods=1 type=simplex octaves=2",
          "periods=1 type=cell dims=1", "periods=1 lattice=osl color=1 channels=4 dims=4",
          "periods=1 type=hash dims=2 offset=-7.5,3", "periods=1 pack=normal channels=4 type=value",
          "periods=1 low=1 dims=2 seed=9"}) {
      SCOPED_TRACE(example);
      const Node node =
          op.make(std::vector{position, FromImage(periods)}, ops::ParseExample(op, example), nullptr);
      const VerifyReport report = Verify(node, PixelType::kFloat, options);
      EXPECT_TRUE(report.within_bound) << report.Summary();
    }
  });
}

TEST(NoisePeriods, RefusalsNameWhatIsWrong) {
  const Node position = FromImage(Image(ImageSpec(4, 4, 3)));
  const auto refusal = [&](const Node& periods, auto change) {
    NoiseParams p = Gradient(3);
    change(p);
    return Refusal([&] { NoiseAt(position, periods, p); });
  };
  const auto same = [](NoiseParams&) {};
  EXPECT_EQ(refusal(position, same), "accepted");
  EXPECT_THAT(refusal(FromImage(Image(ImageSpec(4, 4, 2))), same), HasSubstr("found 2 channels of periods"));
  EXPECT_THAT(refusal(FromImage(Image(ImageSpec(5, 4, 3))), same), HasSubstr("noiseat"));
  EXPECT_THAT(refusal(position, [](NoiseParams& p) { p.period[1] = 3; }),
              HasSubstr("periods: found period="));
  EXPECT_THAT(refusal(position, [](NoiseParams& p) { p.kind = NoiseKind::kGabor; }), HasSubstr("gabor"));
  EXPECT_THAT(refusal(position, [](NoiseParams& p) { p.lattice = NoiseLattice::kPerlin; }),
              HasSubstr("periods"));
  EXPECT_THAT(refusal(position, [](NoiseParams& p) { p.octaves = 2, p.lacunarity = 2.5; }),
              HasSubstr("lacunarity=2.5"));
}

}  // namespace
}  // namespace tessera
