// The mean of an image: its value, what does not count, and that nothing but the image decides on it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/test_ops.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/render.h"

namespace tessera {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

std::vector<float> MeanOf(const Node& node, const RenderOptions& options = {}) {
  const Image image = Render(Mean(node), PixelType::kFloat, options);
  EXPECT_EQ(image.spec().data_window, (Roi{0, 0, 1, 1}));
  std::vector<float> mean;
  for (int c = 0; c < image.spec().channel_count(); ++c) mean.push_back(image.at<float>(0, 0, c));
  return mean;
}

Image Of(int width, int channels, const std::vector<float>& samples) {
  const int height = static_cast<int>(samples.size()) / width / channels;
  const Image image{ImageSpec(width, height, channels)};
  std::copy(samples.begin(), samples.end(), reinterpret_cast<float*>(image.view().data));
  return image;
}

TEST(Mean, IsOfEveryChannelWhateverTheWindow) {
  for (const int channels : {1, 2, 3, 4, 7}) {
    const Image image = testing::RandomImage({-7, 3, 131, 60}, channels, 5);
    const std::vector<float> got = MeanOf(FromImage(image));
    ASSERT_EQ(got.size(), static_cast<size_t>(channels));
    for (int c = 0; c < channels; ++c) {
      long double sum = 0;
      for (int y = 3; y < 60; ++y) {
        for (int x = -7; x < 131; ++x) sum += image.at<float>(x, y, c);
      }
      EXPECT_EQ(got[static_cast<size_t>(c)], static_cast<float>(sum / (138 * 57))) << channels << " " << c;
    }
  }
}

TEST(Mean, OfPixelsThatAreFiniteInEveryChannel) {
  const Image image = Of(2, 3, {1, 2, 3, 5, kNan, 7, 3, 6, 9, 1, -kInf, 1});
  EXPECT_EQ(MeanOf(FromImage(image)), (std::vector<float>{2, 4, 6}));
  for (const float v : MeanOf(FromImage(Of(1, 3, {kNan, 0, 0})))) EXPECT_TRUE(std::isnan(v));
  const Node grey = FromImage(Of(9, 1, {1, 2, 3, 4, 5, 6, 7, kInf, 12}));
  EXPECT_EQ(MeanOf(grey), std::vector<float>{5});
  EXPECT_EQ(MeanOf(FromImage(Of(1, 1, {-0.25f}))), std::vector<float>{-0.25f});
  ImageSpec none(4, 4, 1);
  none.data_window = {2, 2, 2, 2};
  EXPECT_TRUE(std::isnan(MeanOf(FromImage(Image(none)))[0]));
}

// What is lost beside a large sum is kept.
TEST(Mean, LosesNothingBesideLargeSums) {
  std::vector<float> samples(size_t{1} << 16, 1e-3f);
  samples[0] = 3e38f, samples[8] = -3e38f;
  const double expected =
      (static_cast<double>(samples.size()) - 2) * 1e-3f / static_cast<double>(samples.size());
  EXPECT_NEAR(MeanOf(FromImage(Of(256, 1, samples)))[0], expected, expected * 1e-6);
}

TEST(Mean, DependsOnTheImageAlone) {
  const Node image = FromImage(testing::RandomImage({0, 0, 997, 403}, 3, 9));
  const std::vector<float> one = MeanOf(image, {.threads = 1});
  EXPECT_EQ(MeanOf(image, {.threads = 2}), one);
  EXPECT_EQ(MeanOf(image, {.threads = 5, .memory_budget = size_t{1} << 20}), one);
  EXPECT_EQ(MeanOf(image, {.tile_width = 17, .tile_height = 3, .shuffle_tiles = true}), one);
}

TEST(Mean, IsWhatContrastKeeps) {
  const Node image = FromImage(testing::RandomImage({0, 0, 64, 48}, 3, 2));
  const std::vector<float> mean = MeanOf(ChannelSum(image, {.weights = {0.2126, 0.7152, 0.0722}}));
  const Image got = Render(Contrast(image, 0), PixelType::kFloat);
  EXPECT_NEAR(got.at<float>(5, 7, 1), mean[0], 1e-6);
}

}  // namespace
}  // namespace tessera
