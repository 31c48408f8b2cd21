// Resampling and accumulation from the command line: oiiotool's pictures, frames, images in any number.
#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class ResampleTest : public CliTest {
 protected:
  // Both programs do `command` on the pictures; oiiotool judges with the tolerance of the comparison.
  void ExpectAgreement(const std::string& command, const std::string& images = "a.exr ") {
    SCOPED_TRACE(command);
    // New names each time: OpenImageIO remembers what it has read.
    const std::string n = std::to_string(++compared_) + ".exr", ours = "ours" + n, their = "theirs" + n;
    Works(images + command + " -d float -o " + ours);
    const CommandResult theirs = Oiiotool(images + command + " -d float -o " + their);
    ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
    const CommandResult diff =
        Oiiotool("--fail 0.004 --failpercent 1 --warn 1e9 " + ours + " " + their + " --diff");
    EXPECT_EQ(diff.exit_code, 0) << diff.out;
    EXPECT_EQ(Load(ours).roi(), Load(their).roi());
    EXPECT_EQ(Load(ours).roi_full(), Load(their).roi_full());
  }

  int compared_ = 0;
};

TEST_F(ResampleTest, ResizeAndWarpAgreeWithOiiotool) {
  MakePicture("a.exr", 151, 113, 3, OIIO::TypeHalf);
  for (const std::string filter : {"box", "triangle", "catmull-rom", "blackman-harris", "sinc", "mitchell"}) {
    ExpectAgreement("--resize:filter=" + filter + " 75x61");
    // oiiotool's sinc keeps the result's pixels as its unit when enlarging.
    if (filter != "sinc") ExpectAgreement("--resize:filter=" + filter + " 191x261");
  }
  ExpectAgreement("--resize 50%");
  ExpectAgreement("--resize 300x0");
  ExpectAgreement("--resize 151x113");
  ExpectAgreement("--warp 0.9,0.3,0,-0.3,0.9,0,20,-10,1");
  ExpectAgreement("--warp:filter=triangle 1.4,0.1,0.0003,-0.2,1.3,0.0005,-20,-10,1");
  ExpectAgreement("--warp:filter=mitchell 0.4,0.1,0,-0.1,0.5,0,20,10,1");
}

TEST_F(ResampleTest, ResizeKeepsTheOriginOfTheDisplayWindow) {
  const std::string picture = "--pattern fill:top=0,0,0:bottom=1,.5,.2 ";
  ASSERT_EQ(Oiiotool(picture + "100x80-5+7 3 --fullsize 100x80-5+7 -o a.exr").exit_code, 0);
  ExpectAgreement("--resize 50%");
  ExpectAgreement("--resize 0x33");
  ExpectAgreement("--resize 70x77+3-4");
  // The data window within the display window: black beyond it. Around it the windows are the same, but there
  // oiiotool sees the display window's edge.
  ASSERT_EQ(Oiiotool(picture + "30x20+40+50 3 --fullsize 200x160+30+40 -o b.exr").exit_code, 0);
  ASSERT_EQ(Oiiotool(picture + "120x90-10-3 3 --fullsize 100x80+0+0 -o c.exr").exit_code, 0);
  for (const char* const size : {"50%", "50x40+3-4", "0x40", "33%", "70x77", "300x170"})
    ExpectAgreement("--resize " + std::string(size), "b.exr ");
  int count = 0;
  for (const std::string size : {"50%", "50x40+3-4", "0x40", "33%", "70x77"}) {
    SCOPED_TRACE(size);
    const std::string n = std::to_string(++count) + ".exr";
    Works("c.exr --resize " + size + " -o ours_w" + n);
    ASSERT_EQ(Oiiotool("c.exr --resize " + size + " -o theirs_w" + n).exit_code, 0);
    EXPECT_EQ(Load("ours_w" + n).roi(), Load("theirs_w" + n).roi());
    EXPECT_EQ(Load("ours_w" + n).roi_full(), Load("theirs_w" + n).roi_full());
  }
}

TEST_F(ResampleTest, FiltersSeeBlackInTheRestOfTheDisplayWindow) {
  for (const char* const window : {"44x40+30+50", "44x40+0+20", "100x30+0+70"}) {
    SCOPED_TRACE(window);
    const std::string file = "part" + std::to_string(compared_) + ".exr";
    ASSERT_EQ(Oiiotool("--pattern noise:type=uniform " + std::string(window) +
                       " 3 --fullsize 100x100+0+0 -o " + file)
                  .exit_code,
              0);
    for (const char* const command : {"--blur 9x9", "--blur:kernel=box 15x3", "--kernel disk 5x7 --convolve",
                                      "--unsharp", "--laplacian", "--median 5x5", "--dilate 3x3"}) {
      ExpectAgreement(command, file + " ");
    }
  }
}

TEST_F(ResampleTest, HighlightsAreCompressedAsOiiotoolDoes) {
  MakePicture("n.exr", 97, 61, 4, OIIO::TypeHalf);
  ASSERT_EQ(Oiiotool("n.exr --powc 8,8,8,1 --mulc 4,3,2,1 --subc .1,.1,.1,0 -d float -o a.exr").exit_code, 0);
  ExpectAgreement("--resize:highlightcomp=1:filter=lanczos3 150x90");
  ExpectAgreement("--resize:highlightcomp=1 50%");
  ExpectAgreement("--warp:highlightcomp=1 0.9,0.3,0,-0.3,0.9,0,2,-4,1");
}

TEST_F(ResampleTest, WarpsListTheFiltersThatTheyHave) {
  MakePicture("a.exr", 8, 6, 3, OIIO::TypeHalf);
  for (const std::string command : {"warp", "shift", "st_warp", "distort"}) {
    const std::string help = Works("--help " + command);
    EXPECT_NE(help.find("mitchell"), std::string::npos) << command;
    EXPECT_EQ(help.find("disk"), std::string::npos) << command;
  }
  EXPECT_EQ(Tessera("a.exr --warp:filter=disk 1,0,0,0,1,0,0.5,0,1 -o b.exr").exit_code, 2);
  Works("a.exr --resize:filter=disk 5x5 -o b.exr");
}

TEST_F(ResampleTest, SumsOfAnyNumberOfImages) {
  std::string images;
  for (int k = 1; k <= 5; ++k) images += "--pattern constant:color=0." + std::to_string(k) + " 4x3 3 ";
  Works(images + "--accum 1,0,0,-1,10 -d float -o sum.tif");
  EXPECT_NEAR(Sample("sum.tif", 1, 1, 0), 0.1 - 0.4 + 5.0, 1e-6);
  Works(images + "--average 4 -d float -o mean.tif --pop -o first.tif");
  EXPECT_NEAR(Sample("mean.tif", 1, 1, 0), 0.35, 1e-6);
  EXPECT_NEAR(Sample("first.tif", 0, 0, 0), 0.1, 1e-6);
  const CommandResult few = Tessera(images + "--average 6 -o mean.tif");
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_NE(few.err.find("6 images"), std::string::npos) << few.err;
  EXPECT_NE(Works("--help accum").find("as many images"), std::string::npos);
}

TEST_F(ResampleTest, MotionBlurReadsFrames) {
  for (int k = 1; k <= 6; ++k) {
    Works("--pattern constant:color=0." + std::to_string(k) + " 4x3 3 -d float -o f.000" + std::to_string(k) +
          ".tif");
  }
  Works("--motionblur:frames=1-4 f.#.tif -d float -o blur.tif");
  EXPECT_NEAR(Sample("blur.tif", 0, 0, 0), 0.25, 1e-6);
  Works("--motionblur f.1-3#.tif -d float -o range.tif");
  EXPECT_NEAR(Sample("range.tif", 0, 0, 0), 0.2, 1e-6);
  Works("--motionblur:frames=1-3:weights=0.5,0.25,2 f.#.tif -d float -o weights.tif");
  EXPECT_NEAR(Sample("weights.tif", 0, 0, 0), 0.05 + 0.05 + 0.6, 1e-6);
  Works("--motionblur:frames=1-3:shutter=tent f.#.tif -d float -o tent.tif");
  EXPECT_NEAR(Sample("tent.tif", 0, 0, 0), 0.2, 1e-6);
  // Output frame F from sub-frames 2 F - 1 and 2 F.
  Works("--frames 1-3 --motionblur:window=-1,0:step=2 f.#.tif -d float -o half.#.tif");
  EXPECT_NEAR(Sample("half.0003.tif", 0, 0, 0), 0.55, 1e-6);
  const CommandResult missing = Tessera("--motionblur:frames=5-8 f.#.tif -o blur.tif");
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("f.0007.tif"), std::string::npos) << missing.err;
  const CommandResult few = Tessera("--motionblur:frames=1-2:weights=1 f.#.tif -o blur.tif");
  EXPECT_NE(few.exit_code, 0);
  EXPECT_NE(few.err.find("--motionblur:weights: found 1 weights, expected 2"), std::string::npos) << few.err;
  EXPECT_NE(Tessera("--motionblur f.#.tif -o blur.tif").exit_code, 0);
}

TEST_F(ResampleTest, DepthOfFieldAndMipsOnFiles) {
  MakePicture("a.exr", 60, 40, 4, OIIO::TypeHalf);
  Works("--pattern ramp 60x40 1 --mulc 4 -d float -o z.exr");
  EXPECT_NE(Works("--verify a.exr z.exr --dof:aperture=3:max=5 2 -d float -o dof.exr").find("within bound"),
            std::string::npos);
  Works("a.exr --mip:filter=lanczos3 -o mip.exr");
  EXPECT_EQ(Load("mip.exr").roi(), OIIO::ROI(0, 90, 0, 40, 0, 1, 0, 4));
  Works("a.exr --mip:level=2 -o two.exr");
  EXPECT_EQ(Load("two.exr").roi(), OIIO::ROI(0, 15, 0, 10, 0, 1, 0, 4));
}

TEST_F(ResampleTest, ThumbnailsFitTheirBox) {
  MakePicture("a.jpg", 803, 601, 3, OIIO::TypeUInt8);
  MakePicture("a.tif", 803, 601, 3, OIIO::TypeUInt8);
  const auto size = [&](const std::string& box, const std::string& file) {
    Works("-i:thumbnail=" + box + " " + file + " -o t.tif");
    const OIIO::ROI roi = Load("t.tif").roi();
    return std::to_string(roi.width()) + "x" + std::to_string(roi.height());
  };
  EXPECT_EQ(size("100x100", "a.jpg"), "100x75");
  EXPECT_EQ(size("1000x60", "a.jpg"), "80x60");
  EXPECT_EQ(size("5x1", "a.jpg"), "1x1");
  EXPECT_EQ(size("803x601", "a.jpg"), "803x601");
  EXPECT_EQ(size("2000x2000", "a.jpg"), "803x601");  // never larger
  Works("a.jpg -o whole.tif");
  Works("t.tif whole.tif --fail 0 --diff");
  // Another format's pixels are those of --resize; a JPEG's are near them.
  EXPECT_EQ(size("100x100", "a.tif"), "100x75");
  Works("a.tif --resize 100x75 -o resized.tif");
  Works("t.tif resized.tif --fail 0 --diff");
  Works("a.jpg --resize 100x75 -o resized.tif");
  EXPECT_EQ(size("100x100", "a.jpg"), "100x75");
  EXPECT_EQ(Tessera("-q t.tif resized.tif --fail 0 --diff").exit_code, 1);
  Works("t.tif resized.tif --fail 0.02 --failpercent 3 --hardfail 0.1 --diff");

  Works("--codec oiio -i:thumbnail=100x100 a.jpg -o t.tif");
  Works("t.tif resized.tif --fail 0 --diff");

  EXPECT_NE(
      Works("-i:thumbnail=100x100 a.jpg --runstats -o t.tif").find("a.jpg decoded by the codec jpeg at 1/4"),
      std::string::npos);
  EXPECT_EQ(size("100", "a.jpg"), "100x75");
  // The command: the same pixels behind the name, those of --resize behind something else; upright.
  Works("a.jpg --thumbnail 100 -o u.tif");
  Works("t.tif u.tif --fail 0 --diff");
  Works("a.jpg --addc 0 --thumbnail 100x100 -o u.tif");
  Works("resized.tif u.tif --fail 0 --diff");
  Works("a.jpg --thumbnail 2000 -o u.tif");
  Works("whole.tif u.tif --fail 0 --diff");
  Works("a.jpg --orientation 6 -o turned.jpg");
  Works("-i:thumbnail=400x50 turned.jpg --reorient -o t.tif");  // 67x50 as it lies in the file
  Works("turned.jpg --thumbnail 50x400 -o u.tif");
  Works("t.tif u.tif --fail 0 --diff");
  EXPECT_EQ(Load("u.tif").spec().height, 67);
  EXPECT_EQ(Tessera("a.jpg --thumbnail 10% -o x.tif").exit_code, 2);
  for (const char* box : {"x100", "100x", "0x100", "-5x100", "100x100+5+5", "50%", ""}) {
    const CommandResult wrong = Tessera("-i:thumbnail=" + std::string(box) + " a.jpg -o x.tif");
    EXPECT_EQ(wrong.exit_code, 2) << box;
    EXPECT_NE(wrong.err.find("expected WxH"), std::string::npos) << wrong.err;
  }
}

}  // namespace
}  // namespace tessera::testing
