// Median, dilate, erode: NaN and signs of zeros, and every way to compute them against plain sorting.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "support/filters.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using namespace tessera::testing;

TEST(RankTest, NumbersAndNaN) {
  Image image = Flat(5, 1, 1, 2);
  image.at<float>(1, 0) = kNaN;
  image.at<float>(2, 0) = -1;
  OnEveryTarget([&] {
    EXPECT_EQ(Render(Median(FromImage(image), {3, 1})).at<float>(1, 0), 2);  // -1, 2, NaN
    EXPECT_EQ(Render(Dilate(FromImage(image), {3, 1})).at<float>(1, 0), 2);
    EXPECT_EQ(Render(Erode(FromImage(image), {3, 1})).at<float>(1, 0), -1);
    Image none = Flat(3, 3, 1, kNaN);
    EXPECT_TRUE(std::isnan(Render(Dilate(FromImage(none), {3, 3})).at<float>(0, 0)));
    EXPECT_TRUE(std::isnan(Render(Median(FromImage(none), {3, 3})).at<float>(1, 1)));
  });
}

struct Ranks {
  double median, largest, smallest;
};
// Of the samples under the window of (x, y) that exist, as the declarations have it.
Ranks PlainRanks(const Image& image, int x, int y, int c, const RankParams& p) {
  const ConstImageView v = image.view();
  std::vector<double> numbers;
  size_t all = 0;
  for (int j = std::max(0, y - p.height / 2); j < std::min(v.roi.y1, y - p.height / 2 + p.height); ++j) {
    for (int i = std::max(0, x - p.width / 2); i < std::min(v.roi.x1, x - p.width / 2 + p.width);
         ++i, ++all) {
      const double sample = v.type == PixelType::kFloat    ? image.at<float>(i, j, c)
                            : v.type == PixelType::kUint16 ? image.at<uint16_t>(i, j, c)
                                                           : image.at<uint8_t>(i, j, c);
      if (!std::isnan(sample)) numbers.push_back(sample);
    }
  }
  if (numbers.empty()) return {kNaN, kNaN, kNaN};
  std::sort(numbers.begin(), numbers.end());
  return {all / 2 < numbers.size() ? numbers[all / 2] : kNaN, numbers.back(), numbers.front()};
}

template <typename T>
void ExpectRanks(const Image& image, const RankParams& p) {
  const Node node = FromImage(image);
  const PixelType type = image.spec().type;
  const Image median = Render(Median(node, p), type), largest = Render(Dilate(node, p), type),
              smallest = Render(Erode(node, p), type);
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  const ImageSpec& s = image.spec();
  int wrong = 0;
  for (int y = 0; y < s.height(); ++y) {
    for (int x = 0; x < s.width(); ++x) {
      for (int c = 0; c < s.channel_count(); ++c) {
        const Ranks plain = PlainRanks(image, x, y, c, p);
        wrong += !same(median.at<T>(x, y, c), plain.median) + !same(largest.at<T>(x, y, c), plain.largest) +
                 !same(smallest.at<T>(x, y, c), plain.smallest);
      }
    }
  }
  EXPECT_EQ(wrong, 0) << p.width << "x" << p.height << " of " << s.channel_count() << " channels";
}

// Sorted columns and selection, rings of rows and blocks of them; numbers without a sign, with one, with NaN.
TEST(RankTest, EveryWayOfEveryWindowIsThePlainOne) {
  const RankParams windows[] = {{3, 3}, {5, 5}, {2, 7}, {7, 1}, {6, 8}, {13, 9}, {4, 19}};
  OnEveryTarget([&] {
    for (const int channels : {1, 3}) {
      Image image = Random(43, 41, channels);
      for (const RankParams& p : windows) ExpectRanks<float>(image, p);
      for (int y = 20; y < 41; ++y) image.at<float>(y, y) = y % 2 == 0 ? -1.0f : -0.5f;
      for (const RankParams& p : windows) ExpectRanks<float>(image, p);
      for (int y = 30; y < 41; ++y) {
        for (int x = 5; x < 30; ++x) image.at<float>(x, y, channels - 1) = x % 9 == 0 ? -INFINITY : kNaN;
      }
      for (const RankParams& p : windows) ExpectRanks<float>(image, p);
    }
  });
}

// Rows longer than what is worked on at a time, in pixels that it holds no whole number of.
TEST(RankTest, LongRows) {
  for (const int channels : {1, 2, 3, 5, 7}) {
    Image image = Random(2500 / channels + 41, 9, channels);
    for (const RankParams& p : {RankParams{3, 3}, {5, 5}, {4, 6}, {41, 2}}) ExpectRanks<float>(image, p);
    image.at<float>(20, 3) = kNaN;
    for (const RankParams& p : {RankParams{3, 3}, {5, 5}, {4, 6}, {41, 2}}) ExpectRanks<float>(image, p);
  }
}

TEST(RankTest, CodesOfIntegers) {
  OnEveryTarget([] {
    Image bytes(ImageSpec(45, 23, 3, PixelType::kUint8)), words(ImageSpec(45, 23, 3, PixelType::kUint16));
    uint32_t random = 1;
    for (int y = 0; y < 23; ++y) {
      for (int i = 0; i < 45 * 3; ++i) {
        random = random * 1664525 + 1013904223;
        bytes.at<uint8_t>(i / 3, y, i % 3) = static_cast<uint8_t>(random >> 24);
        words.at<uint16_t>(i / 3, y, i % 3) = static_cast<uint16_t>(random >> 16);
      }
    }
    // Counts of the last do not fit in a byte.
    for (const RankParams& p : {RankParams{3, 3}, {5, 5}, {4, 6}, {13, 12}}) {
      ExpectRanks<uint8_t>(bytes, p);
      ExpectRanks<uint16_t>(words, p);
    }
    // What is no code any more stays what it is.
    const Node brighter = MulConstant(FromImage(bytes), {1.7, 1.7, 1.7});
    const Image whole = Render(brighter);
    for (const int size : {3, 5, 7}) {
      EXPECT_EQ(LargestDifference(Render(Median(brighter, {size, size})),
                                  Render(Median(FromImage(whole), {size, size}))),
                0);
    }
  });
}

// Windows that slide over ranked blocks, at places of every kind: corners, edges, seams of blocks and tiles.
TEST(RankTest, MediansOfLargeWindows) {
  constexpr int kWidth = 331, kHeight = 290;
  Image floats = Random(kWidth, kHeight, 2), bytes(ImageSpec(kWidth, kHeight, 2, PixelType::kUint8)),
        words(ImageSpec(kWidth, kHeight, 2, PixelType::kUint16));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 2; ++c) {
        float& v = floats.at<float>(x, y, c);
        bytes.at<uint8_t>(x, y, c) = static_cast<uint8_t>(v * 255);
        words.at<uint16_t>(x, y, c) = static_cast<uint16_t>(v * 65535);
        if (y > 200 && x % 3 != 0) v = x % 2 == 0 ? kNaN : -v;
      }
    }
  }
  const auto check = [](const Image& image, auto sample, const RankParams& p) {
    using T = decltype(sample);
    const Image median = Render(Median(FromImage(image), p), image.spec().type);
    uint32_t random = 5;
    for (int k = 0; k < 60; ++k) {
      random = random * 1664525 + 1013904223;
      const int x = k < 4 ? k % 2 * (kWidth - 1) : static_cast<int>(random >> 8) % kWidth,
                y = k < 4 ? k / 2 * (kHeight - 1) : static_cast<int>(random >> 16) % kHeight;
      const double plain = PlainRanks(image, x, y, k % 2, p).median;
      const double found = median.at<T>(x, y, k % 2);
      ASSERT_TRUE(found == plain || (std::isnan(found) && std::isnan(plain)))
          << p.width << "x" << p.height << " at " << x << "," << y << ": " << found << ", not " << plain;
    }
  };
  OnEveryTarget([&] {
    // Ranks of the last have more than 16 bits.
    for (const RankParams& p : {RankParams{7, 9}, {31, 31}, {40, 17}, {3, 150}, {255, 2}, {170, 160}}) {
      check(floats, 0.0f, p);
      check(bytes, uint8_t{}, p);
      check(words, uint16_t{}, p);
    }
  });
}

// Of equal zeros the last in reading order is the result; of nothing but NaN there is no number.
TEST(RankTest, ZerosKeepTheirSigns) {
  for (const int height : {3, 9}) {
    Image image = Flat(9, 9, 1, -0.0f);
    image.at<float>(8, 8) = 0.0f;
    OnEveryTarget([&] {
      for (const Image& r :
           {Render(Dilate(FromImage(image), {3, height})), Render(Erode(FromImage(image), {3, height}))}) {
        EXPECT_FALSE(std::signbit(r.at<float>(7, 8)));
        EXPECT_TRUE(std::signbit(r.at<float>(6, 8)));
      }
      EXPECT_TRUE(std::signbit(Render(Median(FromImage(image), {3, height})).at<float>(7, 7)));
    });
  }
}

Image Negative(const Image& image) { return Render(MulConstant(FromImage(image), {-1})); }

TEST(MorphologyTest, SpotsAndGaps) {
  // A light spot of 3x3, a dark one of 1x3, an edge.
  Image image = Flat(40, 20, 1, 0.5f);
  for (int y = 0; y < 20; ++y) {
    for (int x = 30; x < 40; ++x) image.at<float>(x, y) = 0.75f;
  }
  for (int y = 5; y < 8; ++y) {
    for (int x = 6; x < 9; ++x) image.at<float>(x, y) = 1;
    image.at<float>(18, y) = 0;
  }
  OnEveryTarget([&] {
    const auto at = [&](MorphologyOperator op, int x, int y) {
      return Render(Morphology(FromImage(image), op, {5, 5})).at<float>(x, y);
    };
    EXPECT_EQ(at(MorphologyOperator::kOpen, 7, 6), 0.5f);
    EXPECT_EQ(at(MorphologyOperator::kOpen, 18, 6), 0);
    EXPECT_EQ(at(MorphologyOperator::kOpen, 35, 6), 0.75f) << "the window fits";
    EXPECT_EQ(at(MorphologyOperator::kClose, 18, 6), 0.5f);
    EXPECT_EQ(at(MorphologyOperator::kClose, 7, 6), 1);
    EXPECT_EQ(at(MorphologyOperator::kTopHat, 7, 6), 0.5f);
    EXPECT_EQ(at(MorphologyOperator::kTopHat, 18, 6), 0);
    EXPECT_EQ(at(MorphologyOperator::kBlackHat, 18, 6), 0.5f);
    EXPECT_EQ(at(MorphologyOperator::kBlackHat, 7, 6), 0);
    EXPECT_EQ(at(MorphologyOperator::kGradient, 29, 15), 0.25f);
    EXPECT_EQ(at(MorphologyOperator::kGradient, 35, 15), 0);
  });
}

TEST(MorphologyTest, Laws) {
  const Image image = Picture({0, 0, 61, 43}, 3, PixelType::kFloat, 7, Content::kOrdinary);
  const auto run = [](const Image& in, MorphologyOperator op, const RankParams& p) {
    return Render(Morphology(FromImage(in), op, p));
  };
  OnEveryTarget([&] {
    for (const RankParams& p : {RankParams{1, 1}, {3, 3}, {7, 1}, {5, 11}, {99, 99}}) {
      const Image open = run(image, MorphologyOperator::kOpen, p),
                  close = run(image, MorphologyOperator::kClose, p);
      ExpectSameBits(run(open, MorphologyOperator::kOpen, p), open);
      ExpectSameBits(run(close, MorphologyOperator::kClose, p), close);
      ExpectSameBits(Negative(run(Negative(image), MorphologyOperator::kOpen, p)), close);
      for (int y = 0; y < 43; ++y) {
        for (int x = 0; x < 61; ++x) {
          for (int c = 0; c < 3; ++c) {
            ASSERT_LE(open.at<float>(x, y, c), image.at<float>(x, y, c));
            ASSERT_GE(close.at<float>(x, y, c), image.at<float>(x, y, c));
          }
        }
      }
    }
  });
  const auto reason = [&](const RankParams& p) {
    try {
      Morphology(FromImage(image), MorphologyOperator::kOpen, p);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(reason({4, 3}), "morphology: found a window of 4x3, expected odd sides of 1 to 255");
  EXPECT_EQ(reason({3, 257}), "morphology: found a window of 3x257, expected odd sides of 1 to 255");
  EXPECT_EQ(reason({-1, 3}), "morphology: found a window of -1x3, expected odd sides of 1 to 255");
}

}  // namespace
}  // namespace tessera
