// The colour state along the line: from file to file the pictures are those of oiiotool that is told every
// space, and the files say what they hold.
#include <algorithm>
#include <fstream>
#include <iterator>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

// In the shape of OpenColorIO's ACES configs.
constexpr char kConfig[] = R"(ocio_profile_version: 2
search_path: .
strictparsing: true
roles: {default: raw, scene_linear: ACEScg, aces_interchange: ACES2065-1, cie_xyz_d65_interchange: xyz, color_timing: ACEScct}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
looks:
  - !<Look> {name: warm, process_space: ACEScct, transform: !<CDLTransform> {slope: [1.1, 1, 0.92], offset: [0.01, 0, -0.01], power: [1.05, 1, 0.95], sat: 1.1}}
displays:
  monitor:
    - !<View> {name: film, view_transform: film, display_colorspace: screen}
    - !<View> {name: warm, view_transform: film, display_colorspace: screen, looks: warm}
    - !<View> {name: plain, view_transform: plain, display_colorspace: screen}
    - !<View> {name: raw, colorspace: raw}
  video:
    - !<View> {name: film, view_transform: film, display_colorspace: Rec.1886 Rec.709 - Display}
view_transforms:
  - !<ViewTransform> {name: plain, from_scene_reference: !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}}
  - !<ViewTransform> {name: film, from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0}}
display_colorspaces:
  - !<ColorSpace> {name: xyz}
  - !<ColorSpace> {name: screen, aliases: [sRGB - Display], from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}}
  - !<ColorSpace> {name: Rec.1886 Rec.709 - Display, from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709}}
colorspaces:
  - !<ColorSpace> {name: raw, isdata: true}
  - !<ColorSpace> {name: ACES2065-1}
  - !<ColorSpace> {name: ACEScg, to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}}
  - !<ColorSpace> {name: ACEScct, to_scene_reference: !<BuiltinTransform> {style: ACEScct_to_ACES2065-1}}
  - !<ColorSpace> {name: logc, to_scene_reference: !<BuiltinTransform> {style: ARRI_ALEXA-LOGC-EI800-AWG_to_ACES2065-1}}
  - !<ColorSpace>
    name: linear709
    aliases: [lin_rec709]
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
  - !<ColorSpace>
    name: texture
    aliases: [srgb_tx]
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, direction: inverse}
)";

// The same picture by both programs: what ours finds out is said to oiiotool.
struct Trip {
  const char* name;
  const char* ours;
  const char* theirs;
  const char* space;  // that the file is read back in
  const char* oiio;   // as OpenImageIO names it in a PNG
};
void PrintTo(const Trip& t, std::ostream* out) { *out << t.ours; }

// cg.exr and ap0.exr say by their chromaticities that they are ACEScg and ACES2065-1; plain.exr says nothing;
// texture.png is sRGB; glow.exr is ACEScg with alpha, 0 in places.
const Trip kTrips[] = {
    {"Display", "cg.exr --ociodisplay monitor film", "cg.exr --ociodisplay:from=ACEScg monitor film",
     "sRGB Display", "sRGB"},
    {"LookDisplay", "cg.exr --ociolook warm --ociodisplay monitor film",
     "cg.exr --ociolook:from=ACEScg:to=ACEScg warm --ociodisplay:from=ACEScg monitor film", "sRGB Display",
     "sRGB"},
    {"ViewWithLook", "cg.exr --ociodisplay monitor warm", "cg.exr --ociodisplay:from=ACEScg monitor warm",
     "sRGB Display", "sRGB"},
    {"CameraConvertDisplay",
     "plain.exr --clamp:min=0:max=1 --colorconvert logc ACEScg --ociodisplay monitor film",
     "plain.exr --clamp:min=0:max=1 --colorconvert logc ACEScg --ociodisplay:from=ACEScg monitor film",
     "sRGB Display", "sRGB"},
    {"CameraLogLookDisplay",
     "plain.exr --clamp:min=0:max=1 --iscolorspace logc --tocolorspace ACEScct --ociolook warm --ociodisplay monitor film",
     "plain.exr --clamp:min=0:max=1 --colorconvert logc ACEScct --ociolook:from=ACEScct:to=ACEScct warm "
     "--ociodisplay:from=ACEScct monitor film",
     "sRGB Display", "sRGB"},
    {"ChromaticitiesDisplay", "ap0.exr --mulc 0.8 --ociodisplay monitor film",
     "ap0.exr --mulc 0.8 --ociodisplay:from=ACES2065-1 monitor film", "sRGB Display", "sRGB"},
    {"TextureToScene", "texture.png --tocolorspace ACEScg", "texture.png --colorconvert texture ACEScg",
     "ACEScg", ""},
    {"TextureThereAndDisplay", "texture.png --colorconvert texture ACEScg --ociodisplay monitor film",
     "texture.png --colorconvert texture ACEScg --ociodisplay:from=ACEScg monitor film", "sRGB Display",
     "sRGB"},
    {"UntaggedIsSceneLinear", "plain.exr --ociodisplay monitor plain",
     "plain.exr --ociodisplay:from=ACEScg monitor plain", "sRGB Display", "sRGB"},
    {"Video", "cg.exr --ociodisplay video film", "cg.exr --ociodisplay:from=ACEScg video film",
     "Rec.1886 Rec.709 Display", "Rec709"},
    {"GlowUnpremultiplied", "glow.exr --colorconvert:unpremult=1 current ACEScct",
     "glow.exr --colorconvert:unpremult=1 ACEScg ACEScct", "ACEScct", "ACEScct"},
    {"LinearThenCurve", "cg.exr --tocolorspace lin_rec709 --curve:negatives=extend srgb",
     "cg.exr --colorconvert ACEScg linear709 --colorconvert linear709 texture", "sRGB", "sRGB"},
    {"LookInverse", "cg.exr --ociolook:inverse=1:from=ACEScct:to=ACEScg warm",
     "cg.exr --ociolook:inverse=1:from=ACEScct:to=ACEScg warm", "ACEScg", ""},
    {"RawView", "cg.exr --ociodisplay monitor raw", "cg.exr --ociodisplay:from=ACEScg monitor raw", "raw",
     ""},
};

class ColorTripTest : public CliTest, public ::testing::WithParamInterface<Trip> {
 protected:
  // Samples of both programs' files, relative where they are above 1.
  void ExpectNear(const std::string& extension, double limit) {
    const OIIO::ImageBuf ours = Load("ours." + extension), theirs = Load("theirs." + extension);
    ASSERT_EQ(ours.roi(), theirs.roi());
    int wrong = 0;
    for (int y = 0; y < 61; ++y) {
      for (int x = 0; x < 97; ++x) {
        for (int c = 0; c < ours.nchannels(); ++c) {
          const double a = ours.getchannel(x, y, 0, c), b = theirs.getchannel(x, y, 0, c);
          const double size = std::max({1.0, std::fabs(a), std::fabs(b)});
          if (!(std::fabs(a - b) <= limit * size) && ++wrong <= 3)
            ADD_FAILURE() << extension << " " << x << "," << y << " channel " << c << ": " << a
                          << ", oiiotool " << b;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }
  void SetUp() override {
    std::ofstream(Path("config.ocio")) << kConfig;
    MakePicture("plain.exr", 97, 61, 3, OIIO::TypeFloat, 3);
    const OIIO::TypeDesc eight(OIIO::TypeDesc::FLOAT, 8);
    const auto tagged = [&](const std::string& name, const std::vector<float>& xy, int channels) {
      MakePicture("made.exr", 97, 61, channels, OIIO::TypeFloat, 5);
      OIIO::ImageBuf image = Load("made.exr");
      image.specmod().attribute("chromaticities", eight, xy.data());
      for (int x = 0; channels == 4 && x < 40; ++x) {
        const float light[4] = {0.5f + 0.1f * static_cast<float>(x), 0.3f, 0.1f, 0};
        image.setpixel(x, 10, light);
      }
      ASSERT_TRUE(image.write(Path(name)));
    };
    const std::vector<float> ap1 = {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f};
    tagged("cg.exr", ap1, 3), tagged("glow.exr", ap1, 4);
    tagged("ap0.exr", {0.7347f, 0.2653f, 0, 1, 0.0001f, -0.077f, 0.32168f, 0.33767f}, 3);
    MakePicture("texture.png", 97, 61, 3, OIIO::TypeUInt8, 7);
  }
};

TEST_P(ColorTripTest, SamePictureSayingWhatItIs) {
  const Trip& t = GetParam();
  const std::string config = "--colorconfig config.ocio ";
  Works(config + t.ours + " -d float -o ours.exr -d uint8 -o ours.png");
  const CommandResult theirs = Oiiotool(config + t.theirs + " -d float -o theirs.exr -d uint8 -o theirs.png");
  ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
  // oiiotool takes OpenColorIO's fast forms, 2^-14 off; a PNG may be off by one code.
  ExpectNear("exr", 1e-3);
  ExpectNear("png", 1.5 / 255);
  const CommandResult verbose = Tessera("-v ours.exr -o again.exr");
  EXPECT_NE(verbose.err.find(std::string(", float, ") + t.space + "\n"), std::string::npos) << verbose.err;
  // oiiotool sees the same: a PNG without a tag counts as sRGB.
  const std::string png = Load("ours.png").spec().get_string_attribute("oiio:ColorSpace");
  EXPECT_EQ(png, *t.oiio == 0 ? "sRGB" : t.oiio);
}

INSTANTIATE_TEST_SUITE_P(Trips, ColorTripTest, ::testing::ValuesIn(kTrips),
                         [](const auto& info) { return std::string(info.param.name); });

class ColorStateLineTest : public CliTest {
 protected:
  void SetUp() override { MakePicture("a.png", 57, 31, 3, OIIO::TypeUInt8); }
  // The lines' results are the same, bit for bit.
  void Same(std::vector<std::string> a, std::vector<std::string> b) {
    for (std::vector<std::string>* line : {&a, &b}) {
      line->insert(line->begin(), "a.png");
      line->insert(line->end(), {"-d", "float", "-o", line == &a ? "x.exr" : "y.exr"});
      const CommandResult result = Tessera(*line);
      ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    const CommandResult diff = Tessera("--fail 0 x.exr y.exr --diff");
    EXPECT_EQ(diff.exit_code, 0) << diff.out;
  }
};

TEST_F(ColorStateLineTest, BuiltInConfig) {
  const std::string view = "ACES 1.0 SDR";
  Same({"--colorconvert", "sRGB", "ACEScg", "--ociodisplay", "sRGB", view},
       {"--colorconvert", "sRGB", "ACEScg", "--ociodisplay:from=ACEScg", "sRGB", view});
  Same({"--ociodisplay", "sRGB", view}, {"--ociodisplay:from=sRGB", "sRGB", view});
  Same({"--curve:inverse=1", "srgb", "--ociodisplay", "sRGB", view},
       {"--curve:inverse=1", "srgb", "--ociodisplay:from=lin_rec709", "sRGB", view});
  Same({"--iscolorspace", "", "--ociodisplay", "sRGB", view}, {"--ociodisplay:from=ACEScg", "sRGB", view});
  Same({"--attrib", "oiio:ColorSpace", "ACEScct", "--tocolorspace", "ACEScg"},
       {"--colorconvert", "ACEScct", "ACEScg"});
  Same({"--colorconvert", "", "ACEScg"}, {"--colorconvert", "sRGB", "ACEScg"});
  // A table baked of a transform starts where the transform does.
  Same({"--ociodisplay:bake=5", "sRGB", "Un-tone-mapped"},
       {"--ociodisplay:bake=5:from=sRGB", "sRGB", "Un-tone-mapped"});
  // Colours that are not premultiplied are not divided.
  Same({"--ch", "R,G,B,A=0.5", "--unpremult", "--colorconvert:unpremult=1", "sRGB", "ACEScg"},
       {"--ch", "R,G,B,A=0.5", "--unpremult", "--colorconvert", "sRGB", "ACEScg"});
  const CommandResult odd = Tessera("a.png --iscolorspace nowhere --tocolorspace ACEScg -o x.exr");
  EXPECT_EQ(odd.exit_code, 2);
  EXPECT_NE(odd.err.find("\"nowhere\", which this config does not have"), std::string::npos) << odd.err;
}

TEST_F(ColorStateLineTest, ProfilesInAndOut) {
  std::string profile(300, '\0');
  profile.replace(36, 4, "acsp").replace(131, 1, "\1").replace(132, 4, "desc");
  profile.replace(139, 1, "\xa0").replace(143, 1, "\x40");
  profile.replace(160, 4, "desc").replace(171, 1, "\xb").replace(172, 10, "Display P3");
  std::ofstream(Path("p3.icc"), std::ios::binary) << profile;
  Works("a.png --iccread p3.icc --mulc 0.5 -o b.tif");
  Works("b.tif --iccwrite again.icc");
  std::ifstream again(Path("again.icc"), std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), profile);
  const CommandResult verbose = Tessera("-v b.tif --iscolorspace sRGB -o c.tif");
  EXPECT_NE(verbose.err.find("uint8, Display P3\n"), std::string::npos) << verbose.err;
  EXPECT_EQ(Load("c.tif").spec().find_attribute("ICCProfile"), nullptr);
  EXPECT_EQ(Tessera("a.png --iccread a.png -o d.tif").exit_code, 1);
  EXPECT_EQ(Tessera("a.png --iccwrite none.icc").exit_code, 1);
}

}  // namespace
}  // namespace tessera::testing
