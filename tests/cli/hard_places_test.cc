// Full disks, folders that cannot be written, inputs that end early, memory that is short: a reason that
// names the file, the old output as it was, nothing else.
#include <OpenImageIO/imagebufalgo.h>

#include <fstream>

#include "cli/cli_test.h"

namespace tessera {
namespace {

constexpr const char* kFormats[] = {"exr", "png", "tif", "jpg",  "tga", "hdr", "dpx",
                                    "ppm", "bmp", "gif", "webp", "sgi", "rla", "jp2"};

class HardPlacesTest : public testing::CliTest {
 protected:
  testing::CommandResult Shell(const std::string& script) {
    return testing::RunCommand({"sh", "-c", script}, directory_.path());
  }
  // The same in a place where file systems may be mounted.
  testing::CommandResult Mounting(const std::string& script) {
    return testing::RunCommand({"unshare", "--user", "--map-root-user", "--mount", "sh", "-c", script},
                               directory_.path());
  }
  static std::string Program() { return TESSERA_PROGRAM " --threads 2 --nosoftwareattrib "; }
};

TEST_F(HardPlacesTest, AFullDisk) {
  std::filesystem::create_directory(Path("disk"));
  if (Mounting("mount -t tmpfs none disk").exit_code != 0) GTEST_SKIP() << "no mounts for users here";
  // Noise of 48 kilobytes.
  Works("--pattern white 128x128 3 -d uint8 -o noise.png");
  for (const std::string codec : {"auto", "oiio"}) {
    for (const std::string format : kFormats) {
      const std::string file = "disk/o." + format;
      // Memory of a page or two for the old file; the new one is larger.
      const testing::CommandResult result = Mounting(
          "mount -t tmpfs -o size=8k none disk && echo old > " + file + " && " + Program() + "--codec " +
          codec + " noise.png -o " + file + "; code=$?; ls -A disk; cat " + file + "; exit $code");
      EXPECT_EQ(result.exit_code, 1) << codec << " " << file << result.err;
      EXPECT_EQ(result.out, "o." + format + "\nold\n") << codec;
      EXPECT_NE(result.err.find("tessera: error: " + file + ": cannot be written"), std::string::npos)
          << codec << result.err;
    }
  }
}

TEST_F(HardPlacesTest, AFolderThatCannotBeWritten) {
  std::filesystem::create_directory(Path("disk"));
  if (Mounting("mount -t tmpfs none disk").exit_code != 0) GTEST_SKIP() << "no mounts for users here";
  Works("--pattern ramp 16x16 3 -o a.exr");
  const testing::CommandResult result =
      Mounting("mount -t tmpfs none disk && echo old > disk/o.exr && mount -o remount,ro disk && " +
               Program() + "a.exr -o disk/o.exr; code=$?; ls -A disk; exit $code");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "o.exr\n");
  EXPECT_EQ(result.err, "tessera: error: disk/o.exr: cannot be written: Read-only file system\n");
}

TEST_F(HardPlacesTest, InputsThatEndEarly) {
  Works("--pattern white 64x64 3 -d uint8 -o noise.png");
  for (const std::string codec : {"auto", "oiio"}) {
    for (const std::string format : kFormats) {
      const std::string whole = "whole." + format, cut = "cut." + format;
      Works("noise.png -o " + whole);
      const std::string bytes = testing::FileText(Path(whole));
      for (size_t part = 1; part < 8; part += 5) {
        std::ofstream(Path(cut), std::ios::binary) << bytes.substr(0, bytes.size() * part / 8);
        const testing::CommandResult result = Tessera("--codec " + codec + " " + cut + " -o new.png");
        EXPECT_EQ(result.exit_code, 1) << codec << " " << cut << " of " << part << " eighths";
        EXPECT_EQ(result.err.find("tessera: error: " + cut + ": "), 0u) << codec << result.err;
        EXPECT_FALSE(std::filesystem::exists(Path("new.png"))) << cut;
      }
    }
  }
}

// Windows that are far away, or would end beyond the coordinates.
TEST_F(HardPlacesTest, FarWindows) {
  MakePicture("a.exr", 60, 40, 3, OIIO::TypeFloat);
  for (const char* far :
       {"+6+16777216", "+16777216+6", "-6-16777216", "60x40+2147483587+0", "60x40+0+2147483607",
        "60x40-2147483647-2147483647", "7x5+60+0", "7x5-7+0", "7x5+0+40"}) {
    Works(std::string("--limit memory=400,seconds=20 a.exr --cut ") + far + " -o o.exr");
    const OIIO::ImageBuf out = Load("o.exr");
    EXPECT_EQ(out.spec().x, 0);
    EXPECT_EQ(out.spec().y, 0);
    EXPECT_EQ(out.spec().width, far[0] == '7' ? 7 : 60) << far;
    EXPECT_TRUE(OIIO::ImageBufAlgo::isConstantColor(out, 0.0f)) << far;
    float value = 1;
    out.getpixel(3, 3, &value, 1);
    EXPECT_EQ(value, 0) << far;
  }
  for (const char* line :
       {"a.exr --crop 1x1+2147483647+0", "a.exr --cut 1x1+2147483647+0", "a.exr --resize 1x1+2147483647+0",
        "a.exr --resize 2x2+2147483646+2147483646", "a.exr --cut 60x40+2147483600+0",
        "a.exr --cut +2147483647+0", "--pattern checker 1x1+0+2147483647 3",
        "--pattern checker 2147483648x1 3", "a.exr --crop 1x1+4294967296+0", "a.exr --crop 0,0,2147483647,0",
        "a.exr --crop -2147483649,0,1,1"}) {
    const testing::CommandResult result = Tessera(std::string(line) + " -o new.exr");
    EXPECT_EQ(result.exit_code, 2) << line << result.err;
    EXPECT_TRUE(result.err.starts_with("tessera: error: --")) << result.err;
    EXPECT_FALSE(std::filesystem::exists(Path("new.exr")));
  }
}

// The loader needs some of it before the program begins, and says so itself (127).
TEST_F(HardPlacesTest, ShortOfMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take terabytes";
#endif
  Works("--pattern ramp 600x400 3 -d half -o a.exr");
  Works("a.exr --blur:sigma=20 -d half -o right.exr");
  int refused = 0;
  for (int kilobytes = 150000; kilobytes < 1000000; kilobytes += kilobytes / 6) {
    const std::string limited = "ulimit -v " + std::to_string(kilobytes) + "; exec " + Program();
    // With less, libraries' own beginnings end the process before anything of ours runs.
    const bool starts = Shell(limited + "--version").exit_code == 0;
    std::ofstream(Path("o.exr")) << "old";
    const auto before = directory_.Names();
    const testing::CommandResult result = Shell(limited + "a.exr --blur:sigma=20 -d half -o o.exr");
    EXPECT_EQ(directory_.Names(), before);
    if (result.exit_code == 0) {
      EXPECT_EQ(Oiiotool("--fail 0 o.exr right.exr --diff").exit_code, 0);
      continue;
    }
    refused += starts ? 1 : 0;
    EXPECT_TRUE(result.exit_code == 1 || !starts) << kilobytes << ": " << result.exit_code << result.err;
    EXPECT_FALSE(starts && result.err.empty());
    EXPECT_EQ(testing::FileText(Path("o.exr")), "old");
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace tessera
