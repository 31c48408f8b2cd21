// Filters: the papers' kernels, hard values, borders, gradients, order statistics, agreement with
// OpenImageIO.
#include "tessera/ops/filter.h"

#include <OpenImageIO/imagebufalgo.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ops/filter/window/factor.h"
#include "support/filters.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

using namespace tessera::testing;

double Sum(const Kernel& k) { return std::accumulate(k.weights.begin(), k.weights.end(), 0.0); }

TEST(KernelTest, SumsAreThoseOfTheTable) {
  for (const char* zero :
       {"line_horizontal", "line_vertical", "line_left", "line_right", "emboss_n", "emboss_ne", "emboss_e",
        "emboss_se", "emboss_s", "emboss_sw", "emboss_w", "emboss_nw", "laplacian3", "laplacian5", "sobel_x",
        "sobel_y", "prewitt_x", "scharr_y", "laplacian"}) {
    EXPECT_EQ(Sum(NamedKernel(zero)), 0) << zero;
  }
  for (const char* one :
       {"mean3", "smooth3", "smooth5", "smooth5_course", "highpass3", "highpass5", "gaussian", "disk"}) {
    EXPECT_NEAR(Sum(NamedKernel(one, 5, 5)), 1, 1e-15) << one;
  }
  EXPECT_EQ(Sum(NamedKernel("highpass5_course")), -7);
  EXPECT_THAT(Refusal([] { NamedKernel("gausian"); }), HasSubstr("gaussian"));
  EXPECT_THAT(Refusal([] { NamedKernel("disk", 300, 3); }), HasSubstr("255x255"));
}

TEST(KernelTest, EqualsOpenImageIo) {
  using OIIO::ImageBufAlgo::make_kernel;
  for (const char* name : {"box", "triangle", "gaussian", "sharp-gaussian", "catmull-rom", "blackman-harris",
                           "sinc", "lanczos3", "radial-lanczos3", "mitchell", "bspline", "disk", "cubic",
                           "keys", "simon", "rifman", "binomial", "laplacian"}) {
    for (const auto& [w, h] : {std::pair{3.0f, 3.0f}, {5.0f, 7.0f}, {6.0f, 4.0f}, {11.0f, 9.0f}}) {
      if (std::string(name) == "laplacian" && w != 3) continue;
      if (std::string(name) == "binomial" && w == 6) continue;  // theirs leaves even sizes undefined
      const OIIO::ImageBuf theirs = make_kernel(name, w, h);
      const Kernel ours = NamedKernel(name, w, h);
      ASSERT_EQ(theirs.spec().width, ours.width) << name;
      ASSERT_EQ(theirs.spec().height, ours.height) << name;
      ASSERT_EQ(theirs.spec().x, -ours.anchor_x) << name;
      for (int y = 0; y < ours.height; ++y) {
        for (int x = 0; x < ours.width; ++x) {
          float v = 0;
          theirs.getpixel(x + theirs.spec().x, y + theirs.spec().y, 0, &v, 1);
          EXPECT_NEAR(v, ours.at(x, y), 1e-5) << name << " " << w << "x" << h << " at " << x << "," << y;
        }
      }
    }
  }
}

TEST(KernelTest, FactorsAreFound) {
  const auto rank = [](const char* name, double w, double h) {
    const ops::Factors f = ops::Factorize(NamedKernel(name, w, h), 0, 8);
    EXPECT_LT(f.residual, 1e-6) << name;
    return f.terms.size();
  };
  EXPECT_EQ(rank("smooth3", 3, 3), 1u);
  EXPECT_EQ(rank("gaussian", 15, 9), 1u);
  EXPECT_EQ(rank("sobel_x", 3, 3), 1u);
  EXPECT_EQ(rank("laplacian3", 3, 3), 2u);
  EXPECT_EQ(rank("highpass3", 3, 3), 2u);
  EXPECT_EQ(rank("smooth5_course", 5, 5), 3u);
  EXPECT_EQ(rank("highpass5", 5, 5), 3u);
}

// As many products as the kernel has rows are enough for any: sums of products are what direct sums are.
TEST(KernelTest, FactorsOfEveryKernelAreWhole) {
  const Image image = testing::Picture({0, 0, 23, 17}, 2, PixelType::kFloat, 3);
  for (const std::string& name : KernelNames()) {
    SCOPED_TRACE(name);
    const Kernel kernel = name == "laplacian" ? NamedKernel(name) : NamedKernel(name, 5, 5);
    double total = 0;
    for (const double w : kernel.weights) total += std::fabs(w);
    EXPECT_LE(ops::Factorize(kernel, 0, kernel.height).residual, 1e-6 * total);
    const ConvolveParams low_rank{.method = FilterMethod::kLowRank}, direct{.method = FilterMethod::kDirect};
    const Image products = Render(Convolve(FromImage(image), kernel, low_rank));
    const Image sums = Render(Convolve(FromImage(image), kernel, direct));
    for (int x = 0; x < 23; ++x)
      EXPECT_NEAR(products.at<float>(x, 9, 1), sums.at<float>(x, 9, 1), 1e-5 * total) << x;
  }
}

TEST(ConvolveTest, TurnsTheKernelAndCorrelateDoesNot) {
  const Image impulse = Flat(9, 9, 1, 0);
  impulse.at<float>(4, 4) = 1;
  Kernel k{3, 2, 0, 1, 1, {1, 2, 3, 4, 5, 6}};
  OnEveryTarget([&] {
    const Image convolved = Render(Convolve(FromImage(impulse), k));
    const Image correlated = Render(Convolve(FromImage(impulse), k, {.correlate = true}));
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 3; ++x) {
        // The impulse's copy of the kernel has the anchor at the impulse.
        EXPECT_EQ(convolved.at<float>(4 + x, 4 + y - 1), k.at(x, y));
        EXPECT_EQ(correlated.at<float>(4 - x, 4 - y + 1), k.at(x, y));
      }
    }
  });
}

TEST(ConvolveTest, ADeltaIsTheIdentityWithEveryBorder) {
  const Image image = Random(37, 11, 4);
  for (const Wrap wrap : kBorders) {
    Kernel delta{5, 5, 2, 2, 1, std::vector<double>(25, 0)};
    delta.weights[12] = 1;
    OnEveryTarget([&] {
      EXPECT_TRUE(SameBits(Render(Convolve(FromImage(image), delta, {.wrap = wrap})), image));
      for (const FilterMethod m : {FilterMethod::kDirect}) {
        EXPECT_TRUE(SameBits(Render(Convolve(FromImage(image), delta, {.wrap = wrap, .method = m})), image));
      }
    });
  }
}

TEST(ConvolveTest, MethodsAgree) {
  const Image image = Random(150, 70, 4);
  for (const char* name : {"disk", "gaussian", "lanczos3"}) {
    const Kernel k = NamedKernel(name, 17, 13);
    OnEveryTarget([&] {
      const Image direct = Render(Convolve(FromImage(image), k, {.method = FilterMethod::kDirect}));
      EXPECT_LT(LargestDifference(direct, Render(Convolve(FromImage(image), k))), 2e-6) << name;
      if (std::string(name) == "gaussian") {
        const ConvolveParams p{.method = FilterMethod::kSeparable};
        EXPECT_LT(LargestDifference(direct, Render(Convolve(FromImage(image), k, p))), 1e-6);
      }
    });
  }
  EXPECT_THAT(Refusal([&] {
                Convolve(FromImage(image), NamedKernel("disk", 9, 9), {.method = FilterMethod::kSeparable});
              }),
              HasSubstr("product of a column and a row"));
}

// A column of `column` over a row of `row` with clamped borders, in double.
double ProductSum(const Image& image, const std::vector<double>& row, const std::vector<double>& column,
                  int x, int y, int c) {
  const int w = image.spec().width(), h = image.spec().height();
  const int left = static_cast<int>(row.size()) / 2, top = static_cast<int>(column.size()) / 2;
  double sum = 0;
  for (int j = 0; j < static_cast<int>(column.size()); ++j) {
    double line = 0;
    for (int i = 0; i < static_cast<int>(row.size()); ++i) {
      line += row[static_cast<size_t>(i)] * double{image.at<float>(std::clamp(x + i - left, 0, w - 1),
                                                                   std::clamp(y + j - top, 0, h - 1), c)};
    }
    sum += column[static_cast<size_t>(j)] * line;
  }
  return sum;
}

// What a transform gives for a channel hangs neither on the channels beside it nor on where tiles end.
TEST(ConvolveTest, TransformedChannelsAreTheirOwn) {
  const ConvolveParams by_transform{.method = FilterMethod::kFft};
  const Kernel k = NamedKernel("disk", 23, 19);
  for (const int channels : {2, 3, 4, 6}) {
    const Image image = Random(210, 170, channels);
    image.at<float>(70, 30, 1) = 1e5f;    // transformed in double
    image.at<float>(150, 90, 0) = 3e38f;  // overflows in floats
    image.at<float>(20, 140, 1) = kNaN;   // summed
    const Node node = FromImage(image);
    OnEveryTarget([&] {
      const Node whole = Convolve(node, k, by_transform);  // the kernel's transform is the target's
      const Image all = Render(whole);
      const Image tiled = Render(whole, PixelType::kFloat, {.tile_width = 37, .tile_height = 29});
      for (int c = 0; c < channels; ++c) {
        const std::vector<ChannelChoice> choice = {ChannelChoice{.channel = c}};
        const Image wanted = Render(SelectChannels(whole, choice)),
                    alone = Render(Convolve(SelectChannels(node, choice), k, by_transform));
        int wrong[3] = {};
        for (int y = 0; y < 170; ++y) {
          for (int x = 0; x < 210; ++x) {
            const auto bits = std::bit_cast<uint32_t>(all.at<float>(x, y, c));
            wrong[0] += std::bit_cast<uint32_t>(tiled.at<float>(x, y, c)) != bits;
            wrong[1] += std::bit_cast<uint32_t>(wanted.at<float>(x, y, 0)) != bits;
            wrong[2] += std::bit_cast<uint32_t>(alone.at<float>(x, y, 0)) != bits;
          }
        }
        EXPECT_THAT(wrong, ::testing::Each(0)) << channels << " channels, " << c;
      }
    });
  }
}

// Weights that read the same from both ends have a form of their own, one more up to 31 along a row; rows
// a multiple of a page apart (256 pixels of RGBA) are copied first.
TEST(ConvolveTest, ProductsOfEverySizeEqualTheirSums) {
  const auto weights = [](int taps, bool symmetric) {
    std::vector<double> w;
    for (int i = 0; i < taps; ++i) w.push_back(1.5 + std::sin(symmetric ? std::abs(2 * i - taps + 1) : i));
    const double sum = std::accumulate(w.begin(), w.end(), 0.0);
    for (double& v : w) v /= sum;
    return w;
  };
  for (const auto& [width, channels] : {std::pair{256, 4}, {77, 4}, {77, 1}, {50, 3}}) {
    const Image image = Random(width, 70, channels);
    for (int taps = 2; taps <= 46; ++taps) {
      for (const bool symmetric : {true, false}) {
        const std::vector<double> row = weights(taps, symmetric), column = weights(48 - taps, symmetric);
        Kernel k{taps, 48 - taps, taps / 2, (48 - taps) / 2, 1, {}};
        for (const double c : column) {
          for (const double r : row) k.weights.push_back(c * r);
        }
        Image first;
        OnEveryTarget([&] {
          const Image result =
              Render(Convolve(FromImage(image), k, {.correlate = true, .method = FilterMethod::kSeparable}));
          for (int y = 0; y < 70; y += 3) {
            for (int x = y % 7; x < width; x += 7) {
              const int c = (x + y) % channels;
              ASSERT_NEAR(result.at<float>(x, y, c), ProductSum(image, row, column, x, y, c),
                          (2 + std::log2(taps * (48 - taps))) * 0x1p-24)
                  << taps << " taps at " << x << "," << y;
            }
          }
          if (SimdTarget().rfind("AVX", 0) != 0) return;  // no fused multiplication
          if (first.spec().width() == 0) first = result;
          EXPECT_TRUE(SameBits(first, result)) << taps << " taps";
        });
      }
    }
  }
}

// Two samples that share a weight are added first: their sum is the limit.
TEST(ConvolveTest, SymmetricProductsOverflowBeyondHalfOfTheLargestFloat) {
  for (const int channels : {1, 4}) {
    for (const int size : {5, 9, 41}) {
      const Kernel k = NamedKernel("gaussian", size, size);
      OnEveryTarget([&] {
        const auto middle = [&](float value) {
          return Render(Convolve(FromImage(Flat(50, 50, channels, value)), k,
                                 {.method = FilterMethod::kSeparable}))
              .at<float>(25, 25);
        };
        EXPECT_NEAR(middle(0x1.fp126f) / 0x1.fp126f, 1, 1e-6) << size;
        EXPECT_EQ(middle(-0x1.1p127f), -kInf) << size;
      });
    }
  }
}

TEST(ConvolveTest, SmallImagesAndLargeKernels) {
  const Kernel k = NamedKernel("triangle", 31, 27);
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {5, 3}}) {
    const Image flat = Flat(w, h, 3, 0.7f);
    for (const Wrap wrap : kBorders) {
      if (wrap == Wrap::kBlack) continue;
      OnEveryTarget([&] {
        EXPECT_LT(LargestDifference(Render(Convolve(FromImage(flat), k, {.wrap = wrap})), flat), 1e-6)
            << w << "x" << h << " border " << static_cast<int>(wrap);
      });
    }
    EXPECT_EQ(Render(Convolve(FromImage(flat), k, {.wrap = Wrap::kValid})).spec().data_window.pixels(), 0);
  }
}

TEST(ConvolveTest, NaNSpreadsExactlyOverTheWeights) {
  for (const char* name : {"disk", "gaussian", "emboss_ne", "laplacian5"}) {
    const Kernel k = NamedKernel(name, 7, 7);
    Image image = Flat(41, 31, 4, 0.5f);
    image.at<float>(20, 15, 1) = kNaN;
    OnEveryTarget([&] {
      const Image result = Render(Convolve(FromImage(image), k, {.correlate = false}));
      for (int y = 0; y < 31; ++y) {
        for (int x = 0; x < 41; ++x) {
          for (int c = 0; c < 4; ++c) {
            const int i = x - 20 + k.anchor_x, j = y - 15 + k.anchor_y;
            const bool under = c == 1 && i >= 0 && j >= 0 && i < k.width && j < k.height && k.at(i, j) != 0;
            ASSERT_EQ(std::isnan(result.at<float>(x, y, c)), under) << name << " " << x << "," << y;
          }
        }
      }
    });
  }
}

TEST(ConvolveTest, ZeroSumKernelsGiveZeroOnFlatImages) {
  for (const float value : {0.1f, 16777217.0f, 1e-38f, 1e8f}) {
    const Image flat = Flat(20, 9, 4, value);
    for (const char* name : {"laplacian", "laplacian5", "emboss_sw", "line_left", "sobel_x", "scharr_y"}) {
      OnEveryTarget([&] {
        EXPECT_EQ(LargestDifference(Render(Convolve(FromImage(flat), NamedKernel(name))), Flat(20, 9, 4, 0)),
                  0)
            << name << " of " << value;
      });
    }
  }
}

TEST(ConvolveTest, FlatImagesStayFlat) {
  for (const float value : {0.1f, 1.0f, 16777217.0f, 1e-38f, 0.7f}) {
    const Image flat = Flat(70, 40, 4, value);
    const auto expect = [&](const std::string& what, const Node& node, double ulps) {
      // Products of subnormal samples are rounded to whole steps of 2^-149.
      const double ulp = std::nextafter(value, kInf) - value, steps = value < 1e-37f ? 20 * 0x1p-149 : 0;
      EXPECT_LE(LargestDifference(Render(node), flat), std::max(ulps * ulp, steps))
          << what << " of " << value;
    };
    OnEveryTarget([&] {
      for (const char* name : {"mean3", "smooth3", "smooth5", "gaussian", "disk", "mitchell"}) {
        const Kernel k = NamedKernel(name, 9, 9);
        expect(name, Convolve(FromImage(flat), k), k.width < 9 || std::string(name) == "gaussian" ? 1 : 3);
      }
      for (const double sigma : {1.0, 2.5, 5.0, 20.0, 200.0}) {
        expect("sigma " + std::to_string(sigma), GaussianBlur(FromImage(flat), {sigma, sigma}), 2);
      }
      expect("box", BoxBlur(FromImage(flat), {41, 41}), 1);
    });
  }
}

TEST(ConvolveTest, BiasDivisorAndAlphaAsSvg) {
  Image image = Flat(5, 5, 4, 0.5f);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) image.at<float>(x, y, 3) = 0.25f;
  }
  Kernel ones{3, 3, 1, 1, 1, std::vector<double>(9, 1)};
  const Image plain = Render(Convolve(FromImage(image), ones, {.divisor = 9, .bias = 0.5}));
  EXPECT_FLOAT_EQ(plain.at<float>(2, 2, 0), 0.625f);
  EXPECT_FLOAT_EQ(plain.at<float>(2, 2, 3), 0.375f);
  const Image kept =
      Render(Convolve(FromImage(image), ones, {.divisor = 9, .bias = 0.5, .preserve_alpha = true}));
  EXPECT_FLOAT_EQ(kept.at<float>(2, 2, 0), 0.625f);  // (0.5 / 0.25 + 0.5) * 0.25
  EXPECT_EQ(kept.at<float>(2, 2, 3), 0.25f);
}

TEST(ConvolveTest, KernelsPerChannelAndKernelImages) {
  const Image image = Random(50, 20, 2);
  Kernel k{3, 1, 1, 0, 2, {1, 0, 0, 0, 0, 1}};
  const Image shifted = Render(Convolve(FromImage(image), k, {.correlate = true}));
  EXPECT_EQ(shifted.at<float>(10, 5, 0), image.at<float>(9, 5, 0));
  EXPECT_EQ(shifted.at<float>(10, 5, 1), image.at<float>(11, 5, 1));
  const Kernel disk = NamedKernel("disk", 7, 5);
  const Image a = Render(Convolve(FromImage(image), disk));
  EXPECT_LT(LargestDifference(a, Render(Convolve(FromImage(image), KernelImage(disk)))), 1e-6);
  EXPECT_THAT(Refusal([&] { Convolve(FromImage(Random(9, 9, 3)), k); }), HasSubstr("2 planes"));
}

TEST(ConvolveTest, ProductsOfAKernelOfFullRank) {
  Kernel k{21, 21, 10, 10, 1, {}};
  std::mt19937 random(4);
  for (int i = 0; i < 21 * 21; ++i) k.weights.push_back(static_cast<int>(random() % 2001) - 1000);
  const Node image = FromImage(Random(40, 30, 2));
  const Node sums = Convolve(image, k, {.method = FilterMethod::kLowRank});
  const VerifyReport report = Verify(sums, PixelType::kFloat, {.samples = 1, .tile_size = 16, .render = {}});
  EXPECT_TRUE(report.within_bound) << report.Summary();
}

TEST(ConvolveTest, AKernelImageThatIsNotThereYetIsExplained) {
  const Node image = FromImage(Random(40, 30, 3)), kernel = KernelImage(NamedKernel("gaussian", 9, 9));
  for (const FilterMethod method : {FilterMethod::kSeparable, FilterMethod::kLowRank}) {
    EXPECT_THAT(Explain(Convolve(image, kernel, {.method = method})), HasSubstr("9x9 image"));
  }
}

TEST(ConvolveTest, Refusals) {
  const Node image = FromImage(Flat(4, 4, 1, 0));
  EXPECT_THAT(Refusal([&] { Convolve(image, Kernel{3, 3, 1, 1, 1, {1, 2}}); }), HasSubstr("found 2 weights"));
  EXPECT_THAT(Refusal([&] {
                Convolve(image, Kernel{0, 3, 0, 0, 1, {}});
              }),
              HasSubstr("expected 1x1 to 255x255"));
  EXPECT_THAT(Refusal([&] { Convolve(image, Kernel{1, 1, 0, 0, 1, {kNaN}}); }), HasSubstr("finite"));
  EXPECT_THAT(Refusal([&] { Convolve(image, Kernel{1, 1, 1, 0, 1, {1}}); }), HasSubstr("anchor"));
  EXPECT_THAT(Refusal([&] { Convolve(image, Kernel(), {.divisor = kNaN}); }), HasSubstr("divisor"));
  EXPECT_THAT(Refusal([&] { Convolve(image, Kernel(), {.method = FilterMethod::kDecimated}); }),
              HasSubstr("method=decimated"));
  EXPECT_THAT(Refusal([&] { GaussianBlur(image, -1); }), HasSubstr("expected 0 to 10000"));
  EXPECT_THAT(Refusal([&] { GaussianBlur(image, kNaN); }), HasSubstr("expected 0 to 10000"));
  EXPECT_THAT(Refusal([&] { GaussianBlur(image, 1e6); }), HasSubstr("expected 0 to 10000"));
  EXPECT_THAT(Refusal([&] { BoxBlur(image, {0, 3}); }), HasSubstr("1x1 to 65535"));
  EXPECT_THAT(Refusal([&] { Median(image, {3, 256}); }), HasSubstr("255x255"));
}

// ---- Gradients, order ----

TEST(SobelTest, RampsAndLargeOffsets) {
  Image image = Flat(30, 20, 1, 0);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) image.at<float>(x, y) = 3.0f * x + 2.0f * y + 60000;
  }
  OnEveryTarget([&] {
    const Image xy = Render(Sobel(FromImage(image), {.output = SobelOutput::kXY}));
    EXPECT_EQ(xy.at<float>(10, 10, 0), 24);
    EXPECT_EQ(xy.at<float>(10, 10, 1), 16);
    EXPECT_EQ(xy.spec().channels[0], "Y.x");
    EXPECT_FLOAT_EQ(Render(Sobel(FromImage(image))).at<float>(10, 10), std::hypot(24.0f, 16.0f));
    EXPECT_FLOAT_EQ(Render(Sobel(FromImage(image), {.output = SobelOutput::kDirection})).at<float>(10, 10),
                    std::atan2(16.0f, 24.0f));
    const Image tiny = Render(Sobel(FromImage(Flat(9, 9, 1, 1e-30f))));
    EXPECT_EQ(tiny.at<float>(4, 4), 0);
  });
  Image step = Flat(9, 9, 1, 0);
  for (int y = 0; y < 9; ++y) step.at<float>(8, y) = 1e30f;
  EXPECT_FLOAT_EQ(Render(Sobel(FromImage(step))).at<float>(7, 4), 4e30f);
}

// Across one column an infinity less itself is a NaN, along it there is an infinite slope.
TEST(SobelTest, WhatIsNotFiniteIsVerified) {
  const Image image = Flat(1, 7, 1, 0.5f);
  image.at<float>(0, 3) = -kInf;
  const VerifyReport report = Verify(Sobel(FromImage(image)));
  EXPECT_TRUE(report.within_bound) << report.Summary();
}

TEST(EmbossTest, NamesAreTheDirectionFromDarkToLight) {
  Image image = Flat(9, 9, 1, 0);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 9; ++x) image.at<float>(x, y) = 1;  // lighter to the north
  }
  EXPECT_GT(Render(Convolve(FromImage(image), NamedKernel("emboss_n"))).at<float>(4, 4), 0);
  EXPECT_LT(Render(Convolve(FromImage(image), NamedKernel("emboss_s"))).at<float>(4, 4), 0);
  EXPECT_GT(Render(Convolve(FromImage(image), NamedKernel("emboss_ne"))).at<float>(4, 4), 0);
}

OIIO::ImageBuf Theirs(const Image& image) {
  const ImageSpec& s = image.spec();
  OIIO::ImageBuf buffer(OIIO::ImageSpec(s.width(), s.height(), s.channel_count(), OIIO::TypeFloat));
  buffer.set_pixels(OIIO::ROI::All(), OIIO::TypeFloat, image.view().data);
  return buffer;
}
double DifferenceFromTheirs(const Image& ours, const OIIO::ImageBuf& theirs) {
  Image copy(ours.spec());
  theirs.get_pixels(OIIO::ROI::All(), OIIO::TypeFloat, copy.view().data);
  return LargestDifference(ours, copy);
}

TEST(FilterTest, UnsharpBlursByEveryMethod) {
  const Node node = FromImage(Random(60, 45, 3));
  const Image direct = Render(UnsharpMask(node, {.width = 9, .method = FilterMethod::kDirect}));
  for (const FilterMethod method : {FilterMethod::kAuto, FilterMethod::kSeparable, FilterMethod::kFft}) {
    EXPECT_LT(LargestDifference(Render(UnsharpMask(node, {.width = 9, .method = method})), direct), 1e-5);
  }
  EXPECT_THROW(UnsharpMask(node, {.kernel = "median", .method = FilterMethod::kDirect}), Error);
}

TEST(FilterTest, EqualsOpenImageIo) {
  using namespace OIIO;
  const Image image = Random(60, 45, 4);
  const ImageBuf in = Theirs(image);
  const Node node = FromImage(image);
  OnEveryTarget([&] {
    EXPECT_LT(DifferenceFromTheirs(Render(Convolve(node, NamedKernel("gaussian", 9, 5))),
                                   ImageBufAlgo::convolve(in, ImageBufAlgo::make_kernel("gaussian", 9, 5))),
              3e-6);
    EXPECT_LT(DifferenceFromTheirs(
                  Render(Convolve(node, KernelImage(NamedKernel("disk", 7, 7)), {.correlate = true})),
                  ImageBufAlgo::convolve(in, ImageBufAlgo::make_kernel("disk", 7, 7))),
              3e-6);
    EXPECT_LT(DifferenceFromTheirs(Render(UnsharpMask(node, {.width = 5, .contrast = 1.5, .threshold = 0.1})),
                                   ImageBufAlgo::unsharp_mask(in, "gaussian", 5, 1.5f, 0.1f)),
              1e-5);
    EXPECT_LT(
        DifferenceFromTheirs(Render(Convolve(node, NamedKernel("laplacian"))), ImageBufAlgo::laplacian(in)),
        1e-5);
    for (const auto& [w, h] : {std::pair{3, 3}, {5, 5}, {4, 3}, {7, 2}}) {
      EXPECT_EQ(DifferenceFromTheirs(Render(Median(node, {w, h})), ImageBufAlgo::median_filter(in, w, h)), 0)
          << w << h;
      EXPECT_EQ(DifferenceFromTheirs(Render(Dilate(node, {w, h})), ImageBufAlgo::dilate(in, w, h)), 0)
          << w << h;
      EXPECT_EQ(DifferenceFromTheirs(Render(Erode(node, {w, h})), ImageBufAlgo::erode(in, w, h)), 0)
          << w << h;
    }
  });
}

}  // namespace
}  // namespace tessera
