// How a run ends: outputs whole or not at all, interrupts, and the reports about a run.
#include <signal.h>

#include <chrono>
#include <thread>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class OutputsTest : public CliTest {
 protected:
  void SetUp() override { MakePicture("a.exr", 200, 150, 3, OIIO::TypeFloat); }
};

TEST_F(OutputsTest, AnOutputMayBeAnInput) {
  Works("a.exr -o copy.exr");
  Works("a.exr --mulc 2 -o a.exr");
  Works("copy.exr --mulc 2 -o expected.exr");
  EXPECT_EQ(Oiiotool("--fail 0 a.exr expected.exr --diff").exit_code, 0);
}

// Half of the codes are one higher where the value lies in the middle between two; one output alone, all that
// follow, and none of other types.
TEST_F(OutputsTest, EightBitsAreDitheredWhereAsked) {
  const std::string grey = "--pattern constant:color=0.5 64x64 1 ";  // 127.5
  const auto mean = [&](const std::string& file) {
    const OIIO::ImageBuf image = Load(file);
    double sum = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) sum += image.getchannel(x, y, 0, 0) * 255 / 4096;
    }
    return sum;
  };
  Works(
      grey +
      "-d uint8 -o plain.png -o:dither=1 own.png -o:dither=2 other.png --dither -o all.png -o:dither=0 none.png");
  EXPECT_NEAR(mean("plain.png"), 128, 1e-3);
  EXPECT_NEAR(mean("own.png"), 127.5, 0.05);
  EXPECT_NEAR(mean("none.png"), 128, 1e-3);
  EXPECT_EQ(Oiiotool("--fail 0 own.png all.png --diff").exit_code, 0);
  EXPECT_NE(Oiiotool("--fail 0 own.png other.png --diff").exit_code, 0);
  Works(grey + "-d uint8 --quantize:dither=1:seed=1 8 -o same.png");
  EXPECT_EQ(Oiiotool("--fail 0 own.png same.png --diff").exit_code, 0);
  Works(grey + "-d half -o plain.exr --dither -o dithered.exr");
  EXPECT_EQ(Oiiotool("--fail 0 plain.exr dithered.exr --diff").exit_code, 0);
  Works(grey + "-d uint8 --dither --verify -o sure.png");
}

TEST_F(OutputsTest, DryRunAndExplainWriteNothing) {
  const auto before = directory_.Names();
  EXPECT_EQ(Works("a.exr --mulc 2 -n -o out.exr"), "");
  const std::string plan = Works("--explain a.exr --mulc 2 --addc 0.5 -d half -o out.exr");
  EXPECT_NE(plan.find("out.exr:"), std::string::npos) << plan;
  EXPECT_NE(plan.find("a.exr"), std::string::npos) << plan;
  EXPECT_NE(plan.find("pass 1"), std::string::npos) << plan;
  EXPECT_EQ(directory_.Names(), before);
  EXPECT_EQ(Tessera("gone.exr -n -o out.exr").exit_code, 1);
}

// Before a pixel is computed: the picture would take minutes. Dry runs and plans find it too.
TEST_F(OutputsTest, WhatCannotBeWrittenIsFoundFirst) {
  std::filesystem::create_directory(Path("closed"));
  std::filesystem::permissions(Path("closed"), std::filesystem::perms::owner_read);
  std::ofstream(Path("plain.txt")) << "no directory";
  const auto before = directory_.Names();
  const std::string picture = "--pattern perlin:octaves=24 60000x60000 3 ";
  struct Case {
    std::string outputs, message;
  };
  std::vector<Case> cases = {{"-o a.tif -d half -o b.png", "b.png: found the type half, expected one"},
                             {"-o a.tif -d float -o b.jpg", "b.jpg: found the type float"},
                             {"-o:type=uint16 b.jpg", "found the type uint16"},
                             {"-o a.tif -o b.unknown", "found the extension \".unknown\""},
                             {"-o a.tif -o missing/b.tif", "no directory missing"},
                             {"-o a.tif -o plain.txt/b.tif", "plain.txt/b.tif: cannot be written"}};
  if (geteuid() != 0) cases.push_back({"-o a.tif -o closed/b.tif", "closed/b.tif: cannot be written"});
  for (const Case& c : cases) {
    for (const std::string how : {"", "-n ", "--explain "}) {
      const auto start = std::chrono::steady_clock::now();
      const CommandResult result = Tessera(how + picture + c.outputs);
      EXPECT_EQ(result.exit_code, 1) << how << c.outputs;
      EXPECT_NE(result.err.find(c.message), std::string::npos) << how << c.outputs << ": " << result.err;
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30)) << c.outputs;
      EXPECT_EQ(directory_.Names(), before) << how << c.outputs;
    }
  }
}

TEST_F(OutputsTest, CropsIntoFormatsWithoutWindowsSayWhatCuts) {
  Works("a.exr --cut 11x7+5+3 -o cut.exr");
  Works("a.exr --cut 11x7+5+3 -d uint8 -o cut.png");
  EXPECT_EQ(Oiiotool("a.exr --cut 11x7+5+3 -o expected.exr").exit_code, 0);
  EXPECT_EQ(Oiiotool("--fail 0 cut.exr expected.exr --diff").exit_code, 0);
  const OIIO::ImageBuf small = Load("cut.png"), window = Load("cut.exr");
  EXPECT_EQ(small.spec().width, 11);
  EXPECT_EQ(small.spec().height, 7);
  EXPECT_EQ(window.spec().x, 0);
  EXPECT_EQ(window.spec().full_width, 11);
  const CommandResult padded = Tessera("a.exr --crop 11x7+5+3 -d uint8 -o crop.png");
  EXPECT_EQ(padded.exit_code, 0);
  EXPECT_NE(padded.err.find("--cut"), std::string::npos) << padded.err;
  EXPECT_EQ(Tessera("-q a.exr --crop 11x7+5+3 -d uint8 -o crop.png").err, "");
  EXPECT_EQ(Tessera("a.exr --crop 11x7+5+3 -o crop.exr").err, "");
}

TEST_F(OutputsTest, NormalsOfAPictureOfHeightsAreNeitherFlatNorCut) {
  Works("--pattern perlin:freq=4 128x64 1 -d uint8 -o height.png");
  Works("height.png --normalmap -o normals.png");
  Works("height.png -d float --normalmap:scale=12.8:pack=1 -d uint8 -o asked.png");
  EXPECT_EQ(Oiiotool("--fail 0 normals.png asked.png --diff").exit_code, 0);
  // Slopes to all sides: red and green about their middle, both ways.
  float low = 1, high = 0;
  const OIIO::ImageBuf normals = Load("normals.png");
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 128; ++x) {
      low = std::min(low, normals.getchannel(x, y, 0, 0));
      high = std::max(high, normals.getchannel(x, y, 0, 0));
      EXPECT_GE(normals.getchannel(x, y, 0, 2), 0.5f);
    }
  }
  EXPECT_LT(low, 0.4f);
  EXPECT_GT(high, 0.6f);
}

TEST_F(OutputsTest, VerifyPrintsALinePerOutput) {
  const std::string out = Works(
      "--verify:samples=4 a.exr --mulc 0.3 --addc 0.1 -o one.exr --clamp:min=0:max=1 -d uint8 -o two.png");
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 2) << out;
  EXPECT_NE(out.find("verify one.exr: max error "), std::string::npos) << out;
  EXPECT_NE(out.find("verify two.png: "), std::string::npos) << out;
  EXPECT_NE(out.find("rms"), std::string::npos) << out;
  EXPECT_NE(out.find("within bound"), std::string::npos) << out;
}

TEST_F(OutputsTest, RunStatsNamePassesAndMemory) {
  const std::string out = Works("--runstats a.exr --mulc 2 -o out.exr");
  for (const char* piece : {"runstats out.exr", "Mpixel/s", "GB/s", "peak memory", "prepare ", "decode ",
                            "compute ", "encode ", "wait ", "limit: "}) {
    EXPECT_NE(out.find(piece), std::string::npos) << piece << "\n" << out;
  }
}

TEST_F(OutputsTest, ProgressGoesToStderrWhereAsked) {
  EXPECT_EQ(Tessera("a.exr --mulc 2 -o out.exr").err, "");
  EXPECT_EQ(Tessera("a.exr --no-progress --mulc 2 -o out.exr").err, "");
  const CommandResult result = Tessera("a.exr --progress --mulc 2 -o out.exr");
  EXPECT_NE(result.err.find("100% out.exr in "), std::string::npos) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_NE(Tessera("-v a.exr -o out.exr").err.find("reading a.exr"), std::string::npos);
}

// One line over all frames and outputs; at its end what was done.
TEST_F(OutputsTest, ProgressIsOfAllFramesAndFitsTheTerminal) {
  const CommandResult result = Tessera(
      "--progress --frames 1-4 a.exr --mulc 2 -o one.#.exr --mulc 2 -o a_name_that_is_far_too_long_for_a_line.#.exr");
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find("100% 4 frames in "), std::string::npos) << result.err;
  EXPECT_NE(result.err.find(" frame 3/4"), std::string::npos) << result.err;
  double before = -1;
  size_t shown = 0;
  std::string line;
  std::istringstream lines(result.err);
  while (std::getline(lines, line, '\r')) {
    const size_t sign = line.find('%');
    if (sign == std::string::npos || sign < 4 || line.find("frame ") == std::string::npos) continue;
    const double percent = std::stod(line.substr(sign - 4, 4));
    EXPECT_GE(percent, before) << line;
    before = percent;
    ++shown;
    EXPECT_LE(line.substr(0, line.find('\033')).size(), 79u) << line;
  }
  EXPECT_GE(shown, 4u);
  // Nothing is shown of what does not compute.
  EXPECT_EQ(Tessera("--progress -n a.exr --mulc 2 -o out.exr").err, "");
}

TEST_F(OutputsTest, ThreadsAndMemoryDoNotChangeABit) {
  const std::string work = " a.exr --mulc 0.7 --addc 0.1,0.2,0.3 --nosoftwareattrib -o ";
  Works("--threads 1" + work + "one.exr");
  Works("--threads 2" + work + "two.exr");
  Works("--threads 3 --max-memory 1" + work + "three.exr");
  EXPECT_EQ(Oiiotool("--fail 0 one.exr two.exr --diff").exit_code, 0);
  EXPECT_EQ(Oiiotool("--fail 0 one.exr three.exr --diff").exit_code, 0);
}

TEST_F(OutputsTest, EveryTargetGivesThePicture) {
  std::istringstream targets(Works("--simd list"));
  Works("a.exr --saturate 1.3 --hue 40 --mulc 0.9 -o best.exr");
  int count = 0;
  for (std::string target; std::getline(targets, target); ++count) {
    Works("--simd " + target + " a.exr --saturate 1.3 --hue 40 --mulc 0.9 -o " + target + ".exr");
    const CommandResult diff = Oiiotool("--fail 4e-6 --warn 1 best.exr " + target + ".exr --diff");
    EXPECT_EQ(diff.exit_code, 0) << target << diff.out;
  }
  EXPECT_GE(count, 1);
}

class InterruptTest : public OutputsTest, public ::testing::WithParamInterface<int> {};

// Until the temporary file has grown: a signal then comes in the middle of writing.
bool WaitForWriting(const TemporaryDirectory& directory, const std::set<std::string>& before) {
  for (int i = 0; i < 6000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (const auto& entry : std::filesystem::directory_iterator(directory.path())) {
      std::error_code gone;
      if (!before.contains(entry.path().filename()) && entry.file_size(gone) > 100000 && !gone) return true;
    }
  }
  return false;
}
const std::vector<std::string> kLongRun = {TESSERA_PROGRAM, "--pattern", "ramp", "30000x30000", "3",
                                           "--mulc",        "0.5",       "-d",   "float",       "-o",
                                           "big.tif"};

TEST_P(InterruptTest, LeavesWhatWasThereAndNothingElse) {
  std::ofstream(Path("big.tif")) << "what was there";
  const auto before = directory_.Names();
  RunningCommand running(kLongRun, directory_.path());
  EXPECT_TRUE(WaitForWriting(directory_, before)) << "no temporary file grew";
  kill(running.pid(), GetParam());
  EXPECT_EQ(running.Wait().exit_code, 128 + GetParam());
  EXPECT_EQ(directory_.Names(), before);
  EXPECT_EQ(FileText(Path("big.tif")), "what was there");
}

INSTANTIATE_TEST_SUITE_P(Signals, InterruptTest,
                         ::testing::Values(SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ, SIGQUIT));

TEST_F(OutputsTest, ALimitOnTheSizeOfFilesEndsTheRun) {
  const auto before = directory_.Names();
  const CommandResult result =
      RunCommand({"/bin/sh", "-c",
                  "ulimit -f 64; exec " TESSERA_PROGRAM " --pattern white 1000x1000 3 -d float -o a.exr"},
                 directory_.path());
  EXPECT_EQ(result.exit_code, 128 + SIGXFSZ) << result.err;
  EXPECT_EQ(directory_.Names(), before);
}

TEST_F(OutputsTest, WhatAKilledRunLeftIsSweptByTheNext) {
  const auto before = directory_.Names();
  RunningCommand killed(kLongRun, directory_.path());
  ASSERT_TRUE(WaitForWriting(directory_, before));
  const auto during = directory_.Names();
  Works("--no-fsync a.exr -o a.exr");
  EXPECT_EQ(directory_.Names(), during) << "the file of a run that goes on stays";
  kill(killed.pid(), SIGKILL);
  EXPECT_EQ(killed.Wait().exit_code, 128 + SIGKILL);
  EXPECT_NE(directory_.Names(), before);
  Works("a.exr -o a.exr");
  EXPECT_EQ(directory_.Names(), before);
}

TEST_F(OutputsTest, ProfilesAppearWithTheirLine) {
  Works("a.exr --iscolorspace sRGB -d uint8 -o a.png");
  Works("a.exr -o kept.exr");
  std::ofstream(Path("p.icc")) << "old";
  // The picture cannot be computed; the profile is not written then either.
  const CommandResult result = Tessera("a.png --iccwrite p.icc gone.exr -o b.exr");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(FileText(Path("p.icc")), "old");
}

}  // namespace
}  // namespace tessera::testing
