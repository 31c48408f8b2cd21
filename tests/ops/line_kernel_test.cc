// Kernels whose weights stand on the line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/apply.h"
#include "support/filters.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

using namespace tessera::testing;

TEST(ConvolveTest, WeightsOnTheLine) {
  const Image image = Random(40, 30, 3);
  const auto line = [&](const std::string& words) { return Apply({"convolve", words}, {FromImage(image)}); };
  const auto expect = [&](const std::string& words, const Kernel& kernel, const ConvolveParams& params = {}) {
    EXPECT_EQ(LargestDifference(Render(line(words)), Render(Convolve(FromImage(image), kernel, params))), 0)
        << words;
  };
  expect("kernel=1,2,1,2,4,2,1,2,1 divisor=16", NamedKernel("smooth3"));
  expect("kernel=1,-2,+.5,2.5e-1,0,3 size=3x2", {3, 2, 1, 1, 1, {1, -2, .5, .25, 0, 3}});
  expect("kernel=1,-2,.5,.25,0,3 size=2x3 anchor=0,2 correlate=1", {2, 3, 0, 2, 1, {1, -2, .5, .25, 0, 3}},
         {.correlate = true});
  expect("kernel=1,2,3,4", {2, 2, 1, 1, 1, {1, 2, 3, 4}});  // as SVG's feConvolveMatrix
  expect("kernel=3", {1, 1, 0, 0, 1, {3}});
  const auto refusal = [&](const std::string& words) { return Refusal([&] { line(words); }); };
  EXPECT_THAT(refusal("kernel=1,2,1"), HasSubstr("found 3 weights in kernel=, expected a square"));
  EXPECT_THAT(refusal("kernel=1,2,1 size=2x2"), HasSubstr("expected as many as size=2x2 has"));
  EXPECT_THAT(refusal("kernel=1,2,1 size=1.5x2"), HasSubstr("expected as many as size=1.5x2 has"));
  for (const char* const words : {"kernel=1,2,", "kernel=1,,2", "kernel=1,2x,3", "kernel=-", "kernel=+-1"}) {
    EXPECT_THAT(refusal(words), HasSubstr("among the weights of kernel=")) << words;
  }
  EXPECT_THAT(refusal("kernel=1e999"), HasSubstr("among the weights of kernel="));
  EXPECT_THAT(refusal("kernel=1e39"), HasSubstr("finite"));
  EXPECT_THAT(refusal("kernel=1,nan size=2x1"), HasSubstr("finite"));
  EXPECT_THAT(refusal("kernel=1,2,1 size=3x1 anchor=3,0"), HasSubstr("anchor"));
}

}  // namespace
}  // namespace tessera
