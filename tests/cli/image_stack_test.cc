// Commands on images and the stack, as a user sees them: what ends up in which file.
#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class ImageStackTest : public CliTest {
 protected:
  // A generated image of one value in every channel.
  static std::string Constant(const std::string& value, const std::string& shape = "4x3 3") {
    return "--pattern constant:color=" + value + " " + shape + " ";
  }
};

TEST_F(ImageStackTest, OperandsAreTakenInTheOrderWritten) {
  Works(Constant("0.75") + Constant("0.25") + "--sub -d float -o sub.tif");
  EXPECT_EQ(Sample("sub.tif", 0, 0, 0), 0.5f);
  Works(Constant("0.75") + Constant("0.25") + "--swap --sub -d float -o swapped.tif");
  EXPECT_EQ(Sample("swapped.tif", 0, 0, 0), -0.5f);
}

TEST_F(ImageStackTest, CommandsMayStandBeforeTheirOperands) {
  Works("--sub " + Constant("0.75") + Constant("0.25") + "-d float -o sub.tif");
  EXPECT_EQ(Sample("sub.tif", 0, 0, 0), 0.5f);
}

TEST_F(ImageStackTest, DupAndPop) {
  Works(Constant("0.5") + "--dup --mul -d float -o square.tif");
  EXPECT_EQ(Sample("square.tif", 1, 1, 1), 0.25f);
  Works(Constant("0.5") + Constant("1") + "--pop -d float -o first.tif");
  EXPECT_EQ(Sample("first.tif", 1, 1, 1), 0.5f);
}

// The mean of a ramp's samples at the places of a set lies where their mean does: in the pixel's middle.
TEST_F(ImageStackTest, LinesSumSamplesAtJitteredPlaces) {
  Works("--pattern ramp 32x32 2 -d float -o ramp.tif");
  Works(
      "--for i 8 ramp.tif --shift:filter=triangle {jitterx(8,i)},{jittery(8,i)} --endfor --average 8 -d float -o mean.tif");
  EXPECT_NEAR(Sample("mean.tif", 16, 9, 0), Sample("ramp.tif", 16, 9, 0), 1e-6);
  EXPECT_NEAR(Sample("mean.tif", 16, 9, 1), Sample("ramp.tif", 16, 9, 1), 1e-6);
  const CommandResult places =
      Tessera("ramp.tif --echo {jitterx(2,0)}/{jittery(2,0)}/{jitterx(16,15)}/{jittery(1+3,1)}");
  EXPECT_EQ(places.out, "-0.25/0.25/0.125/0.25\n") << places.err;
  for (const char* wrong : {"{jitterx(8,8)}", "{jitterx(0,0)}", "{jittery(2.5,1)}"}) {
    const CommandResult refused = Tessera(std::string("ramp.tif --echo ") + wrong);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("expected whole numbers, 1 to 65536 samples"), std::string::npos)
        << refused.err;
  }
}

TEST_F(ImageStackTest, AnOutputStaysOnTheStack) {
  Works(Constant("0.5") + "-d float -o one.tif --mulc 0.5 -o two.tif");
  EXPECT_EQ(Sample("one.tif", 0, 0, 0), 0.5f);
  EXPECT_EQ(Sample("two.tif", 0, 0, 0), 0.25f);
}

TEST_F(ImageStackTest, TypesHoldForTheOutputsThatFollow) {
  Works(Constant("0.5") + "-o a.tif -d uint8 -o b.tif -o:type=uint16 c.tif -o d.tif -d half -o e.exr");
  EXPECT_EQ(Load("a.tif").nativespec().format, OIIO::TypeFloat);
  EXPECT_EQ(Load("b.tif").nativespec().format, OIIO::TypeUInt8);
  EXPECT_EQ(Load("c.tif").nativespec().format, OIIO::TypeUInt16);
  EXPECT_EQ(Load("d.tif").nativespec().format, OIIO::TypeUInt8);
  EXPECT_EQ(Load("e.exr").nativespec().format, OIIO::TypeHalf);
}

TEST_F(ImageStackTest, CreateAndPatterns) {
  Works("--create 5x4+2+1 4 -d float -o black.exr");
  const OIIO::ImageBuf black = Load("black.exr");
  EXPECT_EQ(black.spec().nchannels, 4);
  EXPECT_EQ(black.roi(), OIIO::ROI(2, 7, 1, 5, 0, 1, 0, 4));
  EXPECT_EQ(black.getchannel(4, 3, 0, 3), 0.0f);
  Works("--pattern ramp 8x4 2 -d float -o ramp.tif");
  EXPECT_EQ(Sample("ramp.tif", 3, 1, 0), 3.5f / 8);
  EXPECT_EQ(Sample("ramp.tif", 3, 1, 1), 1.5f / 4);
}

TEST_F(ImageStackTest, ChannelsAndWindows) {
  Works(Constant("0.1,0.2,0.3") + "--ch B,R -d float -o br.exr");
  EXPECT_EQ(Sample("br.exr", 0, 0, Load("br.exr").spec().channelindex("B")), 0.3f);
  Works(Constant("0.1,0.2,0.3") + Constant("0.9", "4x3 1") +
        "--chappend --chnames R,G,B,A -d float -o rgba.exr");
  const OIIO::ImageBuf rgba = Load("rgba.exr");
  EXPECT_EQ(rgba.spec().channelnames, (std::vector<std::string>{"R", "G", "B", "A"}));
  EXPECT_EQ(rgba.getchannel(3, 2, 0, 3), 0.9f);
  Works("rgba.exr --crop 2x1+1+1 -o crop.exr");
  const OIIO::ImageBuf crop = Load("crop.exr");
  EXPECT_EQ(crop.roi(), OIIO::ROI(1, 3, 1, 2, 0, 1, 0, 4));
  EXPECT_EQ(crop.roi_full(), OIIO::ROI(0, 4, 0, 3, 0, 1, 0, 4));
}

TEST_F(ImageStackTest, SubimagesByIndexAndName) {
  Oiiotool(
      "--pattern constant:color=0.25 4x4 3 --attrib oiio:subimagename first --pattern constant:color=0.75 "
      "4x4 3 --attrib oiio:subimagename second --siappend -d half -o parts.exr");
  Works("-i:subimage=1 parts.exr -d float -o index.tif");
  EXPECT_EQ(Sample("index.tif", 0, 0, 0), 0.75f);
  Works("-i:subimage=second parts.exr -d float -o name.tif");
  EXPECT_EQ(Sample("name.tif", 0, 0, 0), 0.75f);
  Works("parts.exr -d float -o default.tif");
  EXPECT_EQ(Sample("default.tif", 0, 0, 0), 0.25f);
}

TEST_F(ImageStackTest, MetadataIsSetKeptAndSignedWithTheLine) {
  Works(Constant("0.5") +
        "--attrib Artist Ada --attrib Take 7 --attrib Gain 0.5 --attrib:type=string Code 12 -o a.exr");
  const OIIO::ImageSpec a = Load("a.exr").spec();
  EXPECT_EQ(a.get_string_attribute("Artist"), "Ada");
  EXPECT_EQ(a.find_attribute("Take")->type(), OIIO::TypeInt);
  EXPECT_EQ(a.get_int_attribute("Take"), 7);
  EXPECT_EQ(a.get_float_attribute("Gain"), 0.5f);
  EXPECT_EQ(a.find_attribute("Code")->type(), OIIO::TypeString);
  Works("a.exr --mulc 2 -o b.exr");
  const OIIO::ImageSpec b = Load("b.exr").spec();
  EXPECT_EQ(b.get_string_attribute("Artist"), "Ada");
  const std::string history = b.get_string_attribute("Exif:ImageHistory");
  EXPECT_NE(history.find("--attrib Artist Ada"), std::string::npos) << history;
  EXPECT_TRUE(history.ends_with("\ntessera a.exr --mulc 2 -o b.exr")) << history;
  EXPECT_TRUE(std::string(b.get_string_attribute("Software")).starts_with("tessera "));
  Works(Constant("0.5") + "--nosoftwareattrib -o c.exr");
  EXPECT_EQ(Load("c.exr").spec().get_string_attribute("Exif:ImageHistory"), "");
}

// A report of --diff without the place of the largest difference: which one of many equal differences is
// named depends on how codes become floats.
std::string WithoutPlace(const std::string& report) {
  std::istringstream lines(report);
  std::string text;
  for (std::string line; std::getline(lines, line);) text += line.substr(0, line.find(" @ ")) + "\n";
  return text;
}

TEST_F(ImageStackTest, DiffJudgesLikeOiiotool) {
  MakePicture("a.png", 40, 30, 3, OIIO::TypeUInt8);
  Works("a.png --addc 0.1 -o b.png");
  for (const std::string limits :
       {"", "--fail 0.2 --warn 0.01 ", "--fail 0.2 --warn 0.3 ", "--fail 1 --warn 1 --hardfail 0.05 ",
        "--failpercent 100 --warnpercent 100 ", "--failpercent 50 ", "--fail 1 --hardwarn 0.05 "}) {
    const std::string line = limits + "a.png b.png --diff";
    const CommandResult ours = Tessera(line), theirs = Oiiotool(line);
    EXPECT_EQ(ours.exit_code, theirs.exit_code) << line;
    for (const std::string word : {"PASS", "WARNING", "FAILURE", "Max error", "pixels ("}) {
      EXPECT_EQ(ours.out.find(word) == std::string::npos, theirs.out.find(word) == std::string::npos)
          << line << ours.out;
    }
    EXPECT_EQ(WithoutPlace(ours.out), WithoutPlace(theirs.out)) << line;
  }
  EXPECT_EQ(Tessera("--diff a.png b.png").exit_code, 1);
  EXPECT_EQ(Tessera("-q a.png b.png --diff").out, "");
  // The verdict does not keep the other outputs from being written.
  EXPECT_EQ(Tessera("a.png b.png --diff --absdiff -o d.png").exit_code, 1);
  EXPECT_TRUE(std::filesystem::exists(Path("d.png")));
}

TEST_F(ImageStackTest, DiffSeesNan) {
  Oiiotool("--pattern constant:color=nan 4x4 1 -o nan.exr");
  EXPECT_EQ(Tessera("nan.exr nan.exr --diff").exit_code, 0);
  EXPECT_EQ(Tessera("nan.exr --create 4x4 1 --diff --fail 1").exit_code, 2);
  EXPECT_EQ(Tessera("--fail 1 nan.exr --create 4x4 1 --diff").exit_code, 1);
}

TEST_F(ImageStackTest, StatisticsAgreeWithOiiotool) {
  const auto numbers = [](const std::string& text) {
    return text.substr(std::min(text.find("Stats Min"), text.size()));
  };
  MakePicture("a.png", 40, 30, 3, OIIO::TypeUInt8);
  MakePicture("f.exr", 40, 30, 4, OIIO::TypeFloat);
  for (const std::string line : {"a.png --printstats", "f.exr --printstats"}) {
    const std::string ours = numbers(Works(line)), theirs = numbers(Oiiotool(line).out);
    EXPECT_FALSE(ours.empty());
    EXPECT_EQ(ours, theirs);
  }
  EXPECT_NE(Works("--pattern constant:color=0.5 8x8 3 --stats").find("Constant: Yes"), std::string::npos);
}

TEST_F(ImageStackTest, StatisticsOfANearlyConstantImageAreExact) {
  // 4096 plus a checkerboard of 2^-11: squares of the mean would swallow the deviation in float.
  const std::string out =
      Works("--pattern checker:width=1:height=1:color1=4096:color2=4096.00048828125 512x512 1 --printstats");
  EXPECT_NE(out.find("Stats Avg: 4096.000244"), std::string::npos) << out;
  EXPECT_NE(out.find("Stats StdDev: 0.000244"), std::string::npos) << out;
}

// A solid's block from a file: slices of a cube, one above the other, whose right half is 1. Bands of half a
// block, again and again, whatever y and z.
TEST_F(ImageStackTest, ABlockOfOnesOwn) {
  Works("--pattern checker:width=4:height=64:color1=0:color2=1 8x64 1 -d float -o block.exr");
  const std::string solid = "--volume:solid=box(0,0,0,.8,.8,.8):dims=32:size=128x64:fov=0:mode=solid:flat=1:";
  Works(solid + "block=block.exr:freq=2 -o two.exr " + solid + "block=block.exr:freq=4 -o four.exr");
  for (const auto& [file, bands] : {std::pair("two.exr", 2), {"four.exr", 4}}) {
    const OIIO::ImageBuf image = Load(file);
    const auto inside = [&](int x, int y) { return image.getchannel(x, y, 0, 3) > 0.999f; };
    int changes = 0, width = 0;
    bool last = false;
    for (int x = 0; x < 128; ++x) {
      if (!inside(x, 32)) continue;
      const bool one = image.getchannel(x, 32, 0, 0) > 0.5f;
      changes += width > 0 && one != last ? 1 : 0;
      last = one;
      ++width;
      EXPECT_NEAR(image.getchannel(x, 24, 0, 0), image.getchannel(x, 32, 0, 0), 1e-5) << file << " " << x;
    }
    EXPECT_GT(width, 30);
    EXPECT_GE(changes, bands) << file;
  }
  EXPECT_EQ(Tessera("--pattern constant 8x63 1 -d float -o odd.exr").exit_code, 0);
  const CommandResult odd = Tessera(solid + "block=odd.exr -o x.exr");
  EXPECT_EQ(odd.exit_code, 1) << odd.err;
  EXPECT_NE(odd.err.find("expected a cube of 4 to 256 a side"), std::string::npos) << odd.err;
}

}  // namespace
}  // namespace tessera::testing
