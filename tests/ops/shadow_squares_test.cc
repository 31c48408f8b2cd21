// Shadows averaged over squares of every size, against the reference: sizes fill vectors or leave a rest.
#include <gtest/gtest.h>

#include <string>

#include "ops/registry.h"
#include "support/pictures.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::Picture;

TEST(ShadowSquares, OfEverySizeAreWithinTheirBound) {
  const ops::OpInfo* const shadow = ops::FindOp("shadow");
  ASSERT_NE(shadow, nullptr);
  // The light of the row's first example.
  const std::string light = shadow->examples[0].substr(0, shadow->examples[0].find(" pcf"));
  ASSERT_NE(light.find("light="), std::string::npos) << light;
  const Roi window{-5, 3, 60, 40};
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    for (int size = 1; size <= 17; ++size) {
      const std::string line = light + " pcf=" + std::to_string(size);
      const Node node = shadow->make(std::vector{FromImage(Picture(window, 4, PixelType::kFloat, 1)),
                                                 FromImage(Picture(window, 4, PixelType::kFloat, 8))},
                                     ops::ParseExample(*shadow, line), nullptr);
      const VerifyReport report = Verify(node, PixelType::kFloat, {.seconds = 0.2});
      EXPECT_TRUE(report.within_bound) << line << " on " << target << ": " << report.Summary();
    }
  }
  SetSimdTarget("auto");
}

}  // namespace
}  // namespace tessera
