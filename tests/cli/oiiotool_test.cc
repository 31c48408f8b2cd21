// Shared commands give oiiotool's picture: within one code for uint8, within 1e-6 for float (a warp: 1e-4).
#include <map>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

// Pictures in the directory: a, b and c in three channels, p and q in four, each as uint8 and as float.
struct Shared {
  const char* name;            // of the test
  const char* images;          // names of pictures
  const char* command;         // the same for both programs
  const char* limit = "1e-6";  // of floats
};
void PrintTo(const Shared& s, std::ostream* out) { *out << s.command; }

const Shared kShared[] = {
    {"Add", "a b", "--add"},
    {"Sub", "a b", "--sub"},
    {"Mul", "a b", "--mul"},
    {"Mad", "a b c", "--mad"},
    {"Min", "a b", "--min"},
    {"Max", "a b", "--max"},
    {"AbsDiff", "a b", "--absdiff"},
    {"AddRgba", "p q", "--add"},
    {"AddConstant", "a", "--addc 0.1"},
    {"AddConstants", "a", "--addc 0.1,-0.2,0.3"},
    {"AddConstantsRgba", "p", "--addc 0.1,-0.2,0.3,0.05"},
    {"SubConstant", "a", "--subc 0.2"},
    {"MulConstant", "a", "--mulc 0.7"},
    {"MulConstantsRgba", "p", "--mulc 0.5,0.6,0.7,0.8"},
    {"MinConstant", "a", "--minc 0.4"},
    {"MaxConstant", "a", "--maxc 0.4"},
    {"AbsDiffConstant", "a", "--absdiffc 0.5"},
    {"Clamp", "a", "--clamp:min=0.25:max=0.75"},
    {"ClampEach", "a", "--clamp:min=0.1,0.2,0.3:max=0.6,0.7,0.8"},
    {"Power", "a", "--powc 2"},
    {"PowersRgba", "p", "--powc 2,3,1,1"},
    {"Invert", "a", "--invert"},
    {"InvertRgba", "p", "--invert"},
    {"Abs", "a", "--addc -0.5 --abs"},
    {"Premult", "p", "--premult"},
    {"Unpremult", "p", "--unpremult --ch R,G,B"},
    {"Repremult", "p", "--repremult"},
    {"UnpremultMarksTheFile", "p", "--unpremult"},
    {"UnpremultAndBack", "p", "--unpremult --mulc 0.8,0.9,0.7,1 --premult"},
    {"Matrix3", "a", "--ccmatrix 0.6,0.3,0.1,0.2,0.7,0.1,0.05,0.15,0.8"},
    {"Matrix4", "p", "--ccmatrix 0.6,0.3,0.1,0,0.2,0.7,0.1,0,0.05,0.15,0.8,0,0,0,0,1"},
    {"Matrix3Transposed", "a", "--ccmatrix:transpose=1 0.6,0.3,0.1,0.2,0.7,0.1,0.05,0.15,0.8"},
    {"Saturate", "a", "--saturate 0.4"},
    {"Channels", "p", "--ch B,R,A,G"},
    {"ChannelsNamed", "p", "--ch R=B,G=0.25,B"},
    {"ChannelAppend", "a b", "--chappend"},
    {"Crop", "a", "--crop 90x60+17+11"},
    {"CropCorners", "a", "--crop 10,20,99,79"},
    {"CropBeyond", "a", "--crop 400x40-20+5"},
    // Windows that differ: the result covers both.
    {"AddWindows", "a b", "--crop 90x60+17+11 --add"},
    {"SubWindows", "a b", "--crop 90x60+17+11 --sub"},
    {"MulWindows", "a b", "--crop 400x40-20+5 --mul"},
    {"AbsDiffWindows", "a b", "--crop 90x60-30+11 --absdiff"},
    {"OverWindows", "p q", "--crop 90x60+17+11 --over"},
    {"MatrixUnpremult", "p", "--ccmatrix:unpremult=1 0.6,0.3,0.1,0.2,0.7,0.1,0.05,0.15,0.8"},
    {"WarpAtBorders", "a b", "--ch R,G --st_warp", "1e-4"},  // oiiotool has its positions in float
    {"Chain", "a b", "--mulc 0.8 --add --mulc 0.5 --addc 0.1 --clamp:min=0:max=0.9"},
};

class OiiotoolTest : public CliTest, public ::testing::WithParamInterface<Shared> {
 protected:
  // Both programs do the line in `extension` files of that type; oiiotool judges.
  void Compare(const std::string& extension, const std::string& type, const std::string& limit) {
    std::string images;
    for (const std::string& name : Words(GetParam().images)) images += name + "." + extension + " ";
    const std::string work = images + GetParam().command + " -d " + type + " -o ";
    Works(work + "ours." + extension);
    const CommandResult theirs = Oiiotool(work + "theirs." + extension);
    ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
    const CommandResult diff =
        Oiiotool("--fail " + limit + " --warn 1e9 ours." + extension + " theirs." + extension + " --diff");
    EXPECT_EQ(diff.exit_code, 0) << work << "\n" << diff.out << diff.err;
    const OIIO::ImageBuf a = Load("ours." + extension), b = Load("theirs." + extension);
    EXPECT_EQ(a.roi(), b.roi());
    EXPECT_EQ(a.roi_full(), b.roi_full());
  }
};

TEST_P(OiiotoolTest, AgreesOnAGeneratedPicture) {
  for (const char* name : {"a", "b", "c", "p", "q"}) {
    const int channels = name[0] >= 'p' ? 4 : 3;
    MakePicture(std::string(name) + ".tif", 301, 173, channels, OIIO::TypeUInt8, name[0]);
    MakePicture(std::string(name) + ".exr", 301, 173, channels, OIIO::TypeFloat, name[0]);
  }
  Compare("tif", "uint8", "0.00393");
  Compare("exr", "float", GetParam().limit);
}

TEST_P(OiiotoolTest, AgreesOnAPhotograph) {
  const std::filesystem::path photograph = "/usr/share/backgrounds/mate/nature/Garden.jpg";
  if (!std::filesystem::exists(photograph))
    GTEST_SKIP() << "no photograph, the package mate-backgrounds is absent";
  // Different parts; the pictures with alpha have their own green as alpha.
  const std::map<std::string, std::string> corners = {
      {"a", "+100+100"}, {"b", "+400+300"}, {"c", "+20+500"}, {"p", "+100+100"}, {"q", "+400+300"}};
  for (const std::string& name : Words(GetParam().images)) {
    const std::string alpha = name < "p" ? "" : "--dup --ch G --chappend --chnames R,G,B,A ";
    const CommandResult cut = Oiiotool(photograph.string() + " --cut 512x384" + corners.at(name) + " " +
                                       alpha + "-d uint8 -o " + name + ".tif -d float -o " + name + ".exr");
    ASSERT_EQ(cut.exit_code, 0) << cut.err;
  }
  Compare("tif", "uint8", "0.00393");
  Compare("exr", "float", GetParam().limit);
}

INSTANTIATE_TEST_SUITE_P(Shared, OiiotoolTest, ::testing::ValuesIn(kShared),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace tessera::testing
