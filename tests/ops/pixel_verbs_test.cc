// oiiotool's pixel verbs: quotients, sums and extremes of channels, contrast by black and white, ranges, lost
// samples, false colours, rectangles, noise, holes; what becomes of NaN, infinities and the smallest numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/every_target.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/composite.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;
using ::testing::HasSubstr;
using ::testing::NanSensitiveFloatEq;
using testing::OnEveryTarget;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kTiny = 1e-44f;  // a denormal

// A row of pixels of `channels` values each.
Image Row(const std::vector<float>& values, int channels = 1) {
  const Image image(ImageSpec(static_cast<int>(values.size()) / channels, 1, channels));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return image;
}
std::vector<float> Samples(const Node& node) {
  const Image image = Render(node);
  const auto count = static_cast<size_t>(image.spec().data_window.pixels()) * image.spec().channels.size();
  const auto* const data = reinterpret_cast<const float*>(image.view().data);
  return {data, data + count};
}
std::string WhatIsRefused(const std::function<void()>& make) {
  try {
    make();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing";
}
// NaN equals NaN, and zeros of either sign are alike.
void ExpectSamples(const Node& node, const std::vector<float>& want) {
  const std::vector<float> got = Samples(node);
  ASSERT_EQ(got.size(), want.size());
  for (size_t i = 0; i < got.size(); ++i) EXPECT_THAT(got[i], NanSensitiveFloatEq(want[i])) << "sample " << i;
}

TEST(PixelVerbsTest, QuotientsByZeroAreZero) {
  const Node a = FromImage(Row({1, -3, kNaN, kInf, 0, kTiny, 1, kInf, 3e38f}));
  const Node b = FromImage(Row({0, -0.0f, 0, 0, 0, kTiny, kNaN, kInf, 0.1f}));
  OnEveryTarget([&] {
    ExpectSamples(Div(a, b), {0, 0, 0, 0, 0, 1, kNaN, kNaN, kInf});
    ExpectSamples(DivConstant(a, {0}), {0, 0, kNaN, kNaN, 0, 0, 0, kNaN, 0});
    ExpectSamples(DivConstant(FromImage(Row({1, -3, kInf, kTiny})), {2}), {0.5f, -1.5f, kInf, kTiny / 2});
  });
  EXPECT_THAT(WhatIsRefused([&] { DivConstant(a, {1e-40}); }),
              HasSubstr("found 1e-40, expected 0 or a divisor"));
}

TEST(PixelVerbsTest, ChannelsBecomeOne) {
  const Node image = FromImage(Row({1, 2, 4, 0.5f, -1, kNaN, 3, 1, kInf, 0, -kInf, kTiny}, 4));
  OnEveryTarget([&] {
    ExpectSamples(ChannelSum(image), {7.5f, kNaN, kNaN});
    ExpectSamples(ChannelSum(image, {{0, 0, 2, -1}}), {7.5f, 5, -kInf});
    ExpectSamples(ChannelSum(image, {{0.5}}), {3.75f, kNaN, kNaN});
    ExpectSamples(ChannelSum(image, {{0}}), {0, 0, 0});
    ExpectSamples(MaxChannel(image), {4, 3, kInf});
    ExpectSamples(MinChannel(image), {0.5f, -1, -kInf});
    const Node lost = FromImage(Row({kNaN, kNaN, kNaN, 7}, 2));
    ExpectSamples(MaxChannel(lost), {kNaN, 7});
    ExpectSamples(MinChannel(lost), {kNaN, 7});
  });
  EXPECT_THAT(ChannelSum(image).spec().channels, ElementsAre("Y"));
  EXPECT_EQ(MaxChannel(image).spec().alpha, -1);
}

TEST(PixelVerbsTest, ContrastByBlackAndWhite) {
  const Node image = FromImage(Row({-1, 0, 0.25f, 0.5f, 1, kNaN, kInf, -kInf, kTiny}));
  OnEveryTarget([&] {
    ExpectSamples(ContrastRemap(image, {.black = {0.5}, .white = {1}}),
                  {-3, -1, -0.5f, 0, 1, kNaN, kInf, -kInf, -1});
    ExpectSamples(ContrastRemap(image, {.black = {1}, .white = {0}}),
                  {2, 1, 0.75f, 0.5f, 0, kNaN, -kInf, kInf, 1});
    // A threshold: NaN is not below it.
    ExpectSamples(ContrastRemap(image, {.black = {0.5}, .white = {0.5}, .min = {-2}, .max = {3}}),
                  {-2, -2, -2, 3, 3, 3, 3, -2, -2});
    const float end = static_cast<float>((1 - 1 / (1 + std::exp(2.5))) /
                                         (std::sinh(2.5) / (2 * std::cosh(1.25) * std::cosh(1.25))));
    const std::vector<float> bent = Samples(ContrastRemap(image, {.scontrast = {5}}));
    EXPECT_THAT(bent[1], ::testing::FloatNear(0, 1e-7f));
    EXPECT_THAT(bent[3], FloatEq(0.5f));
    EXPECT_THAT(bent[4], FloatEq(1));
    EXPECT_TRUE(std::isnan(bent[5]));
    EXPECT_THAT(bent[6], FloatEq(end));
    EXPECT_THAT(bent[7], ::testing::FloatNear(1 - end, 1e-7f));
    // The limit of ever smaller slopes is the line.
    ExpectSamples(ContrastRemap(image, {.scontrast = {0}}),
                  {-1, 0, 0.25f, 0.5f, 1, kNaN, kInf, -kInf, kTiny});
    ExpectSamples(ContrastRemap(image, {.black = {0.25}, .clamp = true}), {0, 0, 0, 1 / 3.0f, 1, 0, 1, 0, 0});
  });
  // A list goes on with its last value.
  ExpectSamples(ContrastRemap(FromImage(Row({0, 0, 0}, 3)), {.min = {0.25, 0.5}}), {0.25f, 0.5f, 0.5f});
  EXPECT_THAT(WhatIsRefused([&] { ContrastRemap(image, {.scontrast = {1000}, .sthresh = {-1}}); }),
              HasSubstr("expected a curve that rises"));
  EXPECT_THAT(WhatIsRefused([&] { ContrastRemap(image, {.min = {1}, .max = {0}, .clamp = true}); }),
              HasSubstr("min=1 above max=0"));
}

TEST(PixelVerbsTest, RangesAreTheInverseOfEachOther) {
  const std::vector<float> values = {0.18f, -0.18f, 1, -1, 1000, 1e30f, 0, kTiny, kNaN, kInf, -kInf, 3e38f};
  const Node image = FromImage(Row(values));
  OnEveryTarget([&] {
    const std::vector<float> compressed = Samples(RangeCompress(image)),
                             back = Samples(RangeExpand(RangeCompress(image)));
    EXPECT_EQ(compressed[0], 0.18f);
    EXPECT_FLOAT_EQ(compressed[2], 0.49178752f);
    EXPECT_EQ(compressed[3], -compressed[2]);
    for (size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) {
        EXPECT_NEAR(back[i], values[i], std::fabs(values[i]) * 2e-5) << i;
      } else {
        EXPECT_THAT(compressed[i], NanSensitiveFloatEq(values[i]));
        EXPECT_THAT(back[i], NanSensitiveFloatEq(values[i]));
      }
    }
    ExpectSamples(RangeExpand(FromImage(Row({17, -17, 15}))),
                  {kInf, -kInf, Samples(RangeExpand(FromImage(Row({15}))))[0]});
  });
}

TEST(PixelVerbsTest, RangesByLuminanceKeepColours) {
  const Node image =
      FromImage(Row({4, 2, 1, 0.5f, -1, 0.1f, 0.1f, 2, kNaN, 1, 1, 1, kInf, 1, 1, 1, 0, 0, 0, kNaN}, 4));
  OnEveryTarget([&] {
    const std::vector<float> got = Samples(RangeCompress(image, {.luma = true}));
    EXPECT_FLOAT_EQ(got[0], 2 * got[1]);
    EXPECT_FLOAT_EQ(got[1], 2 * got[2]);
    EXPECT_EQ(got[3], 0.5f);
    EXPECT_THAT(std::vector<float>(got.begin() + 4, got.begin() + 8), ElementsAre(0, 0, 0, 2));
    EXPECT_TRUE(std::isnan(got[8]));
    EXPECT_EQ(got[9], 0) << "a luminance that is no number is not above 0";
    EXPECT_TRUE(std::isnan(got[12]) && std::isnan(got[13])) << "an infinite one is infinite over itself";
    EXPECT_EQ(got[16], 0);
    EXPECT_TRUE(std::isnan(got[19])) << "alpha is kept";
  });
}

TEST(PixelVerbsTest, LostSamplesAreMended) {
  const Image image(ImageSpec(3, 3, 1));
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) image.at<float>(x, y) = static_cast<float>(3 * y + x);
  }
  image.at<float>(1, 1) = kNaN, image.at<float>(2, 1) = -kInf, image.at<float>(0, 2) = kTiny;
  const Node node = FromImage(image);
  OnEveryTarget([&] {
    ExpectSamples(FixNan(node, FixNanMode::kBlack), {0, 1, 2, 3, 0, 0, kTiny, 7, 8});
    ExpectSamples(FixNan(node, FixNanMode::kBox3), {0, 1, 2, 3, 3, 4.5f, kTiny, 7, 8});
    ExpectSamples(FixNan(node, FixNanMode::kNone), {0, 1, 2, 3, kNaN, -kInf, kTiny, 7, 8});
    ExpectSamples(FixNan(FromImage(Row({kNaN, kNaN})), FixNanMode::kBox3), {0, 0});
    EXPECT_THROW(Render(FixNan(node, FixNanMode::kError)), DataError);
    ExpectSamples(FixNan(FromImage(Row({1, kTiny, 3e38f})), FixNanMode::kError), {1, kTiny, 3e38f});
  });
}

TEST(PixelVerbsTest, FalseColours) {
  const Node greys = FromImage(Row({-1, 0, 0.25f, 0.75f, 1, 2, kNaN, kInf}));
  OnEveryTarget([&] {
    ExpectSamples(ColorMap(greys, {0, 1, 2, 4, 1, -2}),
                  {0, 1, 2, 0, 1, 2, 1, 1, 1, 3, 1, -1, 4, 1, -2, 4, 1, -2, 0, 1, 2, 4, 1, -2});
    // Colours go by their luminance.
    ExpectSamples(ColorMap(FromImage(Row({0, 1, 0, 0.5f}, 4)), {0, 0, 0, 1, 1, 1}),
                  {0.7152f, 0.7152f, 0.7152f});
  });
  EXPECT_THAT(ColorMap(greys, "viridis").spec().channels, ElementsAre("R", "G", "B"));
  EXPECT_THAT(WhatIsRefused([&] { ColorMap(greys, "virdis"); }), HasSubstr("did you mean viridis?"));
  EXPECT_THAT(WhatIsRefused([&] { ColorMap(greys, {0, 1, 2, 3}); }), HasSubstr("found 4 numbers"));
}

TEST(PixelVerbsTest, RectanglesAreFilled) {
  const Node image = FromImage(Row({kNaN, kInf, 3, 4, 5}));
  OnEveryTarget([&] {
    ExpectSamples(Fill(image, {.box = {1, 0, 3, 1},
                               .top_left = {2},
                               .top_right = {4},
                               .bottom_left = {2},
                               .bottom_right = {4}}),
                  {kNaN, 2, 4, 4, 5});
    // The part inside the image is what a gradient runs over.
    ExpectSamples(Fill(image, {.box = {-9, -3, 2, 8},
                               .top_left = {2},
                               .top_right = {4},
                               .bottom_left = {2},
                               .bottom_right = {4}}),
                  {2, 4, 3, 4, 5});
    ExpectSamples(Fill(image, {.box = {7, 0, 9, 1}}), {kNaN, kInf, 3, 4, 5});
    ExpectSamples(Fill(image, {.box = {2, 0, 3, 1}, .top_left = {3e38}, .top_right = {-3e38}}),
                  {kNaN, kInf, 3e38f, 4, 5});
  });
}

TEST(PixelVerbsTest, NoiseIsOiiotools) {
  const Node black = Create(ImageSpec(3, 1, 2));
  OnEveryTarget([&] {
    ExpectSamples(AddNoise(black, {.type = AddedNoise::kUniform, .max = 1, .seed = 5}),
                  {0.12733841f, 0.7777338f, 0.81291676f, 0.594841f, 0.60974693f, 0.09946728f});
    const std::vector<float> want = {0.04088228f, 0.13865288f, -0.13172842f,
                                     0.07195404f, 0.0675294f,  -0.09358966f};
    const std::vector<float> got = Samples(AddNoise(black, {.seed = 5}));
    for (size_t i = 0; i < want.size(); ++i) EXPECT_NEAR(got[i], want[i], 2e-8);
    ExpectSamples(AddNoise(FromImage(Row({kNaN, kInf, 2, kNaN}, 2)),
                           {.type = AddedNoise::kSalt, .value = 7, .portion = 1, .channels = 1}),
                  {7, kInf, 7, kNaN});
    // All channels alike; what is lost stays lost.
    const std::vector<float> mono = Samples(AddNoise(black, {.mono = true}));
    EXPECT_EQ(mono[0], mono[1]);
    EXPECT_NE(mono[0], mono[2]);
    EXPECT_TRUE(std::isnan(Samples(AddNoise(FromImage(Row({kNaN})), {}))[0]));
  });
}

TEST(PixelVerbsTest, HolesAreFilled) {
  ImageSpec spec(37, 21, 4);
  spec.alpha = 3;
  const Image image(spec);
  for (int y = 0; y < 21; ++y) {
    for (int x = 0; x < 37; ++x) {
      const bool hole = x > 9 && x < 30 && y > 4 && y < 17;
      for (int c = 0; c < 4; ++c)
        image.at<float>(x, y, c) = hole ? 0.0f : c == 3 ? 1.0f : 0.25f * static_cast<float>(c + 1);
    }
  }
  OnEveryTarget([&] {
    const Image filled = Render(FillHoles(FromImage(image)));
    for (int y = 0; y < 21; ++y) {
      for (int x = 0; x < 37; ++x) {
        for (int c = 0; c < 4; ++c)  // one colour all around is the colour everywhere
          ASSERT_NEAR(filled.at<float>(x, y, c), c == 3 ? 1 : 0.25 * (c + 1), 1e-6)
              << x << "," << y << "," << c;
      }
    }
  });
  const Node opaque = FromImage(Row({1, kNaN}));
  ExpectSamples(FillHoles(opaque), {1, kNaN});
  // Nothing at all stays nothing.
  ImageSpec empty(5, 3, 4);
  empty.alpha = 3;
  for (const float v : Samples(FillHoles(Create(empty)))) EXPECT_EQ(v, 0);
}

// Of 19 rows made 9 the neighbours of the middle one see it at the very foot of their triangle: with a weight
// of a rounding there, divided by itself, it would be all that they are.
TEST(PixelVerbsTest, WhatLiesAtTheFootOfATriangleFillsNoHole) {
  for (const auto& [width, height] : {std::pair{12, 19}, {19, 12}, {19, 19}}) {
    ImageSpec spec(width, height, 4);
    spec.alpha = 3;
    Image image(spec);
    for (int i = 0; i < (width == 19 ? height : width); ++i) {
      const int x = width == 19 ? 9 : i, y = width == 19 ? i : 9;
      for (int c = 0; c < 4; ++c)
        image.at<float>(x, y, c) = c == 3 ? 1 : static_cast<float>((i * 7 + c) % 5) / 4;
    }
    const VerifyReport report = Verify(FillHoles(FromImage(image)));
    EXPECT_TRUE(report.within_bound && report.undecided == 0)
        << width << "x" << height << ": " << report.Summary();
  }
}

}  // namespace
}  // namespace tessera
