// -d CHANNEL=TYPE: the types and the pixels that oiiotool writes.
#include <OpenImageIO/imageio.h>

#include <algorithm>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class ChannelTypesTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("color.exr", 37, 23, 4, OIIO::TypeHalf, 5);
    MakePicture("gray.exr", 37, 23, 1, OIIO::TypeFloat, 6);
    ASSERT_EQ(Oiiotool("color.exr gray.exr --chnames Z --mulc 3.3 --chappend -d half -o half.exr").exit_code,
              0);
    ASSERT_EQ(
        Oiiotool("color.exr gray.exr --chnames Z --mulc 3.3 --chappend -d float -o float.exr").exit_code, 0);
  }
  // "half half float", the types of an image of the file.
  std::string Types(const std::string& name, int part = 0) const {
    const auto input = OIIO::ImageInput::open(Path(name));
    if (!input || !input->seek_subimage(part, 0)) return "";
    std::string types;
    for (int c = 0; c < input->spec().nchannels; ++c)
      types += std::string(c ? " " : "") + input->spec().channelformat(c).c_str();
    return types;
  }
  void SameAsOiiotool(const std::string& line, const std::string& types) {
    Works(line + " -o ours.exr");
    const CommandResult theirs = Oiiotool(line + " -o theirs.exr");
    EXPECT_EQ(theirs.exit_code, 0) << theirs.err;
    EXPECT_EQ(Types("ours.exr"), types) << line;
    EXPECT_EQ(Types("theirs.exr"), types) << line;
    const CommandResult diff = Oiiotool("ours.exr theirs.exr --fail 0 --diff");
    EXPECT_EQ(diff.exit_code, 0) << line << "\n" << diff.out;
  }
};

TEST_F(ChannelTypesTest, AreOiiotools) {
  SameAsOiiotool("half.exr -d Z=float", "half half half half float");
  SameAsOiiotool("half.exr -d R=half,Z=float", "half half half half float");
  SameAsOiiotool("float.exr -d half -d Z=float", "half half half half float");
  SameAsOiiotool("float.exr -d R=half -d Z=half", "half float float float half");
  SameAsOiiotool("float.exr -d R=half,G=half,B=half", "half half half float float");
  SameAsOiiotool("half.exr -d Z=float -d half", "half half half half half");
  SameAsOiiotool("float.exr -d Q=half", "float float float float float");
  SameAsOiiotool("float.exr --ch Z,R -d Z=half", "float half");  // in the file by their names
  SameAsOiiotool("float.exr --compression piz -d half -d A=float", "half half half float half");
  SameAsOiiotool("float.exr --tile 16 16 -d half -d A=float", "half half half float half");
  SameAsOiiotool("float.exr --crop 20x10+5+3 -d half -d A=float", "half half half float half");
}

// Halves are rounded once, from floats, and what is read from such a file is what is in it.
TEST_F(ChannelTypesTest, PixelsAreThoseOfOneType) {
  Works("float.exr -d half -d Z=float -o mixed.exr");
  Works("float.exr -d half -o all.exr");
  for (const auto& [channels, of] : {std::pair{"R,G,B,A", "all.exr"}, {"Z", "float.exr"}}) {
    Works(std::string("mixed.exr --ch ") + channels + " -d float -o a.exr " + of + " --ch " + channels +
          " -d float -o b.exr");
    EXPECT_EQ(Oiiotool("a.exr b.exr --fail 0 --diff").exit_code, 0) << channels;
  }
  EXPECT_EQ(Load("mixed.exr").spec().find_attribute("tessera:ChannelTypes"), nullptr);
}

TEST_F(ChannelTypesTest, EveryPartHasThem) {
  Works("float.exr half.exr --siappend -d half -d Z=float -o two.exr");
  EXPECT_EQ(Types("two.exr", 0), "half half half half float");
  EXPECT_EQ(Types("two.exr", 1), "half half half half float");
}

TEST_F(ChannelTypesTest, OneTypeForAllIsNoMixture) {
  MakePicture("a.png", 9, 7, 3, OIIO::TypeUInt8);
  Works("a.png -d R=uint16,G=uint16,B=uint16 -o b.png");
  EXPECT_EQ(Types("b.png"), "uint16 uint16 uint16");
  Works("float.exr -d Z=half -o:type=float c.exr");
  EXPECT_EQ(Types("c.exr"), "float float float float float");
  Works("a.png -d Z=half -o d.png");
  EXPECT_EQ(Types("d.png"), "uint8 uint8 uint8");
}

TEST_F(ChannelTypesTest, WhatIsWrongIsTold) {
  MakePicture("a.tif", 9, 7, 3, OIIO::TypeFloat);
  for (const auto& [line, code, part] :
       {std::tuple{"a.tif -d R=half -o b.tif", 1, "expected one type for tiff, or OpenEXR"},
        {"half.exr -d Z=uint8 -o b.exr", 1, "found the type uint8 for the channel Z, expected"},
        {"half.exr -d Z=float16 -o b.exr", 2, "found \"float16\", expected uint8, uint16, half or float"},
        {"half.exr -d Z=half,=float -o b.exr", 2, "expected a channel before each ="},
        {"half.exr -d Z=half,float -o b.exr", 2, "found"},
        {"half.exr -d Z= -o b.exr", 2, "found"},
        {"half.exr -d Z=float --verify -o b.exr", 1, "--verify"}}) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, code) << line << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << line << ": " << result.err;
    EXPECT_FALSE(std::filesystem::exists(Path("b.exr")));
  }
}

}  // namespace
}  // namespace tessera::testing
