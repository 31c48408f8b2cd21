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
  for (const char* piece : {"runstats out.exr", "Mpixel/s", "GB/s", "peak memory"}) {
    EXPECT_NE(out.find(piece), std::string::npos) << piece << "\n" << out;
  }
}

TEST_F(OutputsTest, ProgressGoesToStderrWhereAsked) {
  EXPECT_EQ(Tessera("a.exr --mulc 2 -o out.exr").err, "");
  EXPECT_EQ(Tessera("a.exr --no-progress --mulc 2 -o out.exr").err, "");
  const CommandResult result = Tessera("a.exr --progress --mulc 2 -o out.exr");
  EXPECT_NE(result.err.find("100% out.exr\n"), std::string::npos) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_NE(Tessera("-v a.exr -o out.exr").err.find("reading a.exr"), std::string::npos);
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

TEST_P(InterruptTest, LeavesWhatWasThereAndNothingElse) {
  std::ofstream(Path("big.tif")) << "what was there";
  const auto before = directory_.Names();
  RunningCommand running({TESSERA_PROGRAM, "--pattern", "ramp", "30000x30000", "3", "--mulc", "0.5", "-d",
                          "float", "-o", "big.tif"},
                         directory_.path());
  // Until the temporary file has grown: the signal then comes in the middle of writing.
  bool writing = false;
  for (int i = 0; i < 6000 && !writing; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      std::error_code gone;
      if (!before.contains(entry.path().filename()) && entry.file_size(gone) > 100000 && !gone)
        writing = true;
    }
  }
  EXPECT_TRUE(writing) << "no temporary file grew";
  kill(running.pid(), GetParam());
  EXPECT_EQ(running.Wait().exit_code, 128 + GetParam());
  EXPECT_EQ(directory_.Names(), before);
  EXPECT_EQ(FileText(Path("big.tif")), "what was there");
}

INSTANTIATE_TEST_SUITE_P(Signals, InterruptTest, ::testing::Values(SIGINT, SIGTERM));

}  // namespace
}  // namespace tessera::testing
