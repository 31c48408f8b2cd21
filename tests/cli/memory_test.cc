// The memory budget: what lines take is what they were given, but for what their commands say they hold
// whole.
#include <gtest/gtest.h>

#include <string>

#include "cli/peak_memory.h"

namespace tessera {
namespace {

class MemoryTest : public testing::PeakMemoryTest {};

// A photograph of 18 million pixels: 215 MB of floats, of which there would be two.
TEST_F(MemoryTest, ALargeBlurStaysWithinItsBudget) {
  const std::string picture = "--pattern checker:width=97:height=61 5640x3172 3 -d uint8 -q --threads 2 ";
  const double program = Peak(picture + "--max-memory 64 --mulc 1.5");
  for (const char* blur : {"--blur:sigma=20", "--blur:sigma=20:border=black", "--blur:sigma=7",
                           "--blur:kernel=box 41x41", "--contrast 1.2"}) {
    SCOPED_TRACE(blur);
    EXPECT_LT(Peak(picture + "--max-memory 64 " + blur), program + 64);
  }
  // Two in a row have rows of both, and those on their way from one to the other: less than one picture of
  // floats.
  EXPECT_LT(Peak(picture + "--max-memory 64 --blur:sigma=20 --blur:sigma=40"), program + 128);
  // What is computed in bands is what is computed whole.
  Works(picture + "--max-memory 64 --blur:sigma=20 -o bands.tif");
  Works(picture + "--blur:sigma=20 -o whole.tif");
  Works("bands.tif whole.tif --fail 0 --diff");
}

// A tile's memory goes to a later one when its last reader is done, and steps are few bytes each.
TEST_F(MemoryTest, LongGraphsTakeLittle) {
  std::string blurs, sums;
  for (int i = 0; i < 5000; ++i) blurs += " --blur 3x3", sums += " --blur 3x3 --addc 1e-5";
  const double program = Peak("--pattern clouds 64x64 3 --blur 3x3");
  EXPECT_LT(Peak("--pattern clouds 64x64 3" + blurs), program + 75);
  EXPECT_LT(Peak("--pattern clouds 64x64 3" + sums), program + 150);
}

}  // namespace
}  // namespace tessera
