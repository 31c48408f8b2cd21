// The accumulation buffer, its fixed-point formats, running totals, jitter, range analysis.
#include "tessera/ops/accumulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
using Format = AccumulationFormat;

Image Row(const std::vector<float>& values) {
  const Image image(ImageSpec(static_cast<int>(values.size()), 1, 1));
  std::copy(values.begin(), values.end(), reinterpret_cast<float*>(image.view().data));
  return image;
}

// 8-bit white noise.
Image Codes(int width, int height, uint32_t seed) {
  const Image image(ImageSpec(width, height, 1, PixelType::kUint8));
  std::mt19937 random(seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<uint8_t>(x, y) = static_cast<uint8_t>(random());
  }
  return image;
}

TEST(AccumulationBufferTest, OperatorsAreThoseOfGl) {
  const Image image = Row({0.25f, -0.5f, 2.0f, kNaN});
  AccumulationBuffer buffer(image.spec().data_window, 1);
  const Image out = Row({0, 0, 0, 0});
  buffer.Load(image.view(), 2);
  buffer.Accumulate(image.view(), 0.5);
  buffer.Add(0.125);
  buffer.Multiply(2);  // the factor is not limited to 1
  EXPECT_EQ(buffer.at(0, 0, 0), 2 * (2.5 * 0.25 + 0.125));
  buffer.Return(out.view(), 0.5, false);
  EXPECT_EQ(out.at<float>(0, 0), 0.75f);
  EXPECT_EQ(out.at<float>(1, 0), -1.125f);
  EXPECT_EQ(out.at<float>(2, 0), 5.125f);
  EXPECT_TRUE(std::isnan(out.at<float>(3, 0)));
  buffer.Return(out.view(), 0.5);
  EXPECT_EQ(out.at<float>(1, 0), 0.0f);
  EXPECT_EQ(out.at<float>(2, 0), 1.0f);
  EXPECT_EQ(out.at<float>(3, 0), 0.0f);
  buffer.Clear(0.5);
  EXPECT_EQ(buffer.at(3, 0, 0), 0.5);
}

TEST(AccumulationBufferTest, FixedPointRoundsAndSaturates) {
  AccumulationBuffer buffer({0, 0, 5, 1}, 1, {Format::Store::kFixed, 8});
  buffer.Load(Row({0.3f, 0.9f, -0.9f, kNaN, kInf}).view());
  EXPECT_EQ(buffer.at(0, 0, 0), 77.0 / 256);
  EXPECT_EQ(buffer.at(3, 0, 0), 0.0);
  EXPECT_EQ(buffer.at(4, 0, 0), 1.0);
  buffer.Accumulate(Row({0.3f, 0.9f, -0.9f, 0, 0}).view());
  EXPECT_EQ(buffer.at(1, 0, 0), 1.0);
  EXPECT_EQ(buffer.at(2, 0, 0), -1.0);
  // Two returns make an absolute value: what is negative is lost in each.
  const Image positive = Row({0, 0, 0, 0, 0}), negative = Row({0, 0, 0, 0, 0});
  buffer.Return(positive.view());
  buffer.Return(negative.view(), -1);
  EXPECT_EQ(positive.at<float>(2, 0) + negative.at<float>(2, 0), 1.0f);
}

TEST(AccumulationBufferTest, SixteenImagesAtFourDepths) {
  constexpr int kSide = 256, kImages = 16;
  std::vector<Image> images;
  for (uint32_t k = 0; k < kImages; ++k) images.push_back(Codes(kSide, kSide, k + 1));
  // The course's figures for this very sum, and the step that they are counted in.
  const struct {
    int bits;
    double reported;
  } kRows[] = {{8, 1.9e-2}, {12, 1.2e-3}, {16, 7e-5}, {24, 3e-7}};
  for (const auto& row : kRows) {
    AccumulationBuffer buffer({0, 0, kSide, kSide}, 1, {Format::Store::kFixed, row.bits});
    for (const Image& image : images) buffer.Accumulate(image.view(), 1.0 / kImages);
    std::vector<Node> nodes;
    for (const Image& image : images) nodes.push_back(FromImage(image));
    const Image sum = Render(WeightedSum(nodes, {std::vector<double>(kImages, 1.0 / kImages), row.bits}));
    double worst = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        double exact = 0;
        for (const Image& image : images) exact += image.at<uint8_t>(x, y) / 255.0 / kImages;
        worst = std::max(worst, std::fabs(buffer.at(x, y, 0) - exact));
        ASSERT_EQ(sum.at<float>(x, y), static_cast<float>(buffer.at(x, y, 0)));
      }
    }
    RecordProperty("max_error_" + std::to_string(row.bits) + "_bits", std::to_string(worst));
    EXPECT_LT(worst, 1.4 * row.reported) << row.bits;
    EXPECT_GT(worst, 0.5 * row.reported) << row.bits;
  }
}

TEST(WeightedSumTest, IsTheNearestFloatOfTheExactSum) {
  // 300 images of values that cancel: naive float sums would lose every digit.
  std::vector<Node> images;
  std::vector<double> weights;
  for (int k = 0; k < 300; ++k) {
    const float big = k % 2 == 0 ? 1e6f : -1e6f;
    images.push_back(FromImage(Row({big, 0.1f, 1e-3f * static_cast<float>(k), big + 0.5f})));
    weights.push_back(1.0 / 300);
  }
  OnEveryTarget([&] {
    const Image sum = Render(WeightedSum(images, {weights}));
    EXPECT_NEAR(sum.at<float>(0, 0), 0, 1e-12);
    EXPECT_EQ(sum.at<float>(1, 0), 0.1f);
    EXPECT_NEAR(sum.at<float>(2, 0), 0.1495, 2e-8);
    EXPECT_NEAR(sum.at<float>(3, 0), 0.5, 3e-8);
  });
}

TEST(WeightedSumTest, WeightZeroTakesNoPart) {
  const Node a = FromImage(Row({1, kNaN, kInf})), b = FromImage(Row({2, 3, 4}));
  OnEveryTarget([&] {
    const Image sum = Render(WeightedSum({a, b}, {{0, 0.5}}));
    for (int x = 0; x < 3; ++x) EXPECT_EQ(sum.at<float>(x, 0), 1 + 0.5f * static_cast<float>(x));
    EXPECT_EQ(Render(WeightedSum({a}, {{0}})).at<float>(1, 0), 0.0f);
  });
}

TEST(WeightedSumTest, Refusals) {
  const Node a = FromImage(Row({1, 2})), b = FromImage(Row({1, 2, 3}));
  EXPECT_THAT(Refusal([&] { WeightedSum({a, b}, {{1, 1}}); }), HasSubstr("3x1"));
  EXPECT_THAT(Refusal([&] { WeightedSum({a, a}, {{1}}); }), HasSubstr("2 images and 1 weights"));
  EXPECT_THAT(Refusal([&] { WeightedSum({a}, {{NAN}}); }), HasSubstr("finite"));
  EXPECT_THAT(Refusal([&] { WeightedSum({a}, {{1}, 7}); }), HasSubstr("7 bits"));
  EXPECT_THAT(Refusal([&] { Average({}); }), HasSubstr("0 images"));
}

TEST(RunningTotalTest, DoesNotDrift) {
  constexpr int kLength = 10, kFrames = 100000, kWidth = 64;
  RunningTotal total({0, 0, kWidth, 1}, 1, kLength);
  std::vector<Image> last;
  std::mt19937 random(5);
  for (int t = 0; t < kFrames; ++t) {
    const Image frame(ImageSpec(kWidth, 1, 1, PixelType::kUint8));
    for (int x = 0; x < kWidth; ++x) frame.at<uint8_t>(x, 0) = static_cast<uint8_t>(random());
    total.Push(frame.view());
    last.push_back(frame);
    if (last.size() > kLength) last.erase(last.begin());
  }
  const Image mean(ImageSpec(kWidth, 1, 1));
  total.Mean(mean.view());
  for (int x = 0; x < kWidth; ++x) {
    double exact = 0;
    for (const Image& image : last) exact += static_cast<float>(image.at<uint8_t>(x, 0) / 255.0);
    EXPECT_EQ(mean.at<float>(x, 0), static_cast<float>(exact / kLength)) << x;
  }
  EXPECT_EQ(total.pushed(), kFrames);
}

TEST(RunningTotalTest, RecoversFromWhatHasLeft) {
  RunningTotal total({0, 0, 4, 1}, 1, 3);
  const Image mean = Row({0, 0, 0, 0});
  EXPECT_THAT(Refusal([&] { total.Mean(mean.view()); }), HasSubstr("no image yet"));
  total.Push(Row({kNaN, kInf, 3e38f, 1}).view());
  total.Mean(mean.view());
  EXPECT_TRUE(std::isnan(mean.at<float>(0, 0)));
  for (int t = 0; t < 3; ++t) total.Push(Row({0.5f, 0.25f, 1e-3f, 1e-30f}).view());
  total.Mean(mean.view());
  EXPECT_EQ(mean.at<float>(0, 0), 0.5f);
  EXPECT_EQ(mean.at<float>(1, 0), 0.25f);
  EXPECT_EQ(mean.at<float>(2, 0), 1e-3f);
  EXPECT_EQ(mean.at<float>(3, 0), 1e-30f);
}

TEST(JitterTest, SetsLieInThePixelAboutItsMiddle) {
  for (const int n : {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 16, 17, 64, 1000}) {
    SCOPED_TRACE(n);
    const std::vector<JitterPoint> set = JitterSet(n);
    ASSERT_EQ(static_cast<int>(set.size()), n);
    double x = 0, y = 0, nearest = 1;
    std::set<double> columns, rows;
    for (size_t i = 0; i < set.size(); ++i) {
      EXPECT_TRUE(set[i].x >= 0 && set[i].x < 1 && set[i].y >= 0 && set[i].y < 1);
      x += set[i].x / n, y += set[i].y / n;
      columns.insert(set[i].x), rows.insert(set[i].y);
      for (size_t j = 0; j < i; ++j) {
        const double dx = std::remainder(set[i].x - set[j].x, 1.0),
                     dy = std::remainder(set[i].y - set[j].y, 1.0);
        nearest = std::min(nearest, std::hypot(dx, dy));
      }
    }
    EXPECT_NEAR(x, 0.5, n == 3 ? 0.0035 : 1e-9);
    EXPECT_NEAR(y, 0.5, n == 3 ? 0.0035 : 1e-9);
    const bool printed = n == 4 || n == 9 || n == 12 || n == 16;
    if (!printed) {
      EXPECT_EQ(static_cast<int>(columns.size()), n);
    }
    if (n > 16 || n == 7 || n == 10 || n == 11 || n == 13) {
      EXPECT_GT(nearest, 0.7 / std::sqrt(n));
    }
  }
  EXPECT_THAT(Refusal([] { JitterSet(0); }), HasSubstr("count of 0"));
}

TEST(ShiftAccumulateTest, RangesHoldEveryPrefix) {
  const std::vector<double> sobel = {-1, 0, 1, -2, 0, 2, -1, 0, 1};
  const AccumulationRange range = KernelRange(sobel);
  EXPECT_EQ(range.minimum, -4);
  EXPECT_EQ(range.maximum, 4);
  EXPECT_EQ(range.scale, 0.25);
  EXPECT_EQ(KernelRange({0, 0, 0}).scale, 1);
  EXPECT_EQ(KernelRange({1, 1}, 0.5, 0.75).minimum, 0);  // the range is widened to 0
  // In fixed point nothing saturates, and the error stays within half a step per tap.
  const Image image = Codes(32, 16, 3);
  const Image exact = Render(ShiftAccumulate(FromImage(image), {sobel, 3, 3}));
  OnEveryTarget([&] {
    for (const int bits : {8, 16, 24}) {
      ShiftAccumulateParams p{sobel, 3, 3};
      p.bits = bits;
      const Image fixed = Render(ShiftAccumulate(FromImage(image), p));
      for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 32; ++x) {
          ASSERT_NEAR(fixed.at<float>(x, y), exact.at<float>(x, y),
                      6 * std::ldexp(1.0, -bits - 1) / 0.25 + 1e-6);
        }
      }
    }
  });
  EXPECT_THAT(Refusal([&] { ShiftAccumulate(FromImage(image), {{1, 2}, 3, 3}); }), HasSubstr("found 2 taps"));
}

}  // namespace
}  // namespace tessera
