// Compositing on the command line: oiiotool's pictures of --over and --zover, the other commands at work.
#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class CompositingTest : public CliTest {
 protected:
  // Both programs do the line; equal within `limit`, windows too.
  void Compare(const std::string& line, const std::string& extension, const std::string& type,
               const std::string& limit) {
    Works(line + " -d " + type + " -o ours." + extension);
    const CommandResult theirs = Oiiotool(line + " -d " + type + " -o theirs." + extension);
    ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
    const CommandResult diff =
        Oiiotool("--fail " + limit + " --warn 1e9 ours." + extension + " theirs." + extension + " --diff");
    EXPECT_EQ(diff.exit_code, 0) << line << "\n" << diff.out << diff.err;
    const OIIO::ImageBuf a = Load("ours." + extension), b = Load("theirs." + extension);
    EXPECT_EQ(a.roi(), b.roi());
    EXPECT_EQ(a.roi_full(), b.roi_full());
  }
};

TEST_F(CompositingTest, OverIsOiiotools) {
  for (const char* name : {"p", "q"}) {
    MakePicture(std::string(name) + ".tif", 301, 173, 4, OIIO::TypeUInt8, name[0]);
    MakePicture(std::string(name) + ".exr", 301, 173, 4, OIIO::TypeFloat, name[0]);
  }
  Compare("p.tif q.tif --over", "tif", "uint8", "0");
  Compare("p.exr q.exr --over", "exr", "float", "1e-6");
  Compare("p.exr --crop 90x60+17+11 q.exr --crop 100x90+50+40 --over", "exr", "float", "1e-6");
}

TEST_F(CompositingTest, ZOverIsOiiotools) {
  for (const char* name : {"p", "q"}) {
    MakePicture("rgba.exr", 301, 173, 4, OIIO::TypeFloat, name[0]);
    MakePicture("z.exr", 301, 173, 1, OIIO::TypeFloat, name[0] + 7);
    // Depths of both signs of the comparison, and zeros.
    const std::string depth =
        std::string("z.exr --subc ") + (name[0] == 'p' ? "0.4" : "0.5") + " --clamp:min=0";
    const CommandResult made =
        Oiiotool("rgba.exr " + depth + " --chappend --chnames R,G,B,A,Z -o " + name + ".exr");
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Compare("p.exr q.exr --zover", "exr", "float", "1e-6");
  Compare("p.exr q.exr --zover:zeroisinf=1", "exr", "float", "1e-6");
  Compare("p.exr q.exr --over", "exr", "float", "1e-6");
  Compare("p.exr --crop 90x60+17+11 q.exr --crop 100x90+50+40 --zover", "exr", "float", "1e-6");
}

TEST_F(CompositingTest, EveryCommandWorks) {
  MakePicture("p.exr", 64, 48, 4, OIIO::TypeFloat, 1);
  MakePicture("q.exr", 64, 48, 4, OIIO::TypeFloat, 2);
  Works("p.exr --alphatest:ref=0.5 greater -o test.exr q.exr --dissolve 0 -o zero.exr");
  EXPECT_EQ(Sample("test.exr", 0, 0, 1), 0);
  EXPECT_EQ(Sample("zero.exr", 60, 5, 1), Sample("p.exr", 60, 5, 1));
  Works("p.exr q.exr --dissolve:pattern=ordered 1 -o one.exr");
  EXPECT_EQ(Sample("one.exr", 5, 5, 1), Sample("q.exr", 5, 5, 1));
  Works(
      "p.exr q.exr --blend soft-light q.exr --blend:src=src-alpha:dst=one-minus-src-alpha add q.exr "
      "--pattern thresholds:pattern=ordered 64x48 1 --dissolve:pattern=image 0.5 q.exr --pattern "
      "airbrush:stroke=5,5,40,30 64x48 1 --reveal -o masks.exr q.exr p.exr --stencil:ref=128:mask=128 equal "
      "q.exr --depthtest:depth=B less q.exr p.exr --zcomposite:n=3:depth=2:mode=over q.exr --decals "
      "--pattern puffs:x=32:y=40:velocity=2,-20 64x48 4 --over -o merged.exr "
      "--edges:depthchannel=A:depth=0.1 --outline:kind=outer q.exr --halo:radius=2 "
      "--stencil:update=1:pass=incr always -o lines.exr");
  Works("p.exr q.exr --depthcomplexity:depth=G:far=0.5 -o count.exr");
  const CommandResult refused = Tessera("p.exr q.exr --blend soft-lite -o a.exr");
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("soft-light"), std::string::npos) << refused.err;
  const CommandResult no_depth = Tessera("p.exr q.exr --zover -o a.exr");
  EXPECT_EQ(no_depth.exit_code, 1);
  EXPECT_NE(no_depth.err.find("depth channel"), std::string::npos) << no_depth.err;
}

}  // namespace
}  // namespace tessera::testing
