// Small kernels, boxes and halves of 8- and 16-bit images against sums in integers: every target, border and
// number of channels, pixels as they are and through floats.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "support/filters.h"
#include "support/whole_kernels.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using namespace tessera::testing;

// The sample of a line of `length` that a border shows at n; -1 for none.
int Shown(Wrap wrap, int n, int length) {
  if (n >= 0 && n < length) return n;
  if (wrap == Wrap::kBlack) return -1;
  if (wrap == Wrap::kClamp) return std::clamp(n, 0, length - 1);
  const int period = wrap == Wrap::kRepeat   ? length
                     : wrap == Wrap::kMirror ? 2 * length
                                             : std::max(1, 2 * (length - 1));
  n = (n % period + period) % period;
  if (n < length) return n;
  return wrap == Wrap::kMirror ? period - 1 - n : period - n;
}

// The exact result of a kernel at one sample, `beyond` outside under kBlack.
template <class T>
int64_t ExactCode(const Image& image, const Whole& k, int ax, int ay, Wrap wrap, int64_t beyond, int x, int y,
                  int c) {
  const Roi& w = image.spec().data_window;
  int64_t sum = 0;
  const int64_t* weight = k.weights.data();
  for (int j = 0; j < k.height; ++j) {
    const int sy = Shown(wrap, y + j - ay - w.y0, w.height());
    for (int i = 0; i < k.width; ++i) {
      const int sx = Shown(wrap, x + i - ax - w.x0, w.width());
      sum += *weight++ * (sx < 0 || sy < 0 ? beyond : image.at<T>(w.x0 + sx, w.y0 + sy, c));
    }
  }
  return std::clamp(Quotient(sum, k.divisor), int64_t{0}, static_cast<int64_t>(static_cast<T>(~T{0})));
}

template <class T>
constexpr PixelType kTypeOf = sizeof(T) == 1 ? PixelType::kUint8 : PixelType::kUint16;

// Random codes with many ties of means.
template <class T>
Image CodesIn(const Roi& window, int channels) {
  ImageSpec spec(window.width(), window.height(), channels, kTypeOf<T>);
  spec.data_window = spec.display_window = window;
  const Image image{std::move(spec)};
  std::mt19937 random(static_cast<uint32_t>(window.width() * 64 + channels));
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < channels; ++c)
        image.at<T>(x, y, c) = static_cast<T>(c % 2 == 0          ? random()
                                              : random() % 2 == 0 ? ~T{0}
                                                                  : random() % 4);
    }
  }
  return image;
}

// Renders the pixels as they are, with gaps that no stage takes, and as floats: all have to be what
// `expected`(x, y, c) says.
template <class T, class F>
void ExpectCodes(const Node& node, const F& expected) {
  const Roi window = node.spec().data_window;
  const int channels = node.spec().channel_count();
  constexpr auto kBytes = static_cast<ptrdiff_t>(sizeof(T));
  std::vector<T> memory(static_cast<size_t>(window.pixels()) * static_cast<size_t>(channels + 1));
  const ImageView gaps{reinterpret_cast<std::byte*>(memory.data()),
                       window,
                       channels,
                       kTypeOf<T>,
                       kBytes,
                       kBytes * (channels + 1),
                       kBytes * (channels + 1) * window.width()};
  const Image direct = Render(node, kTypeOf<T>, {.tile_width = 23, .tile_height = 11}),
              whole = Render(node, kTypeOf<T>), floats = Render(node);
  RenderInto(node, gaps);
  int wrong[4] = {};
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < channels; ++c) {
        const int64_t code = expected(x, y, c);
        wrong[0] += direct.at<T>(x, y, c) != code;
        wrong[1] += whole.at<T>(x, y, c) != code;
        wrong[2] += *reinterpret_cast<const T*>(gaps.At(x, y, c)) != code;
        const double largest = static_cast<T>(~T{0});
        const double sample = std::clamp(double{floats.at<float>(x, y, c)} * largest, 0.0, largest);
        wrong[3] += std::nearbyint(sample) != static_cast<double>(code);
      }
    }
  }
  EXPECT_THAT(wrong, ::testing::Each(0))
      << Explain(node) << channels << " channels, " << window.width() << "x" << window.height();
}

constexpr Wrap kSums[] = {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101};
const Roi kWindows[] = {{0, 0, 1, 1}, {-3, 5, -1, 8}, {-7, -2, 30, 5}, {2, -9, 63, 14}};

// Weights that fit in 16 bits, with and without a sign, products and others, powers of two and other
// divisors.
TEST(IntegerWindowTest, SmallWholeKernelsUnderEveryBorder) {
  const Whole kernels[] = {
      {3, 3, {1, 2, 1, 2, 4, 2, 1, 2, 1}, 16},
      {5, 5, {1, 4, 6, 4, 1, 4, 16, 24, 16, 4, 6, 24, 36, 24, 6, 4, 16, 24, 16, 4, 1, 4, 6, 4, 1}, 256},
      {3, 3, {0, -1, 0, -1, 4, -1, 0, -1, 0}, 1},
      {3, 3, {-1, 0, 1, -2, 0, 2, -1, 0, 1}, 4},
      {3, 3, {0, 0, 0, 1, 1, 1, 2, 2, 2}, 9},
      {4, 2, {1, 1, 1, 3, 1, 1, 1, 1}, 10},
      {7, 1, {9, 9, 9, 9, 9, 9, 9}, 1},
      {1, 6, {1, 1, 1, 1, 1, 1}, 6},
      {5, 7, std::vector<int64_t>(35, -3), 70}};
  OnEveryTarget([&] {
    int turn = 0;
    for (const Whole& whole : kernels) {
      for (const Roi& window : kWindows) {
        const int channels = 1 + turn % 5;
        const Wrap wrap = kSums[turn++ % 5];
        const Image image = CodesIn<uint8_t>(window, channels);
        Kernel kernel = KernelOf(whole);
        kernel.anchor_x = turn % kernel.width, kernel.anchor_y = turn % kernel.height;
        const ConvolveParams p{
            .correlate = true, .divisor = static_cast<double>(whole.divisor), .wrap = wrap};
        ExpectCodes<uint8_t>(Convolve(FromImage(image), kernel, p), [&](int x, int y, int c) {
          return ExactCode<uint8_t>(image, whole, kernel.anchor_x, kernel.anchor_y, wrap, 0, x, y, c);
        });
      }
    }
  });
}

template <class T>
void ExpectBoxes() {
  int turn = 0;
  for (const auto& [width, height] :
       {std::pair{3, 3}, {2, 1}, {1, 4}, {21, 21}, {12, 18}, {41, 7}, {5, 128}}) {
    for (const Roi& window : kWindows) {
      const int channels = 1 + turn % 6;
      const Wrap wrap = kSums[turn++ % 5];
      const Image image = CodesIn<T>(window, channels);
      const int ax = (width - 1) / 2, ay = (height - 1) / 2;
      for (const double beyond : {0.0, 1.0}) {
        const BoxParams p{.width = width, .height = height, .wrap = wrap, .border_value = beyond};
        ExpectCodes<T>(BoxBlur(FromImage(image), p), [&, w = width, h = height](int x, int y, int c) {
          const auto largest = static_cast<int64_t>(static_cast<T>(~T{0}));
          return ExactCode<T>(image, Constant(w, h), ax, ay, wrap, beyond == 0 ? 0 : largest, x, y, c);
        });
      }
    }
  }
}

// The operation may be given the same samples as floats later: it keeps to the type that it was made for.
template <class T>
void ExpectBoxesOfFloats() {
  for (const int channels : {1, 3, 4}) {
    const Image image = CodesIn<T>({-7, -2, 30, 5}, channels);
    for (const auto& [width, height] : {std::pair{3, 3}, {21, 15}}) {
      const Node box = BoxBlur(FromImage(image), {.width = width, .height = height});
      const Node again = graph::MakeNode(box.data()->op, {FromImage(Render(FromImage(image)))});
      ExpectCodes<T>(again, [&, w = width, h = height](int x, int y, int c) {
        return ExactCode<T>(image, Constant(w, h), (w - 1) / 2, (h - 1) / 2, Wrap::kClamp, 0, x, y, c);
      });
    }
  }
}
TEST(IntegerWindowTest, BoxesOfBytesThatAreFloatsByNow) { OnEveryTarget(ExpectBoxesOfFloats<uint8_t>); }
TEST(IntegerWindowTest, BoxesOfWordsThatAreFloatsByNow) { OnEveryTarget(ExpectBoxesOfFloats<uint16_t>); }

TEST(IntegerWindowTest, BoxesOfBytesUnderEveryBorder) { OnEveryTarget(ExpectBoxes<uint8_t>); }
TEST(IntegerWindowTest, BoxesOfWordsUnderEveryBorder) { OnEveryTarget(ExpectBoxes<uint16_t>); }

// Of channels chosen from images of codes too, with some that no code was.
TEST(IntegerWindowTest, BoxesOfChosenChannels) {
  const Image image = CodesIn<uint8_t>({-4, 2, 41, 31}, 4);
  const std::vector<ChannelChoice> chosen = {{2, 0, "a"}, {0, 0, "b"}, {-1, 1, "c"}};
  const Node node = BoxBlur(SelectChannels(FromImage(image), chosen), {.width = 11, .height = 11});
  OnEveryTarget([&] {
    ExpectCodes<uint8_t>(node, [&](int x, int y, int c) {
      return c == 2 ? 255
                    : ExactCode<uint8_t>(image, Constant(11, 11), 5, 5, Wrap::kClamp, 0, x, y, 2 - 2 * c);
    });
  });
}

// Halves by a box: the mean of four codes, half to even.
template <class T>
void ExpectHalves() {
  for (const int channels : {1, 2, 3, 4, 5}) {
    for (int width = 2; width < 80; width += width < 20 ? 2 : 14) {
      const Image image = CodesIn<T>({-6, 3, width - 6, 17}, channels);
      const Node source = FromImage(image);
      // Of the pixels from (x, y) on, counted from the corner.
      const auto mean = [&](int x, int y, int c) {
        const auto at = [&](int i, int j) { return int64_t{image.at<T>(x + i - 6, y + j + 3, c)}; };
        return Quotient(at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1), 4);
      };
      ExpectCodes<T>(Resize(source, {.width = width / 2, .height = 7, .x = 9, .y = -2, .filter = "box"}),
                     [&](int x, int y, int c) { return mean(2 * (x - 9), 2 * (y + 2), c); });
      ExpectCodes<T>(Mip(source, {.level = 1}),
                     [&](int x, int y, int c) { return mean(2 * (x + 6), 2 * (y - 3), c); });
    }
  }
}

TEST(IntegerWindowTest, HalvesOfBytesAreMeansOfFour) { OnEveryTarget(ExpectHalves<uint8_t>); }
TEST(IntegerWindowTest, HalvesOfWordsAreMeansOfFour) { OnEveryTarget(ExpectHalves<uint16_t>); }

}  // namespace
}  // namespace tessera
