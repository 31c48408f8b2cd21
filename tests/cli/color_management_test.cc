// The colour-management commands give oiiotool's picture; --colorconfig, bake= and its report, refusals.
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "cli/cli_test.h"
#include "ocio/lut_files.h"

namespace tessera::testing {
namespace {

using ::testing::HasSubstr;

constexpr char kConfig[] = R"(ocio_profile_version: 2
search_path: .
strictparsing: true
roles: {default: raw, scene_linear: lin}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
looks:
  - !<Look> {name: warm, process_space: lin, transform: !<CDLTransform> {slope: [1.2, 1, 0.8], offset: [0.01, 0, -0.01], sat: 1.15}}
displays:
  monitor:
    - !<View> {name: film, colorspace: video, looks: warm}
    - !<View> {name: plain, colorspace: video}
colorspaces:
  - !<ColorSpace> {name: raw, isdata: true}
  - !<ColorSpace> {name: lin}
  - !<ColorSpace> {name: video, from_scene_reference: !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], direction: inverse}}
  - !<ColorSpace> {name: cube, from_scene_reference: !<FileTransform> {src: a.spi3d, interpolation: tetrahedral}}
)";

class ColorManagementTest : public CliTest {
 protected:
  void SetUp() override {
    std::ofstream(Path("config.ocio")) << kConfig;
    for (const LutFile& file : AllLutFiles()) {
      if (file.name == "a.spi3d" || file.name == "resolve.cube") {
        std::ofstream(Path(file.name), std::ios::binary) << file.bytes;
      }
    }
    MakePicture("p.tif", 201, 103, 4, OIIO::TypeUInt8);
    MakePicture("p.exr", 201, 103, 4, OIIO::TypeFloat);
  }
};

TEST_F(ColorManagementTest, AgreesWithOiiotool) {
  for (const std::string command :
       {"--colorconvert lin video", "--colorconvert:unpremult=1 video lin", "--colorconvert lin cube",
        "--ociolook:from=lin:to=video warm", "--ociolook:from=lin:to=lin:inverse=1 warm",
        "--ociodisplay:from=lin monitor film", "--ociodisplay:from=lin monitor plain",
        "--ociofiletransform a.spi3d", "--ociofiletransform resolve.cube"}) {
    SCOPED_TRACE(command);
    for (const auto& [extension, type, limit] :
         std::vector<std::array<std::string, 3>>{{"tif", "uint8", "0.00393"}, {"exr", "float", "3e-4"}}) {
      if (type == "uint8" && !command.starts_with("--colorconvert")) continue;
      const std::string line =
          "--colorconfig config.ocio p." + extension + " " + command + " -d " + type + " -o ";
      Works(line + "ours." + extension);
      const CommandResult theirs = Oiiotool(line + "theirs." + extension);
      ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
      const CommandResult diff =
          Oiiotool("--fail " + limit + " --warn 1e9 ours." + extension + " theirs." + extension + " --diff");
      EXPECT_EQ(diff.exit_code, 0) << line << "\n" << diff.out << diff.err;
    }
  }
}

// OpenImageIO 2.4's oiiotool takes no notice of looks= here.
TEST_F(ColorManagementTest, LooksInPlaceOfTheViewsOwn) {
  const std::string config = "--colorconfig config.ocio p.exr ";
  Works(config + "--ociolook:from=lin:to=video warm -o warm.exr");
  Works(config + "--ociolook:from=lin:to=video -warm -o cold.exr");
  for (const std::string view : {"plain", "film"}) {
    const std::string display = "--ociodisplay:from=lin:looks=", monitor = " monitor " + view + " ";
    Works(config + display + "warm" + monitor + "-o a.exr " + config + display + "-warm" + monitor +
          "-o b.exr");
    EXPECT_EQ(Oiiotool("--fail 1e-5 a.exr warm.exr --diff").exit_code, 0);
    EXPECT_EQ(Oiiotool("--fail 1e-5 b.exr cold.exr --diff").exit_code, 0);
    Works(config + display + "warm" + monitor + display + "warm:inverse=1" + monitor + "-o c.exr");
    EXPECT_EQ(Oiiotool("--fail 1e-3 c.exr p.exr --diff").exit_code, 0);
  }
  const CommandResult unknown = Tessera(config + "--ociodisplay:from=lin:looks=cool monitor plain -o x.exr");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("cool"));
}

TEST_F(ColorManagementTest, OneAndTwoChannels) {
  MakePicture("grey.exr", 57, 31, 1, OIIO::TypeFloat);
  Works("p.exr --ch R,G -o two.exr");
  for (const std::string command : {"--colorconvert lin video", "--colorconvert lin cube",
                                    "--ociolook:from=lin:to=lin warm", "--ociofiletransform a.spi3d"}) {
    for (const char* const file : {"grey.exr ", "two.exr "}) {
      const std::string line = std::string("--colorconfig config.ocio ") + file + command + " -o ";
      Works(line + "ours.exr");
      ASSERT_EQ(Oiiotool(line + "theirs.exr").exit_code, 0);
      const CommandResult diff = Oiiotool("--fail 3e-4 --warn 1e9 ours.exr theirs.exr --diff");
      EXPECT_EQ(diff.exit_code, 0) << line << "\n" << diff.out << diff.err;
    }
  }
  // Alpha beside a grey is alpha, which oiiotool takes for green.
  Works("p.exr --ch Y=R,A -o grey_alpha.exr");
  Works("p.exr --ch R=R,G=R,B=R,A -o color.exr");
  for (const std::string command :
       {"--lut a.spi3d", "--lut:bake=17 a.spi3d", "--colorconvert:unpremult=1 linear sRGB"}) {
    Works("grey_alpha.exr " + command + " -o a.exr color.exr " + command + " -o b.exr");
    for (const int x : {3, 100, 200}) {
      EXPECT_EQ(Sample("a.exr", x, 50, 0), Sample("b.exr", x, 50, 0)) << command;
      EXPECT_EQ(Sample("a.exr", x, 50, 1), Sample("p.exr", x, 50, 3)) << command;
    }
    EXPECT_EQ(Load("a.exr").spec().channelnames, (std::vector<std::string>{"Y", "A"}));
  }
}

TEST_F(ColorManagementTest, EmptyNamesAreTheConfigsDefaults) {
  Works("--colorconfig config.ocio p.exr --ociodisplay:from=lin monitor film -o film.exr");
  const CommandResult result = Tessera(
      {"--colorconfig", "config.ocio", "p.exr", "--ociodisplay:from=lin", "", "", "-o", "default.exr"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Sample("default.exr", 50, 60, 1), Sample("film.exr", 50, 60, 1));
}

TEST_F(ColorManagementTest, LutFilesNeedNoConfig) {
  Works("p.exr --lut a.spi3d -o a.exr");
  Works("--colorconfig config.ocio p.exr --ociofiletransform a.spi3d -o b.exr");
  EXPECT_EQ(Sample("a.exr", 50, 60, 1), Sample("b.exr", 50, 60, 1));
  Works("p.exr --lut:interp=linear a.spi3d -o c.exr");
  EXPECT_NE(Tessera("a.exr c.exr --diff").out.find("FAIL"), std::string::npos) << "interp= changed nothing";
}

TEST_F(ColorManagementTest, BakingTellsItsError) {
  const std::string out = Works("p.exr --ociodisplay:from=linear:bake=33 sRGB Un-tone-mapped -o a.exr");
  EXPECT_THAT(out, HasSubstr("bake 33: domain ["));
  EXPECT_THAT(out, HasSubstr("max error "));
  EXPECT_THAT(out, HasSubstr("RMS error "));
  EXPECT_THAT(out, HasSubstr("largest CIEDE2000 "));
  EXPECT_EQ(Works("p.exr --ociodisplay:from=linear sRGB Un-tone-mapped -o a.exr"), "");
}

TEST_F(ColorManagementTest, Refusals) {
  const auto refusal = [&](const std::string& line, int code) {
    const CommandResult result = Tessera(line + " -o out.exr");
    EXPECT_EQ(result.exit_code, code) << line;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  EXPECT_THAT(refusal("--colorconfig config.ocio p.exr --colorconvert lin vidoe", 1),
              AllOf(HasSubstr("config.ocio"), HasSubstr("did you mean \"video\"?")));
  EXPECT_THAT(refusal("--colorconfig built-in p.exr --ociolook warm", 1),
              HasSubstr("found no look \"warm\" in this config, which has none"));
  EXPECT_THAT(refusal("--colorconfig missing.ocio p.exr --colorconvert lin video", 1),
              HasSubstr("missing.ocio"));
  EXPECT_THAT(refusal("p.exr --lut missing.cube", 1), HasSubstr("missing.cube"));
  EXPECT_THAT(refusal("p.exr --lut:interp=tetra a.spi3d", 2), HasSubstr("did you mean tetrahedral?"));
  EXPECT_THAT(refusal("p.exr --lut:bake=500 a.spi3d", 2), HasSubstr("bake"));
  EXPECT_THAT(refusal("p.exr --colorconfig config.ocio --mulc 2", 2), HasSubstr(":config="));
  EXPECT_THAT(refusal("p.exr --colorconvert:key=A,B:value=1 linear sRGB", 2),
              HasSubstr("2 keys and 1 values"));
}

}  // namespace
}  // namespace tessera::testing
