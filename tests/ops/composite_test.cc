// Compositing by formula: Porter-Duff's identities, 8-bit rounding, blend modes worked by hand, windows.
#include "tessera/ops/composite.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <utility>

#include "support/composite.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "verify/evaluate.h"

namespace tessera::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::HasSubstr;

TEST(PorterDuffTest, Identities) {
  const Node a = FromImage(Premultiplied(61, 17, 1)), b = FromImage(Premultiplied(61, 17, 2)),
             c = FromImage(Premultiplied(61, 17, 3));
  const auto over = [](const Node& s, const Node& d) { return Mode(s, d, BlendMode::kOver); };
  OnEveryTarget([&] {
    EXPECT_LE(Difference(over(over(a, b), c), over(a, over(b, c))), 1e-6);
    EXPECT_EQ(Difference(Mode(a, b, BlendMode::kXor), Mode(b, a, BlendMode::kXor)), 0);
    EXPECT_EQ(Difference(Mode(a, b, BlendMode::kSource), a), 0);
    EXPECT_EQ(Difference(Mode(a, b, BlendMode::kDestination), b), 0);
    EXPECT_EQ(Difference(Mode(a, b, BlendMode::kClear), MulConstant(a, {0})), 0);
    EXPECT_LE(Difference(Add(Mode(a, b, BlendMode::kIn), Mode(a, b, BlendMode::kOut)), a), 1e-7);
    EXPECT_LE(Difference(Mode(a, b, BlendMode::kAtop),
                         Add(Mode(a, b, BlendMode::kIn), Mode(a, b, BlendMode::kDestinationOut))),
              1e-7);
    EXPECT_EQ(Difference(Mode(a, b, BlendMode::kDestinationOver), over(b, a)), 0);
    EXPECT_EQ(Difference(Over(a, b), over(a, b)), 0);
    EXPECT_LE(Difference(Mode(a, b, BlendMode::kNormal), over(a, b)), 0);
  });
}

TEST(PorterDuffTest, OpaqueHidesAndClearShows) {
  const Node front = FromImage(Row({"R", "G", "B", "A"}, {0.25f, 0.5f, 1, 1, 0, 0, 0, 0, 2, 0, 0, 0}));
  const Node back = FromImage(Row({"R", "G", "B", "A"}, {9, 9, 9, 0.5f, 0.1f, 0.2f, 0.3f, 0.4f, 1, 1, 1, 1}));
  // The third is a glow: light without alpha adds.
  EXPECT_THAT(Values(Over(front, back)), ElementsAre(0.25f, 0.5f, 1, 1, 0.1f, 0.2f, 0.3f, 0.4f, 3, 1, 1, 1));
}

TEST(PorterDuffTest, HardValues) {
  const Node front = FromImage(
      Row({"R", "G", "B", "A"}, {1e8f, 0, 0, 1 - 0x1p-24f, 1, 1, 1, 2, 1, 1, 1, -1, kNaN, 1, 1, 0.5f}));
  const Node back = FromImage(Row({"R", "G", "B", "A"}, {1e8f, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}));
  const std::vector<float> v = Values(Mode(front, back, BlendMode::kOver)),
                           limited = Values(Over(front, back));
  EXPECT_FLOAT_EQ(v[0], 1e8f + 1e8f * 0x1p-24f);
  EXPECT_EQ(v[4], 0);        // alpha 2: nothing is limited
  EXPECT_EQ(limited[4], 1);  // as oiiotool does
  EXPECT_EQ(v[8], 3);
  EXPECT_EQ(limited[8], 2);
  EXPECT_TRUE(std::isnan(v[12]));
  EXPECT_EQ(v[13], 1.5f);
}

// The exact value of each operator on codes is N / 255, N whole: its nearest integer is never in doubt.
int Exact(BlendMode mode, int s, int d, int as, int ad, bool alpha) {
  int n = 0;
  const int both = as > 0 && ad > 0 ? 1 : 0;  // else the blend modes' own term is 0
  switch (mode) {
    case BlendMode::kOver:
      n = 255 * s + (255 - as) * d;
      break;
    case BlendMode::kIn:
      n = ad * s;
      break;
    case BlendMode::kOut:
      n = (255 - ad) * s;
      break;
    case BlendMode::kAtop:
      n = ad * s + (255 - as) * d;
      break;
    case BlendMode::kXor:
      n = (255 - ad) * s + (255 - as) * d;
      break;
    case BlendMode::kPlus:
      n = 255 * (s + d);
      break;
    case BlendMode::kMultiply:
      n = both * s * d + (255 - ad) * s + (255 - as) * d;
      break;
    case BlendMode::kScreen:
      n = both * (s * ad + d * as - s * d) + (255 - ad) * s + (255 - as) * d;
      break;
    case BlendMode::kDarken:
      n = both * std::min(s * ad, d * as) + (255 - ad) * s + (255 - as) * d;
      break;
    case BlendMode::kLighten:
      n = both * std::max(s * ad, d * as) + (255 - ad) * s + (255 - as) * d;
      break;
    case BlendMode::kDifference:
      n = both * (alpha ? as * ad : std::abs(d * as - s * ad)) + (255 - ad) * s + (255 - as) * d;
      break;
    default:
      n = both * (alpha ? as * ad : s * ad + d * as - 2 * s * d) + (255 - ad) * s +
          (255 - as) * d;  // exclusion
  }
  return std::min(255, (2 * n + 255) / 510);
}

TEST(PorterDuffTest, BytesAreRoundedOnce) {
  // Every product of a sample and an alpha, all sums of random pixels.
  const Image s = PremultipliedBytes(256, 256, 1), d = PremultipliedBytes(256, 256, 2);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      d.at<uint8_t>(x, y, 0) = static_cast<uint8_t>(x);
      s.at<uint8_t>(x, y, 3) = static_cast<uint8_t>(y);
      s.at<uint8_t>(x, y, 0) = static_cast<uint8_t>((x * 7) % (y + 1));
    }
  }
  // Not premultiplied, an eighth of the alphas 0 and another 255.
  const Image free_s = PremultipliedBytes(256, 256, 3), free_d = PremultipliedBytes(256, 256, 4);
  std::mt19937 random(5);
  for (const Image* image : {&free_s, &free_d}) {
    for (int y = 0; y < 256; ++y) {
      for (int x = 0; x < 256; ++x) {
        for (int c = 0; c < 4; ++c) image->at<uint8_t>(x, y, c) = static_cast<uint8_t>(random());
        if (const auto kind = random() % 8; kind < 2)
          image->at<uint8_t>(x, y, 3) = static_cast<uint8_t>(255 * kind);
      }
    }
  }
  const BlendMode modes[] = {BlendMode::kOver,     BlendMode::kIn,         BlendMode::kOut,
                             BlendMode::kAtop,     BlendMode::kXor,        BlendMode::kPlus,
                             BlendMode::kMultiply, BlendMode::kScreen,     BlendMode::kDarken,
                             BlendMode::kLighten,  BlendMode::kDifference, BlendMode::kExclusion};
  OnEveryTarget([&] {
    for (const BlendMode mode : modes) {
      SCOPED_TRACE(BlendModeNames()[static_cast<size_t>(mode)]);
      for (const auto& [front, back] : {std::pair(&s, &d), {&free_s, &free_d}}) {
        const Image got = Render(Mode(FromImage(*front), FromImage(*back), mode), PixelType::kUint8);
        int wrong = 0;
        for (int y = 0; y < 256; ++y) {
          for (int x = 0; x < 256; ++x) {
            const int as = front->at<uint8_t>(x, y, 3), ad = back->at<uint8_t>(x, y, 3);
            for (int c = 0; c < 4; ++c) {
              wrong += got.at<uint8_t>(x, y, c) !=
                       Exact(mode, front->at<uint8_t>(x, y, c), back->at<uint8_t>(x, y, c), as, ad, c == 3);
            }
          }
        }
        EXPECT_EQ(wrong, 0);
      }
    }
    const Image plain = Render(Over(FromImage(s), FromImage(d)), PixelType::kUint8);
    EXPECT_EQ(LargestDifference(
                  plain, Render(Mode(FromImage(s), FromImage(d), BlendMode::kOver), PixelType::kUint8)),
              0);
  });
}

TEST(BlendTest, BytesOfAllAlphasAgreeWithPlanes) {
  // Colours of any size, each pair of alphas.
  const Image s = PremultipliedBytes(256, 256, 3), d = PremultipliedBytes(256, 256, 4);
  std::mt19937 random(6);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < 3; ++c) {
        s.at<uint8_t>(x, y, c) = static_cast<uint8_t>(random());
        d.at<uint8_t>(x, y, c) = static_cast<uint8_t>(random());
      }
      s.at<uint8_t>(x, y, 3) = static_cast<uint8_t>(x);
      d.at<uint8_t>(x, y, 3) = static_cast<uint8_t>(y);
    }
  }
  const auto five = [](const Image& image) { return SelectChannels(FromImage(image), "R,G,B,A,x=0.5"); };
  OnEveryTarget([&] {
    for (size_t mode = 0; mode < BlendModeNames().size(); ++mode) {
      const auto m = static_cast<BlendMode>(mode);
      if (m >= BlendMode::kHue && m <= BlendMode::kLuminosity) continue;
      const Node planes = SelectChannels(Mode(five(s), five(d), m), "R,G,B,A");
      EXPECT_EQ(LargestDifference(Render(Mode(FromImage(s), FromImage(d), m), PixelType::kUint8),
                                  Render(planes, PixelType::kUint8)),
                0)
          << BlendModeNames()[mode];
    }
  });
}

TEST(PorterDuffTest, DirectPixelsAndPlanesAgree) {
  // The same numbers from RGBA pixels of every type and size of tail, and with a fifth channel, which takes
  // planes.
  for (const int width : {1, 15, 16, 17, 67, 300}) {
    const Image s = Premultiplied(width, 3, 5), d = Premultiplied(width, 3, 6);
    const auto five = [](const Node& n) { return SelectChannels(n, "R,G,B,A,x=0.5"); };
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      const Node a = FromImage(Render(FromImage(s), type)), b = FromImage(Render(FromImage(d), type));
      OnEveryTarget([&] {
        for (size_t mode = 0; mode < BlendModeNames().size(); ++mode) {
          const auto m = static_cast<BlendMode>(mode);
          if (m >= BlendMode::kHue && m <= BlendMode::kLuminosity) continue;
          const Node planes = SelectChannels(Mode(five(a), five(b), m), "R,G,B,A");
          EXPECT_EQ(LargestDifference(Render(Mode(a, b, m), type), Render(planes, type)), 0)
              << BlendModeNames()[mode] << " " << PixelTypeName(type) << " " << width;
        }
      });
    }
  }
}

TEST(PorterDuffTest, InPlace) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kFloat}) {
    const Image s = Render(FromImage(Premultiplied(333, 7, 5)), type),
                d = Render(FromImage(Premultiplied(333, 7, 6)), type);
    const Node node = Over(FromImage(s), FromImage(d));
    const Image apart = Render(node, type);
    RenderInto(node, d.view());
    EXPECT_EQ(LargestDifference(apart, d), 0);
  }
}

TEST(BlendTest, WorkedByHand) {
  // Straight colours 0.8 on 0.25, alphas 0.5 and 1 and both 1.
  struct Case {
    BlendMode mode;
    double b;  // B(0.25, 0.8)
  };
  const Case cases[] = {{BlendMode::kMultiply, 0.2},
                        {BlendMode::kScreen, 0.85},
                        {BlendMode::kOverlay, 0.4},
                        {BlendMode::kDarken, 0.25},
                        {BlendMode::kLighten, 0.8},
                        {BlendMode::kColorDodge, 1},
                        {BlendMode::kColorBurn, 0.0625},
                        {BlendMode::kHardLight, 1 - 2 * 0.75 * 0.2},
                        {BlendMode::kSoftLight, 0.25 + 0.6 * (0.5 - 0.25)},
                        {BlendMode::kDifference, 0.55},
                        {BlendMode::kExclusion, 0.65},
                        {BlendMode::kHue, 0.25},
                        {BlendMode::kSaturation, 0.25},
                        {BlendMode::kColor, 0.25},
                        {BlendMode::kLuminosity, 0.8}};
  const Node full = FromImage(Row({"R", "G", "B", "A"}, {0.8f, 0.8f, 0.8f, 1}));
  const Node half = FromImage(Row({"R", "G", "B", "A"}, {0.4f, 0.4f, 0.4f, 0.5f}));
  const Node back = FromImage(Row({"R", "G", "B", "A"}, {0.25f, 0.25f, 0.25f, 1}));
  const Node thin = FromImage(Row({"R", "G", "B", "A"}, {0.125f, 0.125f, 0.125f, 0.5f}));
  OnEveryTarget([&] {
    for (const Case& c : cases) {
      SCOPED_TRACE(BlendModeNames()[static_cast<size_t>(c.mode)]);
      EXPECT_NEAR(Values(Mode(full, back, c.mode))[0], c.b, 1e-6);
      EXPECT_NEAR(Values(Mode(half, back, c.mode))[0], 0.5 * c.b + 0.5 * 0.25, 1e-6);
      EXPECT_NEAR(Values(Mode(half, thin, c.mode))[0], 0.25 * c.b + 0.5 * 0.4 + 0.5 * 0.125, 1e-6);
      EXPECT_NEAR(Values(Mode(half, thin, c.mode))[3], 0.75, 1e-6);
    }
  });
}

// An image without alpha has a colour where the other one has its alpha: it is opaque all the same.
TEST(BlendTest, AColourInThePlaceOfAlphaIsNone) {
  const Node colors = FromImage(Row({"R", "G", "B", "Y"}, {0.8f, 0.6f, 0.4f, 0.3f}));
  const Node back = FromImage(Row({"R", "G", "B", "A"}, {0.125f, 0.25f, 0.375f, 0.5f}));
  OnEveryTarget([&] {
    for (const BlendMode mode :
         {BlendMode::kHardLight, BlendMode::kMultiply, BlendMode::kOver, BlendMode::kAtop}) {
      EXPECT_NEAR(Values(Mode(colors, back, mode))[3], mode == BlendMode::kAtop ? 0.5 : 1, 1e-6);
    }
  });
}

TEST(BlendTest, NonSeparableColours) {
  const Node red = FromImage(Row({"R", "G", "B", "A"}, {1, 0, 0, 1})),
             back = FromImage(Row({"R", "G", "B", "A"}, {0.2f, 0.4f, 0.6f, 1}));
  // SetLum(SetSat(red, 0.4), 0.362): (0.4, 0, 0) has luminosity 0.12.
  const std::vector<float> hue = Values(Mode(red, back, BlendMode::kHue));
  EXPECT_NEAR(hue[0], 0.642, 1e-6);
  EXPECT_NEAR(hue[1], 0.242, 1e-6);
  // SetLum(red, 0.362): (1.062, 0.062, 0.062) is drawn back to 1.
  const std::vector<float> color = Values(Mode(red, back, BlendMode::kColor));
  EXPECT_NEAR(color[0], 1, 1e-6);
  EXPECT_NEAR(color[1], 0.362 + (0.062 - 0.362) * (1 - 0.362) / (1.062 - 0.362), 1e-6);
  // SetLum(back, 0.3) moves all by -0.062.
  EXPECT_NEAR(Values(Mode(red, back, BlendMode::kLuminosity))[2], 0.538, 1e-6);
  // SetLum(SetSat(back, 1), 0.362): (0, 0.5, 1) has luminosity 0.405.
  const double n = -0.043;
  EXPECT_NEAR(Values(Mode(red, back, BlendMode::kSaturation))[2],
              0.362 + (0.957 - 0.362) * 0.362 / (0.362 - n), 1e-6);
}

TEST(BlendTest, BytesAreTheNearestCodes) {
  const Node s = FromImage(PremultipliedBytes(128, 64, 11)), d = FromImage(PremultipliedBytes(128, 64, 12));
  OnEveryTarget([&] {
    for (size_t mode = 0; mode < BlendModeNames().size(); ++mode) {
      const Node node = Mode(s, d, static_cast<BlendMode>(mode));
      const Image got = Render(node, PixelType::kUint8);
      verify::ReferenceEngine engine([](const std::string&) { return 0.0; });
      const verify::Evaluated want = engine.Evaluate(node, got.spec().data_window);
      int wrong = 0;
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 128; ++x) {
          for (int c = 0; c < 4; ++c) {
            const double exact = 255 * std::clamp(want.value.at(x, y, c), 0.0, 1.0),
                         code = got.at<uint8_t>(x, y, c);
            wrong += std::fabs(exact - code) > 0.5 + 1e-3;
          }
        }
      }
      EXPECT_EQ(wrong, 0) << BlendModeNames()[mode];
    }
  });
}

TEST(BlendTest, GlFactors) {
  const Node s = FromImage(Row({"R", "G", "B", "A"}, {0.5f, 0.25f, 1, 0.5f})),
             d = FromImage(Row({"R", "G", "B", "A"}, {kNaN, 0.5f, 0.5f, 1}));
  using F = BlendFactor;
  const auto blend = [&](BlendParams p) { return Values(Blend(s, d, p)); };
  EXPECT_EQ(blend({.mode = BlendMode::kAdd, .source = F::kOne, .destination = F::kZero})[0],
            0.5f);  // NaN has no weight
  EXPECT_EQ(blend({.mode = BlendMode::kSubtract, .source = F::kSourceAlpha})[2], 0.0f);
  EXPECT_EQ(blend({.mode = BlendMode::kReverseSubtract})[1], 0.25f);
  EXPECT_EQ(blend({.mode = BlendMode::kMax})[0], 0.5f);  // a number wins
  EXPECT_EQ(blend({.mode = BlendMode::kModulate})[1], 0.125f);
  const auto c = blend({.mode = BlendMode::kConstant, .constant = {0, 0.25, 0.5, 0.75}});
  EXPECT_EQ(c[1], 0.4375f);
  EXPECT_EQ(c[3], 0.5f * 0.75f + 0.25f);
  const auto saturate =
      blend({.mode = BlendMode::kAdd, .source = F::kSourceAlphaSaturate, .destination = F::kZero});
  EXPECT_EQ(saturate[1], 0.0f);  // min(0.5, 1 - 1)
  EXPECT_EQ(saturate[3], 0.5f);
  EXPECT_THAT(Refusal([&] { blend({.mode = BlendMode::kOver, .source = F::kOne}); }),
              HasSubstr("found factors with the mode over"));
}

TEST(BlendTest, StraightOverEqualsPremultipliedOver) {
  const Node a = FromImage(Premultiplied(64, 16, 9)), b = FromImage(Premultiplied(64, 16, 10));
  const Image straight = Render(a);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float alpha = straight.at<float>(x, y, 3);
      for (int c = 0; c < 3 && alpha > 0; ++c) straight.at<float>(x, y, c) /= alpha;
    }
  }
  EXPECT_LE(Difference(Mode(FromImage(straight), b, BlendMode::kStraightOver), Mode(a, b, BlendMode::kOver)),
            1e-6);
}

TEST(BlendTest, RepeatedDabs) {
  const Image dab = Row({"R", "G", "B", "A"}, {0.125f, 0.125f, 0.125f, 0.125f});
  Node n = MulConstant(FromImage(dab), {0});
  for (int i = 0; i < 12; ++i) n = Mode(FromImage(dab), n, BlendMode::kOver);
  EXPECT_NEAR(Values(n)[3], 1 - std::pow(0.875, 12), 1e-6);
}

TEST(WindowTest, ResultCoversBothImages) {
  ImageSpec spec(4, 3, 4);
  const Image a(spec);
  spec.data_window = {2, 1, 7, 5};
  spec.display_window = {0, 0, 9, 9};
  const Image b(spec);
  std::fill_n(reinterpret_cast<float*>(a.view().data), 48, 0.5f);
  std::fill_n(reinterpret_cast<float*>(b.view().data), 80, 0.25f);
  const Image over = Render(Over(FromImage(a), FromImage(b)));
  EXPECT_EQ(over.spec().data_window, (Roi{0, 0, 7, 5}));
  EXPECT_EQ(over.spec().display_window, (Roi{0, 0, 9, 9}));
  EXPECT_EQ(over.at<float>(0, 0, 0), 0.5f);
  EXPECT_EQ(over.at<float>(3, 2, 0), 0.625f);
  EXPECT_EQ(over.at<float>(6, 4, 3), 0.25f);
  EXPECT_EQ(over.at<float>(6, 0, 0), 0);
  // An image without alpha is opaque where it has pixels.
  const Image opaque = Render(Over(FromImage(a), SelectChannels(FromImage(b), "R,G,B")));
  EXPECT_EQ(opaque.spec().channel_count(), 4);
  EXPECT_EQ(opaque.at<float>(3, 2, 0), 0.625f);
  EXPECT_EQ(opaque.at<float>(3, 2, 3), 1);
  EXPECT_EQ(opaque.at<float>(6, 4, 3), 1);
  EXPECT_EQ(opaque.at<float>(6, 0, 3), 0);
  EXPECT_EQ(opaque.at<float>(0, 0, 3), 0.5f);
  EXPECT_THAT(Refusal([&] { Over(FromImage(a), SelectChannels(FromImage(b), "R,G")); }),
              HasSubstr("channels"));
  EXPECT_THAT(Refusal([&] { ZOver(FromImage(a), FromImage(b)); }), HasSubstr("expected a depth channel"));
}

}  // namespace
}  // namespace tessera::testing
