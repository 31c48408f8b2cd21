// What must not be read: pipes, devices, files without an end, lines without an end; and what messages show
// of it.
#include <sys/stat.h>

#include <fstream>

#include "cli/cli_test.h"

namespace tessera {
namespace {

class DoorsTest : public testing::CliTest {
 protected:
  void Put(const std::string& name, const std::string& text) {
    std::ofstream(Path(name), std::ios::binary) << text;
  }
  // Refused at once, with one short line, and nothing left.
  void Refused(const std::string& line, const std::string& reason) {
    const testing::CommandResult result = Tessera(line + " -o out.exr");
    EXPECT_EQ(result.exit_code, 1) << line << "\n" << result.err.substr(0, 400);
    EXPECT_NE(result.err.find(reason), std::string::npos) << line << "\n" << result.err.substr(0, 400);
    EXPECT_LT(result.err.size(), 3000u) << line;
    EXPECT_FALSE(directory_.Names().contains("out.exr"));
  }
};

TEST_F(DoorsTest, PipesAndDevicesAreNoFiles) {
  Works("--pattern ramp 8x8 3 -o a.exr");
  for (const char* name : {"p.cube", "p.csp", "p.txt", "p.ocio", "p.vdb", "p.raw", "p.obj", "p.exr", "p.icc"})
    ASSERT_EQ(::mkfifo(Path(name).c_str(), 0600), 0);
  for (const char* line :
       {"p.exr", "a.exr --lut p.cube", "a.exr --lut p.csp", "a.exr --lut /dev/zero", "a.exr --table p.txt",
        "a.exr --table /dev/zero", "a.exr --ociofiletransform p.cube", "a.exr --ociofiletransform /dev/zero",
        "a.exr --colorconfig p.ocio --colorconvert a b", "a.exr --colorconfig /dev/zero --colorconvert a b",
        "a.exr --iccread p.icc", "a.exr --iccread /dev/zero", "--volume:file=p.vdb:size=8x8",
        "--volume:file=p.raw:dims=8,8,8:size=8x8", "--volume:file=/dev/zero:size=8x8",
        "--volume:file=/dev/zero:dims=8,8,8:size=8x8", "--volume:mesh=p.obj:size=8x8",
        "--volume:mesh=/dev/zero:size=8x8"}) {
    Refused(line, "found a device, pipe or socket, expected ");
  }
}

TEST_F(DoorsTest, FilesThatAConfigNamesAreLookedAtToo) {
  Works("--pattern ramp 8x8 3 -o a.exr");
  ASSERT_EQ(::mkfifo(Path("p.cube").c_str(), 0600), 0);
  Put("endless.spi1d", "CSPLUTV100\n3D\n\nBEGIN METADATA\nx\n");
  for (const std::string lut : {"p.cube", "endless.spi1d"}) {
    Put("c.ocio",
        "ocio_profile_version: 2\nsearch_path: \".\"\nroles:\n  default: raw\ndisplays:\n  d:\n    - !<View> {name: v, "
        "colorspace: raw}\nactive_displays: []\nactive_views: []\ncolorspaces:\n  - !<ColorSpace>\n    name: raw\n"
        "  - !<ColorSpace>\n    name: other\n    from_scene_reference: !<GroupTransform>\n      children:\n"
        "        - !<FileTransform> {src: " +
            lut + "}\n");
    Refused("a.exr --colorconfig c.ocio --colorconvert raw other",
            lut == "p.cube" ? "found a device, pipe or socket" : "expected END METADATA");
  }
}

TEST_F(DoorsTest, MetadataOfATableEnds) {
  Works("--pattern ramp 8x8 3 -o a.exr");
  // OpenColorIO tries the readers of all formats, whatever the name.
  for (const char* name : {"h.csp", "h.cube", "h.txt", "h.spi3d"}) {
    for (const char* text : {"CSPLUTV100\n3D\n\nBEGIN METADATA\nx\n",
                             "CSPLUTV100\r\n3D\r\n\r\nBEGIN METADATA\r\nEND METADATA x\r\n",
                             " csplutv100\n3D\nBEGIN METADATA\nend metadata\n"}) {
      Put(name, text);
      const testing::CommandResult result = Tessera("a.exr --lut " + std::string(name) + " -o out.exr");
      EXPECT_EQ(result.exit_code, 1) << name << "\n" << result.err;
    }
  }
}

TEST_F(DoorsTest, LinesOfTextHaveAnEnd) {
  Works("--pattern ramp 8x8 3 -o a.exr");
  const std::string word(10 << 20, '7');
  Put("long.cube", "LUT_1D_SIZE 2\n0 0 0\n1 1 " + word + "\n");
  Refused("a.exr --lut long.cube", "line 3: found more than 4096 bytes, expected a shorter line");
  Put("title.cube", word);
  Refused("a.exr --lut title.cube", "line 1: found more than");
  Put("long.3dl", word + "x");
  Refused("a.exr --lut long.3dl", "line 1: found more than");
  Put("long.txt", "1\n" + word);
  Refused("a.exr --table long.txt", "line 2: found more than");
  Put("long.obj", "v 0 0 0\n" + word);
  Refused("--volume:mesh=long.obj:size=8x8", "line 2: found more than");
  Put("long.clf", "<?xml version=\"1.0\"?><ProcessList id=\"" + word + "\">");
  Refused("a.exr --lut long.clf", "CLF parsing error");
}

TEST_F(DoorsTest, MessagesDoNotReachTheTerminalsControls) {
  const testing::CommandResult result =
      Tessera(std::vector<std::string>{"\x1b[31m\xc2\x9b"
                                       "2J\x9b\x7f\xe2\x82\xac\xff.exr",
                                       "-o", "out.exr"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("\\x1b[31m\\x9b2J\\x9b\\x7f\xe2\x82\xac\\xff.exr"), std::string::npos)
      << result.err;
}

}  // namespace
}  // namespace tessera
