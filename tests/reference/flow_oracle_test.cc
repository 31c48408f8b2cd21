// The reference of line integral convolution against a box filter, and its bounds: small enough to fail.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/oracle.h"

namespace tessera {
namespace {

using testing::Command;
using testing::ReferenceOf;

Node Field(int width, int height, double (*u)(double, double), double (*v)(double, double)) {
  ImageSpec spec(width, height, 2);
  spec.type = PixelType::kFloat;
  const Image field(spec);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      field.at<float>(x, y, 0) = static_cast<float>(u(x, y)),
                            field.at<float>(x, y, 1) = static_cast<float>(v(x, y));
    }
  }
  return FromImage(field);
}

// Along straight lines of a periodic picture it is the mean of 2 L + 1 neighbours.
TEST(FlowOracle, ConstantFieldIsABoxFilter) {
  constexpr int kWidth = 40, kHeight = 6, kLength = 5;
  ImageSpec spec(kWidth, kHeight, 1);
  spec.type = PixelType::kFloat;
  const Image texture(spec);
  for (int i = 0; i < kWidth * kHeight; ++i)
    texture.at<float>(i % kWidth, i / kWidth, 0) = static_cast<float>(std::fmod(i * 0.754877666, 1.0));
  const Node field = Field(
      kWidth, kHeight, [](double, double) { return 2.0; }, [](double, double) { return 0.0; });
  for (const char* integrator : {"euler", "rk4", "adaptive", "cell"}) {
    const reference::ImageD found =
        ReferenceOf(Command("lic", std::string("input=1 length=5 border=repeat integrator=") + integrator,
                            {FromImage(texture), field}));
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        double sum = 0;
        for (int k = -kLength; k <= kLength; ++k) sum += texture.at<float>((x + k + kWidth) % kWidth, y, 0);
        EXPECT_NEAR(found.at(x, y, 0), sum / (2 * kLength + 1), 1e-12) << integrator << " " << x << "," << y;
      }
    }
  }
}

// Vortices with saddles between: the bound of a noise of [0, 1] is small almost everywhere, holds, and tells
// the picture from its neighbour.
TEST(FlowOracle, BoundsCanFail) {
  const Node field = Field(
      120, 100, [](double x, double y) { return std::sin(x / 9) * std::cos(y / 7) + 0.2; },
      [](double x, double y) { return -std::cos(x / 9) * std::sin(y / 7); });
  for (const char* words :
       {"length=40 contrast=none method=direct", "length=40 contrast=none method=direct sampling=linear",
        "length=40 contrast=none method=fast"}) {
    SCOPED_TRACE(words);
    const bool shared = std::string(words).find("fast") != std::string::npos;
    const Node node = Command("lic", words, {field});
    verify::ReferenceEngine engine([](const std::string& op) { return ops::FindOp(op)->bound_u; });
    const Roi roi{40, 30, 72, 62};
    const verify::Evaluated want = engine.Evaluate(node, roi);
    const Image got = Render(node);
    std::vector<double> bounds;
    int outside = 0, neighbours_outside = 0;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; ++x) {
        if (want.Undecided(x, y, 0)) continue;
        const double bound = want.tolerance.at(x, y, 0);
        bounds.push_back(bound);
        outside += std::fabs(got.at<float>(x, y, 0) - want.value.at(x, y, 0)) > bound;
        neighbours_outside += std::fabs(got.at<float>(x + 3, y + 3, 0) - want.value.at(x, y, 0)) > bound;
      }
    }
    ASSERT_GT(bounds.size(), 900u);  // of 1024
    std::sort(bounds.begin(), bounds.end());
    EXPECT_EQ(outside, 0);
    EXPECT_LT(bounds.back(), shared ? 0.5001 : 0.2501);
    EXPECT_LT(bounds[bounds.size() / 2], shared ? 0.35 : 0.05);
    if (!shared) {
      EXPECT_GT(neighbours_outside, static_cast<int>(bounds.size()) / 3);
    }
  }
}

}  // namespace
}  // namespace tessera
