// Lines whose files are read in a sandbox give the same bits, say so, and end when their readers do.
#include <cstring>
#include <fstream>

#include "cli/cli_test.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class SandboxLineTest : public testing::CliTest {
 protected:
  void SetUp() override { MakePicture("a.exr", 200, 150, 3, OIIO::TypeFloat); }
  std::string Bytes(const std::string& name) {
    std::ifstream stream(Path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void SameBits(const std::string& safe, const std::string& plain) {
    Works(safe + " -d float -o s.exr");
    Works(plain + " -d float -o n.exr");
    const OIIO::ImageBuf s = Load("s.exr"), n = Load("n.exr");
    ASSERT_EQ(s.spec().nchannels, n.spec().nchannels) << plain;
    ASSERT_EQ(s.spec().image_bytes(), n.spec().image_bytes()) << plain;
    EXPECT_EQ(std::memcmp(s.localpixels(), n.localpixels(), s.spec().image_bytes()), 0) << plain;
  }
  std::string Error(const std::string& line) {
    const testing::CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 1) << line << result.err;
    return result.err;
  }
};

TEST_F(SandboxLineTest, SafeLinesGiveTheSameBits) {
  for (const char* name : {"a.png", "a.jpg", "a.tif", "a.dpx", "a.hdr", "a.gif", "a.bmp", "a.webp", "a.sgi",
                           "a.ppm", "a.tga", "a.rla", "a.tx", "a.exr"}) {
    if (Oiiotool("a.exr -o " + std::string(name)).exit_code != 0) continue;
    for (const std::string& line : {std::string(name) + " --resize 77x55",
                                    std::string(name) + " --ch R,G,B a.exr --add", std::string(name)}) {
      SameBits("--safe " + line, line);
    }
  }
  SameBits("--safe -i:thumbnail=50x50 a.jpg", "-i:thumbnail=50x50 a.jpg");
}

TEST_F(SandboxLineTest, FormatsOffTheListAreReadInOne) {
  ASSERT_EQ(Oiiotool("a.exr -d uint8 -o a.iff").exit_code, 0);
  const auto explained = [&](const std::string& line) { return Works(line + " --explain -o o.exr"); };
  EXPECT_NE(explained("--formats all a.iff").find(", in a sandbox"), std::string::npos);
  EXPECT_EQ(explained("--formats all a.exr").find(", in a sandbox"), std::string::npos);
  EXPECT_EQ(explained("--formats all --no-sandbox a.iff").find(", in a sandbox"), std::string::npos);
  EXPECT_NE(explained("--safe a.exr").find(", in a sandbox"), std::string::npos);
  SameBits("--formats all a.iff", "--formats all --no-sandbox a.iff");
  // By what it holds, whatever its name is.
  fs::rename(Path("a.iff"), Path("b.tif"));
  EXPECT_NE(explained("--formats all b.tif").find(", in a sandbox"), std::string::npos);
}

// IFF files that are damaged have corrupted memory: none is more than an error of the file.
TEST_F(SandboxLineTest, DamagedFilesAreErrors) {
  ASSERT_EQ(Oiiotool("a.exr -d uint8 -o a.iff").exit_code, 0);
  const std::string whole = Bytes("a.iff");
  uint32_t state = 1;
  for (int round = 0; round < 40; ++round) {
    std::string bytes = whole;
    for (int k = 0; k < 3; ++k) {
      state = state * 1664525 + 1013904223;
      bytes[(state >> 8) % std::min<size_t>(bytes.size(), 400)] = static_cast<char>(state >> 24);
    }
    std::ofstream(Path("b.iff"), std::ios::binary) << bytes;
    const testing::CommandResult result = Tessera("--formats all --limit seconds=20 b.iff -o b.ppm");
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1) << round << " " << result.exit_code;
    EXPECT_TRUE(result.exit_code == 0 || result.err.starts_with("tessera: error: b.iff: ")) << result.err;
  }
}

TEST_F(SandboxLineTest, JobsDoNotWaiveIt) {
  std::ofstream(Path("jobs")) << "--no-sandbox a.exr -o b.exr\n--formats all a.exr -o c.exr\n";
  const std::string batch = std::string("exec ") + TESSERA_PROGRAM + " --batch ";
  const testing::CommandResult result =
      testing::RunCommand({"sh", "-c", batch + "--safe < jobs"}, directory_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("found in a job, expected on the program's own line"), std::string::npos);
  EXPECT_FALSE(fs::exists(Path("b.exr")));
  EXPECT_TRUE(fs::exists(Path("c.exr")));
}

// A volume whose name does not say that OpenVDB reads it: the program starts over with that library.
TEST_F(SandboxLineTest, LibrariesAreLoadedWhenTheyAreWanted) {
  std::string vdb(" BDV");
  vdb += std::string(4, '\0') + std::string("\xe0\0\0\0\x0a\0\0\0\0\0\0\0\1", 13) + std::string(36, 'a');
  vdb += std::string(8, '\0');  // no metadata, no grids
  std::ofstream(Path("a.grid"), std::ios::binary) << vdb;
  EXPECT_NE(Error("--safe a.grid -o b.exr").find("tessera: error: a.grid: "), std::string::npos);
  EXPECT_EQ(Error("--safe a.grid -o b.exr"), Error("a.grid -o b.exr"));
}

}  // namespace
}  // namespace tessera
