// Volumes drawn by shear-warp, every type of sample and both kinds of camera, against the reference: rays to
// their ends, so that nothing is left out that a bound would have to allow for.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "support/test_ops.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

TEST(ShearWarp, IsWithinItsBound) {
  const ops::OpInfo* const volume = ops::FindOp("volume");
  ASSERT_NE(volume, nullptr);
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    for (const char* const type : {"uint8", "uint16", "half", "float"}) {
      for (const char* const view : {"solid=knot dims=20 size=44x30", "solid=body dims=24 size=22x20 fov=0",
                                     "solid=knot dims=16 size=37x41 fov=60"}) {
        const std::string line = std::string(view) + " mode=over method=shearwarp termination=0 type=" + type;
        const Node node = volume->make({}, ops::ParseExample(*volume, line), nullptr);
        const VerifyReport report = Verify(node, PixelType::kFloat, {.seconds = 0.3});
        EXPECT_TRUE(report.within_bound) << line << " on " << target << ": " << report.Summary();
        EXPECT_GT(report.samples, 0);
      }
    }
  }
  SetSimdTarget("auto");
}

TEST(ShearWarp, HasTheSameBitsHoweverManyLanesAVectorHas) {
  const ops::OpInfo* const volume = ops::FindOp("volume");
  for (const char* const view : {"solid=knot dims=20 size=44x30", "solid=body dims=24 size=61x20 fov=0",
                                 "solid=knot dims=16 size=37x41 fov=60"}) {
    const Node node = volume->make(
        {}, ops::ParseExample(*volume, std::string(view) + " mode=over method=shearwarp"), nullptr);
    std::optional<Image> widest;
    for (const std::string& target : SimdTargets()) {
      if (target.rfind("AVX", 0) != 0) continue;  // the others round products before they add
      SetSimdTarget(target);
      Image drawn = Render(node, PixelType::kFloat);
      if (widest) {
        testing::ExpectSameBits(drawn, *widest);
      } else {
        widest = std::move(drawn);
      }
    }
  }
  SetSimdTarget("auto");
}

}  // namespace
}  // namespace tessera
