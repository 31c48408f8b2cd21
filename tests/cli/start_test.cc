// What the program loads: libraries for rare files only where a line asks for such a file, whatever the
// file's name is.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// A movie of one frame, not compressed: RIFF chunks of little-endian words.
std::string Avi(int width, int height, const std::string& bgr) {
  const auto words = [](const std::vector<int>& values) {
    std::string bytes;
    for (const int v : values) {
      for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(v >> shift & 255);
    }
    return bytes;
  };
  const auto chunk = [&](const std::string& id, const std::string& data) {
    return id + words({static_cast<int>(data.size())}) + data;
  };
  std::string frame;
  for (int i = 0; i < width * height; ++i) frame += bgr;
  const int bytes = static_cast<int>(frame.size());
  const std::string header =
      chunk("avih", words({40000, 0, 0, 0, 1, 0, 1, bytes, width, height, 0, 0, 0, 0}));
  const std::string stream =
      chunk("strh", "vidsDIB " + words({0, 0, 0, 1, 25, 0, 1, bytes, -1, 0, 0, height << 16 | width})) +
      chunk("strf", words({40, width, height, 24 << 16 | 1, 0, bytes, 0, 0, 0, 0}));
  return chunk("RIFF", "AVI " + chunk("LIST", "hdrl" + header + chunk("LIST", "strl" + stream)) +
                           chunk("LIST", "movi" + chunk("00db", frame)));
}

class StartTest : public CliTest {
 protected:
  // The libraries that a line loads, by their paths, but for those that stand in for others.
  std::vector<std::string> Loaded(const std::string& line) {
    std::vector<std::string> words = Words(line);
    words.insert(words.begin(),
                 {"env", "LD_DEBUG=files", "LD_DEBUG_OUTPUT=" + Path("loaded"), TESSERA_PROGRAM});
    result_ = RunCommand(std::move(words), directory_.path());
    std::vector<std::string> libraries;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      if (entry.path().stem() != "loaded") continue;
      std::ifstream log(entry.path());
      for (std::string text; std::getline(log, text);) {
        const size_t at = text.find("calling init: ");
        if (at != std::string::npos && text.find("/lib/tessera/") == std::string::npos)
          libraries.push_back(text.substr(at + 14));
      }
      std::filesystem::remove(entry.path());
    }
    return libraries;
  }

  CommandResult result_;
};

TEST_F(StartTest, CommonLinesLoadNothingForRareFiles) {
  for (const char* line : {"--version", "--help", "--pattern constant:color=.1,.2,.3 1x1 3 -o x.tif",
                           "x.tif --mulc 2 -o y.exr", "y.exr --colorconvert ACEScg sRGB -o z.png",
                           "--volume:solid=body:mode=iso:size=8x6:dims=16 -o v.png"}) {
    const std::vector<std::string> libraries = Loaded(line);
    EXPECT_EQ(result_.exit_code, 0) << line << "\n" << result_.err;
    EXPECT_THAT(libraries, Contains(HasSubstr("libOpenImageIO.so")));  // or nothing was found
    for (const char* rare : {"libopenvdb", "libopencv", "libavcodec", "libavformat", "libgdal"})
      EXPECT_THAT(libraries, Not(Contains(HasSubstr(rare)))) << line;
  }
}

TEST_F(StartTest, FilesOfMoviesAndVolumesLoadTheirs) {
  std::istringstream formats(OIIO::get_string_attribute("extension_list"));
  int extensions = 0;
  for (std::string format; std::getline(formats, format, ';');) {
    const std::string name = format.substr(0, format.find(':'));
    const char* const library = name == "ffmpeg" ? "libavformat" : name == "openvdb" ? "libopenvdb" : nullptr;
    if (library == nullptr) continue;
    std::istringstream list(format.substr(name.size() + 1));
    for (std::string extension; std::getline(list, extension, ',');) {
      const std::string file = "absent." + extension;
      EXPECT_THAT(Loaded(file + " -o x.png"), Contains(HasSubstr(library))) << extension;
      EXPECT_EQ(result_.exit_code, 1) << extension;
      EXPECT_THAT(result_.err, AllOf(HasSubstr("tessera: error: "), HasSubstr(file)));
      ++extensions;
    }
  }
  EXPECT_GT(extensions, 0);
}

// An OpenVDB file is known by its first bytes: the line starts over in its middle, says what is wrong, and
// leaves what a line leaves that failed.
TEST_F(StartTest, AFileOfAnotherNameStartsTheLineOver) {
  std::string bytes(" BDV\0\0\0\0\xe0\0\0\0\x0a\0\0\0\0\0\0\0\1", 21);
  bytes += std::string(36, 'a') + std::string(8, '\0');  // no metadata, no grids
  std::ofstream(Path("volume.dat")) << bytes;
  const std::vector<std::string> libraries = Loaded("--pattern ramp 8x8 3 -o first.tif volume.dat -o x.png");
  EXPECT_THAT(libraries, Contains(HasSubstr("libopenvdb")));
  EXPECT_EQ(result_.exit_code, 1);
  EXPECT_THAT(result_.err, AllOf(HasSubstr("tessera: error: "), HasSubstr("volume.dat")));
}

TEST_F(StartTest, MoviesAreRead) {
  std::ofstream(Path("clip.avi"), std::ios::binary) << Avi(64, 48, {10, 100, '\xc8'});
  Works("--formats all clip.avi -d uint8 -o frame.tif");
  EXPECT_NEAR(Sample("frame.tif", 5, 5, 0), 200 / 255.0, 1e-6);
  EXPECT_NEAR(Sample("frame.tif", 63, 47, 2), 10 / 255.0, 1e-6);
}

TEST_F(StartTest, MeshesAreConverted) {
  std::ofstream(Path("tetrahedron.obj"))
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::vector<std::string> libraries =
      Loaded("--volume:mesh=tetrahedron.obj:mode=iso:size=8x6:dims=24 -o v.png");
  EXPECT_EQ(result_.exit_code, 0) << result_.err;
  EXPECT_THAT(libraries, Contains(HasSubstr("libopenvdb")));
}

}  // namespace
}  // namespace tessera::testing
