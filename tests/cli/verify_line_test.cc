// --verify on lines: right pictures pass, every output and frame is looked at, and the line says how.
#include <algorithm>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class VerifyLineTest : public CliTest {
 protected:
  void SetUp() override { MakePicture("a.exr", 200, 150, 4, OIIO::TypeFloat); }
};

TEST_F(VerifyLineTest, RightPicturesPass) {
  Works("--pattern clouds 320x200 3 -d uint8 -o c8.png");
  Works("--pattern perlin:freq=5 320x200 1 --mulc 30 -d half -o z.exr");
  Works("--pattern checker:color1=0,0,0:color2=1,1,1:width=160:height=400 320x200 3 -d float -o edge.exr");
  Works("a.exr --ch R,G,B -o rgb.exr");
  Works("--pattern constant:color=0.45,0.3,0.7 64x48 3 -d uint8 -o flat8.png");
  Works("--pattern white:seed=4 224x373 4 -d uint16 -o white16.tif");
  const char* lines[] = {
      // A surface holds its places, and normals of noise change across them within a voxel.
      "white16.tif --volume:aovs=1 --verify -o out.exr",
      // Square roots of differences that are almost nothing.
      "c8.png --sobel --verify -o out.exr",
      "c8.png --sobel --verify -d uint8 -o out.png",
      // Circles of confusion.
      "c8.png z.exr --dof:aperture=90:max=24 11 --verify -o out.exr",
      // What a Gaussian leaves far from an edge.
      "edge.exr --blur:sigma=20 --verify -d float -o out.exr",
      "edge.exr --blur:sigma=20:method=recursive --verify -d float -o out.exr",
      "edge.exr --blur:sigma=4 --verify -d float -o out.exr",
      // Decisions within an error.
      "c8.png --mulc 0.9 --quantize 4 --blur 3x3 --verify -d float -o out.exr",
      "c8.png --mulc 0.7 c8.png --absdiff --alphatest:ref=0.1 greater --verify -d float -o out.exr",
      // What was computed from codes is no code, however near.
      "flat8.png --addc 1.4e-5 --blur 3x3 --verify -d float -o out.exr",
      "flat8.png --addc 1.4e-5 --blur 21x21 --verify -d float -o out.exr",
      "flat8.png --addc 1.4e-5 --blur:sigma=1.2 --verify -d float -o out.exr",
      "flat8.png --addc 1.4e-5 --unsharp --verify -d float -o out.exr",
      // Zeros have either sign; what is 0 but for roundings.
      "flat8.png --normalmap:pack=0 --powc -1 --verify -d float -o out.exr",
      "--pattern constant:color=0.2,0.4,0.6,0.8 32x32 4 --mulc 0.7 --laplacian:method=fft --repremult --verify -d float -o out.exr",
      "flat8.png --mulc 0.7 --laplacian:method=fft --normals --verify -d float -o out.exr",
      // A block of four colours, none of which is alpha.
      "--pattern constant:color=0.2,0.4,0.6 8x8 3 --cmyk --dup --dup --solid --verify -d float -o out.exr",
      // A mean of values that hang on decisions.
      "--pattern perlin:gradient=1:dims=3:turbulence=1 192x1 4 --contrast -1 --verify -d float -o out.exr",
      // More channels than a table has; rings that are counted in floats.
      "--pattern checker 16x16 5 --dup --lookup:filter=mipmap --verify -d float -o out.exr",
      "--pattern ripples:freq=1e4 64x64 3 --verify -d float -o out.exr",
      // Curves that are steep at 0.
      "a.exr --mulc 0.7 --curve pq --verify -d float -o out.exr",
      "rgb.exr --mulc 0.7 --curve gamma --verify -d float -o out.exr",
      // OpenColorIO's own processor.
      "rgb.exr --mulc 3 --ociodisplay:from=ACEScg sRGB ACES_1.0_SDR --verify -d float -o out.exr",
      // Formats that round again, divide by alpha or keep something else.
      "a.exr --mulc 0.9 -d uint8 --verify -o out.png",
      "a.exr --mulc 0.9 -d uint16 --verify -o out.png",
      "rgb.exr --mulc 0.9 -d uint8 --verify -o out.jpg",
      "rgb.exr --mulc 0.9 -d uint16 --attrib oiio:BitsPerSample 10 --verify -o out.dpx",
      "a.exr --attrib compression dwaa --mulc 0.9 -d half --verify -o out.exr",
      // Windows of their own.
      "a.exr --crop 91x53+17+9 --resize 60x40 -d half --verify -o out.exr",
      "a.exr --crop 91x53+17+9 -d uint8 --verify -o out.png",
  };
  for (std::string line : lines) {
    std::vector<std::string> words = Words(line);
    for (std::string& word : words)
      std::replace(word.begin(), word.end(), '_', word.rfind("ACES", 0) == 0 ? ' ' : '_');
    const CommandResult result = Tessera(words);
    EXPECT_EQ(result.exit_code, 0) << line << "\n" << result.err;
    EXPECT_NE(result.out.find("within bound"), std::string::npos) << line << "\n" << result.out;
    EXPECT_NE(result.out.find("% of the pixels"), std::string::npos) << line << "\n" << result.out;
  }
}

TEST_F(VerifyLineTest, EveryOutputOfEveryFrameIsLookedAt) {
  const std::string out = Works(
      "--frames 1-3 --verify a.exr --mulc {FRAME_NUMBER/4} -d uint8 -o one.#.png --blur 3x3 -d half -o two.#.exr");
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 6) << out;
  for (const char* name : {"one.0001.png", "two.0001.exr", "one.0003.png", "two.0003.exr"}) {
    EXPECT_NE(out.find("verify " + std::string(name) + ": max error "), std::string::npos) << out;
  }
}

TEST_F(VerifyLineTest, AnInputMayBeTheOutput) {
  Works("a.exr --mulc 0.5 --verify -o a.exr");
  EXPECT_LT(std::fabs(Sample("a.exr", 3, 3, 3)), 0.5f);
}

// A format whose writer loses samples is found: OpenImageIO's RLA writer drops the ends of some rows.
TEST_F(VerifyLineTest, WhatAFormatLosesIsFoundAndNotWritten) {
  Works(
      "--pattern perlin:freq=6 150x90 4 --addc 0.1,0.2,-0.1,0 --clamp:min=0:max=1 --ch R,G,B --mulc 0.9 -d uint8 "
      "-o right.tif");
  Works("right.tif -d uint8 -o plain.rla");
  const bool kept = Oiiotool("--fail 0 right.tif plain.rla --diff").exit_code == 0;
  const CommandResult result = Tessera("right.tif -d uint8 --verify -o out.rla");
  EXPECT_EQ(result.exit_code, kept ? 0 : 1) << result.out << result.err;
  EXPECT_EQ(std::filesystem::exists(Path("out.rla")), kept);
  EXPECT_EQ(result.err.find("out.rla: what was stored is not within its bound") == std::string::npos, kept);
}

}  // namespace
}  // namespace tessera::testing
