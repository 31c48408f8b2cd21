// Costs by trial: of every example something, in passes that add up, without a look at more than is said.
#include "tessera/cost.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/cases.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/color.h"
#include "tessera/ops/filter.h"
#include "tessera/prepared_graph.h"

namespace tessera {
namespace {

CostEstimate::Part Part(const char* name, double elapsed, double busy, int pass) {
  return {name, elapsed, busy, pass};
}

TEST(CostEstimate, PassesFollowEachOtherAndPartsOfOneOverlap) {
  CostEstimate cost;
  EXPECT_EQ(cost.Seconds(), 0);
  EXPECT_EQ(cost.Limit(), "");
  cost.threads = 1;
  cost.parts = {Part("decode", 2, 2, 0), Part("compute", 1, 1, 0), Part("encode", 3, 3, 1)};
  EXPECT_EQ(cost.Seconds(), 6);  // one thread does one after the other
  EXPECT_EQ(cost.Limit(), "encode");
  cost.threads = 2;
  // The longer of 2 s alone and 3 s shared by two, and an eighth of the other part.
  EXPECT_DOUBLE_EQ(cost.Seconds(), 2 + 1.0 / 8 + 3);
  cost.parts[1].busy = 8;
  EXPECT_DOUBLE_EQ(cost.Seconds(), 3 + 3);  // no more than one after the other
}

// Rows of a ramp; counts those that were read.
class Ramp final : public graph::PixelSource {
 public:
  explicit Ramp(ImageSpec spec) : spec_(std::move(spec)) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "ramp"; }
  int RowGranularity() const override { return 16; }
  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    class Reader final : public graph::RowReader {
     public:
      Reader(const Ramp& ramp, int channels) : ramp_(ramp), channels_(channels) {}
      void Read(const ImageView& out) override {
        ramp_.rows_read += out.roi.height();
        for (int y = out.roi.y0; y < out.roi.y1; ++y) {
          auto* const v = reinterpret_cast<float*>(out.At(out.roi.x0, y));
          for (int i = 0; i < out.roi.width() * channels_; ++i) v[i] = 0.001f * static_cast<float>(i % 1000);
        }
      }

     private:
      const Ramp& ramp_;
      const int channels_;
    };
    return std::make_unique<Reader>(*this, last - first);
  }
  mutable int rows_read = 0;

 private:
  ImageSpec spec_;
};

std::vector<std::string> Names(const CostEstimate& cost) {
  std::vector<std::string> names;
  for (const auto& p : cost.parts) names.push_back(p.name);
  return names;
}
int PassOf(const CostEstimate& cost, const std::string& name) {
  const auto p =
      std::find_if(cost.parts.begin(), cost.parts.end(), [&](const auto& part) { return part.name == name; });
  return p == cost.parts.end() ? -1 : p->pass;
}

TEST(EstimateCost, ReadsTheFirstRowsOfAFileAndTakesTheRestToBeAsTheyAre) {
  ImageSpec spec(8192, 30000, 4);
  const auto ramp = std::make_shared<const Ramp>(spec);
  const Node file = graph::MakeSource(ramp);
  const CostEstimate cost = EstimateCost(Saturate(file, 0.5), PixelType::kHalf, {.threads = 2});
  EXPECT_GT(ramp->rows_read, 0);
  EXPECT_LE(ramp->rows_read, 256);
  EXPECT_EQ(Names(cost), (std::vector<std::string>{"prepare", "decode ramp", "compute"}));
  EXPECT_EQ(PassOf(cost, "decode ramp"), PassOf(cost, "compute"));
  EXPECT_EQ(cost.pixels, 8192 * int64_t{30000});
  EXPECT_EQ(cost.bytes, cost.pixels * (16 + 8));
  EXPECT_EQ(cost.threads, 2);
  EXPECT_EQ(cost.band.spec().type, PixelType::kHalf);
  EXPECT_EQ(cost.band.spec().width(), 8192);
  EXPECT_LE(cost.band.spec().height(), 2048);
  EXPECT_GT(cost.Seconds(), 0);
  EXPECT_LT(cost.memory, size_t{1} << 29);
}

TEST(EstimateCost, WholeImagesAndTurnedFilesComeBefore) {
  const auto ramp = std::make_shared<const Ramp>(ImageSpec(2048, 2048, 4));
  const Node file = graph::MakeSource(ramp);
  const CostEstimate blur = EstimateCost(GaussianBlur(file, 30));
  EXPECT_LT(PassOf(blur, "decode ramp"), PassOf(blur, "blur"));
  EXPECT_LT(PassOf(blur, "blur"), PassOf(blur, "compute"));
  EXPECT_GT(blur.memory, size_t{2} * 2048 * 2048 * 16);
  const CostEstimate turned = EstimateCost(Rotate90(file));
  EXPECT_GE(PassOf(turned, "decode ramp"), 0);
  EXPECT_LT(PassOf(turned, "decode ramp"), PassOf(turned, "compute"));
}

TEST(EstimateCost, RefusesAsRenderDoes) {
  EXPECT_THROW(EstimateCost(Node()), Error);
  const Node nothing = FromImage(Image(ImageSpec(0, 0, 3)));
  EXPECT_GE(EstimateCost(nothing).Seconds(), 0);
}

class CostOfRows : public ::testing::TestWithParam<testing::Case> {};

TEST_P(CostOfRows, IsFinite) {
  const Node node = GetParam().Make({0, 0, 90, 60}, 4, PixelType::kFloat);
  const CostEstimate cost = EstimateCost(node);
  EXPECT_TRUE(std::isfinite(cost.Seconds()));
  EXPECT_GE(cost.parts.size(), 2U);
  for (const CostEstimate::Part& p : cost.parts) {
    EXPECT_GE(p.elapsed, 0) << p.name;
    EXPECT_LE(p.busy, p.elapsed * cost.threads * (1 + 1e-9)) << p.name;
  }
}
INSTANTIATE_TEST_SUITE_P(Registry, CostOfRows, ::testing::ValuesIn(testing::AllCases()), testing::CaseName);

}  // namespace
}  // namespace tessera
