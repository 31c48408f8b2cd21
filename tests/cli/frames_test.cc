// Frame sequences: patterns, ranges, padding, bad frames.
#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class FramesTest : public CliTest {
 protected:
  // in.0001.png to in.0003.png; frame N holds N/10.
  void SetUp() override {
    for (int f = 1; f <= 3; ++f) {
      Works("--pattern constant:color=0." + std::to_string(f) + " 4x4 1 -o in.000" + std::to_string(f) +
            ".tif");
    }
  }
};

TEST_F(FramesTest, EveryFrameRunsTheLine) {
  Works("--frames 1-3 in.#.tif --mulc 2 -o out.#.tif");
  EXPECT_EQ(Sample("out.0001.tif", 0, 0, 0), 0.2f);
  EXPECT_EQ(Sample("out.0003.tif", 0, 0, 0), 0.6f);
}

TEST_F(FramesTest, ThePatternTellsTheDigits) {
  Works("--frames 1-3x2 in.%04d.tif -o a.%02d.tif");
  Works("--frames 2 in.#.tif -o b.@@@.tif");
  Works("--frames 1-3y2 --framepadding 4 in.@.tif -o c.@.tif");
  const std::set<std::string> names = directory_.Names();
  for (const char* name : {"a.01.tif", "a.03.tif", "b.002.tif", "c.0002.tif"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_EQ(names.size(), 3u + 4u);
}

TEST_F(FramesTest, FilesPresentAndRangesInNamesDecideWithoutTheOption) {
  Works("in.#.tif -o all.#.tif");
  Works("in.1-2#.tif -o moved.11-12#.tif");
  const std::set<std::string> names = directory_.Names();
  for (const char* name :
       {"all.0001.tif", "all.0002.tif", "all.0003.tif", "moved.0011.tif", "moved.0012.tif"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  EXPECT_EQ(names.size(), 3u + 5u);
  EXPECT_EQ(Sample("moved.0012.tif", 0, 0, 0), 0.2f);
}

TEST_F(FramesTest, FramesAreIndependent) {
  Works("--frames 1-3 in.#.tif --invert -o whole.#.tif");
  Works("--frames 2 in.#.tif --invert -o part.#.tif");
  EXPECT_EQ(Oiiotool("--fail 0 whole.0002.tif part.0002.tif --diff").exit_code, 0);
}

TEST_F(FramesTest, TheFrameNumberEntersAnyArgument) {
  Works("--frames 1-3 in.#.tif --mulc {FRAME_NUMBER*2-1},1 -o odd.#.tif");
  EXPECT_FLOAT_EQ(Sample("odd.0003.tif", 0, 0, 0), 1.5f);
  Works("--frames 8,12 --pattern perlin:offset={-(FRAME_NUMBER-4)/8} 4x4 1 -o moved.#.tif");
  Works("--pattern perlin:offset=-0.5 4x4 1 -o half.tif --pattern perlin:offset=-1 4x4 1 -o one.tif");
  EXPECT_EQ(Oiiotool("--fail 0 moved.0008.tif half.tif --diff").exit_code, 0);
  EXPECT_EQ(Oiiotool("--fail 0 moved.0012.tif one.tif --diff").exit_code, 0);
  EXPECT_NE(Oiiotool("--info -v odd.0002.tif").out.find("--mulc 3,1"), std::string::npos);
  for (const char* line : {"in.0001.tif --mulc {FRAME_NUMBER} -o x.tif",
                           "--frames 1-2 in.#.tif --mulc {FRAME_NUMBER/0} -o x.#.tif",
                           "--frames 1-2 in.#.tif --mulc {FRAME_NUMBER+} -o x.#.tif",
                           "--frames 1-2 in.#.tif --mulc {(FRAME_NUMBER} -o x.#.tif"}) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 2) << line;
    EXPECT_NE(result.err.find("FRAME_NUMBER"), std::string::npos) << result.err;
  }
}

TEST_F(FramesTest, OnlyTheFirstSignIsTheFrame) {
  Works("--frames 1-2 in.#.tif -o 100%_%04d.tif");
  Works("--frames 1-2 in.#.tif -o a%b.@.tif");
  Works("--frames 1-2 in.#.tif -o %d%d.tif");
  Works("--frames 1-2 in.#.tif -o a[(.%3d.tif");
  for (const char* name : {"100%_0002.tif", "a%b.2.tif", "2%d.tif", "a[(.  2.tif"})
    EXPECT_TRUE(directory_.Names().contains(name)) << name;
  Works("100%_%04d.tif -o found.#.tif");
  Works("a[(.%3d.tif -o spaces.#.tif");
  for (const char* name : {"found.0002.tif", "spaces.0002.tif"})
    EXPECT_TRUE(directory_.Names().contains(name)) << name;
}

TEST_F(FramesTest, RangesToTheEndOfIntegersEnd) {
  Works("--frames 1-2147483647x1000000000 --pattern ramp 4x4 1 -o far.#.tif");
  for (const char* name : {"far.0001.tif", "far.1000000001.tif", "far.2000000001.tif"})
    EXPECT_TRUE(directory_.Names().contains(name)) << name;
  Works("--frames 1-5y2 --pattern ramp 4x4 1 -o others.@.tif");
  EXPECT_FALSE(directory_.Names().contains("others.3.tif"));
  EXPECT_TRUE(directory_.Names().contains("others.4.tif"));
  for (const char* range : {"1-2147483648", "1-2147483647", "0-2147483647y1", "1-2147483647y1000000000"})
    EXPECT_EQ(Tessera("--frames " + std::string(range) + " --pattern ramp 4x4 1 -o x.#.tif").exit_code, 2);
}

TEST_F(FramesTest, NumbersOfMoreDigitsThanNamesHoldAreRefused) {
  const std::string many(20000, '#');
  for (const std::string& name : {many, many + ".tif", std::string("a.%99999999d.tif"),
                                  std::string("a.%99999999999999999999999d.tif")}) {
    const CommandResult result = Tessera("--frames 1-2 in.#.tif -o " + name);
    EXPECT_EQ(result.exit_code, 2) << result.err.substr(0, 200);
    EXPECT_NE(result.err.find("digits"), std::string::npos) << result.err.substr(0, 200);
  }
}

// A file that is there wins over what its name could stand for.
TEST_F(FramesTest, NamesWithTheSignsOfFramesAreFiles) {
  Works("--pattern checker 8x6 3 -d uint8 -o plain.png");
  for (const std::string name : {"icon@2x.png", "a#b.png", "50%d.png", "%04d#@.png"}) {
    std::filesystem::copy_file(Path("plain.png"), Path(name));
    Works(name + " -o copy.png");
    EXPECT_EQ(Oiiotool("--fail 0 plain.png copy.png --diff").exit_code, 0) << name;
  }
  Works("--wildcardoff plain.png -o new@3x#.png");
  EXPECT_TRUE(directory_.Names().contains("new@3x#.png"));
  // Only the names that follow.
  Works("--frames 1-2 --wildcardoff icon@2x.png --wildcardon -o out.#.png");
  EXPECT_TRUE(directory_.Names().contains("out.0002.png"));
  EXPECT_EQ(Tessera("no@file.png -o x.png").exit_code, 1);
}

TEST_F(FramesTest, ASequenceThatIsReadWholeIsNotTheOutput) {
  const CommandResult result = Tessera("--motionblur:window=0,1 s.#.exr --frames 1-2 -o out.exr");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("--motionblur"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("output"), std::string::npos) << result.err;
}

TEST_F(FramesTest, ABadFrameStopsTheRunOrIsSkipped) {
  std::ofstream(Path("in.0002.tif")) << "spoilt";
  CommandResult result = Tessera("--frames 1-3 in.#.tif -o stop.#.tif");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("in.0002.tif"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(Path("stop.0003.tif")));
  result = Tessera("--frames 1-3 --skip-bad-frames in.#.tif -o skip.#.tif");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("frame 2 skipped"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(Path("skip.0002.tif")));
  EXPECT_TRUE(std::filesystem::exists(Path("skip.0003.tif")));
}

// Frames are under way at once; what comes of them, and in which order, is as if each waited for the last.
TEST_F(FramesTest, FramesUnderWayAtOnceAreAsOneByOne) {
  for (int f = 1; f <= 12; ++f)
    Works("--pattern perlin:seed=" + std::to_string(f) + " 300x200 3 -d half -o n." + std::to_string(f) +
          ".exr");
  for (const std::string threads : {"1", "2", "5"}) {
    Works("--nosoftwareattrib --threads " + threads + " n.@.exr --blur 5x5 --saturate 0.4 -o t" + threads +
          ".@.exr");
  }
  for (int f = 1; f <= 12; ++f) {
    const std::string name = "." + std::to_string(f) + ".exr";
    const std::string one = "--fail 0 --hardfail 0 t1" + name + " ";
    EXPECT_EQ(Tessera(one + "t2" + name + " --diff").exit_code, 0) << f;
    EXPECT_EQ(Tessera(one + "t5" + name + " --diff").exit_code, 0) << f;
  }
}

TEST_F(FramesTest, AFrameMayReadWhatOneBeforeItWrote) {
  for (const std::string threads : {"--threads 1 ", "--threads 4 "}) {
    Works("in.0001.tif -o acc.tif");
    Works(threads + "--frames 1-3 acc.tif in.#.tif --add -o acc.tif");
    EXPECT_NEAR(Sample("acc.tif", 0, 0, 0), 0.7f, 1e-6f) << threads;
    Works("in.0001.tif -o chain.1.tif");
    Works(threads + "chain.1-8@.tif --mulc 2 -o ./chain.2-9@.tif");
    EXPECT_NEAR(Sample("chain.9.tif", 0, 0, 0), 25.6f, 1e-5f) << threads;
    std::filesystem::remove(Path("alias.tif"));
    std::filesystem::create_symlink("acc.tif", Path("alias.tif"));
    Works("in.0001.tif -o acc.tif");
    Works(threads + "--frames 1-3 alias.tif in.#.tif --add -o acc.tif");
    EXPECT_NEAR(Sample("acc.tif", 0, 0, 0), 0.7f, 1e-6f) << threads;
  }
}

TEST_F(FramesTest, ErrorsOfFramesUnderWayComeInOrder) {
  for (int f = 1; f <= 9; ++f)
    Works("--pattern constant:color=0.5 400x300 3 -o e." + std::to_string(f) + ".tif");
  for (const int f : {4, 5, 8}) std::ofstream(Path("e." + std::to_string(f) + ".tif")) << "spoilt";
  for (const std::string threads : {"--threads 1 ", "--threads 2 ", "--threads 5 "}) {
    CommandResult result = Tessera(threads + "e.@.tif -o out.@.tif");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("e.4.tif"), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("e.5.tif"), std::string::npos) << result.err;
    std::set<std::string> names = directory_.Names();
    for (int f = 1; f <= 9; ++f)
      EXPECT_EQ(names.contains("out." + std::to_string(f) + ".tif"), f < 4) << threads << f;
    EXPECT_EQ(names.size(), 3u + 9u + 3u) << "something else was left";
    result = Tessera(threads + "--skip-bad-frames e.@.tif -o skip.@.tif");
    EXPECT_EQ(result.exit_code, 1);
    const size_t first = result.err.find("frame 4 skipped"), second = result.err.find("frame 5 skipped"),
                 third = result.err.find("frame 8 skipped");
    EXPECT_TRUE(first < second && second < third && third != std::string::npos) << result.err;
    names = directory_.Names();
    EXPECT_EQ(names.size(), 3u + 9u + 3u + 6u);
    for (int f = 1; f <= 9; ++f) {
      for (const std::string name : {"out.", "skip."})
        std::filesystem::remove(Path(name + std::to_string(f) + ".tif"));
    }
  }
}

TEST_F(FramesTest, AnAnimatedOperationCountsItsOwnFrames) {
  Works("--pattern ramp 24x16 3 -o field.exr");
  Works("field.exr --lic:animate=3:length=5 -o loop.#.exr");
  const std::set<std::string> names = directory_.Names();
  for (const char* name : {"loop.0001.exr", "loop.0002.exr", "loop.0003.exr"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_FALSE(names.contains("loop.0004.exr"));
  Works("field.exr --lic:length=5:kernel=ripple -o first.exr");
  EXPECT_EQ(Sample("loop.0001.exr", 12, 8, 0), Sample("first.exr", 12, 8, 0));
  EXPECT_NE(Sample("loop.0002.exr", 12, 8, 0), Sample("first.exr", 12, 8, 0));
  EXPECT_EQ(Tessera("field.exr --lic:animate=3 -o one.exr").exit_code, 2);
}

TEST_F(FramesTest, ImagesAreConvolvedAlongTheFieldAboveThem) {
  Works(
      "--pattern checker:width=4:height=4 24x16 3 --pattern ramp 24x16 2 --lic:input=1:length=3 -o smear.exr");
  EXPECT_EQ(Tessera("--pattern ramp 24x16 2 --lic:input=1 -o none.exr").exit_code, 2);
}

}  // namespace
}  // namespace tessera::testing
