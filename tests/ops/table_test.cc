// Tables as values: storage, builders, inverse, mip chains, refusals.
#include "tessera/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/half.h"
#include "support/refusal.h"
#include "tessera/error.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Samples = std::vector<float>;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Table RandomTable(std::vector<int> sizes, int channels) {
  size_t n = static_cast<size_t>(channels);
  for (const int size : sizes) n *= static_cast<size_t>(size);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> d(-1, 2);
  Samples s(n);
  for (float& v : s) v = d(random);
  return Table(std::move(sizes), channels, s, TableAlign::kCentres);
}
TEST(TableTest, StorageRoundsAndReadsBack) {
  const Samples samples = {0, 1, 0.5f, -0.25f, 1.5f, kNaN, 65519.99f, 1e-8f};
  const Table eight({8}, 1, samples, TableAlign::kEnds, PixelType::kUint8);
  EXPECT_THAT(eight.Samples(), ElementsAre(0, 1, 128 / 255.0f, 0, 1, 0, 1, 0));
  const Table half({8}, 1, samples, TableAlign::kEnds, PixelType::kHalf);
  EXPECT_EQ(half.At(6, 0), 65504.0f);
  EXPECT_EQ(half.At(3, 0), -0.25f);
  EXPECT_EQ(half.At(7, 0), 0.0f);
  const Table sixteen = Table({8}, 1, samples, TableAlign::kEnds).WithStorage(PixelType::kUint16);
  EXPECT_EQ(sixteen.At(2, 0), static_cast<float>(32768 / 65535.0));
  EXPECT_EQ(sixteen.bytes(), 16u);
  EXPECT_THAT(Refusal([] { Table({2, 0}, 1, {}, TableAlign::kEnds); }), HasSubstr("found sizes 2x0"));
  EXPECT_THAT(Refusal([] { Table({2, 2, 2, 2, 2}, 1, {}, TableAlign::kEnds); }), HasSubstr("found 5 axes"));
  EXPECT_THAT(Refusal([] { Table({65536, 65536}, 1, {}, TableAlign::kEnds); }), HasSubstr("fewer than 2^31"));
  EXPECT_THAT(Refusal([&] { Table({3}, 2, samples, TableAlign::kEnds); }),
              HasSubstr("found 8 samples, expected 6"));
  EXPECT_THAT(Refusal([&] { Table({1}, 8, samples, TableAlign::kEnds); }),
              HasSubstr("found 8 result channels"));
}

TEST(TableTest, SlicesAreStackedAsTheyCome) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    std::vector<Image> slices;
    for (int k = 0; k < 4; ++k) {
      ImageSpec spec(3, 2, 2);
      spec.type = type;
      slices.emplace_back(spec);
      for (int i = 0; i < 12; ++i) {
        const int x = i / 2 % 3, y = i / 6, c = i % 2, v = k * 12 + i;
        if (type == PixelType::kUint8) slices[k].at<uint8_t>(x, y, c) = static_cast<uint8_t>(v);
        if (type == PixelType::kUint16) slices[k].at<uint16_t>(x, y, c) = static_cast<uint16_t>(v);
        if (type == PixelType::kHalf) slices[k].at<uint16_t>(x, y, c) = base::HalfFromFloat(v / 64.0f);
        if (type == PixelType::kFloat) slices[k].at<float>(x, y, c) = v / 64.0f;
      }
    }
    const Table table = TableFromSlices(slices, TableAlign::kEnds);
    EXPECT_THAT(table.sizes(), ElementsAre(3, 2, 4));
    EXPECT_EQ(table.channels(), 2);
    EXPECT_EQ(table.align(), TableAlign::kEnds);
    const float step = type == PixelType::kUint8    ? 1 / 255.0f
                       : type == PixelType::kUint16 ? 1 / 65535.0f
                                                    : 1 / 64.0f;
    const Samples samples = table.Samples();
    ASSERT_EQ(samples.size(), 48u);
    for (size_t i = 0; i < samples.size(); ++i) EXPECT_FLOAT_EQ(samples[i], static_cast<float>(i) * step);
    slices.emplace_back(ImageSpec(2, 2, 2));
    EXPECT_THAT(
        Refusal([&] { TableFromSlices(slices); }),
        HasSubstr("found slices of 3x2 with 2 channels and 2x2 with 2 channels, expected equal ones"));
  }
  EXPECT_THAT(Refusal([] { TableFromSlices({}); }), HasSubstr("found no slices"));
}

TEST(TableTest, FunctionTablesReportTheirError) {
  const auto decay = [](const double* s, double* v) { v[0] = std::exp(-5 * s[0]); };
  double last = 0;
  for (const int n : {65, 129, 257}) {
    const FunctionTable table = TableFromFunction(decay, {.sizes = {n}});
    const double bound = 25.0 / 8 / ((n - 1.0) * (n - 1.0));
    EXPECT_LE(table.max_error, bound * 1.01 + 1e-7) << n;
    EXPECT_GE(table.max_error, bound * 0.9) << n;
    if (last > 0) {
      EXPECT_NEAR(last / table.max_error, 4, 0.1);
    }
    last = table.max_error;
    EXPECT_GT(table.rms_error, 0);
    EXPECT_LT(table.rms_error, table.max_error);
    EXPECT_LT(table.worst[0], 0.05);
  }
  // Away from the ends, where it has all four entries, a cubic lookup is of a higher order.
  const Table cubic = TableFromFunction(decay, {.sizes = {257}, .probes = 1}).table;
  for (double s = 0.1; s < 0.9; s += 0.00137) {
    double got, want;
    SampleTable(cubic, {.filter = TableFilter::kCubic}, &s, &got);
    decay(&s, &want);
    ASSERT_NEAR(got, want, 2e-7) << s;
  }
  const FunctionTable coarse = TableFromFunction(decay, {.sizes = {257}, .storage = PixelType::kUint8});
  EXPECT_GT(coarse.max_error, 1e-3);
}

TEST(TableTest, InverseUndoesAMonotoneTable) {
  Samples up, down;
  for (int i = 0; i < 1000; ++i) {
    up.push_back(static_cast<float>(std::pow(i / 999.0, 2.2)));
    down.push_back(1 - up.back());
  }
  for (const Samples& values : {up, down}) {
    const Table table({1000}, 1, values, TableAlign::kEnds), inverse = InverseTable(table, 4096);
    for (int j = 0; j < 4096; ++j) {
      const double s = inverse.At(j, 0);
      double v;
      SampleTable(table, {}, &s, &v);
      ASSERT_NEAR(v, j / 4095.0, 2e-7);
    }
  }
  EXPECT_THAT(Refusal([] {
                InverseTable(Table({3}, 1, Samples{0, 1, 1}, TableAlign::kEnds), 5);
              }),
              HasSubstr("entry 2: found 1 after 1"));
}

TEST(TableTest, MipChainsKeepTheMean) {
  for (const MipFilter filter :
       {MipFilter::kBox, MipFilter::kLinear, MipFilter::kMitchell, MipFilter::kLanczos3}) {
    const Table table = RandomTable({16, 8, 4}, 2);
    const std::vector<Table> levels = MipChain(table, filter, {Wrap::kRepeat});
    ASSERT_EQ(levels.size(), 5u);
    EXPECT_THAT(levels[2].sizes(), ElementsAre(4, 2, 1));
    double mean = 0;
    for (int64_t i = 0; i < table.entries(); ++i) mean += table.At(i, 1);
    // The windowed sinc's weights for an entry sum to 1 only nearly.
    const double within = filter == MipFilter::kLanczos3 ? 1e-3 : 1e-6;
    EXPECT_NEAR(levels[4].At(0, 1), mean / static_cast<double>(table.entries()), within) << int(filter);
  }
  // Eight entries make one, and the third of an odd edge is shared.
  const Table cube({2, 2, 2}, 1, Samples{1, 2, 3, 4, 5, 6, 7, 8}, TableAlign::kCentres);
  EXPECT_EQ(MipChain(cube)[1].At(0, 0), 4.5f);
  const Table odd({5}, 1, Samples{2, 4, 6, 8, 10}, TableAlign::kCentres);
  EXPECT_THAT(MipChain(odd)[1].Samples(), ElementsAre((2 + 4 + 3) / 2.5f, (3 + 8 + 10) / 2.5f));
  // A tent that is twice as wide on every level: 1 3 5 7 7 5 3 1, not 1 3 3 1 twice over.
  Samples impulse(16, 0);
  impulse[5] = 32;
  const Table texture({16}, 1, impulse, TableAlign::kCentres);
  EXPECT_THAT(MipChain(texture, MipFilter::kLinear, {Wrap::kRepeat})[2].Samples(),
              ElementsAre(1.0f, 7.0f, 0.0f, 0.0f));
  // Levels of a tabulated function keep to its coordinates, its ends included.
  Samples ramp(17);
  for (size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<float>(i) / 16;
  const Table function({17}, 1, ramp, TableAlign::kEnds);
  for (const MipFilter filter : {MipFilter::kBox, MipFilter::kLinear}) {
    const Table level = MipChain(function, filter)[2];
    ASSERT_EQ(level.size(0), 4);
    for (int i = 1; i < 3; ++i) EXPECT_NEAR(level.At(i, 0), i / 3.0, 0.01) << int(filter);
    EXPECT_NEAR(level.At(0, 0) + level.At(3, 0), 1, 1e-6) << int(filter);
  }
  EXPECT_THAT(Refusal([] {
                MipChain(RandomTable({2, 2, 2, 2}, 1));
              }),
              HasSubstr("4 dimensions, expected 1 to 3"));
}

}  // namespace
}  // namespace tessera
