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
    {"Div", "a b", "--maxc 0.1 --div"},
    {"DivByZero", "p q", "--addc -0.5 --maxc 0 --div"},
    {"DivWindows", "a b", "--crop 90x60+17+11 --div"},
    {"AddRgba", "p q", "--add"},
    {"AddConstant", "a", "--addc 0.1"},
    {"AddConstants", "a", "--addc 0.1,-0.2,0.3"},
    {"AddConstantsRgba", "p", "--addc 0.1,-0.2,0.3,0.05"},
    {"SubConstant", "a", "--subc 0.2"},
    {"MulConstant", "a", "--mulc 0.7"},
    {"MulConstantsRgba", "p", "--mulc 0.5,0.6,0.7,0.8"},
    {"DivConstant", "a", "--divc 1.7"},
    {"DivConstantsRgba", "p", "--divc 1.5,0.8,0,1"},
    {"DivConstantsFew", "p", "--divc 1.5,0.8"},
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
    {"Contrast", "a", "--contrast:black=0.1:white=0.75"},
    {"ContrastInverse", "a", "--contrast:black=1.0:white=0.0:clamp=0"},
    {"ContrastSigmoid", "a", "--contrast:scontrast=5", "2e-6"},
    {"ContrastEach", "p", "--contrast:black=0.1,0.2:white=0.9,0.8,0.7:min=0.05,0:max=0.9:clamp=1"},
    {"ContrastSigmoidEach", "p", "--contrast:scontrast=5,3:sthresh=0.4,0.5,0.6:min=0.1:max=0.8", "2e-6"},
    {"ContrastThreshold", "p", "--contrast:black=0.5:white=0.5:min=0.2:max=0.7"},
    {"RangeCompress", "p", "--mulc 3 --rangecompress"},
    {"RangeCompressLuma", "p", "--mulc 3 --rangecompress:luma=1", "2e-6"},
    {"RangeExpand", "p", "--clamp:min=-0.5:max=0.6 --rangeexpand",
     "4e-6"},  // oiiotool has its exponents in float
    {"RangeExpandLuma", "p", "--clamp:min=-0.5:max=0.6 --rangeexpand:luma=1", "4e-6"},
    {"ChannelSum", "p", "--chsum --mulc 0.25"},
    {"ChannelSumWeights", "p", "--chsum:weight=.2126,.7152,.0722,0"},
    {"ChannelSumFewWeights", "p", "--chsum:weight=.2,.3 --mulc 0.4"},
    {"MaxChannel", "p", "--maxchan"},
    {"MinChannel", "p", "--minchan"},
    {"ColorMapTurbo", "a", "--colormap turbo", "2e-6"},
    {"ColorMapViridis", "p", "--colormap viridis", "2e-6"},
    {"ColorMapMagma", "a", "--ch R --colormap magma", "2e-6"},
    {"ColorMapInferno", "a", "--colormap inferno", "2e-6"},
    {"ColorMapPlasma", "a", "--colormap plasma", "2e-6"},
    {"ColorMapBlueRed", "a", "--colormap blue-red"},
    {"ColorMapSpectrum", "a", "--colormap spectrum", "2e-6"},
    {"ColorMapHeat", "a", "--colormap heat", "2e-6"},
    {"ColorMapKnots", "a", "--colormap .25,.25,.25,0,.5,0,1,0,0"},
    {"FixNanOfNumbers", "p", "--fixnan box3"},
    {"Fill", "p", "--fill:color=1,0.5,0.25 90x60+17+11"},
    {"FillWhite", "a", "--fill:color=1 10,20,99,79"},
    {"FillDown", "a", "--fill:top=0.1,0.2,0.3:bottom=0,0,0.5 90x60+17+11"},
    {"FillAcross", "p", "--fill:left=0:right=1,0.5 400x60-20+11"},
    {"FillCorners", "a",
     "--fill:topleft=.1,.1,.1:topright=1,0,0:bottomleft=0,1,0:bottomright=0,0,1 90x600+17+11"},
    {"FillHoles", "p", "--fill:color=0 90x60+17+11 --fillholes", "1e-5"},
    {"NoiseGaussian", "p", "--noise:stddev=0.05:seed=3"},
    {"NoiseUniform", "p", "--noise:type=uniform:min=-0.1:max=0.3:mono=1"},
    {"NoiseWhite", "p", "--noise:type=white:nchannels=3"},
    {"NoiseSalt", "p", "--noise:type=salt:value=1:portion=0.05"},
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
  for (const std::string& name : Words(GetParam().images)) {
    const int channels = name[0] >= 'p' ? 4 : 3;
    MakePicture(name + ".tif", 301, 173, channels, OIIO::TypeUInt8, name[0]);
    MakePicture(name + ".exr", 301, 173, channels, OIIO::TypeFloat, name[0]);
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
  static const TemporaryDirectory parts;  // made once
  for (const std::string& name : Words(GetParam().images)) {
    const std::string part = (parts.path() / name).string();
    if (!std::filesystem::exists(part + ".exr")) {
      const std::string alpha = name < "p" ? "" : "--dup --ch G --chappend --chnames R,G,B,A ";
      const CommandResult cut = Oiiotool(photograph.string() + " --cut 512x384" + corners.at(name) + " " +
                                         alpha + "-d uint8 -o " + part + ".tif -d float -o " + part + ".exr");
      ASSERT_EQ(cut.exit_code, 0) << cut.err;
    }
    for (const char* extension : {".tif", ".exr"}) {
      std::filesystem::copy_file(part + extension, Path(name + extension));
    }
  }
  Compare("tif", "uint8", "0.00393");
  Compare("exr", "float", GetParam().limit);
}

INSTANTIATE_TEST_SUITE_P(Shared, OiiotoolTest, ::testing::ValuesIn(kShared),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace tessera::testing
