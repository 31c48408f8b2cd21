// The reference engine tells the truth, and says so when a kernel lies.
#include "tessera/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/reference.h"
#include "support/test_ops.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/geometry.h"
#include "verify/evaluate.h"
#include "verify/pixels.h"

namespace tessera {
namespace {

using testing::RandomImage;
using testing::SlowAffine;
using testing::SlowAffineOf;

void AffineReference(const reference::Call& call) {
  const auto& p = std::any_cast<const SlowAffine&>(call.parameters);
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    const double v = call.in[0].samples[i];
    call.out.samples[i] = static_cast<double>(p.factor) * v + p.offset;
    if (call.scale != nullptr) call.scale->samples[i] = std::fabs(p.factor * v) + std::fabs(p.offset);
  }
}

// The same operation with a kernel that is wrong in one pixel of a thousand.
class SpoiltOp final : public graph::OpWith<SlowAffine> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-spoilt"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    class Stage final : public graph::PointStage {
     public:
      explicit Stage(const SlowAffine& p) : p_(p) {}
      void Run(const graph::PointArgs& a) const override {
        for (int i = 0; i < a.count; ++i) {
          const float lie = (a.x + a.order[i] + 31 * a.y) % 1000 == 0 ? 1e-4f : 0.0f;
          float r[4];
          for (int c = 0; c < 4; ++c) r[c] = p_.factor * a.in[0][c][i] + p_.offset + lie;
          for (int c = 0; c < 4; ++c) a.out[c][i] = r[c];
        }
      }

     private:
      SlowAffine p_;
    };
    return std::make_unique<Stage>(params());
  }
};

class VerifyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    reference::Register({"test-affine", AffineReference, nullptr});
    reference::Register({"test-spoilt", AffineReference, nullptr});
  }
  Image in_ = RandomImage({0, 0, 200, 150}, 4, 1);
};

TEST_F(VerifyTest, HonestKernelIsWithinBoundAndTheErrorIsTheOneMeasured) {
  const Node node = SlowAffineOf(SlowAffineOf(FromImage(in_), {0.7f, 0.3f}), {1.3f, -0.1f});
  VerifyOptions options;
  options.samples = 100;  // everything, some of it twice
  options.tile_size = 200;
  const VerifyReport report = Verify(node, PixelType::kFloat, options);
  const Image out = Render(node);
  double worst = 0, squares = 0;
  for (int y = 0; y < 150; ++y) {
    for (int x = 0; x < 200; ++x) {
      for (int c = 0; c < 4; ++c) {
        const double exact =
            1.3f * (0.7f * static_cast<double>(in_.at<float>(x, y, c)) + 0.3f) - double{0.1f};
        const double error = std::fabs(out.at<float>(x, y, c) - exact);
        worst = std::max(worst, error);
        squares += error * error;
      }
    }
  }
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_EQ(report.samples, 200 * 150 * 4);
  EXPECT_NEAR(report.max_error, worst, 1e-3 * worst);
  EXPECT_NEAR(report.rms_error, std::sqrt(squares / (200 * 150 * 4)), 1e-3 * report.rms_error);
  EXPECT_GT(report.max_error, 0);
}

TEST_F(VerifyTest, SpoiltKernelIsFound) {
  const Node node =
      graph::MakeNode(std::make_shared<const SpoiltOp>(SlowAffine{0.7f, 0.3f}), {FromImage(in_)});
  const VerifyReport report = Verify(node);
  EXPECT_FALSE(report.within_bound);
  EXPECT_NEAR(report.max_error, 1e-4, 1e-6);
  EXPECT_EQ((report.worst_x + 31 * report.worst_y) % 1000, 0);
  EXPECT_NE(report.Summary().find("OUT OF BOUND"), std::string::npos);
}

TEST_F(VerifyTest, CodesAreComparedForIntegerTypes) {
  const VerifyReport good = Verify(SlowAffineOf(FromImage(in_), {0.5f, 0.2f}), PixelType::kUint8);
  EXPECT_TRUE(good.within_bound) << good.Summary();
  EXPECT_LE(good.max_code_error, 1);
  EXPECT_EQ(verify::CodeOf(0.5 / 255, 255), 0);  // half to even
  EXPECT_EQ(verify::CodeOf(1.5 / 255, 255), 2);
  EXPECT_EQ(verify::CodeOf(std::nan(""), 255), 0);
  EXPECT_EQ(verify::CodeOf(7.0, 65535), 65535);
}

TEST_F(VerifyTest, HalfIsReadExactly) {
  EXPECT_EQ(verify::HalfToDouble(0x3C00), 1.0);
  EXPECT_EQ(verify::HalfToDouble(0xC000), -2.0);
  EXPECT_EQ(verify::HalfToDouble(0x0001), 0x1p-24);
  EXPECT_EQ(verify::HalfToDouble(0x7BFF), 65504.0);
  EXPECT_TRUE(std::isinf(verify::HalfToDouble(0x7C00)));
  EXPECT_TRUE(std::isnan(verify::HalfToDouble(0x7E00)));
}

TEST_F(VerifyTest, PixelsThatComeFromVeryManyAreSampled) {
  const Node large = Ramp(ImageSpec(4000, 3000, 1));
  const VerifyReport report = Verify(Resize(large, {40, 30}));
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_LT(report.samples, 40 * 30);
  EXPECT_NE(report.Summary().find("sampled in "), std::string::npos) << report.Summary();
  // One pixel of gigabytes.
  EXPECT_THROW(Verify(Resize(Ramp(ImageSpec(100000, 100000, 1)), {1, 1})), Error);
  // A window as wide as the image does not get cheaper with smaller tiles.
  const VerifyReport small =
      Verify(Resize(Ramp(ImageSpec(400, 300, 1)), {40, 30}), PixelType::kFloat, {.seconds = 60});
  EXPECT_EQ(small.samples, 40 * 30);
  EXPECT_TRUE(small.remarks.empty());
}

// The reference of a region takes what it needs of the input and nothing less.
TEST_F(VerifyTest, PiecesOfAReductionAreThoseOfTheWhole) {
  const Node in = Crop(FromImage(in_), {-9, 11, 170, 140});
  ResizeParams disk{61, 33};
  disk.filter = "disk", disk.x = 3, disk.y = -2;
  for (const Node& node : {Resize(in, {17, 23}), Resize(in, {333, 11}), Resize(in, disk),
                           Zoom(in, {0.3, -1.7}), Zoom(in, {-2.5, 0.6})}) {
    verify::ReferenceEngine engine([](const std::string&) { return 1.0; });
    const Roi window = node.spec().data_window;
    const verify::Evaluated whole = engine.Evaluate(node, window);
    for (int y0 = window.y0; y0 < window.y1; y0 += 7) {
      for (int x0 = window.x0; x0 < window.x1; x0 += 13) {
        const Roi piece = Intersection({x0, y0, x0 + 13, y0 + 7}, window);
        const verify::Evaluated part = engine.Evaluate(node, piece);
        for (int y = piece.y0; y < piece.y1; ++y) {
          for (int x = piece.x0; x < piece.x1; ++x) {
            ASSERT_EQ(part.value.at(x, y, 2), whole.value.at(x, y, 2)) << x << "," << y;
          }
        }
      }
    }
  }
}

TEST_F(VerifyTest, ValuesThatAreNotFiniteAreJudgedToo) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (int x = 0; x < 200; ++x) {
    in_.at<float>(x, 3, 0) = std::nanf("");
    in_.at<float>(x, 4, 1) = kInfinity, in_.at<float>(x, 5, 2) = -kInfinity;
  }
  const Node node = SlowAffineOf(SlowAffineOf(FromImage(in_), {0.7f, 0.3f}), {0.5f, 0.1f});
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    const VerifyReport report = Verify(node, type, {.samples = 100});
    EXPECT_TRUE(report.within_bound) << PixelTypeName(type) << report.Summary();
    EXPECT_EQ(report.undecided, 0);
  }
  const Image image = Render(node);
  image.at<float>(7, 3, 0) = 0, image.at<float>(7, 4, 1) = -kInfinity, image.at<float>(7, 9, 1) = kInfinity;
  const VerifyReport spoilt = VerifyStored(node, image.view(), {.samples = 100});
  EXPECT_EQ(spoilt.nan_mismatches, 3);
  EXPECT_EQ(spoilt.out_of_bound, 3);
}

// 1 where the sample is at least a half, else 0.
float Step(float v) { return v >= 0.5f ? 1.0f : 0.0f; }
void StepReference(const reference::Call& call) {
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    call.out.samples[i] = call.in[0].samples[i] >= 0.5 ? 1 : 0;
    if (call.scale != nullptr) call.scale->samples[i] = 0;
  }
}
class StepOp final : public graph::OpWith<int> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-step"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    class Stage final : public graph::PointStage {
     public:
      void Run(const graph::PointArgs& a) const override {
        for (int i = 0; i < a.count; ++i) {
          for (int c = 0; c < 4; ++c) a.out[c][i] = Step(a.in[0][c][i]);
        }
      }
    };
    return std::make_unique<Stage>();
  }
};

class UndecidedTest : public VerifyTest {
 protected:
  void SetUp() override {
    VerifyTest::SetUp();
    reference::Register({"test-step", StepReference, nullptr});
    // Every sample is 0.2, 0.9, or what 0.1 of 1.6 and 0.34 is: a half within a rounding.
    for (int y = 0; y < 150; ++y) {
      for (int x = 0; x < 200; ++x) {
        for (int c = 0; c < 4; ++c)
          in_.at<float>(x, y, c) = (x + y) % 10 == 0 ? 1.6f : x % 2 == 0 ? -1.4f : 5.6f;
      }
    }
    before_ = SlowAffineOf(FromImage(in_), {0.1f, 0.34f});
    stepped_ = graph::MakeNode(std::make_shared<const StepOp>(0), {before_});
  }
  Node before_, stepped_;
};

TEST_F(UndecidedTest, ValuesWithinTheirErrorOfADecisionAreNeitherRightNorWrong) {
  const VerifyReport report = Verify(stepped_, PixelType::kFloat, {.samples = 100, .seconds = 600});
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_EQ(report.samples, 200 * 150 * 4);
  EXPECT_EQ(report.undecided, 200 * 150 * 4 / 10);
  EXPECT_LT(report.largest_bound, 1e-10);  // no other value has a bound that it could hide behind
  EXPECT_NE(report.Summary().find("10 % undecided (more than 1 %"), std::string::npos) << report.Summary();
  // The other way is as good; a decision that is clear is not.
  const Image image = Render(stepped_);
  for (int c = 0; c < 4; ++c) image.at<float>(10, 0, c) = 1 - image.at<float>(10, 0, c);
  EXPECT_TRUE(VerifyStored(stepped_, image.view(), {.samples = 100}).within_bound);
  image.at<float>(11, 0, 0) = 1 - image.at<float>(11, 0, 0);
  const VerifyReport spoilt = VerifyStored(stepped_, image.view(), {.samples = 100});
  EXPECT_EQ(spoilt.out_of_bound, 1);
  EXPECT_EQ(spoilt.worst_x, 11);
}

TEST_F(UndecidedTest, DecisionsOfExactInputsAreClear) {
  const Node exact = graph::MakeNode(std::make_shared<const StepOp>(0), {FromImage(Render(before_))});
  const VerifyReport report = Verify(exact, PixelType::kFloat, {.samples = 100});
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_EQ(report.undecided, 0);
}

TEST_F(UndecidedTest, WhatComesFromAnUndecidedValueIsUndecidedToo) {
  const VerifyReport scaled =
      Verify(SlowAffineOf(stepped_, {0.5f, 0.1f}), PixelType::kFloat, {.samples = 100, .seconds = 600});
  EXPECT_TRUE(scaled.within_bound) << scaled.Summary();
  EXPECT_EQ(scaled.undecided, 200 * 150 * 4 / 10);
  // Nothing of it is left where it takes no part.
  const VerifyReport gone = Verify(SlowAffineOf(stepped_, {0.0f, 0.1f}), PixelType::kFloat, {.samples = 100});
  EXPECT_EQ(gone.undecided, 0);
  EXPECT_TRUE(gone.within_bound);
}

// Between both ends of a clamp, and off by more than lies between them: half of that is no slope.
TEST_F(UndecidedTest, AClampAtBothEndsIsADecision) {
  std::fill_n(&in_.at<float>(0, 0, 0), 200 * 150 * 4, 1.0f);
  const Node far = SlowAffineOf(SlowAffineOf(FromImage(in_), {0x1p30f, -0x1p30f}), {1.0f, 0.5f});
  const VerifyReport report = Verify(Clamp(far, {.min = {0}, .max = {1}}), PixelType::kFloat);
  EXPECT_EQ(report.undecided, report.samples);
  const VerifyReport near = Verify(Clamp(before_, {.min = {0}, .max = {1}}), PixelType::kFloat);
  EXPECT_EQ(near.undecided, 0);
  EXPECT_TRUE(near.within_bound) << near.Summary();
}

// A reference that knows a decision of its own says so.
TEST_F(UndecidedTest, AReferenceMaySayItself) {
  reference::Register({"test-step",
                       [](const reference::Call& call) {
                         StepReference(call);
                         for (int x = 20; x < 30; ++x) {
                           if (call.out.roi.Contains({x, 7, x + 1, 8})) call.Undecided(x, 7);
                         }
                       },
                       nullptr});
  const Node exact = graph::MakeNode(std::make_shared<const StepOp>(0), {FromImage(Render(before_))});
  const VerifyReport report = Verify(exact, PixelType::kFloat, {.samples = 100});
  EXPECT_EQ(report.undecided, 10 * 4);
}

// What may be infinite is still undecided where its weight is 0; what is finite either way is not.
TEST_F(UndecidedTest, WhatMayBeInfiniteIsNotGoneWhereItIsMultipliedByNothing) {
  static double jump;
  reference::Register({"test-step",
                       [](const reference::Call& call) {
                         StepReference(call);
                         if (call.out.roi.Contains({20, 7, 21, 8})) call.Undecided(20, 7, jump);
                       },
                       nullptr});
  const Node exact = graph::MakeNode(std::make_shared<const StepOp>(0), {FromImage(Render(before_))});
  const Node gone = SlowAffineOf(exact, {0.0f, 0.1f});
  jump = reference::kUnknownJump;
  EXPECT_EQ(Verify(gone, PixelType::kFloat, {.samples = 100}).undecided, 0);
  jump = reference::kEndlessJump;
  EXPECT_EQ(Verify(gone, PixelType::kFloat, {.samples = 100}).undecided, 4);
}

// The bound of a sum of many follows how errors add up by chance, and holds for those that are all alike.
TEST_F(VerifyTest, ErrorsOfNeighboursAddUpAsTheyDo) {
  const Node before = SlowAffineOf(FromImage(in_), {0.7f, 0.3f});
  for (const Node& node : {GaussianBlur(before, 2), Sobel(before), Resize(before, {57, 41})}) {
    const VerifyReport report = Verify(node);
    EXPECT_TRUE(report.within_bound) << report.Summary();
    EXPECT_GT(report.closest, 0.01) << report.Summary();
  }
  const Image flat = RandomImage({0, 0, 200, 150}, 4, 1);
  std::fill_n(&flat.at<float>(0, 0, 0), 200 * 150 * 4, 0.1f);
  const Node alike = SlowAffineOf(FromImage(flat), {0.7f, 0.3f});
  for (const Node& node : {GaussianBlur(alike, 2), Sobel(alike)}) {
    const VerifyReport report = Verify(node);
    EXPECT_TRUE(report.within_bound) << report.Summary();
  }
}

TEST_F(VerifyTest, HalvesAreRoundedToTheNearestEven) {
  for (int bits = 0; bits < 0x7C00; ++bits) {
    const double here = verify::HalfToDouble(static_cast<uint16_t>(bits));
    ASSERT_EQ(verify::NearestHalf(here), here);
    const double next = verify::HalfToDouble(static_cast<uint16_t>(bits + 1));
    if (std::isinf(next)) break;
    const double tie = (here + next) / 2;
    ASSERT_EQ(verify::NearestHalf(tie), bits % 2 == 0 ? here : next);
    ASSERT_EQ(verify::NearestHalf(std::nextafter(tie, 0)), here);
    ASSERT_EQ(-verify::NearestHalf(-std::nextafter(tie, 1e9)), next);
  }
  EXPECT_TRUE(std::isinf(verify::NearestHalf(65520)));
  EXPECT_EQ(verify::NearestHalf(65519.99), 65504);
}

TEST_F(VerifyTest, TheTimeIsLimitedAndTheReportSaysHowMuchWasLookedAt) {
  const Node large = GaussianBlur(Ramp(ImageSpec(2000, 1500, 3)), 12);
  VerifyOptions options;
  options.samples = 1000, options.seconds = 0.05;
  const Image image = Render(large);
  const VerifyReport report = VerifyStored(large, image.view(), options);
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_GT(report.samples, 0);
  EXPECT_LT(report.share, 0.5);
  EXPECT_DOUBLE_EQ(report.share, static_cast<double>(report.samples) / (2000.0 * 1500 * 3));
  EXPECT_NE(report.Summary().find("% of the pixels"), std::string::npos) << report.Summary();
}

TEST_F(VerifyTest, AnOperationWithoutReferenceIsRefused) {
  EXPECT_THROW(Verify(testing::BoxSumOf(FromImage(in_), {})), Error);
}

}  // namespace
}  // namespace tessera
