// Arithmetic and generators: hard values, oiiotool's rules for constants, quantising and its dither,
// refusals.
#include "tessera/ops/arithmetic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// A row of pixels, `channels` values each.
Image Row(const std::vector<float>& values, int channels = 1) {
  const Image image(ImageSpec(static_cast<int>(values.size()) / channels, 1, channels));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return image;
}
template <typename T = float>
std::vector<T> Samples(const Node& node, PixelType type = PixelType::kFloat) {
  const Image image = Render(node, type);
  const auto count = static_cast<size_t>(image.spec().data_window.pixels()) * image.spec().channels.size();
  const T* data = reinterpret_cast<const T*>(image.view().data);
  return {data, data + count};
}
uint32_t Bits(float v) {
  uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  return bits;
}
// Runs a check on every instruction set of this machine.
TEST(ArithmeticTest, SumsFollowIeee) {
  const Node a = FromImage(Row({FLT_MAX, kInf, kInf, -0.0f, 1e-45f, 16777216.0f, kNaN}));
  const Node b = FromImage(Row({FLT_MAX, -kInf, 1.0f, -0.0f, 1e-45f, 1.0f, 1.0f}));
  OnEveryTarget([&] {
    const std::vector<float> sum = Samples(Add(a, b));
    EXPECT_EQ(sum[0], kInf);
    EXPECT_TRUE(std::isnan(sum[1]));
    EXPECT_EQ(sum[2], kInf);
    EXPECT_EQ(Bits(sum[3]), Bits(-0.0f));
    EXPECT_EQ(sum[4], 2.8e-45f);
    EXPECT_EQ(sum[5], 16777216.0f);
    EXPECT_TRUE(std::isnan(sum[6]));
    const std::vector<float> product = Samples(Mul(a, b));
    EXPECT_EQ(product[0], kInf);
    EXPECT_EQ(Bits(product[3]), Bits(0.0f));
    EXPECT_EQ(product[4], 0.0f);
    EXPECT_EQ(Samples(AbsDiff(a, b))[1], kInf);
    EXPECT_EQ(Samples(Sub(a, b))[0], 0.0f);
  });
}

TEST(ArithmeticTest, NumbersWinOverNaN) {
  const Node a = FromImage(Row({kNaN, 1.0f, kNaN, kInf, -2.0f}));
  const Node b = FromImage(Row({3.0f, kNaN, kNaN, 1.0f, kInf}));
  OnEveryTarget([&] {
    const std::vector<float> low = Samples(Min(a, b)), high = Samples(Max(a, b));
    EXPECT_EQ(low[0], 3.0f);
    EXPECT_EQ(low[1], 1.0f);
    EXPECT_TRUE(std::isnan(low[2]));
    EXPECT_EQ(low[3], 1.0f);
    EXPECT_EQ(low[4], -2.0f);
    EXPECT_EQ(high[0], 3.0f);
    EXPECT_EQ(high[1], 1.0f);
    EXPECT_TRUE(std::isnan(high[2]));
    EXPECT_EQ(high[3], kInf);
    EXPECT_THAT(Samples(Clamp(a, {.min = {0}, .max = {2}})), ElementsAre(0, 1, 0, 2, 0));
    EXPECT_EQ(Samples(Clamp(a, {.max = {2}}))[0], 2.0f);
    EXPECT_TRUE(std::isnan(Samples(Clamp(a, {}))[0]));
    EXPECT_EQ(Samples(MaxConstant(a, {0.5}))[0], 0.5f);
  });
}

TEST(ThresholdTest, StepsAndRamps) {
  const float next = std::nextafter(0.5f, 1.0f), tiny = std::numeric_limits<float>::denorm_min();
  const Node a = FromImage(Row({0.5f, next, kNaN, kInf, -kInf, 0.25f, 0.625f}));
  OnEveryTarget([&] {
    EXPECT_THAT(Samples(Threshold(a, {{0.5}})), ElementsAre(0, 1, 0, 1, 0, 0, 1));
    EXPECT_THAT(Samples(Threshold(a, {{0.5}, 0.5})),
                ElementsAre(0.5f, 0.5f + 2 * (next - 0.5f), 0, 1, 0, 0, 0.75f));
    EXPECT_THAT(Samples(Threshold(FromImage(Row({0, tiny, -tiny, -0.0f})), {{0}})), ElementsAre(0, 1, 0, 0));
    EXPECT_THAT(Samples(Threshold(FromImage(Row({1, 3e38f, -3e38f})), {{1}, 1e-30})),
                ElementsAre(0.5f, 1, 0));
    const Node rgb = FromImage(Row({0.5f, 0.5f, 0.5f}, 3));
    EXPECT_THAT(Samples(Threshold(rgb, {{0.75, 0.25}})), ElementsAre(0, 1, 1)) << "0 beyond the list";
  });
  EXPECT_EQ(Refusal([&] { Threshold(a, {}); }),
            "threshold: found no numbers, expected one, or one per channel");
  EXPECT_EQ(Refusal([&] {
              Threshold(a, {{0.5}, -1});
            }),
            "threshold: found a softness of -1, expected 0 or 1e-30 to 1e30");
}

TEST(ArithmeticTest, DirectPixelsAndPlanesAgree) {
  // The same numbers straight from RGBA pixels of every type and size of tail, from pixels of another type
  // than the result's, and with a fifth channel, which takes planes.
  using Op = std::function<Node(const Node&, const Node&, const Node&)>;
  const std::vector<std::pair<const char*, Op>> ops = {
      {"mad", [](const Node& a, const Node& b, const Node& c) { return Mad(a, b, c); }},
      {"interp", [](const Node& a, const Node& b, const Node&) { return Interpolate(a, b, 0.7); }},
      {"abs", [](const Node& a, const Node&, const Node&) { return Abs(a); }},
      {"absdiffc",
       [](const Node& a, auto&...) {
         return AbsDiffConstant(a, {0.1, 0.2, 0.3, 0.4, 0});
       }},
      {"quantize", [](const Node& a, const Node&, const Node&) { return Quantize(a, {.bits = 5}); }},
      {"threshold",
       [](const Node& a, auto&...) {
         return Threshold(a, {{0.3, 0.5, 0.7, 0.1, 0}});
       }},
      {"premult", [](const Node& a, const Node&, const Node&) { return Premultiply(a); }},
      {"unpremult", [](const Node& a, const Node&, const Node&) { return Unpremultiply(a); }},
  };
  const auto five = [](const Node& n) { return SelectChannels(n, "R,G,B,A,x=0.5"); };
  for (const int width : {1, 15, 16, 17, 67, 300}) {
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      std::vector<Node> in;
      for (const uint32_t seed : {1u, 2u, 3u}) {
        const auto content = seed == 3 ? testing::Content::kOrdinary : testing::Content::kSpecial;
        in.push_back(FromImage(testing::Picture({0, 0, width, 3}, 4, type, seed, content)));
      }
      OnEveryTarget([&] {
        for (const auto& [name, op] : ops) {
          SCOPED_TRACE(::testing::Message() << name << ' ' << PixelTypeName(type) << ' ' << width);
          const Node direct = op(in[0], in[1], in[2]);
          const Node planes = SelectChannels(op(five(in[0]), five(in[1]), five(in[2])), "R,G,B,A");
          for (const PixelType result : {type, PixelType::kFloat}) {
            testing::ExpectSameBits(Render(direct, result), Render(planes, result));
          }
        }
      });
    }
  }
}

TEST(ArithmeticTest, DenseSamplesAndPlanesAgree) {
  // Images of one to four channels as rows of samples, and into pixels of another type or with room between
  // them, which take planes.
  using Op = std::function<Node(const Node&, const Node&, const Node&)>;
  const std::vector<std::pair<const char*, Op>> ops = {
      {"add", [](const Node& a, const Node& b, auto&) { return Add(a, b); }},
      {"sub", [](const Node& a, const Node& b, auto&) { return Sub(a, b); }},
      {"mul", [](const Node& a, const Node& b, auto&) { return Mul(a, b); }},
      {"square", [](const Node& a, auto&...) { return Mul(a, a); }},
      {"min", [](const Node& a, const Node& b, auto&) { return Min(a, b); }},
      {"absdiff", [](const Node& a, const Node& b, auto&) { return AbsDiff(a, b); }},
      {"mad", [](const Node& a, const Node& b, const Node& c) { return Mad(a, b, c); }},
      {"interp", [](const Node& a, const Node& b, auto&) { return Interpolate(a, b, 0.7); }},
      {"abs", [](const Node& a, auto&...) { return Abs(a); }},
      {"mulc", [](const Node& a, auto&...) { return MulConstant(a, {0.7}); }},
      {"clamp", [](const Node& a, auto&...) { return Clamp(a, {.min = {0.25}, .max = {0.75}}); }},
      {"maxc", [](const Node& a, auto&...) { return MaxConstant(a, {0.25}); }},
      {"srgb", [](const Node& a, auto&...) { return Encode(a, TransferFunction::kSrgb); }},
      {"power", [](const Node& a, auto&...) { return PowerConstant(a, {1.7}); }},
      // Not alike.
      {"addc",
       [](const Node& a, auto&...) {
         return AddConstant(a, {0.1, 0.2, 0.3});
       }},
      {"quantize", [](const Node& a, auto&...) { return Quantize(a, {.bits = 5, .dither = true}); }},
  };
  for (const int channels : {1, 2, 3, 4}) {
    for (const int width : {1, 5, 21, 64, 67, 301}) {
      for (const PixelType type :
           {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
        std::vector<Node> in;
        for (const uint32_t seed : {1u, 2u, 3u}) {
          const auto content = seed == 3 ? testing::Content::kOrdinary : testing::Content::kSpecial;
          in.push_back(FromImage(testing::Picture({0, 0, width, 3}, channels, type, seed, content)));
        }
        ImageSpec spec = in[0].spec();
        const Image dense(spec), roomy(ImageSpec(width, 3, channels + 1, type));
        ImageView apart = roomy.view();
        apart.channels = channels;
        OnEveryTarget([&] {
          for (const auto& [name, op] : ops) {
            SCOPED_TRACE(::testing::Message()
                         << name << ' ' << PixelTypeName(type) << ' ' << width << 'x' << channels);
            const Node node = op(in[0], in[1], in[2]);
            RenderInto(node, dense.view());
            RenderInto(node, apart);
            // An affine operation on codes rounds once, on values of planes twice: a tie may differ.
            const bool affine = name == std::string("mulc") || name == std::string("addc");
            int wrong = 0;
            for (int i = 0; i < 3 * width * channels; ++i) {
              const int x = i / channels % width, y = i / channels / width, c = i % channels;
              const std::byte *const p = dense.view().At(x, y, c), *const q = apart.At(x, y, c);
              if (std::memcmp(p, q, PixelBytes(type)) == 0) continue;
              uint16_t code[2] = {0, 0};
              std::memcpy(&code[0], p, std::min<size_t>(2, PixelBytes(type)));
              std::memcpy(&code[1], q, std::min<size_t>(2, PixelBytes(type)));
              const bool integer = type == PixelType::kUint8 || type == PixelType::kUint16;
              wrong += !(affine && integer && std::abs(code[0] - code[1]) == 1);
            }
            EXPECT_EQ(wrong, 0);
          }
        });
      }
    }
  }
}

TEST(ArithmeticTest, InPlace) {
  const Image a = testing::Picture({0, 0, 333, 7}, 4, PixelType::kFloat, 1),
              b = testing::Picture({0, 0, 333, 7}, 4, PixelType::kFloat, 2),
              c = testing::Picture({0, 0, 333, 7}, 4, PixelType::kFloat, 3);
  const Node node = Mad(FromImage(a), FromImage(b), FromImage(c));
  const Image apart = Render(node);
  RenderInto(node, b.view());
  testing::ExpectSameBits(apart, b);
}

TEST(ArithmeticTest, AbsoluteValueClearsTheSign) {
  const Node a = FromImage(Row({-0.0f, -1e-45f, -kInf, -FLT_MAX, 2.0f}));
  OnEveryTarget([&] {
    const std::vector<float> v = Samples(Abs(a));
    EXPECT_EQ(Bits(v[0]), 0u);
    EXPECT_EQ(v[1], 1e-45f);
    EXPECT_EQ(v[2], kInf);
    EXPECT_EQ(v[3], FLT_MAX);
    EXPECT_EQ(v[4], 2.0f);
  });
}

TEST(ArithmeticTest, OneChannelGoesWithAll) {
  const Node a = FromImage(Row({0.5f, 0.25f, 1.0f, 0.75f}, 4)), matte = FromImage(Row({0.5f}, 1));
  EXPECT_THAT(Samples(Mul(a, matte)), ElementsAre(0.25f, 0.125f, 0.5f, 0.375f));
  EXPECT_THAT(Samples(Sub(a, matte)), ElementsAre(0, -0.25f, 0.5f, 0.25f));
  EXPECT_THAT(Samples(Max(a, matte)), ElementsAre(0.5f, 0.5f, 1.0f, 0.75f));
  EXPECT_EQ(Mul(a, matte).spec().channels, a.spec().channels);
  EXPECT_THROW(Mul(matte, a), Error);
  EXPECT_THROW(Mul(a, FromImage(Row({1, 1}, 2))), Error);
}

// As measured with oiiotool 2.4.7.
TEST(ArithmeticTest, ConstantListsAreReadAsByOiiotool) {
  const Node a = FromImage(Row({0.125f, 0.25f, 0.375f, 0.5f}, 4));
  EXPECT_THAT(Samples(AddConstant(a, {1})), ElementsAre(1.125f, 1.25f, 1.375f, 1.5f));
  EXPECT_THAT(Samples(AddConstant(a, {1, 2})), ElementsAre(1.125f, 2.25f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(AddConstant(a, {1, 2, 3, 4, 5})), ElementsAre(1.125f, 2.25f, 3.375f, 4.5f));
  EXPECT_THAT(Samples(SubConstant(a, {1, 1})), ElementsAre(-0.875f, -0.75f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(MulConstant(a, {2, 4})), ElementsAre(0.25f, 1.0f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(MinConstant(a, {0.25, 0.125})), ElementsAre(0.125f, 0.125f, 0, 0));
  EXPECT_THAT(Samples(MaxConstant(a, {0.25})), ElementsAre(0.25f, 0.25f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(AbsDiffConstant(a, {0.25})), ElementsAre(0.125f, 0, 0.125f, 0.25f));
  EXPECT_THAT(Samples(Invert(a)), ElementsAre(0.875f, 0.75f, 0.625f, 0.5f));
  EXPECT_THAT(Samples(Invert(a, {.first = 1, .last = 2})), ElementsAre(0.125f, 0.75f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(Invert(a, {.last = 4})), ElementsAre(0.875f, 0.75f, 0.625f, 0.5f));
  EXPECT_THAT(Samples(Clamp(a, {.max = {0.25, 0.125}})), ElementsAre(0.125f, 0.125f, 0.375f, 0.5f));
  EXPECT_THAT(Samples(Clamp(MulConstant(a, {4}), {.clamp_alpha = true})),
              ElementsAre(0.5f, 1.0f, 1.5f, 1.0f));
}

TEST(ArithmeticTest, ChannelsBeyondAlphaTakePart) {
  const Node a = FromImage(Row({1, 2, 3, 4, 5, 6, 7}, 7));
  EXPECT_THAT(Samples(AddConstant(a, {1})), ElementsAre(2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(Samples(Mad(a, a, a)), ElementsAre(2, 6, 12, 20, 30, 42, 56));
}

TEST(ArithmeticTest, PackingRoundsTheExactProductHalfToEven) {
  const float half_code = 0.5f / 255;
  const std::vector<float> in = {
      0.5f, 0.49999997f / 255, half_code, 254.5f / 255, 255.5f / 255, kNaN, kInf, -kInf, -0.0f};
  OnEveryTarget([&] {
    // The product with 1 leaves the sample alone: what is seen is the conversion.
    const std::vector<uint8_t> codes =
        Samples<uint8_t>(AddConstant(FromImage(Row(in)), {0}), PixelType::kUint8);
    for (size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(codes[i], std::nearbyint(std::min(1.0, double{in[i]}) * 255)) << i;
    }
    EXPECT_EQ(codes[5], 0);
    EXPECT_EQ(codes[6], 255);
    EXPECT_EQ(codes[7], 0);
    const std::vector<uint16_t> halves = Samples<uint16_t>(
        FromImage(Row({65519.99f, 65520.0f, 5.9604645e-8f, 2.9802322e-8f, -0.0f})), PixelType::kHalf);
    EXPECT_THAT(halves, ElementsAre(0x7bff, 0x7c00, 0x0001, 0x0000, 0x8000));
  });
}

TEST(ArithmeticTest, PairsCoverBothWindows) {
  ImageSpec spec(3, 2, 1);
  const Image left(spec);
  spec.data_window = {2, 1, 5, 4};
  spec.display_window = {-1, 0, 5, 4};
  const Image right(spec);
  std::fill_n(reinterpret_cast<float*>(left.view().data), 6, 0.5f);
  std::fill_n(reinterpret_cast<float*>(right.view().data), 9, 0.25f);
  const Image sub = Render(Sub(FromImage(left), FromImage(right)));
  EXPECT_EQ(sub.spec().data_window, (Roi{0, 0, 5, 4}));
  EXPECT_EQ(sub.spec().display_window, (Roi{-1, 0, 5, 4}));
  EXPECT_EQ(sub.at<float>(0, 0, 0), 0.5f);
  EXPECT_EQ(sub.at<float>(2, 1, 0), 0.25f);
  EXPECT_EQ(sub.at<float>(4, 3, 0), -0.25f);
  EXPECT_EQ(sub.at<float>(4, 0, 0), 0);
  EXPECT_EQ(Render(Mul(FromImage(left), FromImage(right))).at<float>(0, 0, 0), 0);
  EXPECT_EQ(Render(Min(FromImage(left), FromImage(right))).at<float>(0, 0, 0), 0);
}

TEST(ArithmeticTest, RefusalsNameBothOperands) {
  const Node four = Constant(ImageSpec(4, 4, 4)), three = Constant(ImageSpec(4, 4, 3)),
             wide = Constant(ImageSpec(5, 4, 4));
  EXPECT_EQ(Refusal([&] { Add(four, three); }),
            "add: operands differ in channels: 4 (R,G,B,A) and 3 (R,G,B), expected the same number");
  EXPECT_THAT(Refusal([&] { Mad(four, four, three); }), HasSubstr("mad: operands differ in channels"));
  EXPECT_EQ(Mad(four, four, wide).spec().data_window, (Roi{0, 0, 5, 4}));
  EXPECT_THAT(Refusal([&] { Add(four, Node()); }), HasSubstr("add: an operand is empty"));
  EXPECT_THAT(Refusal([&] { AddConstant(four, {}); }), HasSubstr("addc: found no numbers"));
  EXPECT_THAT(Refusal([&] { AddConstant(four, {kNaN}); }), HasSubstr("expected finite numbers"));
  EXPECT_THAT(Refusal([&] { MulConstant(four, {1e39}); }), HasSubstr("expected finite numbers"));
  EXPECT_THAT(Refusal([&] { Clamp(four, {.min = {2}, .max = {1}}); }), HasSubstr("expected min <= max"));
  EXPECT_THAT(Refusal([&] { Invert(four, {.first = 3, .last = 1}); }),
              HasSubstr("expected 0 <= chbegin <= chend"));
  EXPECT_EQ(Refusal([&] { Quantize(four, {.bits = 0}); }), "quantize: found 0 bits, expected 1 to 24");
  EXPECT_EQ(Refusal([&] { Quantize(four, {.bits = 25}); }), "quantize: found 25 bits, expected 1 to 24");
}

TEST(QuantizeTest, EveryCodeIsAFixedPointAndNeighboursRoundToIt) {
  for (const int bits : {1, 2, 8, 10, 16}) {
    SCOPED_TRACE(bits);
    const double last = std::ldexp(1.0, bits) - 1;
    std::vector<float> codes, ties;
    for (int k = 0; k <= last; ++k) {
      codes.push_back(static_cast<float>(k / last));
      // The floats on both sides of the middle between two codes.
      const auto middle = static_cast<float>((k + 0.5) / last);
      ties.insert(ties.end(), {std::nextafterf(middle, 0), middle, std::nextafterf(middle, 2)});
    }
    OnEveryTarget([&] {
      EXPECT_EQ(Samples(Quantize(FromImage(Row(codes)), {.bits = bits})), codes);
      EXPECT_EQ(Samples(Quantize(FromImage(Row(codes)), {.bits = bits, .dither = false, .seed = 3})), codes);
      const std::vector<float> got = Samples(Quantize(FromImage(Row(ties)), {.bits = bits}));
      for (size_t i = 0; i < ties.size(); ++i) {
        const double code = std::nearbyint(std::min(1.0, double{ties[i]}) * last);
        ASSERT_EQ(got[i], static_cast<float>(code / last)) << ties[i];
      }
    });
  }
}

TEST(QuantizeTest, SaturatesAndTakesNaNForZero) {
  const Node a = FromImage(Row({-1.0f, 2.0f, kNaN, kInf, -kInf, -0.0f, 1e-45f}));
  OnEveryTarget([&] {
    for (const bool dither : {false, true}) {
      const std::vector<float> v = Samples(Quantize(a, {.bits = 8, .dither = dither}));
      EXPECT_THAT(v, ElementsAre(0, 1, 0, 1, 0, 0, 0));
      EXPECT_EQ(Bits(v[5]), 0u);
    }
  });
}

TEST(QuantizeTest, DitherKeepsTheMeanAndNeedsNoNeighbours) {
  const ImageSpec spec(256, 256, 2);
  for (const double level : {0.1, 0.4999, 0.73}) {
    const Node flat = Constant(spec, {{level, level}});
    const std::vector<float> v = Samples(Quantize(flat, {.bits = 4, .dither = true}));
    double mean[2] = {}, product = 0;
    for (size_t i = 0; i < v.size(); i += 2) {
      EXPECT_LE(std::fabs(v[i] - level), 1.0 / 15 + 1e-6);
      mean[0] += v[i], mean[1] += v[i + 1];
      product += (v[i] - level) * (v[i + 1] - level);
    }
    const double count = 65536, deviation = 0.5 / 15 / std::sqrt(count);
    EXPECT_NEAR(mean[0] / count, static_cast<float>(level), 5 * deviation);
    EXPECT_NEAR(mean[1] / count, static_cast<float>(level), 5 * deviation);
    // The channels' patterns are independent.
    EXPECT_NEAR(product / count, 0, 5 * 0.25 / 225 / std::sqrt(count));
  }
  const Node flat = Constant(spec, {{0.5, 0.5}});
  EXPECT_NE(Samples(Quantize(flat, {.bits = 4, .dither = true})),
            Samples(Quantize(flat, {.bits = 4, .dither = true, .seed = 1})));
}

TEST(QuantizeTest, DitherHasNoPatternBetweenNeighbours) {
  const Node flat = Constant(ImageSpec(256, 256, 1), {{0.5}});
  const std::vector<float> v = Samples(Quantize(flat, {.bits = 1, .dither = true}));
  for (const size_t step : {1u, 2u, 3u, 16u, 256u, 257u, 255u, 512u}) {
    double sum = 0;
    for (size_t i = step; i < v.size(); ++i) sum += (v[i] - 0.5) * (v[i - step] - 0.5) * 4;
    EXPECT_NEAR(sum / 65536, 0, 5.0 / 256) << step;
  }
}

TEST(GenerateTest, CheckerGoesOnAcrossTheOrigin) {
  ImageSpec spec(40, 40, 1);
  spec.data_window = spec.display_window = Roi{-20, -20, 20, 20};
  for (const auto& [width, height] :
       {std::pair{1, 1}, {3, 5}, {16, 16}, {127, 1}, {128, 2}, {1 << 29, 1 << 29}}) {
    const Image image = Render(Checker(spec, {.width = width, .height = height}));
    for (int y = -20; y < 20; ++y) {
      for (int x = -20; x < 20; ++x) {
        const auto square = static_cast<int>(std::floor(1.0 * x / width) + std::floor(1.0 * y / height));
        ASSERT_EQ(image.at<float>(x, y), square & 1) << x << "," << y << " " << width << "x" << height;
      }
    }
  }
  EXPECT_THAT(Refusal([&] { Checker(spec, {.width = 0}); }), HasSubstr("found squares of 0x16 pixels"));
}

TEST(GenerateTest, RampIsExactAtPixelCentres) {
  ImageSpec spec(7, 5, 5);
  spec.display_window = {10, 20, 17, 25};
  spec.data_window = {12, 21, 17, 30};
  const Image image = Render(Ramp(spec));
  for (int y = 21; y < 30; ++y) {
    for (int x = 12; x < 17; ++x) {
      EXPECT_EQ(image.at<float>(x, y, 0), static_cast<float>((x - 9.5) / 7));
      EXPECT_EQ(image.at<float>(x, y, 1), static_cast<float>((y - 19.5) / 5));
      EXPECT_EQ(image.at<float>(x, y, 2), 0.0f);
      EXPECT_EQ(image.at<float>(x, y, 3), 1.0f);
      EXPECT_EQ(image.at<float>(x, y, 4), 1.0f);
    }
  }
}

TEST(GenerateTest, ConstantFillsMissingChannelsWithOneAndCreateWithZero) {
  EXPECT_THAT(Samples(Constant(ImageSpec(1, 1, 4), {{0.5, 0.25}})), ElementsAre(0.5f, 0.25f, 1, 1));
  EXPECT_THAT(Samples(Constant(ImageSpec(1, 1, 3), {{0.5}})), ElementsAre(0.5f, 0.5f, 0.5f));
  EXPECT_THAT(Samples(Create(ImageSpec(1, 1, 5))), ElementsAre(0, 0, 0, 0, 0));
  EXPECT_THROW(Constant(ImageSpec(), {}), Error);
}

}  // namespace
}  // namespace tessera
