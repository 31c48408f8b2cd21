// --safe: no environment, no files outside a config's folder, no links to write through, listed formats
// alone, limits; each of which the same line is free of without it.
#include <fstream>

#include "cli/cli_test.h"
#include "support/sanitized.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class SafeTest : public testing::CliTest {
 protected:
  void SetUp() override { MakePicture("a.exr", 30, 20, 3, OIIO::TypeFloat); }
  testing::CommandResult With(const std::string& variables, const std::string& line) {
    std::vector<std::string> words = testing::Words("env " + variables);
    words.push_back(TESSERA_PROGRAM);
    for (const std::string& word : testing::Words(line)) words.push_back(word);
    return testing::RunCommand(words, directory_.path());
  }
  void OnlyUnsafe(const std::string& line, const std::string& message) {
    EXPECT_EQ(Tessera(line).exit_code, 0) << line << Tessera(line).err;
    for (const std::string& safe : {"--safe " + line, line + " --safe"}) {
      const testing::CommandResult result = Tessera(safe);
      EXPECT_EQ(result.exit_code, 1) << safe << result.err;
      EXPECT_NE(result.err.find(message), std::string::npos) << safe << "\n" << result.err;
    }
  }
  void Put(const std::string& name, const std::string& text) { std::ofstream(Path(name)) << text; }
  static std::string Config(const std::string& paths, const std::string& lut) {
    return "ocio_profile_version: 2\nsearch_path: " + paths +
           "\nenvironment: {SHOT: inside}\nroles: {default: lin, scene_linear: lin}\ndisplays:\n  d:\n"
           "    - !<View> {name: v, colorspace: lin}\ncolorspaces:\n  - !<ColorSpace> {name: lin}\n"
           "  - !<ColorSpace> {name: log, from_scene_reference: !<FileTransform> {src: \"" +
           lut + "\"}}\n";
  }
};

TEST_F(SafeTest, NoVariableIsUsed) {
  if (testing::kThreadSanitized) GTEST_SKIP() << "nor are those that let a reader have threads";
  const std::string line = "a.exr --colorconvert linear sRGB -o out.png";
  Put("other.ocio", Config(".", "gone.cube"));
  EXPECT_EQ(With("OCIO=other.ocio", line).exit_code, 1);
  Works(line);
  fs::rename(Path("out.png"), Path("right.png"));
  const testing::CommandResult safe = With("OCIO=other.ocio", "--safe " + line);
  EXPECT_EQ(safe.exit_code, 0) << safe.err;
  EXPECT_EQ(Oiiotool("--fail 0 out.png right.png --diff").exit_code, 0);
  // OpenImageIO has read this one before main().
  const std::string log = "OPENIMAGEIO_OPTIONS=log_times=1 OPENIMAGEIO_LOG_TIMES=1 OPENIMAGEIO_DEBUG=2";
  EXPECT_EQ(With(log, "--safe --codec oiio " + line).out, "");
  // The mark of a program that was started over is no way in.
  EXPECT_EQ(With("TESSERA_STARTED_OVER= OCIO=other.ocio", "--safe " + line).exit_code, 0);
}

TEST_F(SafeTest, ConfigsNameFilesOfTheirFolder) {
  fs::create_directories(Path("c/inside"));
  fs::create_directory(Path("outside"));
  const std::string cube = "LUT_1D_SIZE 2\n0 0 0\n.5 .5 .5\n";
  for (const char* name : {"c/l.cube", "c/inside/l.cube", "outside/l.cube"}) Put(name, cube);
  fs::create_symlink("../outside/l.cube", Path("c/link.cube"));
  const std::string line = "--colorconfig c/c.ocio a.exr --colorconvert";
  for (const auto& [paths, lut] : std::vector<std::pair<std::string, std::string>>{
           {".", "l.cube"}, {"inside", "l.cube"}, {".", "${SHOT}/l.cube"}, {".", "inside/../l.cube"}}) {
    Put("c/c.ocio", Config(paths, lut));
    Works("--safe " + line + " lin log -o out.exr");
  }
  const std::string refusal = "c/c.ocio: names the file ";
  for (const auto& [paths, lut] :
       std::vector<std::pair<std::string, std::string>>{{".", "../outside/l.cube"},
                                                        {"../outside", "l.cube"},
                                                        {".", "link.cube"},
                                                        {".", Path("outside/l.cube")}}) {
    Put("c/c.ocio", Config(paths, lut));
    OnlyUnsafe(line + " lin log -o out.exr", refusal);
  }
  // What the line puts into a config's names is looked at too.
  Put("c/c.ocio", Config(".", "${SHOT}/l.cube"));
  OnlyUnsafe(line + ":key=SHOT:value=../outside lin log -o out.exr", refusal);
}

TEST_F(SafeTest, TablesHoldAllOfThemselves) {
  Put("other.ctf",
      "<?xml version=\"1.0\"?>\n<ProcessList id=\"b\" version=\"1.7\">\n<Matrix inBitDepth=\"32f\" outBitDepth=\"32f\">"
      "<Array dim=\"3 3 3\">.5 0 0 0 .5 0 0 0 .5</Array></Matrix>\n</ProcessList>\n");
  Put("l.ctf",
      "<?xml version=\"1.0\"?>\n<ProcessList id=\"a\" version=\"1.7\">\n"
      "<Reference path=\"other.ctf\" inBitDepth=\"32f\" outBitDepth=\"32f\"></Reference>\n</ProcessList>\n");
  OnlyUnsafe("a.exr --lut l.ctf -o out.exr", "l.ctf: refers to other files");
  Works("--safe a.exr --lut other.ctf -o out.exr");
}

TEST_F(SafeTest, OutputsGoThroughNoLinks) {
  fs::create_directory(Path("real"));
  fs::create_directory_symlink("real", Path("way"));
  Put("real/o.exr", "old");
  fs::create_symlink("real/o.exr", Path("link.exr"));
  fs::create_symlink("gone.exr", Path("nowhere.exr"));
  OnlyUnsafe("a.exr -o link.exr", "found the symbolic link link.exr");
  EXPECT_EQ(Tessera("--safe a.exr -o nowhere.exr").exit_code, 1);
  OnlyUnsafe("a.exr -o way/../way/o.exr", "found the symbolic link way, expected none");
  EXPECT_TRUE(fs::is_symlink(Path("link.exr")));
  Works("--safe a.exr -o real/o.exr");
  // Reading through them is the system's to allow.
  Works("--safe link.exr -o real/p.exr");
}

TEST_F(SafeTest, OnlyListedFormats) {
  ASSERT_EQ(Oiiotool("a.exr -d uint8 -o a.iff").exit_code, 0);
  OnlyUnsafe("--formats all a.iff -o out.png", "found the format iff");
  OnlyUnsafe("a.exr -o out.fits", "found the format fits, expected one of those that are stood behind");
  OnlyUnsafe("a.exr -o out.term", "found the format term");
}

TEST_F(SafeTest, Limits) {
  const std::string large = "--pattern ramp 16385x16385 1 --resize 8x8 -o out.exr";
  const testing::CommandResult refused = Tessera("--safe " + large);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("over the limit pixels=268435456"), std::string::npos) << refused.err;
  Works("--safe --limit pixels=3e8 -n " + large);
  Works("-n " + large);
  EXPECT_NE(Tessera("--safe --pattern ramp 8x8 65 -o out.exr").err.find("limit channels=64"),
            std::string::npos);
  EXPECT_NE(Tessera("--safe --frames 1-1001 a.exr -o f.#.exr").err.find("limit frames=1000"),
            std::string::npos);
}

TEST_F(SafeTest, FontsAreNotNamed) {
  const auto result =
      Tessera("--safe --pattern checker 64x64 3 --text:font=/etc/passwd x -d uint8 -o text.png");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("--safe"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace tessera
