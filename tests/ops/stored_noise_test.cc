// Stored noise: the samples of every packing, its tables and files, and turbulence read from them.
#include "tessera/ops/stored_noise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "support/noise_values.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/noise.h"

namespace tessera {
namespace {

using tessera::testing::At;
using tessera::testing::Values;

constexpr NoisePacking kPackings[] = {NoisePacking::kSingle, NoisePacking::kOctaves, NoisePacking::kNormal,
                                      NoisePacking::kPrecomputed};

// Octave k of the noise with `cells` cells per block at positions in blocks.
std::vector<float> Exact(const std::vector<float>& positions, int cells, int k) {
  NoiseParams p;
  p.dims = 3;
  p.frequency = std::ldexp(cells, k);
  p.period = {cells, cells, cells, 0};
  return At(positions, p);
}
std::vector<float> Centres(int size) {
  std::vector<float> positions;
  for (int i = 0; i < size * size * size; ++i) {
    for (const int c : {i % size, i / size % size, i / size / size})
      positions.push_back((static_cast<float>(c) + 0.5f) / static_cast<float>(size));
  }
  return positions;
}
Node Positions(const std::vector<float>& positions) {
  const Image image(ImageSpec(static_cast<int>(positions.size()) / 3, 1, 3));
  std::copy(positions.begin(), positions.end(), reinterpret_cast<float*>(image.view().data));
  return FromImage(image);
}
std::vector<float> Anywhere(int count) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> number(-3, 3);
  std::vector<float> positions(static_cast<size_t>(3) * count);
  for (float& p : positions) p = number(generator);
  return positions;
}

TEST(StoredNoiseTest, SamplesAreTheNoiseAtTheirCentres) {
  constexpr int kSize = 16, kCells = 4;
  const std::vector<float> centres = Centres(kSize);
  const size_t count = centres.size() / 3;
  std::vector<std::vector<float>> octave;
  for (int k = 0; k < 5; ++k) octave.push_back(Exact(centres, kCells, k));
  for (const NoisePacking packing : kPackings) {
    const Table table = StoredNoise({.packing = packing, .size = kSize, .cells = kCells, .octaves = 5});
    SCOPED_TRACE(static_cast<int>(packing));
    ASSERT_EQ(table.sizes(), (std::vector<int>{kSize, kSize, kSize}));
    ASSERT_EQ(table.align(), TableAlign::kCentres);
    const std::vector<float> samples = table.Samples();
    const auto channels = static_cast<size_t>(table.channels());
    ASSERT_EQ(samples.size(), count * channels);
    for (size_t i = 0; i < count; ++i) {
      if (packing == NoisePacking::kPrecomputed) {
        double sum = 0;
        for (size_t k = 0; k < 5; ++k) sum += std::ldexp(std::fabs(octave[k][i]), -static_cast<int>(k));
        ASSERT_NEAR(samples[i], sum, 4e-6);
      } else if (packing == NoisePacking::kOctaves) {
        for (size_t k = 0; k < 4; ++k) ASSERT_NEAR(samples[4 * i + k], octave[k][i], 2e-6);
      } else {
        ASSERT_NEAR(samples[channels * i + channels - 1], octave[0][i], 2e-6);
      }
      if (packing == NoisePacking::kNormal) {
        const double length = std::hypot(samples[4 * i], samples[4 * i + 1], samples[4 * i + 2]);
        ASSERT_TRUE(length == 0 || std::fabs(length - 1) < 1e-6) << length;
      }
    }
    // By a file and back.
    const Image file =
        Render(StoredNoiseImage({.packing = packing, .size = kSize, .cells = kCells, .octaves = 5}));
    EXPECT_EQ(TableFromImage(file.view(), {.slices = {kSize}}).Samples(), samples);
  }
}

// Lookups of all packings approach the formula, repeat after the block, and mean the same in integers.
TEST(StoredNoiseTest, TurbulenceFromEveryPacking) {
  constexpr int kSize = 64, kCells = 2, kOctaves = 4;
  const std::vector<float> positions = Anywhere(4000);
  std::vector<double> formula(positions.size() / 3);
  for (int k = 0; k < kOctaves; ++k) {
    const std::vector<float> octave = Exact(positions, kCells, k);
    for (size_t i = 0; i < formula.size(); ++i) formula[i] += std::ldexp(std::fabs(octave[i]), -k);
  }
  std::vector<float> next = positions;
  for (float& p : next) p += 4;
  for (const NoisePacking packing : kPackings) {
    SCOPED_TRACE(static_cast<int>(packing));
    StoredNoiseParams stored{.packing = packing, .size = kSize, .cells = kCells, .octaves = kOctaves};
    const StoredTurbulenceParams params{.packing = packing, .octaves = kOctaves};
    const Table table = StoredNoise(stored);
    const std::vector<float> read = Values(StoredTurbulence(Positions(positions), table, params));
    ASSERT_EQ(read.size(), formula.size());
    double square = 0;
    for (size_t i = 0; i < read.size(); ++i) square += std::pow(read[i] - formula[i], 2);
    // One noise has 32 samples per cell, octaves beside each other down to 4.
    const bool fine = packing == NoisePacking::kSingle || packing == NoisePacking::kNormal;
    EXPECT_LT(std::sqrt(square / static_cast<double>(read.size())), fine ? 2e-3 : 1.5e-2);
    EXPECT_THAT(Values(StoredTurbulence(Positions(next), table, params)),
                ::testing::Pointwise(::testing::FloatNear(2e-5f), read));
    stored.storage = PixelType::kUint8;
    EXPECT_THAT(Values(StoredTurbulence(Positions(positions), StoredNoise(stored), params)),
                ::testing::Pointwise(::testing::FloatNear(1.875f / 255 + 1e-5f), read));
  }
}

// The specification: four channels are four lookups of the octaves' own blocks.
TEST(StoredNoiseTest, FourChannelsAreFourLookups) {
  const std::vector<float> positions = Anywhere(500);
  const Table packed = StoredNoise({.packing = NoisePacking::kOctaves, .size = 32, .cells = 4});
  const std::vector<float> four = Values(
      StoredTurbulence(Positions(positions), packed, {.packing = NoisePacking::kOctaves, .octaves = 4}));
  std::vector<float> sum(four.size(), 0);
  for (int k = 0; k < 4; ++k) {
    std::vector<float> samples;
    for (int64_t i = 0; i < packed.entries(); ++i) samples.push_back(packed.At(i, k));
    const Table one({32, 32, 32}, 1, samples, TableAlign::kCentres);
    const std::vector<float> term = Values(StoredTurbulence(Positions(positions), one, {.octaves = 1}));
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += std::ldexp(term[i], -k);
  }
  EXPECT_THAT(sum, ::testing::Pointwise(::testing::FloatNear(1e-6f), four));
}

TEST(StoredNoiseTest, RefusalsNameTheParameter) {
  const auto refused = [](const StoredNoiseParams& params, const char* name) {
    EXPECT_THAT([&] { StoredNoise(params); }, ::testing::ThrowsMessage<Error>(::testing::HasSubstr(name)));
  };
  refused({.size = 1}, "size");
  refused({.size = 513}, "size");
  refused({.cells = 0}, "cells");
  refused({.size = 8, .cells = 9}, "cells");
  refused({.octaves = 17}, "octaves");
  const Node position = Positions(Anywhere(1));
  const Table table = StoredNoise({.size = 4});
  const auto unread = [&](const StoredTurbulenceParams& params, const char* name) {
    EXPECT_THAT([&] { StoredTurbulence(position, table, params); },
                ::testing::ThrowsMessage<Error>(::testing::HasSubstr(name)));
  };
  unread({.octaves = 0}, "octaves");
  unread({.wrap = Wrap::kClamp}, "wrap");
  unread({.packing = NoisePacking::kOctaves}, "table");
}

}  // namespace
}  // namespace tessera
