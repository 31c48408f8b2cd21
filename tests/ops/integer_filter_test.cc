// Filters of 8- and 16-bit images: exact sums, rounded once; and filters through accumulation buffers of few
// bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "support/filters.h"
#include "support/whole_kernels.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

using namespace tessera::testing;

template <class T>
Image Codes(int width, int height, PixelType type, int channels = 3) {
  const Image image{ImageSpec(width, height, channels, type)};
  std::mt19937 random(7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.at<T>(x, y, c) = static_cast<T>(c % 3 == 0      ? random()
                                              : c % 3 == 1    ? random() % 3  // many ties of means
                                              : x < width / 2 ? 0
                                                              : ~T{0});  // an edge
      }
    }
  }
  return image;
}

// The number of samples of `result` that are not the exact sum of the clamped image, rounded.
template <class T>
int64_t WrongSamples(const Image& image, const Image& result, const Whole& k) {
  const int width = image.spec().width(), height = image.spec().height();
  const auto largest = static_cast<int64_t>(static_cast<T>(~T{0}));
  const int ax = (k.width - 1) / 2, ay = (k.height - 1) / 2;
  int64_t wrong = 0;
  for (int c = 0; c < image.spec().channel_count(); ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        int64_t sum = 0;
        const int64_t* weight = k.weights.data();
        for (int j = 0; j < k.height; ++j) {
          const int sy = std::clamp(y + j - ay, 0, height - 1);
          for (int i = 0; i < k.width; ++i)
            sum += *weight++ * image.at<T>(std::clamp(x + i - ax, 0, width - 1), sy, c);
        }
        const int64_t expected = std::clamp(Quotient(sum, k.divisor), int64_t{0}, largest);
        wrong += expected != result.at<T>(x, y, c);
      }
    }
  }
  return wrong;
}

template <class T>
void ExpectExact(PixelType type) {
  const Image image = Codes<T>(61, 23, type);
  const Image out{ImageSpec(61, 23, 3, type)};
  for (const Whole& k :
       {Whole{3, 3, {1, 2, 1, 2, 4, 2, 1, 2, 1}, 16}, Whole{3, 3, {0, -1, 0, -1, 5, -1, 0, -1, 0}, 1},
        Whole{2, 1, {1, 1}, 2}, Constant(6, 4), RandomKernel(7, 5, -3), RandomKernel(15, 15, 1),
        RandomKernel(31, 31, 0), RandomKernel(255, 255, 0)}) {
    SCOPED_TRACE(std::to_string(k.width) + "x" + std::to_string(k.height));
    const ConvolveParams p{.correlate = true, .divisor = static_cast<double>(k.divisor)};
    RenderInto(Convolve(FromImage(image), KernelOf(k), p), out.view());
    EXPECT_EQ(WrongSamples<T>(image, out, k), 0);
  }
  for (const auto& [width, height] : {std::pair{5, 5}, {41, 41}, {12, 18}, {255, 255}}) {
    SCOPED_TRACE("box " + std::to_string(width) + "x" + std::to_string(height));
    RenderInto(BoxBlur(FromImage(image), {width, height}), out.view());
    EXPECT_EQ(WrongSamples<T>(image, out, Constant(width, height)), 0);
  }
}

TEST(IntegerFilterTest, BytesAreExactSumsRoundedOnce) { ExpectExact<uint8_t>(PixelType::kUint8); }

TEST(IntegerFilterTest, WordsAreExactSumsRoundedOnce) { ExpectExact<uint16_t>(PixelType::kUint16); }

TEST(IntegerFilterTest, EveryTargetAgrees) {
  const Image image = Codes<uint16_t>(61, 23, PixelType::kUint16);
  const Image out{ImageSpec(61, 23, 3, PixelType::kUint16)};
  const Whole k = RandomKernel(9, 6, -2);
  OnEveryTarget([&] {
    const ConvolveParams p{.correlate = true, .divisor = static_cast<double>(k.divisor)};
    RenderInto(Convolve(FromImage(image), KernelOf(k), p), out.view());
    EXPECT_EQ(WrongSamples<uint16_t>(image, out, k), 0);
  });
}

// Whole weights are summed exactly in floats, others in floats that are mended near ties.
TEST(IntegerFilterTest, PixelsAsTheyAreAndThroughFloatsAgree) {
  RenderOptions options;
  options.tile_width = 67, options.tile_height = 23;
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    for (const int channels : {1, 3, 4}) {
      const Roi window{-3, 5, 197, 75};
      const Node image = FromImage(Picture(window, channels, type, 3));
      const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
      // No stage takes pixels with a gap between them.
      std::vector<std::byte> memory(static_cast<size_t>(window.pixels() * bytes * (channels + 1)));
      const ImageView gaps{memory.data(),
                           window,
                           channels,
                           type,
                           bytes,
                           bytes * (channels + 1),
                           bytes * (channels + 1) * window.width()};
      for (const Node& node :
           {Median(image, {3, 3}), Median(image, {5, 5}), Median(image, {13, 11}), Dilate(image, {5, 2}),
            Erode(image, {9, 12}), Convolve(image, NamedKernel("gaussian", 3, 3)),
            Convolve(image, NamedKernel("laplacian"), {.wrap = Wrap::kMirror}),
            Convolve(image, NamedKernel("disk", 9, 7), {.wrap = Wrap::kRepeat}), GaussianBlur(image, 2.3),
            Convolve(image, NamedKernel("gaussian", 15, 15)),
            Convolve(image, NamedKernel("gaussian", 5, 5), {.wrap = Wrap::kRepeat}),
            Convolve(image, NamedKernel("gaussian", 9, 3), {.wrap = Wrap::kMirror101})}) {
        OnEveryTarget([&] {
          const Image direct = Render(node, type, options);
          RenderInto(node, gaps, options);
          int wrong = 0;
          for (int y = window.y0; y < window.y1; ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
              wrong += std::memcmp(direct.view().At(x, y), gaps.At(x, y),
                                   static_cast<size_t>(bytes * channels)) != 0;
            }
          }
          EXPECT_EQ(wrong, 0) << Explain(node) << channels << " channels";
        });
      }
    }
  }
}

TEST(IntegerFilterTest, BytesOfAnyChannelsOnEveryTarget) {
  for (const int channels : {1, 2, 3, 4, 5}) {
    SCOPED_TRACE(channels);
    const Image image = Codes<uint8_t>(61, 23, PixelType::kUint8, channels);
    const Image out{ImageSpec(61, 23, channels, PixelType::kUint8)};
    OnEveryTarget([&] {
      for (const Whole& k :
           {Whole{3, 3, {1, 2, 1, 2, 4, 2, 1, 2, 1}, 16}, Whole{3, 3, {1, 1, 1, 1, -8, 1, 1, 1, 1}, 1},
            Constant(2, 6), RandomKernel(5, 4, 3), RandomKernel(9, 9, -3)}) {
        SCOPED_TRACE(std::to_string(k.width) + "x" + std::to_string(k.height));
        const ConvolveParams p{.correlate = true, .divisor = static_cast<double>(k.divisor)};
        RenderInto(Convolve(FromImage(image), KernelOf(k), p), out.view());
        EXPECT_EQ(WrongSamples<uint8_t>(image, out, k), 0);
      }
      for (const auto& [width, height] : {std::pair{8, 8}, {41, 7}, {16, 16}, {255, 254}}) {
        SCOPED_TRACE("box " + std::to_string(width) + "x" + std::to_string(height));
        RenderInto(
            BoxBlur(FromImage(image), {.width = width, .height = height, .method = FilterMethod::kRecursive}),
            out.view());
        EXPECT_EQ(WrongSamples<uint8_t>(image, out, Constant(width, height)), 0);
      }
    });
  }
}

// The number of samples that are not the sum over the clamped image in long double, rounded; sums next to the
// middle between two codes may round either way.
template <class T>
int WrongReals(const Image& image, const Image& result, const Kernel& k) {
  const int width = image.spec().width(), height = image.spec().height();
  const long double largest = static_cast<T>(~T{0});
  int wrong = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < image.spec().channel_count(); ++c) {
        long double sum = 0;
        for (int j = 0; j < k.height; ++j) {
          for (int i = 0; i < k.width; ++i) {
            const int sx = std::clamp(x + i - k.anchor_x, 0, width - 1),
                      sy = std::clamp(y + j - k.anchor_y, 0, height - 1);
            sum += static_cast<long double>(k.weights[static_cast<size_t>(j * k.width + i)]) *
                   image.at<T>(sx, sy, c);
          }
        }
        const long double code = std::clamp(std::round(sum), 0.0L, largest);
        const bool tie = std::fabs(std::fabs(sum - std::floor(sum)) - 0.5L) < 1e-7L;
        wrong += !tie && code != result.at<T>(x, y, c);
      }
    }
  }
  return wrong;
}

template <class T>
void ExpectReals(PixelType type, int width, int height,
                 const std::vector<std::pair<const char*, std::pair<int, int>>>& kernels) {
  const Image image = Codes<T>(width, height, type);
  const Image out{ImageSpec(width, height, 3, type)};
  for (const auto& [name, size] : kernels) {
    SCOPED_TRACE(std::string(name) + " " + std::to_string(size.first) + "x" + std::to_string(size.second));
    const Kernel k = NamedKernel(name, size.first, size.second);
    RenderInto(Convolve(FromImage(image), k, {.correlate = true}), out.view());
    EXPECT_EQ(WrongReals<T>(image, out, k), 0);
  }
}

// Weights that are no whole numbers.
TEST(IntegerFilterTest, BytesUnderRealWeights) {
  ExpectReals<uint8_t>(
      PixelType::kUint8, 397, 61,
      {{"gaussian", {3, 3}}, {"gaussian", {15, 15}}, {"disk", {7, 7}}, {"lanczos3", {9, 9}}});
}

// Products of a column and a row, unrolled and long, negative weights, lines, and so large that bytes are
// summed in double too.
TEST(IntegerFilterTest, ProductsOfRealWeightsOnEveryTarget) {
  const std::vector<std::pair<const char*, std::pair<int, int>>> kernels = {
      {"gaussian", {5, 9}}, {"gaussian", {13, 3}},  {"gaussian", {1, 7}},
      {"gaussian", {7, 1}}, {"lanczos3", {11, 5}},  {"gaussian", {31, 21}},
      {"mitchell", {5, 5}}, {"gaussian", {61, 91}}, {"sharp-gaussian", {3, 3}}};
  OnEveryTarget([&] {
    ExpectReals<uint8_t>(PixelType::kUint8, 45, 11, kernels);
    ExpectReals<uint16_t>(PixelType::kUint16, 45, 11, kernels);
  });
}

// Half of an odd code goes to the even one, by any real weights.
template <class T>
void ExpectEvenHalves(PixelType type, int side) {
  constexpr int kWidth = 83, kHeight = 9;
  Kernel k = NamedKernel("gaussian", side, side);
  double sum = 0;
  for (const double w : k.weights) sum += w;
  for (double& w : k.weights) w /= 2 * sum;
  const Image image{ImageSpec(kWidth, kHeight, 1, type)}, out{ImageSpec(kWidth, kHeight, 1, type)};
  for (const int code : {1, 3, 253, 255}) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) image.at<T>(x, y, 0) = static_cast<T>(code);
    }
    RenderInto(Convolve(FromImage(image), k), out.view());
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(out.at<T>(x, y, 0), (code + 1) / 4 * 2) << code << " at " << x << "," << y;
      }
    }
  }
}

TEST(IntegerFilterTest, TiesOfRealWeightsGoToEvenCodes) {
  OnEveryTarget([] {
    for (const int side : {3, 15, 61}) {
      ExpectEvenHalves<uint8_t>(PixelType::kUint8, side);
      ExpectEvenHalves<uint16_t>(PixelType::kUint16, side);
    }
  });
}

// Whole codes that no byte has: what an operation before has made.
TEST(IntegerFilterTest, CodesBeyondBytesAreFloats) {
  const Image bright = Codes<uint8_t>(61, 23, PixelType::kUint8);
  for (int y = 0; y < 23; ++y) {
    for (int x = 0; x < 61; ++x) {
      for (int c = 0; c < 3; ++c) bright.at<uint8_t>(x, y, c) |= 128;
    }
  }
  const Node doubled = MulConstant(FromImage(bright), {2});
  const Image floats = Render(doubled);
  const Kernel kernel = NamedKernel("smooth3");
  EXPECT_TRUE(SameBits(Render(Convolve(doubled, kernel)), Render(Convolve(FromImage(floats), kernel))));
  const Image box = Render(BoxBlur(doubled, {.width = 21, .height = 21})),
              expected = Render(BoxBlur(FromImage(floats), {.width = 21, .height = 21}));
  EXPECT_LT(LargestDifference(box, expected), 1e-6);
}

// A constant image stays what it is where only the weights inside count, to the code.
TEST(IntegerFilterTest, RenormalizedFlatImagesStay) {
  const Image image{ImageSpec(40, 30, 3, PixelType::kUint16)}, out{ImageSpec(40, 30, 3, PixelType::kUint16)};
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) image.at<uint16_t>(x, y, c) = static_cast<uint16_t>(12345 + 20000 * c);
    }
  }
  RenderInto(Convolve(FromImage(image), NamedKernel("disk", 21, 17), {.wrap = Wrap::kRenormalize}),
             out.view());
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_EQ(out.at<uint16_t>(x, y, c), 12345 + 20000 * c) << x << "," << y;
    }
  }
}

// What an operation before has made of the codes is filtered as the floats that it is.
TEST(IntegerFilterTest, FloatsOfEarlierOperationsAreLeftAlone) {
  const Node scaled = MulConstant(FromImage(Codes<uint8_t>(61, 23, PixelType::kUint8)), {0.37});
  const Image floats = Render(scaled);
  for (const char* name : {"smooth3", "gaussian"}) {
    const Kernel kernel = NamedKernel(name, 9, 9);
    EXPECT_TRUE(SameBits(Render(Convolve(scaled, kernel)), Render(Convolve(FromImage(floats), kernel))))
        << name;
  }
}

// Windows that see codes only get exact sums, others the floats' own, whatever shares a tile with them.
TEST(IntegerFilterTest, CodesAndFloatsMixWithoutSeams) {
  const Node halved = MulConstant(FromImage(Codes<uint8_t>(61, 23, PixelType::kUint8)), {0.5});
  for (const char* name : {"smooth3", "gaussian", "disk"}) {
    const Node node = Convolve(halved, NamedKernel(name, 7, 5));
    const Image whole = Render(node);
    for (const int tile : {1, 8, 17}) {
      EXPECT_TRUE(SameBits(whole, Render(node, PixelType::kFloat, {.tile_width = tile, .tile_height = tile})))
          << name << ", tiles of " << tile;
    }
  }
}

// Fixed point of few bits: within the range analysis' bound of the exact sum, worse with fewer bits, every
// border.
TEST(BufferBitsTest, ErrorsAreThoseOfTheRangeAnalysis) {
  const Image image = Random(37, 21, 4);
  auto* const samples = reinterpret_cast<float*>(image.view().data);
  for (int i = 0; i < 37 * 21 * 4; ++i)
    samples[i] = std::clamp(samples[i], 0.0f, 1.0f);  // the range that is assumed
  const Kernel kernel = NamedKernel("smooth5");
  const double scale = KernelRange(kernel.weights).scale;
  for (const Wrap wrap : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101}) {
    const Image exact = Render(Convolve(FromImage(image), kernel, {.wrap = wrap}));
    double last = 1;
    for (const int bits : {8, 12, 16, 24}) {
      OnEveryTarget([&] {
        const Image held = Render(Convolve(FromImage(image), kernel, {.wrap = wrap, .bits = bits}));
        const double error = LargestDifference(held, exact);
        EXPECT_LE(error, 25 * std::ldexp(1, -(bits + 1)) / scale + 2e-6) << bits;
        EXPECT_LT(error, last) << bits;
        // A buffer of that depth, not a better one.
        if (bits < 20) {
          EXPECT_GT(error, std::ldexp(1, -(bits + 2)) / scale) << bits;
        }
      });
      last =
          LargestDifference(Render(Convolve(FromImage(image), kernel, {.wrap = wrap, .bits = bits})), exact);
    }
  }
  const Node valid = Convolve(FromImage(image), kernel, {.wrap = Wrap::kValid, .bits = 16});
  EXPECT_EQ(valid.spec().data_window, (Roi{2, 2, 35, 19}));
}

// Gradients, blurs of a sigma and sharpening through a buffer: nearer to the exact result with every bit.
TEST(BufferBitsTest, EveryFilterTakesThem) {
  const Image image = Random(37, 21, 4);
  auto* const samples = reinterpret_cast<float*>(image.view().data);
  for (int i = 0; i < 37 * 21 * 4; ++i) samples[i] = std::clamp(samples[i], 0.0f, 1.0f);
  const Node node = FromImage(image);
  const auto gaussian = [&](int bits) {
    return Render(GaussianBlur(node, {.sigma_x = 2, .sigma_y = 1, .bits = bits}));
  };
  const auto sobel = [&](int bits) { return Render(Sobel(node, {.bits = bits})); };
  const auto components = [&](int bits) {
    return Render(Sobel(node, {.output = SobelOutput::kXY, .wrap = Wrap::kMirror, .bits = bits}));
  };
  const auto unsharp = [&](int bits) { return Render(UnsharpMask(node, {.width = 5, .bits = bits})); };
  const auto expect = [&](const auto& filter, double taps, double scale) {
    const Image exact = filter(0);
    double last = 10;
    for (const int bits : {8, 12, 16, 24}) {
      const double error = LargestDifference(filter(bits), exact);
      EXPECT_LE(error, taps * std::ldexp(1, -(bits + 1)) / scale + 4e-6) << bits;
      EXPECT_LT(error, last) << bits;
      if (bits < 16) {
        EXPECT_GT(error, std::ldexp(1, -(bits + 3))) << bits;
      }
      last = error;
    }
  };
  expect(gaussian, 21 + 13, 1);
  expect(components, 6, 0.25);
  expect(sobel, 6 * 1.5, 0.25);
  expect(unsharp, 25, 1);
}

TEST(BufferBitsTest, RefusesWhatABufferCannotHold) {
  const Node image = FromImage(Random(9, 9, 4));
  EXPECT_THAT(Refusal([&] { UnsharpMask(image, {.kernel = "median", .bits = 12}); }), HasSubstr("median"));
  EXPECT_THAT(Refusal([&] { GaussianBlur(image, {.sigma_x = 30, .sigma_y = 1, .bits = 12}); }),
              HasSubstr("at most 255"));
  EXPECT_THAT(Refusal([&] { Sobel(image, {.bits = 7}); }), HasSubstr("expected 8 to 32"));
  const Kernel kernel = NamedKernel("smooth3");
  EXPECT_THAT(Refusal([&] { Convolve(image, kernel, {.bias = 0.5, .bits = 12}); }),
              HasSubstr("bits=12 with a bias"));
  EXPECT_THAT(Refusal([&] { Convolve(image, kernel, {.wrap = Wrap::kRenormalize, .bits = 12}); }),
              HasSubstr("wrap=renormalize"));
  EXPECT_THAT(Refusal([&] { Convolve(image, kernel, {.bits = 7}); }), HasSubstr("expected 8 to 32"));
  EXPECT_THAT(Refusal([&] { Convolve(image, KernelImage(kernel), {.bits = 12}); }),
              HasSubstr("kernel image"));
}

// A filter's input may have an integer type and hold no codes: it has been computed.
TEST(IntegerFilterTest, WhatWasComputedFromCodesIsNotTakenForCodes) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    const Image flat{ImageSpec(40, 24, 3, type)};
    const double code = type == PixelType::kUint8 ? 104 / 255.0 : 26728 / 65535.0;
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 40; ++x) {
        for (int c = 0; c < 3; ++c) {
          if (type == PixelType::kUint8) {
            flat.at<uint8_t>(x, y, c) = 104;
          } else {
            flat.at<uint16_t>(x, y, c) = 26728;
          }
        }
      }
    }
    // Less than a hundredth of a code away.
    const double away = type == PixelType::kUint8 ? 1.6e-5 : 6e-8;
    const Node computed = AddConstant(FromImage(flat), {away});
    const double expected = static_cast<double>(static_cast<float>(away)) + static_cast<float>(code);
    const float bound = type == PixelType::kUint8 ? 1e-6f : 1.3e-7f;
    for (const FilterMethod method :
         {FilterMethod::kAuto, FilterMethod::kDirect, FilterMethod::kSeparable, FilterMethod::kRecursive}) {
      const Image box = Render(BoxBlur(computed, {.width = 3, .height = 3, .method = method}));
      EXPECT_NEAR(box.at<float>(20, 12, 1), expected, bound) << static_cast<int>(method);
    }
    EXPECT_NEAR(Render(GaussianBlur(computed, 1)).at<float>(20, 12, 1), expected, 2 * bound);
    const Kernel kernel{3, 3, 1, 1, 1, {1, 2, 1, 2, 4, 2, 1, 2, 1}};
    EXPECT_NEAR(Render(Convolve(computed, kernel, {.divisor = 16})).at<float>(20, 12, 1), expected, bound);
  }
}

}  // namespace
}  // namespace tessera
