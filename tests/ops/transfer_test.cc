// The pixel-transfer pipeline stage by stage: order, formats, clamps and codes, lists of constants, what is
// refused, samples that are no numbers.
#include "tessera/ops/transfer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/lookups.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::OnEveryTarget;
using testing::Pixels;
using testing::Samples;
using testing::Values;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Table Ends(const Samples& entries) {
  return Table({static_cast<int>(entries.size())}, 1, entries, TableAlign::kEnds);
}

TEST(TransferTest, StagesComeInTheirOrder) {
  const Node image = Pixels({0.2f, 0.4f, 0.6f, 0.5f}, 4);
  OnEveryTarget([&] {
    // Scale, then table: 0.2 * 2 = 0.4 is nearest to entry 0 of (0, 10); 0.4 * 2 = 0.8 to entry 1.
    TransferParams p{.scale = {2}, .table1 = {{Ends({0, 10})}, ColorTableFormat::kLuminance}};
    EXPECT_THAT(Values(Transfer(image, p)), ::testing::ElementsAre(0, 10, 10, 1));
    // Then the matrix on columns, then scale and bias, then the second table.
    p.matrix = {0, 1, 0, 0, 0, 0.1, 1, 0, 0};
    p.scale2 = {0.1}, p.bias2 = {0, 0, 0, 0.5};
    p.table2 = {{Ends({0, 0.25, 0.5, 0.75, 1})}, ColorTableFormat::kAlpha, true};
    const Samples v = Values(Transfer(image, p));
    EXPECT_FLOAT_EQ(v[0], 1);
    EXPECT_FLOAT_EQ(v[1], 0.1f);
    EXPECT_FLOAT_EQ(v[2], 0);
    EXPECT_FLOAT_EQ(v[3], 0.6f);
  });
}

TEST(TransferTest, FormatsReplaceTheirChannels) {
  const Samples in = {0.9f, 0.8f, 0.7f, 0.6f};
  const Node image = Pixels(in, 4);
  const Table a = Ends({1, 11}), b = Ends({2, 12}), c = Ends({3, 13}), d = Ends({4, 14});
  const struct {
    ColorTableFormat format;
    std::vector<Table> tables;
    Samples want;
  } kRows[] = {{ColorTableFormat::kRgba, {a, b, c, d}, {11, 12, 13, 14}},
               {ColorTableFormat::kRgb, {a, b, c}, {11, 12, 13, 0.6f}},
               {ColorTableFormat::kLuminance, {a}, {11, 11, 11, 0.6f}},
               {ColorTableFormat::kLuminanceAlpha, {a, b}, {11, 11, 11, 12}},
               {ColorTableFormat::kAlpha, {a}, {0.9f, 0.8f, 0.7f, 11}},
               {ColorTableFormat::kIntensity, {a}, {11, 11, 11, 11}}};
  for (const auto& row : kRows) {
    EXPECT_EQ(Values(Transfer(image, {.table1 = {row.tables, row.format}})), row.want);
    EXPECT_THROW(Transfer(image, {.table1 = {{a, a, a, a, a}, row.format}}), Error);
  }
  EXPECT_EQ(Values(Transfer(image, {.maps = {a, b, c, d}})), (Samples{11, 12, 13, 14}));
  EXPECT_EQ(Values(Transfer(image, {})), in);
  EXPECT_THROW(Transfer(image, {.matrix = {1, 2, 3}}), Error);
}

TEST(TransferTest, ClampsAndCodesWhereAsked) {
  const Node image = Pixels({1.5f, -0.5f, 0.3f, 1}, 4);
  const std::vector<double> half = {0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5};
  EXPECT_THAT(Values(Transfer(image, {.scale = {2, 2, 2, 1}, .matrix = half})),
              ::testing::ElementsAre(1.5f, -0.5f, 0.3f, 1));
  EXPECT_THAT(
      Values(Transfer(image, {.scale = {2, 2, 2, 1}, .matrix = half, .clamp = TransferClamp::kFinal})),
      ::testing::ElementsAre(1, 0, 0.3f, 1));
  EXPECT_THAT(
      Values(Transfer(image, {.scale = {2, 2, 2, 1}, .matrix = half, .clamp = TransferClamp::kStages})),
      ::testing::ElementsAre(0.5f, 0, 0.3f, 1));
  // An 8-bit framebuffer between the stages: 0.3 doubled is code 153; 0.4 of that is 61.2, so 61.
  const std::vector<double> less = {0.4, 0, 0, 0, 0.4, 0, 0, 0, 0.4};
  const Samples codes = Values(Transfer(image, {.scale = {2, 2, 2, 1}, .matrix = less, .bits = 8}));
  EXPECT_THAT(codes,
              ::testing::ElementsAre(static_cast<float>(102 / 255.0), 0, static_cast<float>(61 / 255.0), 1));
}

TEST(TransferTest, RotationAboutTheMiddleOfTheCube) {
  // Scale 2, bias -1, rotation, scale 1/2, bias 1/2 fixes (1/2, 1/2, 1/2) and turns the rest about it.
  const TransferParams p{.scale = {2, 2, 2, 1},
                         .bias = {-1, -1, -1, 0},
                         .matrix = {0, -1, 0, 1, 0, 0, 0, 0, 1},
                         .scale2 = {0.5, 0.5, 0.5, 1},
                         .bias2 = {0.5, 0.5, 0.5, 0}};
  const Samples v = Values(Transfer(Pixels({0.5f, 0.5f, 0.5f, 1, 1, 0.5f, 0.25f, 1}, 4), p));
  EXPECT_THAT(v, ::testing::ElementsAre(0.5f, 0.5f, 0.5f, 1, 0.5f, 1, 0.25f, 1));
}

TEST(TransferTest, ConvolutionStandsBetweenTheTables) {
  const Node image = Pixels({0, 0, 1, 0, 0}, 1);
  Kernel mean;
  mean.width = 3, mean.anchor_x = 1, mean.weights = {1 / 3.0, 1 / 3.0, 1 / 3.0};
  const Samples v = Values(Transfer(image, {.kernel = mean, .scale_convolved = {3}, .bias_convolved = {1}}));
  EXPECT_FLOAT_EQ(v[0], 1);
  EXPECT_FLOAT_EQ(v[1], 2);
  EXPECT_FLOAT_EQ(v[2], 2);
}

TEST(TransferTest, ListsAreForAllChannelsForEachOrForRgba) {
  using ::testing::HasSubstr;
  const Samples in = {0.5f, 0.25f, 1, 0.75f};
  // Three channels have no alpha to be scaled, one has R alone; the fifth of five keeps its bits.
  EXPECT_EQ(Values(Transfer(Pixels({in[0], in[1], in[2]}, 3), {.scale = {2, 4, 8, 16}})), (Samples{1, 1, 8}));
  EXPECT_EQ(Values(Transfer(Pixels({in[0]}, 1), {.bias = {2, 4, 8, 16}})), (Samples{2.5f}));
  EXPECT_EQ(Values(Transfer(Pixels({1, 1, 1, 1, 1}, 5), {.scale2 = {2, 4, 8, 16}})),
            (Samples{2, 4, 8, 16, 1}));
  EXPECT_EQ(Values(Transfer(Pixels({1, 1, 1, 1, 1}, 5), {.scale2 = {2, 3, 4, 5, 6}})),
            (Samples{2, 3, 4, 5, 6}));
  const Node rgba = Pixels(in, 4), rgb = Pixels({in[0], in[1], in[2]}, 3);
  const auto refusal = [](const Node& image, const TransferParams& p) {
    return Refusal([&] { Transfer(image, p); });
  };
  EXPECT_THAT(refusal(rgba, {.scale = {1, 2}}), HasSubstr("transfer:scale: found 2 numbers, expected 1"));
  EXPECT_THAT(refusal(rgba, {.bias = {1, 2, 3}}), HasSubstr("transfer:bias: found 3 numbers"));
  EXPECT_THAT(
      refusal(rgb, {.scale_convolved = {1, 2}}),
      HasSubstr("transfer:scalec: found 2 numbers, expected 1 for all channels, 3, one per channel, or 4"));
  EXPECT_THAT(refusal(rgba, {.bias_convolved = {1, 2, 3, 4, 5}}), HasSubstr("transfer:biasc: found 5"));
  EXPECT_THAT(refusal(rgba, {.scale2 = {1, 2}}), HasSubstr("transfer:scale2: found 2"));
  EXPECT_THAT(refusal(rgba, {.bias2 = {1, kNaN, 3, 4}}), HasSubstr("transfer:bias2: found nan"));
  const Table ends = Ends({0, 1}), wide({2, 2}, 1, Samples{0, 1, 2, 3}, TableAlign::kEnds);
  EXPECT_THAT(refusal(rgba, {.maps = {ends, ends}}), HasSubstr("transfer:map: found 2 maps"));
  EXPECT_THAT(refusal(rgba, {.table1 = {{ends}}}), HasSubstr("transfer:table1: found 1 tables, expected 3"));
  EXPECT_THAT(refusal(rgba, {.table_convolved = {{ends, Table(), ends}}}),
              HasSubstr("transfer:tablec: found an empty table"));
  EXPECT_THAT(refusal(rgba, {.table2 = {{ends, wide, ends}}}),
              HasSubstr("transfer:table2: found a table of 2 dimensions and 1 channels"));
  EXPECT_THAT(refusal(rgba, {.bits = 25}), HasSubstr("transfer:quantize: found 25 bits"));
}

TEST(TransferTest, CountsTheSamplesThatTablesTakeForTheirFirstEntry) {
  // NaN in R of the second pixel and in A of the third; the first table replaces what is NaN in the colours.
  const Node image = Pixels({0, 0.5f, 1, 1, kNaN, 0.5f, 1, 1, 0.25f, 0.5f, 1, kNaN}, 4);
  const Table ends = Ends({0.25f, 1});
  TransferParams p{.table1 = {{ends}, ColorTableFormat::kLuminance},
                   .table2 = {{ends}, ColorTableFormat::kIntensity}};
  p.lookup = Table({2, 2}, 1, Samples{0, 1, 2, 3}, TableAlign::kEnds);
  for (const int threads : {1, 3}) {
    const std::vector<LostSamples> lost = CountLostSamples(image, p, {.threads = threads});
    ASSERT_EQ(lost.size(), 3u);
    EXPECT_EQ(lost[0].stage, "table1");
    EXPECT_EQ(lost[0].lost.not_a_number, 1);
    EXPECT_EQ(lost[0].lost.first_x, 1);
    EXPECT_EQ(lost[1].stage, "table2");
    EXPECT_EQ(lost[1].lost.not_a_number, 1);
    EXPECT_EQ(lost[1].lost.first_x, 2);
    EXPECT_EQ(lost[2].stage, "lookup");
    EXPECT_EQ(lost[2].lost.not_a_number, 0);
    EXPECT_EQ(lost[2].lost.pixels, 3);
  }
  p.lookup = {};
  EXPECT_EQ(Values(Transfer(image, p))[4], 0.25f);
  EXPECT_TRUE(CountLostSamples(image, {.scale = {2}}).empty());
}

}  // namespace
}  // namespace tessera
