// Colour operations on every target: checks and hard cases of doc/maths/color.md, bounds against the oracle,
// folding.
#include "tessera/ops/color.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "graph/op.h"
#include "graph/optimize.h"
#include "ops/registry.h"
#include "reference/reference.h"
#include "support/every_target.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
const LuminanceWeights kSets[] = {kRec709, kHaeberli, kNtsc601};

using Samples = std::vector<float>;

Image MakeImage(const Samples& samples, int channels) {
  Image image(ImageSpec(static_cast<int>(samples.size()) / channels, 1, channels));
  for (size_t i = 0; i < samples.size(); ++i) {
    image.at<float>(static_cast<int>(i) / channels, 0, static_cast<int>(i) % channels) = samples[i];
  }
  return image;
}
Samples Values(const Node& node, const RenderOptions& options = {}) {
  const Image image = Render(node, PixelType::kFloat, options);
  Samples out;
  for (int y = 0; y < image.spec().height(); ++y) {
    for (int x = 0; x < image.spec().width(); ++x) {
      for (int c = 0; c < image.spec().channel_count(); ++c) out.push_back(image.at<float>(x, y, c));
    }
  }
  return out;
}
Node Pixels(const Samples& samples, int channels = 4) { return FromImage(MakeImage(samples, channels)); }
Samples RandomSamples(size_t n, float low, float high, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> d(low, high);
  Samples s(n);
  for (float& v : s) v = d(random);
  return s;
}
bool SameBits(const Samples& a, const Samples& b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (std::bit_cast<uint32_t>(a[i]) != std::bit_cast<uint32_t>(b[i])) return false;
  }
  return true;
}
double MaxDifference(const Samples& a, const Samples& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    worst = std::max(worst, std::fabs(static_cast<double>(a[i]) - b[i]));
  }
  return worst;
}

class ColorTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, ColorTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

// Every colour operation of the registry, every example, against the oracle within the bound its row states.
TEST_P(ColorTest, StaysWithinItsBound) {
  for (const ops::OpInfo& info : ops::Registry()) {
    if (info.family != "color") continue;
    for (const std::string& example : info.examples) {
      SCOPED_TRACE(info.name + " " + example);
      std::vector<Node> in;
      std::vector<reference::ImageD> in_d;
      std::vector<ImageSpec> specs;
      for (int k = 0; k < info.inputs; ++k) {
        const Samples s = RandomSamples(4 * 20000, k == 0 ? -1.f : 0.f, 2.f, static_cast<unsigned>(k + 3));
        in.push_back(Pixels(s));
        specs.push_back(in.back().spec());
        in_d.emplace_back(specs.back().data_window, 4);
        std::copy(s.begin(), s.end(), in_d.back().samples.begin());
      }
      const Node node = info.make(in, ops::ParseExample(info, example), nullptr);
      if (node.data()->inputs.size() != in.size() || node.data()->inputs[0].data() != in[0].data())
        continue;  // several operations: see the laws
      const graph::Op& op = *node.data()->op;
      const reference::Entry* const entry = reference::Find(op.Name());
      ASSERT_NE(entry, nullptr);
      reference::ImageD out(node.spec().data_window, node.spec().channel_count()), scale = out;
      entry->evaluate({op.Parameters(), in_d, specs, node.spec(), out, &scale});
      const Samples got = Values(node);
      ASSERT_EQ(got.size(), out.samples.size());
      double worst = 0;
      for (size_t i = 0; i < got.size(); ++i) {
        const double bound = info.bound_u * 0x1p-24 * scale.samples[i];
        const double error = std::fabs(got[i] - out.samples[i]);
        ASSERT_LE(error, bound + 1e-44) << i << ": " << got[i] << ", expected " << out.samples[i];
        if (scale.samples[i] > 0) worst = std::max(worst, error / scale.samples[i] * 0x1p24);
      }
      RecordProperty(info.name, std::to_string(worst));
    }
  }
}

TEST_P(ColorTest, IdentityParametersReturnTheBits) {
  Samples s = RandomSamples(4 * 67, -2, 3);
  s[0] = kNaN, s[5] = kInf, s[9] = -0.0f, s[13] = FLT_MIN / 8;
  const Node in = Pixels(s);
  for (const Node& node :
       {RotateHue(in, Degrees(0)), RotateHue(in, Degrees(-720)), RotateHue(in, {360, HuePreserve::kNone}),
        Saturate(in, 1), Brightness(in, 1), Contrast(in, 1), Contrast(in, {1, 0.5}),
        ColorMatrix(in, {{1, 0, 0, 0, 1, 0, 0, 0, 1}}), Interpolate(in, Saturate(in, 0), 0),
        Interpolate(Saturate(in, 0), in, 1)}) {
    EXPECT_TRUE(SameBits(Values(node), s)) << node.data()->op->Describe();
  }
}

TEST_P(ColorTest, LuminanceAndGreysAreKept) {
  const Samples s = RandomSamples(4 * 1000, 0, 1);
  const Node in = Pixels(s);
  for (const LuminanceWeights& w : kSets) {
    const Samples before = Values(Luminance(in, {w}));
    for (const double degrees : {1.0, 75.0, 90.0, 180.0, -33.3, 1e9}) {
      EXPECT_LT(
          MaxDifference(Values(Luminance(Pixels(Values(RotateHue(in, Degrees(degrees), w))), {w})), before),
          1e-6);
    }
    for (const double sat : {-1.0, 0.0, 0.4}) {
      EXPECT_LT(MaxDifference(Values(Luminance(Pixels(Values(Saturate(in, sat, w))), {w})), before), 1e-6);
    }
    Samples greys;
    for (const float v : RandomSamples(200, 0, 1, 5)) greys.insert(greys.end(), {v, v, v, 1});
    for (const Node& node : {RotateHue(Pixels(greys), Degrees(41), w), Saturate(Pixels(greys), 1.7, w)}) {
      const Samples got = Values(node);
      for (size_t i = 0; i < got.size(); ++i) EXPECT_NEAR(got[i], greys[i], 4 * FLT_EPSILON * greys[i]);
    }
    const Samples black = Values(RotateHue(Pixels({0, 0, 0, 1}), Degrees(77), w));
    EXPECT_EQ(black, (Samples{0, 0, 0, 1}));
    const Samples grey = Values(Saturate(in, 0, w));
    for (size_t i = 0; i < grey.size(); i += 4) EXPECT_TRUE(grey[i] == grey[i + 1] && grey[i] == grey[i + 2]);
  }
}

TEST_P(ColorTest, HueIsAGroup) {
  const Node in = Pixels(RandomSamples(4 * 500, 0, 1));
  const Samples original = Values(in);
  for (const LuminanceWeights& w : kSets) {
    const auto hue = [&](const Node& n, double a) { return RotateHue(n, Degrees(a), w); };
    EXPECT_LT(MaxDifference(Values(hue(hue(in, 25), 50)), Values(hue(in, 75))), 1e-6);
    EXPECT_LT(MaxDifference(Values(hue(Pixels(Values(hue(in, 25))), 50)), Values(hue(in, 75))), 2e-6);
    EXPECT_LT(MaxDifference(Values(hue(hue(in, 31), -31)), original), 1e-6);
    EXPECT_LT(MaxDifference(Values(hue(hue(hue(in, 120), 120), 120)), original), 1e-6);
    EXPECT_LT(MaxDifference(Values(hue(hue(in, 180), 180)), original), 1e-6);
    Node many = in;
    for (int i = 0; i < 1000; ++i) many = hue(many, 0.36);
    EXPECT_LT(MaxDifference(Values(many), original), 1e-6);
  }
  // The plain rotation by 120 degrees is the permutation R to G to B.
  const Samples turned = Values(RotateHue(Pixels({1, 0, 0, 0.5f}), {120, HuePreserve::kNone}));
  EXPECT_LT(MaxDifference(turned, {0, 1, 0, 0.5f}), 1e-7);
  // Haeberli's weights, values printed in doc/maths/color.md.
  EXPECT_LT(MaxDifference(Values(RotateHue(Pixels({1, 0, 0, 1}), Degrees(90), kHaeberli)),
                          {0.0041055f, 0.5814557f, -0.5732448f, 1}),
            1e-6);
}

TEST_P(ColorTest, ThirtySixThousandRotationsFold) {
  const Node in = Pixels(RandomSamples(4 * 100, 0, 1));
  Node node = in;
  for (int i = 0; i < 36000; ++i) node = RotateHue(node, Degrees(1));
  EXPECT_LT(MaxDifference(Values(node), Values(in)), 1e-6);
}

TEST_P(ColorTest, NeighboursFoldIntoOneNode) {
  const Node in = Pixels(RandomSamples(4 * 300, 0, 1));
  Node node = Saturate(ColorMatrix(AddConstant(MulConstant(in, {1.1}), {0.01}),
                                   {{.9, .1, 0, 0, 0, .8, .1, 0, .1, .1, .9, 0, 0, 0, 0, 1}}),
                       1.3);
  node = Clamp(RotateHue(Cmy(node), Degrees(20)), {{0, 0, 0, 0}, {1, 1, 1, 1}});
  const Node folded = graph::Optimize(node);
  EXPECT_EQ(folded.data()->inputs[0].data(), in.data());
  RenderOptions apart;
  apart.optimize = false;
  EXPECT_LT(MaxDifference(Values(node), Values(node, apart)), 1e-6);
  // A clamp in between stays.
  const Node blocked = graph::Optimize(Saturate(Clamp(Saturate(in, 3), {{0}, {1}}), 0.5));
  EXPECT_NE(blocked.data()->inputs[0].data(), in.data());
  EXPECT_EQ(blocked.data()->inputs[0].data()->inputs[0].data(), in.data());
}

TEST_P(ColorTest, NotANumberSpreadsOnlyWhereSaid) {
  const Samples bad = {kNaN, 0.5f, 0.25f, 0.75f, 0.5f, kInf, 0.25f, 0.75f, 0.5f, 0.5f, 0.25f, kNaN};
  const Samples sat = Values(Saturate(Pixels(bad), 1.5));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isnan(sat[static_cast<size_t>(i)]));
  for (int i = 4; i < 7; ++i) EXPECT_FALSE(std::isfinite(sat[static_cast<size_t>(i)]));
  EXPECT_EQ(sat[3], 0.75f);
  EXPECT_EQ(sat[7], 0.75f);
  for (int i = 8; i < 11; ++i) EXPECT_TRUE(std::isfinite(sat[static_cast<size_t>(i)]));
  EXPECT_TRUE(std::isnan(sat[11]));
  const Samples bright = Values(Brightness(Pixels(bad), 2));
  EXPECT_TRUE(std::isnan(bright[0]));
  EXPECT_EQ(bright[1], 1.0f);
  EXPECT_EQ(bright[5], kInf);
  const Samples coupled =
      Values(ColorMatrix(Pixels(bad), {{1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2}}));
  // Alpha has a weight of R here, G and B have none.
  EXPECT_TRUE(std::isnan(coupled[0]));
  EXPECT_EQ(coupled[1], 0.5f);
  EXPECT_EQ(coupled[2], 0.25f);
  EXPECT_TRUE(std::isnan(coupled[3]));
  // Nothing couples the channels: 16 numbers or 9, NaN stays in its own.
  const Samples apart = Values(ColorMatrix(Pixels(bad), {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2}}));
  EXPECT_TRUE(std::isnan(apart[0]));
  EXPECT_EQ(apart[1], 0.5f);
  EXPECT_EQ(apart[2], 0.25f);
  EXPECT_EQ(apart[3], 1.5f);
  EXPECT_EQ(apart[8], 0.5f);
  EXPECT_TRUE(std::isnan(apart[11]));
  // A weight of 0 is none, whether the matrix has nine numbers or sixteen, is divided by alpha or not.
  const Samples hot = {kInf, 0.5f, 0.25f, 0.5f, kInf, -kInf, kNaN, 0.5f};
  for (const bool unpremult : {false, true}) {
    const Samples scaled = Values(ColorMatrix(Pixels(hot), {{2, 0, 0, 0, 3, 0, 0, 0, 4}, false, unpremult}));
    EXPECT_EQ(scaled[0], kInf);
    EXPECT_EQ(scaled[1], 1.5f);
    EXPECT_EQ(scaled[2], 1.0f);
    EXPECT_EQ(scaled[4], kInf);
    EXPECT_EQ(scaled[5], -kInf);
    EXPECT_TRUE(std::isnan(scaled[6]));
    const Samples swapped = Values(
        ColorMatrix(Pixels(hot), {{0, 1, 0, 0, 1, 0, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1}, false, unpremult}));
    EXPECT_EQ(swapped[0], 0.5f);
    EXPECT_EQ(swapped[1], kInf);
    EXPECT_EQ(swapped[2], 0.5f);
    EXPECT_EQ(swapped[3], 0.5f);
  }
  const Samples clamped = Values(Clamp(Pixels(bad), {{0.1}, {1}}));
  EXPECT_EQ(clamped[0], 0.1f);
  EXPECT_EQ(clamped[5], 1.0f);
}

// Matrices with limits of every form between them: all alike, of one side only, one per channel, of some
// channels. However many of them go through one stage together, each gives what it gives alone.
TEST_P(ColorTest, LimitsBetweenMatricesHoldInEveryForm) {
  const ColorMatrixParams mix = {{.9, .3, 0, 0, -.2, .8, .1, 0, .1, -.1, .9, 0, 0, 0, 0, 1.1}};
  const std::vector<ClampParams> forms = {
      {{0}, {1}}, {{0.2}, {}}, {{}, {0.7}}, {{0, 0.1, 0.2, 0.3}, {1, 0.9, 0.8, 0.7}}, {{0, 0}, {1, 1, 0.5}}};
  Samples bad = RandomSamples(4 * 300, -1, 2);
  for (size_t i = 0; i < bad.size(); i += 7) bad[i] = i % 3 == 0 ? kNaN : i % 3 == 1 ? kInf : -kInf;
  Image codes(ImageSpec(37, 9, 4, PixelType::kUint8));
  std::mt19937 random(3);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 37; ++x) {
      for (int c = 0; c < 4; ++c) codes.at<uint8_t>(x, y, c) = static_cast<uint8_t>(random());
    }
  }
  for (const ClampParams& first : forms) {
    for (const ClampParams& second : forms) {
      for (const bool last : {true, false}) {
        const auto chain = [&](const Node& in, const auto& between) {
          const Node once = between(Clamp(ColorMatrix(in, mix), first));
          const Node twice = ColorMatrix(once, mix);
          return last ? Clamp(twice, second) : twice;
        };
        const auto together = [](const Node& node) { return node; };
        const auto apart = [](const Node& node) { return FromImage(Render(node, PixelType::kFloat)); };
        const Samples a = Values(chain(Pixels(bad), together)), b = Values(chain(Pixels(bad), apart));
        ASSERT_EQ(a.size(), b.size());
        for (size_t i = 0; i < a.size(); ++i) {
          ASSERT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])))
              << i << ": " << a[i] << ' ' << b[i];
        }
        const Image fused = Render(chain(FromImage(codes), together), PixelType::kUint8);
        const Samples exact = Values(chain(FromImage(codes), apart));
        for (int i = 0; i < 37 * 9 * 4; ++i) {
          const double v = std::clamp(double{exact[static_cast<size_t>(i)]}, 0.0, 1.0) * 255;
          ASSERT_LE(std::fabs(fused.at<uint8_t>(i / 4 % 37, i / 148, i % 4) - v), 0.5 + 0x1p-12) << i;
        }
      }
    }
  }
}

TEST_P(ColorTest, MatrixIsRowVectorTimesMatrix) {
  const Samples p = {0.2f, 0.3f, 0.5f, 0.5f};
  const auto near = [](const Samples& a, const Samples& b) { return MaxDifference(a, b) < 1e-5; };
  // What Debian's oiiotool 2.4 prints.
  EXPECT_TRUE(
      near(Values(ColorMatrix(Pixels(p), {{1, 10, 100, 0, 1, 0, 0, 0, 1}})), {0.2f, 2.3f, 20.5f, 0.5f}));
  EXPECT_TRUE(near(Values(ColorMatrix(Pixels(p), {{1, 10, 100, 0, 1, 0, 0, 0, 1}, true})),
                   {53.2f, 0.3f, 0.5f, 0.5f}));
  const std::vector<double> last_row = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1};
  EXPECT_TRUE(near(Values(ColorMatrix(Pixels(p), {last_row})), {5.2f, 10.3f, 15.5f, 0.5f}));
  EXPECT_TRUE(near(Values(ColorMatrix(Pixels({0.2f, 0.3f, 0.5f}, 3), {last_row})), {0.2f, 0.3f, 0.5f}));
  std::vector<double> doubled = last_row;
  doubled[15] = 2;
  EXPECT_TRUE(near(Values(ColorMatrix(Pixels(p), {doubled, false, true})), {2.7f, 5.3f, 8.0f, 1.0f}));
  EXPECT_TRUE(
      near(Values(ColorMatrix(Pixels(p), {{1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 6, 7}})), {5.2f, 6.3f, 7.5f, 0.5f}));
}

// The numbers as W3C Filter Effects 1 prints them: rows of five, and hueRotate's three matrices.
TEST_P(ColorTest, SvgAndCss) {
  const Node in = Pixels({0.2f, 0.3f, 0.5f, 0.5f, 1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1});
  const auto by = [&](const char* name, const std::string& example) {
    const ops::OpInfo& op = *ops::FindOp(name);
    return Values(op.make({&in, 1}, ops::ParseExample(op, example), nullptr));
  };
  const Samples rows = by("ccmatrix", "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20 layout=svg");
  EXPECT_LT(MaxDifference(Samples(rows.begin(), rows.begin() + 4),
                          {0.2f + 0.6f + 1.5f + 2 + 5, 1.2f + 2.1f + 4 + 4.5f + 10,
                           2.2f + 3.6f + 6.5f + 7 + 15, 3.2f + 5.1f + 9 + 9.5f + 20}),
            1e-5);
  // luminanceToAlpha.
  const Samples alpha = by("ccmatrix", "0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0.2126,0.7152,0.0722,0,0 layout=svg");
  EXPECT_LT(MaxDifference(Samples(alpha.begin() + 8, alpha.begin() + 12), {0, 0, 0, 0.7152f}), 1e-6);
  EXPECT_THROW(by("ccmatrix", "1,0,0,0,1,0,0,0,1 layout=svg"), Error);

  // Columns are what pure red, green and blue become.
  const double grey[3] = {0.213, 0.715, 0.072};
  const double cosine[3][3] = {{0.787, -0.715, -0.072}, {-0.213, 0.285, -0.072}, {-0.213, -0.715, 0.928}};
  const double sine[3][3] = {{-0.213, -0.715, 0.928}, {0.143, 0.140, -0.283}, {-0.787, 0.715, 0.072}};
  for (const int degrees : {0, 30, 90, 180, 271, -45, 720 + 60}) {
    const Samples turned = by("hue", std::to_string(degrees) + " preserve=css");
    const double t = degrees * std::acos(-1.0) / 180;
    for (size_t from = 0; from < 3; ++from) {
      for (size_t to = 0; to < 3; ++to) {
        const double want = grey[from] + std::cos(t) * cosine[to][from] + std::sin(t) * sine[to][from];
        EXPECT_NEAR(turned[4 + 4 * from + to], want, 1e-6) << degrees;
      }
    }
  }
  EXPECT_THROW(by("hue", "30 preserve=css weights=yiq"), Error);
}

TEST_P(ColorTest, InterpolationHardCases) {
  const Node a = Pixels({FLT_MAX, 1, kInf, -0.0f}), b = Pixels({-FLT_MAX, 1, kInf, 5});
  EXPECT_EQ(Values(Interpolate(a, b, 0.5))[0], 0.0f);
  EXPECT_EQ(Values(Interpolate(a, b, 1e8))[1], 1.0f);
  EXPECT_EQ(Values(Interpolate(a, b, 0.25))[2], kInf);
  EXPECT_TRUE(SameBits(Values(Interpolate(a, b, 0)), Values(a)));
  EXPECT_TRUE(SameBits(Values(Interpolate(a, b, 1)), Values(b)));
  const Node p = Pixels(RandomSamples(4 * 100, 0, 1));
  EXPECT_LT(MaxDifference(Values(Interpolate(Luminance(p), p, 1.4)), Values(Saturate(p, 1.4))), 1e-6);
}

TEST_P(ColorTest, RoundTrips) {
  const Node p = Pixels(RandomSamples(4 * 500, 0, 1));
  EXPECT_LT(MaxDifference(Values(Cmy(Pixels(Values(Cmy(p))))), Values(p)), 1e-7);
  EXPECT_LT(MaxDifference(Values(Yiq(Pixels(Values(Yiq(p))), {true})), Values(p)), 1e-6);
  const Samples white = Values(Yiq(Pixels({1, 1, 1, 1})));
  EXPECT_LT(MaxDifference(white, {1, 0, 0, 1}), 1e-6);
  EXPECT_LT(MaxDifference(Values(Unpremultiply(Pixels(Values(Premultiply(p))))), Values(p)), 1e-6);
  const Samples k = Values(Cmyk(Pixels({0.2f, 0.5f, 0.75f, 0.1f})));
  EXPECT_LT(MaxDifference(k, {0.55f, 0.25f, 0, 0.25f}), 1e-6);
  EXPECT_EQ(Cmyk(p).spec().channels, (std::vector<std::string>{"C", "M", "Y", "K"}));
  EXPECT_EQ(Values(Unpremultiply(Pixels({0.2f, 0.3f, 0.5f, 0})))[0], 0.2f);
  EXPECT_EQ(Values(Unpremultiply(Pixels({0.2f, 0.3f, 0.5f, 1e-40f})))[0], kInf);
  const Samples glow = {0.2f, -0.3f, kInf, 0, 0.2f, -0.3f, 0.5f, -0.0f, 0.5f, 1, kNaN, 0.5f};
  const Samples kept = Values(Repremultiply(Pixels(glow)));
  EXPECT_TRUE(SameBits(Samples(kept.begin(), kept.begin() + 8), Samples(glow.begin(), glow.begin() + 8)));
  EXPECT_EQ(kept[8], 0.25f);
  EXPECT_EQ(kept[9], 0.5f);
  EXPECT_TRUE(std::isnan(kept[10]));
  EXPECT_TRUE(std::isnan(Values(Repremultiply(Pixels({0.2f, 0.3f, 0.5f, kNaN})))[0]));
  EXPECT_TRUE(std::isnan(Values(Unpremultiply(Pixels({0.2f, 0.3f, 0.5f, kNaN})))[0]));
}

TEST_P(ColorTest, ContrastKeepsTheMean) {
  Samples s = RandomSamples(4 * 1000, 0, 1);
  const auto mean = [](const Node& n) {
    double sum = 0;
    const Samples v = Values(Luminance(n));
    for (size_t i = 0; i < v.size(); i += 4) sum += v[i];
    return sum / static_cast<double>(v.size() / 4);
  };
  EXPECT_NEAR(mean(Pixels(Values(Contrast(Pixels(s), 1.8)))), mean(Pixels(s)), 1e-6);
  const Samples nan(16, kNaN);
  EXPECT_TRUE(std::isnan(Values(Contrast(Pixels(nan), 2))[0]));
}

// Codes differ from the rounded exact value only within 2^-12 of a tie.
TEST_P(ColorTest, EightAndSixteenBitPixelsAreRounded) {
  const double m[4][4] = {{.9, .1, .05, .01}, {.1, .8, .1, -.1}, {.05, -.1, .7, .2}, {.1, 0, .2, .6}};
  std::vector<double> values(16);
  values.insert(values.end(), {0.01, -0.02, 0.03, 0});
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) values[i * 4 + j] = m[j][i];
  }
  const double bias[4] = {0.01, -0.02, 0.03, 0};
  std::mt19937 random(9);
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    const int max = type == PixelType::kUint8 ? 255 : 65535;
    Image in(ImageSpec(131, 50, 4, type));
    const auto code = [&](const Image& image, int x, int y, int c) {
      return max == 255 ? int{image.at<uint8_t>(x, y, c)} : int{image.at<uint16_t>(x, y, c)};
    };
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 131; ++x) {
        for (int c = 0; c < 4; ++c) {
          if (max == 255) {
            in.at<uint8_t>(x, y, c) = static_cast<uint8_t>(random());
          } else {
            in.at<uint16_t>(x, y, c) = static_cast<uint16_t>(random());
          }
        }
      }
    }
    const Image out = Render(ColorMatrix(FromImage(in), {values}), type);
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 131; ++x) {
        for (int c = 0; c < 4; ++c) {
          double exact = bias[c] * max;
          for (int k = 0; k < 4; ++k) exact += m[c][k] * code(in, x, y, k);
          exact = std::min(std::max(exact, 0.0), double(max));
          const double slack = max == 255 ? 0x1p-12 : 0x1p-6;  // a float holds 8 bits below a 16-bit code
          ASSERT_LE(std::fabs(code(out, x, y, c) - exact), 0.5 + slack) << x << ',' << y << ',' << c;
        }
      }
    }
    // Identity through the integer path keeps every code.
    const Image kept = Render(Saturate(Brightness(Brightness(FromImage(in), 2), 0.5), 1), type);
    for (int x = 0; x < 131; ++x) ASSERT_EQ(code(kept, x, 7, 1), code(in, x, 7, 1));
  }
}

TEST_P(ColorTest, SameBitsOnTargetsWithFusedMultiplyAdd) {
  const Node in = Pixels(RandomSamples(4 * 1000, -1, 2));
  const Node node = Clamp(
      ColorMatrix(Saturate(in, 1.3), {{.9, .1, 0, 0, 0, .8, .1, 0, .1, .1, .9, 0, 0, 0, 0, 1}}), {{0}, {1}});
  if (GetParam() == "SSE4" || !testing::HasTarget("AVX2")) GTEST_SKIP() << "no other fused multiply-add";
  const Samples here = Values(node);
  SetSimdTarget("AVX2");
  EXPECT_TRUE(SameBits(Values(node), here));
}

TEST(GreyTest, GreysHaveTheValuesOfTheirColors) {
  const Samples y = {0.5f, -2, kInf, 0.25f}, ya = {0.5f, 0.25f, 2, 0.5f, -1, 0};
  const auto grey_alpha = [&] {
    ImageSpec spec(3, 1, 2);
    spec.channels = {"Y", "A"}, spec.alpha = 1;
    Image image(spec);
    for (int x = 0; x < 3; ++x) {
      for (int c = 0; c < 2; ++c) image.at<float>(x, 0, c) = ya[static_cast<size_t>(2 * x + c)];
    }
    return FromImage(image);
  }();
  EXPECT_EQ(Values(Brightness(Pixels(y, 1), 2)), (Samples{1, -4, kInf, 0.5f}));
  EXPECT_EQ(Values(Contrast(Pixels(y, 1), {.x = 2, .pivot = 0.5, .weights = kRec709})),
            (Samples{0.5f, -4.5f, kInf, 0}));
  EXPECT_EQ(Values(Cmy(grey_alpha)), (Samples{0.5f, 0.25f, -1, 0.5f, 2, 0}));
  EXPECT_EQ(Values(Premultiply(grey_alpha)), (Samples{0.125f, 0.25f, 1, 0.5f, 0, 0}));
  EXPECT_EQ(Values(Unpremultiply(grey_alpha)), (Samples{2, 0.25f, 4, 0.5f, -1, 0}));
  EXPECT_EQ(Values(Premultiply(Unpremultiply(grey_alpha))), Samples({0.5f, 0.25f, 2, 0.5f, 0, 0}));
  const Node contrast = Contrast(grey_alpha, 3);  // the mean is 0.5
  EXPECT_LT(MaxDifference(Values(contrast), {0.5f, 0.25f, 5, 0.5f, -4, 0}), 1e-6);
  EXPECT_EQ(contrast.spec().channels, (std::vector<std::string>{"Y", "A"}));
  EXPECT_EQ(contrast.spec().alpha, 1);
  // Two colours without alpha: the mean takes the third as 0.
  const Node red_green = SelectChannels(Pixels({1}, 1), std::vector<ChannelChoice>{{0, 0, "R"}, {0, 0, "G"}});
  EXPECT_LT(MaxDifference(Values(Contrast(red_green, 0)), {0.9278f, 0.9278f}), 1e-6);
}

TEST(ColorErrorTest, RefusesBadParameters) {
  const Node in = Pixels({0.1f, 0.2f, 0.3f, 1});
  EXPECT_THROW(Saturate(in, std::nan("")), Error);
  EXPECT_THROW(Saturate(in, 0.5, {1, -1, 0}), Error);
  EXPECT_THROW(Luminance(in, {{kInf, 0, 0}}), Error);
  EXPECT_THROW(RotateHue(in, Degrees(kInf)), Error);
  EXPECT_THROW(ColorMatrix(in, {std::vector<double>(8, 1.0)}), Error);
  EXPECT_THROW(ColorMatrix(in, {std::vector<double>(9, std::nan(""))}), Error);
  EXPECT_THROW(Interpolate(in, Pixels({1, 2, 3, 4, 5, 6, 7, 8}), 0.5), Error);
  EXPECT_THROW(RotateHue(Pixels({1, 2}, 2), Degrees(10)), Error);
}

}  // namespace
}  // namespace tessera
