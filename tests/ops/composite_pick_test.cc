// Compositing by choice: depth, alpha and stencil tests, dissolves, masks, decals.
#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>

#include "support/composite.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/composite.h"

namespace tessera::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::HasSubstr;

TEST(DepthTest, ZOverFollowsTheNearerPixel) {
  const std::vector<std::string> channels = {"R", "G", "B", "A", "Z"};
  const Node a = FromImage(
      Row(channels, {1, 0, 0, 1, 5, 0.5f, 0, 0, 0.5f, 5, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 1, kNaN}));
  const Node b =
      FromImage(Row(channels, {0, 1, 0, 1, 5, 0, 1, 0, 1, 3, 0, 1, 0, 1, 3, 0, 1, 0, 1, 4, 0, 1, 0, 1, 4}));
  OnEveryTarget([&] {
    EXPECT_THAT(Values(ZOver(a, b)), ElementsAre(1, 0, 0, 1, 5,    // equal: a in front
                                                 0, 1, 0, 1, 3,    // b nearer and opaque
                                                 0, 1, 0, 1, 3,    // a in front but clear: b's depth
                                                 1, 0, 0, 1, 0,    // zero means zero
                                                 0, 1, 0, 1, 4));  // NaN is not nearer
    EXPECT_THAT(Values(SelectChannels(ZOver(a, b, {.zero_is_infinite = true}), "R")),
                ElementsAre(1, 0, 0, 0, 0));
  });
}

TEST(DepthTest, TiesKeepTheBackground) {
  const std::vector<std::string> channels = {"Y", "Z"};
  const Node f = FromImage(Row(channels, {1, 0.5f, 1, 1, 1, -0.0f, 1, kNaN, 1, 0.5f, 1, kInf}));
  const Node b = FromImage(Row(channels, {0, 0.5f, 0, 1, 0, 0, 0, 0.5f, 0, kNaN, 0, kInf}));
  OnEveryTarget([&] {
    EXPECT_THAT(Values(SelectChannels(tessera::DepthTest(f, b), "Y")), ElementsAre(0, 0, 0, 0, 1, 0));
    EXPECT_THAT(Values(SelectChannels(tessera::DepthTest(f, b, {.test = Comparison::kLessOrEqual}), "Y")),
                ElementsAre(1, 1, 1, 0, 1, 1));
    const Node squeezed = tessera::DepthTest(f, b, {.scale = 0.5f, .bias = 0.125f});
    EXPECT_EQ(Values(squeezed)[0], 1);
    EXPECT_EQ(Values(squeezed)[1], 0.375f);
  });
}

TEST(DepthTest, MergeDoesNotDependOnTheOrder) {
  std::vector<Node> images;
  for (uint32_t k = 0; k < 5; ++k) {
    const Node n = FromImage(Premultiplied(40, 9, 20 + k));
    images.push_back(
        RenameChannels(AppendChannels(n, SelectChannels(FromImage(Premultiplied(40, 9, 40 + k)), "R")),
                       {"R", "G", "B", "A", "Z"}));
  }
  // Random depths of opaque and clear pixels: 0 where alpha was 0, so ties are there; make depths unlike.
  for (size_t k = 0; k < images.size(); ++k) {
    images[k] = AddConstant(images[k], {0, 0, 0, 0, 1e-3 * static_cast<double>(k)});
  }
  std::vector<Node> turned = images;
  std::ranges::reverse(turned);
  OnEveryTarget([&] {
    for (const bool over : {false, true}) {
      EXPECT_EQ(Difference(ZComposite(images, {.over = over}), ZComposite(turned, {.over = over})), 0);
      const Node pairs =
          ZComposite({ZComposite({images[0], images[1]}, {.over = false}), images[2]}, {.over = false});
      if (!over) {
        EXPECT_EQ(Difference(pairs, ZComposite({images[0], images[1], images[2]})), 0);
        EXPECT_EQ(Difference(ZComposite({images[3], images[3]}), images[3]), 0);
      }
    }
    EXPECT_LE(Difference(ZComposite({images[0], images[1]}, {.over = true}), ZOver(images[0], images[1])),
              1e-6);
  });
}

TEST(DepthTest, ComplexityCountsWhatIsThere) {
  const auto z = [](float a, float b) { return FromImage(Row({"Z"}, {a, b})); };
  EXPECT_THAT(Values(DepthComplexity({z(0.5f, 1), z(kNaN, 0), z(0.25f, kInf)})), ElementsAre(2, 1));
}

bool Passes(int test, double a, double b) {
  const bool results[] = {false, a<b, a == b, a <= b, a> b, a != b, a >= b, true};
  return results[test];
}

TEST(AlphaTestTest, EveryComparison) {
  const std::vector<float> alphas = {0, 0.25f, 0.5f, 1, -0.0f, kNaN, kInf};
  const Image image = Row({"A"}, alphas);
  OnEveryTarget([&] {
    for (int test = 0; test < 8; ++test) {
      const std::vector<float> got =
          Values(AlphaTest(FromImage(image), {static_cast<Comparison>(test), 0.5f}));
      for (size_t i = 0; i < alphas.size(); ++i) {
        const float want = Passes(test, double{alphas[i]}, 0.5) ? alphas[i] : 0;
        EXPECT_TRUE(got[i] == want || (std::isnan(got[i]) && std::isnan(want))) << test << " " << alphas[i];
      }
    }
  });
}

TEST(StencilTest, EveryByteComparisonAndAction) {
  const Image bytes(ImageSpec(256, 1, 1, PixelType::kUint8));
  for (int v = 0; v < 256; ++v) bytes.at<uint8_t>(v, 0) = static_cast<uint8_t>(v);
  const Node stencil = FromImage(bytes);
  const Node front = FromImage(Row({"Y"}, std::vector<float>(256, 1))),
             back = FromImage(Row({"Y"}, std::vector<float>(256, 0)));
  OnEveryTarget([&] {
    for (int test = 0; test < 8; ++test) {
      for (int action = 0; action < 8; ++action) {
        const StencilParams p{static_cast<Comparison>(test),     0x53, 0x7C, 0x3F, StencilAction::kInvert,
                              static_cast<StencilAction>(action)};
        const std::vector<float> picked = Values(StencilSelect(front, back, stencil, p));
        const Image updated = Render(StencilUpdate(stencil, p), PixelType::kUint8);
        for (int v = 0; v < 256; ++v) {
          const bool pass = Passes(test, 0x53 & 0x7C, v & 0x7C);
          const int results[] = {
              v, 0, 0x53, std::min(v + 1, 255), std::max(v - 1, 0), 255 - v, (v + 1) & 255, (v + 255) & 255};
          const int next = pass ? results[action] : 255 - v;
          ASSERT_EQ(picked[static_cast<size_t>(v)], pass ? 1 : 0) << test << " " << v;
          ASSERT_EQ(updated.at<uint8_t>(v, 0), (v & ~0x3F) | (next & 0x3F))
              << test << " " << action << " " << v;
        }
      }
    }
  });
  EXPECT_THAT(Refusal([&] { StencilUpdate(stencil, {.reference = 256}); }), HasSubstr("expected a byte"));
}

TEST(DissolveTest, EndsNestingAndShares) {
  const ImageSpec spec(256, 128, 1);
  const Image a(spec), b(spec);
  std::fill_n(reinterpret_cast<float*>(b.view().data), 256 * 128, 1.0f);
  const auto at = [&](float t, DissolvePattern pattern) {
    return Values(Dissolve(FromImage(a), FromImage(b), {.t = t, .pattern = pattern}));
  };
  OnEveryTarget([&] {
    for (const DissolvePattern pattern : {DissolvePattern::kNoise, DissolvePattern::kOrdered,
                                          DissolvePattern::kRight, DissolvePattern::kDown}) {
      const std::vector<float> none = at(0, pattern), all = at(1, pattern), some = at(0.3f, pattern),
                               more = at(0.6f, pattern);
      EXPECT_EQ(std::ranges::count(none, 1.0f), 0);
      EXPECT_EQ(std::ranges::count(at(kNaN, pattern), 1.0f), 0);
      EXPECT_EQ(std::ranges::count(all, 0.0f), 0);
      const double count = 256.0 * 128;
      EXPECT_NEAR(static_cast<double>(std::ranges::count(some, 1.0f)) / count, 0.3, 3 / std::sqrt(count));
      for (size_t i = 0; i < some.size(); ++i) ASSERT_LE(some[i], more[i]);
    }
    // Both masks together are one.
    const Node t = Dissolve(FromImage(a), FromImage(b), {.t = 0.3f}),
               u = Dissolve(FromImage(b), FromImage(a), {.t = 0.3f});
    EXPECT_THAT(Values(Add(t, u)), ::testing::Each(1.0f));
  });
  const Node pattern = FromImage(Row({"Y"}, {0, 0.5f, 0.999f, kNaN}));
  const Node zeros = FromImage(Row({"Y"}, {0, 0, 0, 0})), ones = FromImage(Row({"Y"}, {1, 1, 1, 1}));
  const DissolveParams half{.t = 0.5f, .pattern = DissolvePattern::kImage};
  EXPECT_THAT(Values(Dissolve(zeros, ones, half, pattern)), ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(Refusal([&] { Dissolve(zeros, ones, half); }), HasSubstr("found no pattern"));
}

TEST(DissolveTest, OrderedHasEveryRankOnce) {
  ImageSpec spec(16, 16, 1);
  const Image black(spec), white(spec);
  std::fill_n(reinterpret_cast<float*>(white.view().data), 256, 1.0f);
  for (int k = 0; k <= 256; ++k) {
    const auto v = Values(Dissolve(FromImage(black), FromImage(white),
                                   {.t = static_cast<float>(k) / 256, .pattern = DissolvePattern::kOrdered}));
    ASSERT_EQ(std::accumulate(v.begin(), v.end(), 0.0f), static_cast<float>(k));
  }
}

TEST(RevealTest, MasksLeadFromOneToTheOther) {
  const Node a = FromImage(Row({"Y"}, {0.1f, 0.1f, 3e38f})), b = FromImage(Row({"Y"}, {0.7f, 0.7f, -3e38f}));
  EXPECT_THAT(Values(Reveal(a, b, FromImage(Row({"Y"}, {0, 1, 1})))), ElementsAre(0.1f, 0.7f, -3e38f));
  EXPECT_THAT(Values(Reveal(a, b, FromImage(Row({"Y"}, {0.25f, -1, 0})))),
              ElementsAre(FloatNear(0.25f, 1e-7f), FloatNear(-0.5f, 1e-6f), 3e38f));
}

TEST(DecalTest, FirstOnTopWithinTheBase) {
  // Sixteen combinations of four decals, on and off the base.
  std::vector<float> base;
  std::vector<std::vector<float>> decals(4);
  for (int i = 0; i < 32; ++i) {
    base.insert(base.end(), {i < 16 ? 0.9f : 0.0f, i < 16 ? 1.0f : 0.0f});
    for (size_t k = 0; k < 4; ++k) {
      const bool on = (i >> k & 1) != 0;
      decals[k].insert(decals[k].end(), {on ? 0.1f * static_cast<float>(k + 1) : 0.0f, on ? 1.0f : 0.0f});
    }
  }
  std::vector<Node> nodes;
  for (const auto& d : decals) nodes.push_back(FromImage(Row({"Y", "A"}, d)));
  OnEveryTarget([&] {
    const std::vector<float> got = Values(Decals(FromImage(Row({"Y", "A"}, base)), nodes));
    for (int i = 0; i < 32; ++i) {
      float want = base[static_cast<size_t>(2 * i)];
      for (int k = 3; k >= 0 && i < 16; --k) {
        if (i >> k & 1) want = 0.1f * static_cast<float>(k + 1);
      }
      EXPECT_EQ(got[static_cast<size_t>(2 * i)], want) << i;
    }
  });
}

}  // namespace
}  // namespace tessera::testing
