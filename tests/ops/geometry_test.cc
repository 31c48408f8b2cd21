// Resampling: bits kept where they must be, hard values and coordinates, mip chains, refusals.
#include "tessera/ops/geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "ops/geometry/filters.h"
#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::Content;
using testing::ExpectSameBits;
using ::testing::HasSubstr;
using testing::OnEveryTarget;
using testing::Picture;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// An image at the origin filled by f(x, y, c).
template <class F>
Image Filled(int width, int height, int channels, F f) {
  const Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = static_cast<float>(f(x, y, c));
    }
  }
  return image;
}
Image Noise(int width, int height, int channels = 4, Content content = Content::kOrdinary) {
  const Image random = Picture({0, 0, width, height}, channels, PixelType::kFloat, 17, content);
  return Filled(width, height, channels, [&](int x, int y, int c) { return random.at<float>(x, y, c); });
}

uint32_t Bits(float v) {
  uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  return bits;
}

// result(x, y) is image(source(x, y)) bit for bit.
template <class F>
void ExpectMoved(const Image& result, const Image& image, F source) {
  const Roi& w = result.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      const auto [sx, sy] = source(x, y);
      if (!image.spec().data_window.Contains({sx, sy, sx + 1, sy + 1})) continue;
      for (int c = 0; c < image.spec().channel_count(); ++c) {
        ASSERT_EQ(Bits(result.at<float>(x, y, c)), Bits(image.at<float>(sx, sy, c))) << x << "," << y;
      }
    }
  }
}

TEST(GeometryTest, FlipsQuarterTurnsAndWholeShiftsKeepBits) {
  const Image image = Noise(23, 17, 4, Content::kSpecial);
  const Node node = FromImage(image);
  OnEveryTarget([&] {
    for (const char* filter : {"triangle", "lanczos3", "catmull-rom", "box"}) {
      SCOPED_TRACE(filter);
      const auto warp = [&](std::vector<double> m) {
        return Render(Warp(node, {std::move(m), filter, Wrap::kBlack, true}));
      };
      ExpectMoved(warp({-1, 0, 0, 0, 1, 0, 23, 0, 1}), image,
                  [](int x, int y) { return std::pair(22 - x, y); });
      ExpectMoved(warp({1, 0, 0, 0, 1, 0, 5, -3, 1}), image,
                  [](int x, int y) { return std::pair(x - 5, y + 3); });
      // A quarter turn whose zeros are what cosf makes of 90 degrees.
      const double c = std::cos(1.5707963267948966);
      ExpectMoved(warp({c, 1, 0, -1, c, 0, 17, 0, 1}), image,
                  [](int x, int y) { return std::pair(y, 16 - x); });
      ExpectMoved(Render(Shift(node, {3, -2, filter, Wrap::kRepeat})), image,
                  [](int x, int y) { return std::pair((x + 20) % 23, (y + 2) % 17); });
    }
    ExpectMoved(Render(Zoom(node, {-1, 1})), image, [](int x, int y) { return std::pair(-1 - x, y); });
    ExpectMoved(Render(Zoom(node, {2, -3})), image,
                [](int x, int y) { return std::pair(x / 2, static_cast<int>(std::floor((y + 0.5) / -3))); });
    ExpectSameBits(Render(Resize(node, {23, 17, 0, 0, "mitchell"})), image);
  });
}

TEST(GeometryTest, ZoomMovesTheWindows) {
  const Node node = FromImage(Noise(10, 6));
  EXPECT_EQ(Zoom(node, {-2, 0.5}).spec().data_window, (Roi{-20, 0, 0, 3}));
  EXPECT_EQ(Zoom(node, {1.5, -1}).spec().display_window, (Roi{0, -6, 15, 0}));
}

TEST(GeometryTest, WeightsSumToOneAndConstantsStay) {
  OnEveryTarget([&] {
    for (const float value : {0.1f, 16777217.0f, 1e-38f, -3.0f}) {
      const Node flat = FromImage(Filled(67, 41, 3, [&](int, int, int) { return value; }));
      for (const std::string& filter : ops::FilterNames()) {
        if (filter == "disk") continue;  // may have no pixel within reach
        const Image image = Render(Resize(flat, {29, 90, 0, 0, filter}));
        for (const int x : {0, 13, 28}) {
          ASSERT_NEAR(image.at<float>(x, 44, 1) / value, 1.0, 1.3e-7) << filter << " " << value;
        }
      }
    }
  });
}

// A depth map's background is often the largest float.
TEST(GeometryTest, HalvesOfTheLargestDoNotOverflow) {
  for (int channels = 1; channels <= 5; ++channels) {
    const Image image = Filled(50, 6, channels, [](int x, int, int c) {
      return x >= 40 ? kInf : x >= 20 ? 0x1p-149f : c % 2 != 0 ? -FLT_MAX : FLT_MAX;
    });
    OnEveryTarget([&] {
      const Image half = Render(Resize(FromImage(image), {25, 3, 0, 0, "box"}));
      for (int x = 0; x < 25; ++x) {
        for (int c = 0; c < channels; ++c)
          ASSERT_EQ(half.at<float>(x, 2, c), image.at<float>(2 * x, 4, c))
              << channels << " " << x << " " << c;
      }
    });
  }
}

TEST(GeometryTest, NaNSpreadsOnlyWhereItHasWeight) {
  const Image image = Filled(32, 24, 4, [](int x, int y, int) { return x == 16 && y == 12 ? kNaN : 0.5f; });
  const Node node = FromImage(image);
  OnEveryTarget([&] {
    const Image half = Render(Resize(node, {16, 12, 0, 0, "box"}));
    const Image shifted = Render(Shift(node, {0.5, 0, "triangle", Wrap::kClamp}));
    const Image warped = Render(Warp(node, {{1, 0, 0, 0, 1, 0, 0.5, 0, 1}, "triangle", Wrap::kClamp, false}));
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 32; ++x) {
        if (x < 16 && y < 12) {
          EXPECT_EQ(std::isnan(half.at<float>(x, y, 2)), x == 8 && y == 6);
        }
        const bool reached = y == 12 && (x == 16 || x == 17);
        EXPECT_EQ(std::isnan(shifted.at<float>(x, y, 0)), reached) << x << "," << y;
        EXPECT_EQ(std::isnan(warped.at<float>(x, y, 0)), reached) << x << "," << y;
      }
    }
  });
}

TEST(GeometryTest, LargeValuesOfBothSignsMeetAtZero) {
  const Node node = FromImage(Filled(2, 1, 1, [](int x, int, int) { return x == 0 ? FLT_MAX : -FLT_MAX; }));
  OnEveryTarget([&] {
    EXPECT_EQ(Render(Shift(node, {0.5, 0, "triangle", Wrap::kClamp})).at<float>(1, 0), 0.0f);
    EXPECT_EQ(
        Render(Warp(node, {{1, 0, 0, 0, 1, 0, 0.5, 0, 1}, "triangle", Wrap::kClamp, false})).at<float>(1, 0),
        0.0f);
  });
}

// Position p read from an image whose pixels hold their own index.
float At(double p, Wrap wrap, const std::string& filter = "triangle") {
  constexpr int kSize = 8;
  static const Node ramp = FromImage(Filled(kSize, 1, 1, [](int x, int, int) { return x; }));
  const Node st = FromImage(Filled(1, 1, 2, [&](int, int, int c) { return c == 0 ? p / kSize : 0.5; }));
  return Render(StWarp(ramp, st, {filter, wrap, Wrap::kClamp})).at<float>(0, 0);
}

TEST(GeometryTest, WrapModesAtTheEdges) {
  OnEveryTarget([&] {
    EXPECT_EQ(At(0, Wrap::kRepeat), 3.5f);  // half of pixel 7, half of pixel 0
    EXPECT_EQ(At(8, Wrap::kRepeat), 3.5f);
    EXPECT_EQ(At(0, Wrap::kClamp), 0.0f);
    EXPECT_EQ(At(0, Wrap::kMirror), 0.0f);
    EXPECT_EQ(At(8, Wrap::kMirror), 7.0f);
    EXPECT_EQ(At(-1.5, Wrap::kMirror), 1.0f);
    EXPECT_EQ(At(-1.5, Wrap::kRepeat), 6.0f);
    EXPECT_EQ(At(9.5, Wrap::kClamp), 7.0f);
    EXPECT_EQ(At(9.5, Wrap::kBlack), 0.0f);
    EXPECT_EQ(At(2.5, Wrap::kBlack), 2.0f);
    EXPECT_EQ(At(2.5 + 8e6, Wrap::kRepeat), 2.0f);
    EXPECT_EQ(At(-1e-8, Wrap::kRepeat), 3.5f);
    for (const Wrap wrap : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
      for (const char* filter : {"triangle", "lanczos3", "box", "gaussian"}) {
        for (const float odd : {kNaN, kInf, -kInf, 3e38f}) EXPECT_EQ(At(odd, wrap, filter), 0.0f) << odd;
        for (const double far : {1e9, -1e9}) EXPECT_TRUE(std::isfinite(At(far, wrap, filter)));
      }
    }
  });
}

TEST(GeometryTest, CoordinatesAreExactAcrossAMillionPixels) {
  // Pixel x holds its index modulo 1024; the warp reads at 1/64-pixel steps near the far end.
  constexpr int kWide = 1000000;
  const Node strip = FromImage(Filled(kWide, 1, 1, [](int x, int, int) { return x % 1024; }));
  OnEveryTarget([&] {
    const Node warped =
        Warp(strip, {{64, 0, 0, 0, 1, 0, -64.0 * 999000, 0, 1}, "triangle", Wrap::kClamp, false});
    const Image image = Render(Crop(warped, {32, 0, 544, 1}));
    for (int x = 32; x < 544; ++x) {
      const double index = 999000 % 1024 + (x + 0.5) / 64 - 0.5;
      ASSERT_NEAR(image.at<float>(x, 0), index, 0x1p-16 + 4e-5) << x;
    }
  });
}

TEST(GeometryTest, WarpsAreTheSameWhereverARunOfPixelsBegins) {
  // Turned, so that runs at the edges have pixels that need a second look and those inside have none; the
  // parts begin elsewhere and are narrower than a run. Maps that reduce give neighbouring pixels one tap more
  // or less; the last map reduces on one side only.
  const auto value = [](int x, int y, int c) {
    const int speck = (x * 131 + y * 77) % 997;
    if (speck < 4) return std::array{std::nan(""), HUGE_VAL, -HUGE_VAL, -0.0}[static_cast<size_t>(speck)];
    return ((x * 37 + y * 101 + c * 11) % 256) / 255.0;
  };
  const Node image = FromImage(Filled(300, 190, 4, value));
  const Node coordinates = FromImage(Filled(300, 190, 4, [](int x, int y, int c) {
    return c == 0 ? (0.95 * x + 0.11 * y) / 300 : (0.97 * y - 0.1 * x + 8.25) / 190;
  }));
  OnEveryTarget([&] {
    for (const char* filter : {"triangle", "simon", "lanczos3", "box"}) {
      for (const Node& node :
           {Warp(image, {{1.05, 0.11, 0, -0.11, 1.05, 0, 10, -15, 1}, filter, Wrap::kMirror, false}),
            Warp(image, {{0.55, 0.06, 0, -0.05, 0.8, 0, 30, 20, 1}, filter, Wrap::kBlack, false}),
            Warp(image, {{0.2, 0, 0, 0, 1.5, 0, 90, -10, 1}, filter, Wrap::kRepeat, false}),
            Warp(image, {{1.02, 0.1, 3e-4, -0.1, 0.98, -2e-4, 5, 5, 1}, filter, Wrap::kClamp, false}),
            StWarp(image, coordinates, {filter, Wrap::kRepeat, Wrap::kClamp})}) {
        const Image whole = Render(node);
        for (const Roi& roi : {Roi{3, 5, 60, 90}, Roi{101, 40, 299, 43}, Roi{160, 0, 230, 190}}) {
          const Image part = Render(Crop(node, roi));
          for (int y = roi.y0; y < roi.y1; ++y) {
            for (int x = roi.x0; x < roi.x1; ++x) {
              for (int c = 0; c < 4; ++c) {
                ASSERT_EQ(std::bit_cast<uint32_t>(part.at<float>(x, y, c)),
                          std::bit_cast<uint32_t>(whole.at<float>(x, y, c)))
                    << filter << " " << x << "," << y;
              }
            }
          }
        }
      }
    }
  });
}

TEST(GeometryTest, HomographiesSeeNothingBehindTheProjector) {
  const Node flat = FromImage(Filled(64, 64, 4, [](int, int, int) { return 1; }));
  // q = 1 - x / 40 of the source: pixels beyond x = 40 are behind.
  const std::vector<double> m = {1, 0, -1.0 / 40, 0, 1, 0, 0, 0, 1};
  OnEveryTarget([&] {
    const Image image = Render(Warp(flat, {m, "triangle", Wrap::kClamp, false}));
    std::vector<double> negative = m;
    for (double& v : negative) v = -v;
    ExpectSameBits(image, Render(Warp(flat, {negative, "triangle", Wrap::kClamp, false})));
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) ASSERT_TRUE(std::isfinite(image.at<float>(x, y, 0)));
    }
    EXPECT_EQ(image.at<float>(20, 20, 0), 1.0f);
  });
  const Node narrow = FromImage(Filled(9, 9, 1, [](int, int, int) { return 1; }));
  for (const double scale : {1e-6, 1e6}) {
    const Image image =
        Render(Warp(narrow, {{scale, 0, 0, 0, scale, 0, 4.5, 4.5, 1}, "mitchell", Wrap::kClamp, false}));
    EXPECT_NEAR(image.at<float>(8, 8), 1.0f, 1e-6f) << scale;
  }
}

// Of an image with more than four channels the first four, or any others, are what they are among all.
TEST(GeometryTest, SomeChannelsOfAWarpAreThoseOfAllOfThem) {
  const Roi window{0, 0, 300, 3};
  for (const int channels : {5, 6, 9}) {
    const Node image = FromImage(testing::Picture(window, channels, PixelType::kFloat, 8));
    for (const char* const filter : {"triangle", "lanczos3", "mitchell", "box", "gaussian"}) {
      for (const bool tilted : {false, true}) {
        SCOPED_TRACE(std::to_string(channels) + " channels, " + filter);
        WarpParams p{{1, 0, 0, 0, 1, 0, 0.5, 0.25, 1}, filter, Wrap::kMirror};
        if (tilted) p.matrix = {0.4, 0.1, 0, -0.1, 0.3, 0, 2, 5, 1};
        const Node warped = Warp(image, p);
        OnEveryTarget([&] {
          const Image all = Render(warped);
          for (const auto& some : std::vector<std::vector<int>>{{0, 1, 2, 3}, {4}, {3, 4}, {0, 1, 2}}) {
            std::vector<ChannelChoice> choices;
            for (const int c : some) choices.push_back({c, 0, "X" + std::to_string(c)});
            const Image part = Render(SelectChannels(warped, choices));
            for (int y = 0; y < 3; ++y) {
              for (int x = 0; x < 300; ++x) {
                for (size_t k = 0; k < some.size(); ++k) {
                  ASSERT_EQ(Bits(part.at<float>(x, y, static_cast<int>(k))),
                            Bits(all.at<float>(x, y, some[k])))
                      << x << "," << y << " channel " << some[k];
                }
              }
            }
          }
        });
      }
    }
  }
}

// Level 0 is the image whoever asks, with filters that would blur it too.
TEST(GeometryTest, MipLevelZeroIsTheImageWithoutTheOptimiser) {
  const Image image = testing::Picture({-2, 3, 9, 10}, 3, PixelType::kFloat, 4);
  OnEveryTarget([&] {
    for (const char* const filter : {"box", "linear", "mitchell", "lanczos3"}) {
      SCOPED_TRACE(filter);
      const Node level = Mip(FromImage(image), {filter, Wrap::kClamp, 0});
      ExpectSameBits(Render(level, PixelType::kFloat, {.optimize = false}), image);
    }
  });
}

// Tiles that see nothing of the image, because of their rows or of their columns.
TEST(GeometryTest, TilesBeyondABlackBorderAreBlack) {
  const Roi window{-25, 0, 1, 1};
  OnEveryTarget([&] {
    for (const int channels : {1, 3, 4, 5}) {
      SCOPED_TRACE(channels);
      const Node image = FromImage(testing::Picture(window, channels, PixelType::kFloat, 4));
      for (const auto& [dx, dy] : {std::pair{3.0, -2.0}, {3.5, 7.25}, {-40.0, 0.0}, {30.5, 0.0}}) {
        const Node moved = Shift(image, {dx, dy, "lanczos3", Wrap::kBlack});
        const Image result =
            Render(moved, PixelType::kFloat, {.threads = 1, .tile_width = 2, .tile_height = 1});
        for (int x = window.x0; x < window.x1; ++x) ASSERT_EQ(result.at<float>(x, 0, 0), 0.0f) << x;
        // The same where the tile also sees the image for another reason.
        const Node both = Add(moved, Abs(image));
        Render(both, PixelType::kFloat, {.threads = 1, .tile_width = 2, .tile_height = 1});
      }
    }
  });
}

TEST(GeometryTest, MipLevels) {
  const Image image = Noise(16, 8, 3);
  const Node node = FromImage(image);
  OnEveryTarget([&] {
    const std::vector<Node> levels = MipChain(node, {"box", Wrap::kClamp});
    ASSERT_EQ(levels.size(), 5u);
    EXPECT_EQ(levels[4].spec().data_window, (Roi{0, 0, 1, 1}));
    // A box of a box is the wider box; the mean is kept.
    const Image two = Render(levels[2]),
                twice = Render(Mip(Mip(node, {"box", Wrap::kClamp, 1}), {"box", Wrap::kClamp, 1}));
    double mean = 0;
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 16; ++x) mean += image.at<float>(x, y, 1) / 128.0;
    }
    EXPECT_NEAR(Render(levels[4]).at<float>(0, 0, 1), mean, 1e-6);
    for (int x = 0; x < 4; ++x) EXPECT_NEAR(two.at<float>(x, 1, 2), twice.at<float>(x, 1, 2), 4e-7f);
    // The doubled tent from level 0: 1 3 5 7 7 5 3 1 over 32.
    const Node impulse = FromImage(Filled(32, 1, 1, [](int x, int, int) { return x == 16 ? 32 : 0; }));
    const Image tent = Render(Mip(impulse, {"linear", Wrap::kRepeat, 2}));
    EXPECT_NEAR(tent.at<float>(3, 0), 3.0f, 1e-5f);
    EXPECT_NEAR(tent.at<float>(4, 0), 5.0f, 1e-5f);
    // The picture of all levels holds each of them.
    const Image all = Render(Mip(node, {"mitchell", Wrap::kMirror}));
    const std::vector<Node> chain = MipChain(node, {"mitchell", Wrap::kMirror});
    for (int k = 0; k < 5; ++k) {
      const Roi at = MipLevelWindow(node.spec(), k);
      const Image level = Render(chain[static_cast<size_t>(k)]);
      EXPECT_EQ(all.at<float>(at.x0, at.y1 - 1, 1), level.at<float>(0, at.height() - 1, 1)) << k;
    }
  });
}

// Every channel of a picture is resampled as the four channels of a picture of its own, bit for bit.
void ExpectChannelsAlone(const Image& image, const std::function<Node(const Node&)>& resample) {
  const Roi& window = image.spec().data_window;
  const Node node = resample(FromImage(image));
  const Image together = Render(node);
  for (const auto& [width, height] : {std::pair(17, 13), std::pair(1, 40), std::pair(4096, 3)}) {
    ExpectSameBits(together, Render(node, PixelType::kFloat, {.tile_width = width, .tile_height = height}));
  }
  for (int c = 0; c < image.spec().channel_count(); ++c) {
    const Image alone = Render(resample(FromImage(Filled(
        window.width(), window.height(), 4, [&](int x, int y, int) { return image.at<float>(x, y, c); }))));
    const Roi& w = alone.spec().data_window;
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        ASSERT_EQ(Bits(together.at<float>(x, y, c)), Bits(alone.at<float>(x, y, 2)))
            << x << "," << y << " channel " << c;
      }
    }
  }
}

TEST(GeometryTest, ChannelsDoNotMatterToOneAnother) {
  struct Case {
    int width, height;  // of the source
    ResizeParams to;
  };
  const Case cases[] = {{150, 70, {75, 35, 0, 0, "lanczos3"}},   // source rows in common
                        {150, 70, {15, 7, 0, 0, "box"}},         // none
                        {20, 700, {9, 19, 0, 0, "lanczos3"}},    // too many of them to keep
                        {151, 37, {201, 56, 0, 0, "mitchell"}},  // growing
                        {150, 70, {75, 35, 0, 0, "box"}},        // means of four
                        {67, 50, {67, 21, 0, 0, "triangle"}},    // one axis
                        {67, 50, {67, 7, 0, 0, "box"}},         {67, 50, {29, 50, 0, 0, "lanczos3"}},
                        {1, 45, {3, 20, 0, 0, "triangle"}},     {41, 1, {20, 1, 0, 0, "triangle"}},
                        {1, 1, {2, 2, 0, 0, "mitchell"}}};
  OnEveryTarget([&] {
    for (const Case& to : cases) {
      for (const int channels : {1, 2, 3, 5}) {
        SCOPED_TRACE(std::to_string(to.width) + "x" + std::to_string(to.height) + " " + to.to.filter +
                     " of " + std::to_string(channels));
        ExpectChannelsAlone(Noise(to.width, to.height, channels, Content::kSpecial),
                            [&](const Node& node) { return Resize(node, to.to); });
      }
    }
    // Beyond a black border there are results without taps, rows and columns of them.
    for (const int channels : {1, 3}) {
      ExpectChannelsAlone(Noise(45, 39, channels, Content::kSpecial), [](const Node& node) {
        return Shift(node, {17.25, -20.5, "mitchell", Wrap::kBlack});
      });
    }
  });
}

TEST(GeometryTest, DisplacementOfHalfIsNone) {
  const Image image = Noise(31, 9);
  const Node half = FromImage(Filled(31, 9, 1, [](int, int, int) { return 0.5; }));
  const Node more = FromImage(Filled(31, 9, 1, [](int, int, int) { return 0.75; }));
  OnEveryTarget([&] {
    ExpectSameBits(Render(Distort(FromImage(image), half, {.amount = 37})), image);
    ExpectMoved(Render(Distort(FromImage(image), more, {.amount = 8})), image,
                [](int x, int y) { return std::pair(x + 2, y + 2); });
  });
}

// What moves by nothing is what moves by almost nothing: a filter that smooths does so.
TEST(GeometryTest, FiltersThatSmoothDoSoWhereNothingMoves) {
  const Image image = Noise(31, 9);
  const Node node = FromImage(image);
  for (const bool smooths : {true, false}) {
    const std::string filter = smooths ? "mitchell" : "catrom";
    const Image nearly = Render(Distort(node, node, {.amount = 1e-6, .filter = filter}));
    for (const Node& still : {Warp(node, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, filter}),
                              Distort(node, node, {.amount = 0, .filter = filter})}) {
      const Image result = Render(still);
      if (!smooths) ExpectSameBits(result, image);
      float smoothed = 0, apart = 0;
      for (int x = 4; x < 27; ++x) {
        smoothed = std::max(smoothed, std::fabs(result.at<float>(x, 4) - image.at<float>(x, 4)));
        apart = std::max(apart, std::fabs(result.at<float>(x, 4) - nearly.at<float>(x, 4)));
      }
      EXPECT_EQ(smoothed > 0.01f, smooths) << smoothed;
      EXPECT_LT(apart, 1e-4f);
    }
  }
}

TEST(GeometryTest, RefusalsNameWhatWasFound) {
  const Node node = FromImage(Noise(8, 8));
  EXPECT_THAT(Refusal([&] { Resize(node, {4, 4, 0, 0, "lanzcos3"}); }), HasSubstr("lanczos3"));
  EXPECT_THAT(Refusal([&] { Resize(node, {0, 4}); }), HasSubstr("found 0x4"));
  EXPECT_THAT(Refusal([&] {
                Resize(node, {31, 8, std::numeric_limits<int>::max() - 3, 0});
              }),
              HasSubstr("beyond 2^31"));
  EXPECT_THAT(Refusal([&] {
                Resize(Crop(node, {-2000, 0, 2000, 8}), {1 << 24, 8});
              }),
              HasSubstr("beyond 2^31"));
  EXPECT_THAT(Refusal([&] { Zoom(node, {0, 1}); }), HasSubstr("other than 0"));
  EXPECT_THAT(Refusal([&] { Zoom(node, {0.01, 1}); }), HasSubstr("no pixel"));
  EXPECT_THAT(Refusal([&] { Zoom(node, {1e9, 1}); }), HasSubstr("at most 2^30"));
  EXPECT_THAT(Refusal([&] { Shift(node, {NAN, 0}); }), HasSubstr("at most 2^24"));
  EXPECT_THAT(Refusal([&] { Shift(node, {0.5, 0, "disk"}); }), HasSubstr("separable"));
  EXPECT_THAT(Refusal([&] { Warp(node, {{1, 2, 3}}); }), HasSubstr("found 3 numbers, expected 9"));
  EXPECT_THAT(Refusal([&] { Warp(node, {{1, 2, 0, 2, 4, 0, 0, 0, 1}}); }), HasSubstr("invertible"));
  EXPECT_THAT(Refusal([&] { Warp(node, {{kNaN, 0, 0, 0, 1, 0, 0, 0, 1}}); }), HasSubstr("invertible"));
  EXPECT_THAT(Refusal([&] { StWarp(node, node, {.channel_t = 4}); }), HasSubstr("channel 4"));
  EXPECT_THAT(Refusal([&] { Mip(node, {"gaussian"}); }), HasSubstr("found the filter \"gaussian\""));
  EXPECT_THAT(Refusal([&] { Mip(node, {"box", Wrap::kClamp, 4}); }), HasSubstr("expected 0 to 3"));
  EXPECT_THAT(Refusal([&] { Distort(node, FromImage(Noise(8, 9)), {.amount = 1}); }), HasSubstr("8x9"));
}

// A mip chain's level 0 has the picture's bits and a frame of its own, from which a zoom counts.
TEST(GeometryTest, WhatKeepsTheBitsMayMoveTheFrame) {
  const Node picture = FromImage(Picture({0, 0, 40, 3}, 3, PixelType::kFloat, 5));
  const Node level = Mip(Crop(picture, {2, -4, 32, 13}), {.level = 0});
  const Node alone = FromImage(Render(level));
  EXPECT_EQ(alone.spec().display_window, (Roi{2, -4, 32, 13}));
  ExpectSameBits(Render(Zoom(level, {1.2, -1})), Render(Zoom(alone, {1.2, -1})));
}

}  // namespace
}  // namespace tessera
