// Pipelines through OpenColorIO's own processor are verified: honest ones pass and say what they were
// compared with, a kernel that lies before, behind or in the processor's place is found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "config_text.h"
#include "lut_files.h"
#include "model/foreign_pixels.h"
#include "reference/reference.h"
#include "support/test_ops.h"
#include "tessera/ocio.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The reference of testing::SlowAffine; with `kLie` it differs in one sample of a hundred.
template <bool kLie>
void AffineReference(const reference::Call& call) {
  const auto& p = std::any_cast<const testing::SlowAffine&>(call.parameters);
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    const double v = static_cast<double>(p.factor) * call.in[0].samples[i];
    call.out.samples[i] = v + p.offset + (kLie && i % 100 == 0 ? 1e-4 : 0);
    if (call.scale != nullptr) call.scale->samples[i] = std::fabs(v) + std::fabs(p.offset);
  }
}

class FallbackTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const testing::LutFile& file : testing::AllLutFiles()) {
      if (file.name == "a.spi1d" || file.name == "a.spi3d") folder_.Write(file.name, file.bytes);
    }
    params_.config = folder_.Write("config.ocio", testing::ConfigText(folder_.path()));
    reference::Register({"test-affine", AffineReference<false>});
  }
  // A pipeline: ours, OpenColorIO's conversion by way of HSV, ours.
  Node Pipeline() const {
    const Node before = testing::SlowAffineOf(image_, {0.4f, 0.45f});
    return testing::SlowAffineOf(ColorConvert(before, "lin", "fixed", params_), {0.9f, 0.05f});
  }
  testing::Folder folder_;
  OcioParams params_;
  Node image_ = FromImage(testing::RandomImage({0, 0, 150, 100}, 4, 3));
};

TEST_F(FallbackTest, HonestPipelinesPassAndTellWhatTheyWereComparedWith) {
  for (const PixelType type : {PixelType::kFloat, PixelType::kUint16}) {
    const VerifyReport report = Verify(Pipeline(), type);
    EXPECT_TRUE(report.within_bound) << report.Summary();
    EXPECT_GT(report.largest_bound, 0x1p-21);
    EXPECT_LT(report.largest_bound, 1e-4);
    EXPECT_THAT(report.remarks, Contains(HasSubstr("OpenColorIO")));
  }
  const VerifyReport inverse = Verify(ColorConvert(image_, "inverse_curve", "lin", params_));
  EXPECT_TRUE(inverse.within_bound) << inverse.Summary();
  const Node aces = OcioDisplay(Clamp(image_, {.min = {0}}), "sRGB", "ACES 1.0 SDR", {.from = "ACEScg"},
                                {.config = kBuiltInConfig});
  const VerifyReport display = Verify(aces);
  EXPECT_TRUE(display.within_bound) << display.Summary();
  EXPECT_THAT(display.remarks, Contains(HasSubstr("OpenColorIO")));
  // What has nodes of its own has a reference of its own.
  EXPECT_THAT(Verify(ColorConvert(image_, "lin", "logc", params_)).remarks, IsEmpty());
}

TEST_F(FallbackTest, LiesBeforeAndBehindAreFound) {
  reference::Register({"test-affine", AffineReference<true>});
  for (const Node& node :
       {testing::SlowAffineOf(ColorConvert(image_, "lin", "fixed", params_), {0.9f, 0.05f}),
        ColorConvert(testing::SlowAffineOf(image_, {0.4f, 0.45f}), "lin", "fixed", params_)}) {
    const VerifyReport report = Verify(node);
    EXPECT_FALSE(report.within_bound) << report.Summary();
    EXPECT_GT(report.out_of_bound, 0);
  }
}

// An operation in the processor's place: `run` is what it does, `check` what it should do.
class StandIn final : public graph::OpWith<model::ForeignPixels> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "ociocpu"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    class Stage final : public graph::PointStage {
     public:
      explicit Stage(const model::ForeignPixels& p) : p_(p) {}
      void Run(const graph::PointArgs& a) const override {
        for (int i = 0; i < a.count; ++i) {
          float v[4];
          for (int c = 0; c < 4; ++c) v[c] = a.in[0][c][i];
          p_.run(v, 1);
          for (int c = 0; c < 4; ++c) a.out[c][i] = v[c];
        }
      }

     private:
      model::ForeignPixels p_;
    };
    return std::make_unique<Stage>(params());
  }
};

TEST_F(FallbackTest, AProcessorThatLiesIsFound) {
  const auto curve = [](float error) {
    return [error](float* v, int count) {
      for (int i = 0; i < 4 * count; ++i) v[i] = i % 4 == 3 ? v[i] : v[i] * v[i] + error;
    };
  };
  for (const float error : {0.0f, 1e-9f, 1e-6f, 1e-4f}) {
    const Node node = graph::MakeNode(
        std::make_shared<const StandIn>(model::ForeignPixels{curve(error), curve(0)}), {image_});
    const VerifyReport report = Verify(node);
    EXPECT_EQ(report.within_bound, error < 1e-8f) << report.Summary();
  }
}

}  // namespace
}  // namespace tessera
