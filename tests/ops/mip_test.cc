// All levels of a box in one pass against each level by itself, and against sums in long double.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <random>
#include <string>
#include <utility>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/node.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"
#include "verify/pixels.h"

namespace tessera {
namespace {

using testing::Content;
using testing::OnEveryTarget;
using testing::Picture;

Image AllLevels(const Image& image, FilterMethod method, int threads = 1) {
  RenderOptions options;
  options.threads = threads;
  return Render(Mip(FromImage(image), {"box", Wrap::kClamp, -1, method}), image.spec().type, options);
}

// The sides that matter: about strips of 256 columns and bands of 64 rows, even and odd after any number of
// halvings.
int Side(std::mt19937& random) {
  constexpr int kSides[] = {1,   2,   3,   5,   48,  63,  64,  65,  127, 128,
                            129, 192, 255, 256, 257, 320, 511, 512, 513, 768};
  const auto pick = random() % 30;
  return pick < std::size(kSides) ? kSides[pick] : 1 + static_cast<int>(random() % 700);
}

TEST(MipTest, OnePassEqualsEachLevelByItself) {
  OnEveryTarget([] {
    std::mt19937 random(20261127);
    for (int trial = 0; trial < 60; ++trial) {
      const Roi window{-3, 2, -3 + Side(random), 2 + Side(random)};
      const int channels = 1 + static_cast<int>(random() % 5);
      const PixelType type = std::array{PixelType::kFloat, PixelType::kHalf, PixelType::kUint8,
                                        PixelType::kUint16}[random() % 4];
      const Content content = random() % 3 == 0 ? Content::kSpecial : Content::kOrdinary;
      SCOPED_TRACE(std::to_string(window.width()) + "x" + std::to_string(window.height()) + "x" +
                   std::to_string(channels) + " type " + std::to_string(static_cast<int>(type)));
      const Image image = Picture(window, channels, type, static_cast<uint32_t>(trial), content);
      const Image one = AllLevels(image, FilterMethod::kAuto), many = AllLevels(image, FilterMethod::kDirect);
      ASSERT_EQ(one.spec().data_window, many.spec().data_window);
      const Roi& roi = one.spec().data_window;
      int64_t wrong = 0;
      for (int y = roi.y0; y < roi.y1; ++y) {
        for (int x = roi.x0; x < roi.x1; ++x) {
          for (int c = 0; c < channels; ++c) {
            const double a = verify::SampleOf(one.view(), x, y, c),
                         b = verify::SampleOf(many.view(), x, y, c);
            if (std::isnan(a) && std::isnan(b)) continue;
            // One pass rounds once; halves by themselves are floats, rounded up to three times.
            const double step = type == PixelType::kFloat   ? 0x1p-22
                                : type == PixelType::kHalf  ? std::fabs(b) * 0x1p-10 + 0x1p-22
                                : type == PixelType::kUint8 ? 1.001 / 255
                                                            : 1.001 / 65535;
            const double cancelled = content == Content::kSpecial && type == PixelType::kFloat ? 1e32 : 0;
            if (!(a == b || std::fabs(a - b) <= step + cancelled)) ++wrong;
          }
        }
      }
      EXPECT_EQ(wrong, 0);
    }
  });
}

TEST(MipTest, LevelsAreMeansOfTheirWindows) {
  OnEveryTarget([] {
    for (const auto& [width, height] : {std::pair{512, 384}, {300, 257}, {77, 530}}) {
      const Image image = Picture({0, 0, width, height}, 4, PixelType::kFloat, 9);
      const Image all = AllLevels(image, FilterMethod::kAuto);
      for (int level = 1; level < MipLevelCount(image.spec()); ++level) {
        const Roi at = MipLevelWindow(image.spec(), level);
        const double step_x = double{1} * width / at.width(), step_y = double{1} * height / at.height();
        for (int y = 0; y < at.height(); ++y) {
          for (int x = 0; x < at.width(); ++x) {
            long double sum = 0, largest = 0;
            int64_t count = 0;
            for (int j = 0; j < height; ++j) {
              if (std::fabs(j + 0.5 - (y + 0.5) * step_y) > step_y / 2 + 1e-9) continue;
              for (int i = 0; i < width; ++i) {
                if (std::fabs(i + 0.5 - (x + 0.5) * step_x) > step_x / 2 + 1e-9) continue;
                const float v = image.at<float>(i, j, 1);
                sum += v, ++count;
                largest = std::max<long double>(largest, std::fabs(v));
              }
            }
            ASSERT_NEAR(all.at<float>(at.x0 + x, at.y0 + y, 1), static_cast<double>(sum / count),
                        static_cast<double>(largest) * 0x1p-24 * 1.01)
                << level << ": " << x << ", " << y;
          }
        }
      }
    }
  });
}

// Means half way between two codes are put aside for the sink only where they are means of codes: an image
// that was computed from codes has any values.
TEST(MipTest, ComputedValuesAreNotTakenForCodes) {
  OnEveryTarget([] {
    const Image codes(ImageSpec(256, 256, 1, PixelType::kUint16));
    std::mt19937 random(20261127);
    for (int y = 0; y < 256; ++y) {
      for (int x = 0; x < 256; ++x) codes.at<uint16_t>(x, y) = static_cast<uint16_t>(random());
    }
    const Node inverted = Invert(FromImage(codes));
    const Image in = Render(inverted, PixelType::kFloat);
    const Node halves[] = {Mip(inverted, {}), Mip(inverted, {.method = FilterMethod::kDirect}),
                           Mip(inverted, {.level = 1}),
                           Resize(inverted, {.width = 128, .height = 128, .filter = "box"})};
    for (const Node& half : halves) {
      const Image got = Render(half, PixelType::kFloat);
      const Roi at =
          got.spec().data_window.width() > 128 ? MipLevelWindow(inverted.spec(), 1) : got.spec().data_window;
      for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 128; ++x) {
          double mean = 0, largest = 0;
          for (const auto& [i, j] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
            const double v = in.at<float>(2 * x + i, 2 * y + j);
            mean += v / 4, largest = std::max(largest, v);
          }
          ASSERT_NEAR(got.at<float>(at.x0 + x, at.y0 + y), mean, 2 * 0x1p-24 * largest) << x << " " << y;
        }
      }
    }
  });
}

// Results do not depend on who works, or on how much memory there is beyond what methods say.
TEST(MipTest, ThreadsAndMemory) {
  const Image image = Picture({0, 0, 700, 900}, 4, PixelType::kFloat, 3);
  const Image one = AllLevels(image, FilterMethod::kAuto);
  testing::ExpectSameBits(AllLevels(image, FilterMethod::kAuto, 3), one);
  RenderOptions little;
  little.memory_budget = 1 << 20;
  testing::ExpectSameBits(Render(Mip(FromImage(image), {}), PixelType::kFloat, little),
                          AllLevels(image, FilterMethod::kDirect));
}

}  // namespace
}  // namespace tessera
