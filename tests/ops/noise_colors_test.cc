// Coloured noise on every lattice, in every number of dimensions and channels, against the reference.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::Picture;

TEST(NoiseColors, AreWithinTheirBoundOnEveryLattice) {
  const Roi window{-7, 3, 52, 9};
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    int drawn = 0;
    for (const char* const name :
         {"white", "value", "perlin", "simplex", "cell", "sparse", "spot", "hash", "noiseat"}) {
      const ops::OpInfo* const op = ops::FindOp(name);
      ASSERT_NE(op, nullptr) << name;
      for (const char* const lattice : {"tessera", "osl"}) {
        for (const int dims : {1, 2, 3, 4}) {
          for (const int channels : {3, 6}) {
            std::string line = std::string("color=1 lattice=") + lattice + " dims=" + std::to_string(dims);
            line += op->generator ? " freq=0.37" : " freq=7 channels=" + std::to_string(channels);
            const Image picture = Picture(window, channels, PixelType::kFloat, 4);
            Node node;
            try {
              const ops::Arguments arguments = ops::ParseExample(*op, line);
              std::vector<Node> inputs;
              if (!op->generator) inputs.push_back(FromImage(picture));
              node = op->make(inputs, arguments, op->generator ? &picture.spec() : nullptr);
            } catch (const Error&) {
              continue;  // not every kind has every lattice
            }
            const VerifyReport report = Verify(node, PixelType::kFloat, {.seconds = 0.1});
            EXPECT_TRUE(report.within_bound) << name << " " << line << ", " << channels << " channels on "
                                             << target << ": " << report.Summary();
            ++drawn;
          }
        }
      }
    }
    EXPECT_GE(drawn, 60);
  }
  SetSimdTarget("auto");
}

}  // namespace
}  // namespace tessera
