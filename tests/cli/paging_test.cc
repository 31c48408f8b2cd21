// What is held whole and is larger than the budget: paged, to the same bits, within the memory that was
// given.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cli/peak_memory.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

class PagingTest : public testing::PeakMemoryTest {
 protected:
  void ExpectSame(const std::string& line, const std::string& budget) {
    SCOPED_TRACE(line);
    Works(line + " -o whole.exr");
    Works("--max-memory " + budget + " " + line + " -o paged.exr");
    Works("whole.exr paged.exr --fail 0 --diff");
  }
};

TEST_F(PagingTest, WhatIsPagedIsTheSameBits) {
  Works("--pattern clouds 700x500 3 --addc .1,.2,.3 -d half -o a.exr");
  Works("--pattern perlin 500x400 2 -o b.exr");
  Works("--pattern perlin 32x1024 3 --tile 64 64 -o table.tif");
  Works("--pattern clouds 640x320 3 -o map.exr");
  for (const char* line : {"a.exr --warp 1.2,0.3,-80,-0.2,1.1,40,0,0,1",
                           "a.exr --warp:filter=lanczos3 3,0.3,-80,-0.2,2.1,40,0,0,1",
                           "b.exr a.exr --crop 500x400+0+0 --st_warp", "a.exr --rotate 31", "a.exr --flip",
                           "a.exr --rotate90", "a.exr table.tif --lookup:dims=3:slices=32",
                           "a.exr table.tif --lookup:dims=2:filter=cubic:wrap=repeat", "a.exr --resize 30%",
                           "a.exr --blur:sigma=9:method=direct", "a.exr --median 5x5", "a.exr --contrast 1.2",
                           "map.exr --envconvert latlong cube 384x64", "a.exr --mip"}) {
    if (Tessera(std::string("-n ") + line + " -o out.exr").exit_code != 0) {
      ADD_FAILURE() << line;
      continue;
    }
    ExpectSame(line, "1");
  }
}

// A photograph of 18 million pixels, 215 MB of floats, and a table of 16 million entries, 201 MB.
TEST_F(PagingTest, WarpsAndTablesStayWithinTheirBudget) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers' shadows are resident too";
#endif
  const std::string picture = "--pattern checker:width=97:height=61 5640x3172 3 -d uint8 -q --threads 2 ";
  const double program = Peak(picture + "--max-memory 64 --mulc 1.5");
  const std::string warp = "--warp 0.9,0,80,0.001,0.9,90,0,0,1";
  EXPECT_GT(Peak(picture + warp), program + 180);
  EXPECT_LT(Peak(picture + "--max-memory 64 " + warp), program + 80);
  Works("--pattern perlin 256x65536 3 -d half --tile 256 256 -o table.exr -q");
  const std::string lookup =
      "--pattern clouds 2000x1500 3 table.exr --lookup:dims=3:slices=256 -q --threads 2";
  EXPECT_GT(Peak(lookup), program + 180);
  EXPECT_LT(Peak(lookup + " --max-memory 64"), program + 80);
}

TEST_F(PagingTest, VolumesArePaged) {
  std::ofstream(Path("a.raw"), std::ios::binary) << std::string(size_t{160} * 160 * 160, 'a') << "b";
  const std::string line =
      "--volume:file=a.raw:dims=160:type=uint8:mode=over:transfer=0,1,.5,.2,0,1,.2,.4,1,.5:size=64x48:header=1";
  ExpectSame(line, "2");
  // Damaged: nothing is written.
  std::filesystem::resize_file(Path("a.raw"), 4000000);
  const auto result = Tessera("--max-memory 2 " + line + " -o new.exr");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("a.raw: found 4000000 bytes, expected 4096001"));
  EXPECT_FALSE(std::filesystem::exists(Path("new.exr")));
}

TEST_F(PagingTest, AFolderWithoutRoomIsNamed) {
  Works("--pattern clouds 700x500 3 -o a.exr");
  std::vector<std::string> words = {"env", "TMPDIR=" + Path("nowhere"), TESSERA_PROGRAM};
  for (const std::string& word :
       testing::Words("--max-memory 1 a.exr --warp 1.2,0.3,-80,-0.2,1.1,40,0,0,1 -o new.exr"))
    words.push_back(word);
  const auto result = testing::RunCommand(words, directory_.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("nowhere: cannot hold a temporary file of"));
  EXPECT_THAT(result.err, HasSubstr("TMPDIR"));
  EXPECT_FALSE(std::filesystem::exists(Path("new.exr")));
}

}  // namespace
}  // namespace tessera
