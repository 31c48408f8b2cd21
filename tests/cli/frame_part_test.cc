// --part: which frames, from the line or from a scheduler's variables; what parts make is what one process
// makes.
#include "cli/frame_part.h"

#include <cstdlib>
#include <map>
#include <numeric>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

using cli::FramePart;
using cli::ParseFramePart;

const std::vector<std::string> kVariables = {"SLURM_ARRAY_TASK_ID",
                                             "SLURM_ARRAY_TASK_MIN",
                                             "SLURM_ARRAY_TASK_MAX",
                                             "SLURM_ARRAY_TASK_STEP",
                                             "SLURM_ARRAY_TASK_COUNT",
                                             "SLURM_PROCID",
                                             "SLURM_NTASKS",
                                             "SGE_TASK_ID",
                                             "SGE_TASK_FIRST",
                                             "SGE_TASK_LAST",
                                             "SGE_TASK_STEPSIZE",
                                             "LSB_JOBINDEX",
                                             "LSB_JOBINDEX_END",
                                             "LSB_JOBINDEX_STEP",
                                             "PBS_ARRAY_INDEX",
                                             "PBS_ARRAYID",
                                             "AWS_BATCH_JOB_ARRAY_INDEX",
                                             "JOB_COMPLETION_INDEX"};

// The variables of a task; those of others are not set.
class Task {
 public:
  explicit Task(const std::map<std::string, std::string>& variables) {
    for (const std::string& name : kVariables) unsetenv(name.c_str());
    for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Task() {
    for (const std::string& name : kVariables) unsetenv(name.c_str());
  }
};

std::string Name(const std::string& text) {
  try {
    return ParseFramePart(text).Name();
  } catch (const cli::UsageError& e) {
    return e.what();
  }
}

TEST(FramePartTest, TheLineSaysWhichOfHowMany) {
  EXPECT_EQ(Name("3/16"), "3-of-16");
  EXPECT_EQ(Name("1/1"), "1-of-1");
  for (const char* wrong : {"", "3", "/", "3/", "/3", "0/3", "4/3", "1/0", "1/1000001", "-1/3", "a/3",
                            "3/16x", "1.5/3", "99999999999999999999/3", "auto/", "auto/x", "automatic"}) {
    EXPECT_NE(Name(wrong).find("expected"), std::string::npos) << wrong << ": " << Name(wrong);
  }
}

TEST(FramePartTest, SchedulersSayItInTheirWords) {
  const auto of = [](const std::map<std::string, std::string>& variables, const std::string& text = "auto") {
    const Task task(variables);
    return Name(text);
  };
  EXPECT_EQ(of({{"SLURM_ARRAY_TASK_ID", "3"},
                {"SLURM_ARRAY_TASK_MIN", "1"},
                {"SLURM_ARRAY_TASK_MAX", "16"},
                {"SLURM_ARRAY_TASK_COUNT", "16"},
                {"SLURM_PROCID", "0"},
                {"SLURM_NTASKS", "1"}}),
            "3-of-16");
  EXPECT_EQ(of({{"SLURM_ARRAY_TASK_ID", "20"},
                {"SLURM_ARRAY_TASK_MIN", "0"},
                {"SLURM_ARRAY_TASK_MAX", "38"},
                {"SLURM_ARRAY_TASK_STEP", "2"},
                {"SLURM_ARRAY_TASK_COUNT", "20"}}),
            "11-of-20");
  EXPECT_EQ(of({{"SLURM_ARRAY_TASK_ID", "7"},
                {"SLURM_ARRAY_TASK_MIN", "3"},
                {"SLURM_ARRAY_TASK_MAX", "7"},
                {"SLURM_ARRAY_TASK_COUNT", "2"}},
               "auto/16"),
            "7-of-16")
      << "one that is run again";
  EXPECT_NE(of({{"SLURM_ARRAY_TASK_ID", "7"},
                {"SLURM_ARRAY_TASK_MIN", "3"},
                {"SLURM_ARRAY_TASK_MAX", "7"},
                {"SLURM_ARRAY_TASK_COUNT", "2"}})
                .find("with gaps"),
            std::string::npos);
  EXPECT_EQ(of({{"SLURM_PROCID", "3"}, {"SLURM_NTASKS", "4"}}), "4-of-4");
  EXPECT_EQ(
      of({{"SGE_TASK_ID", "5"}, {"SGE_TASK_FIRST", "1"}, {"SGE_TASK_LAST", "9"}, {"SGE_TASK_STEPSIZE", "4"}}),
      "2-of-3");
  EXPECT_NE(of({{"SGE_TASK_ID", "undefined"}}).find("found none of the variables"), std::string::npos);
  EXPECT_EQ(of({{"LSB_JOBINDEX", "2"}, {"LSB_JOBINDEX_END", "8"}}), "2-of-8");
  EXPECT_NE(of({{"LSB_JOBINDEX", "0"}}).find("found none of the variables"), std::string::npos) << "no array";
  EXPECT_EQ(of({{"PBS_ARRAY_INDEX", "8"}}, "auto/8"), "8-of-8");
  EXPECT_EQ(of({{"PBS_ARRAYID", "8"}}, "auto/9"), "8-of-9");
  EXPECT_EQ(of({{"AWS_BATCH_JOB_ARRAY_INDEX", "0"}}, "auto/9"), "1-of-9");
  EXPECT_EQ(of({{"JOB_COMPLETION_INDEX", "8"}}, "auto/9"), "9-of-9");
  EXPECT_NE(of({{"PBS_ARRAY_INDEX", "8"}}).find("expected auto/N"), std::string::npos);
  EXPECT_NE(of({{"PBS_ARRAY_INDEX", "9"}}, "auto/8").find("PBS_ARRAY_INDEX"), std::string::npos);
  EXPECT_NE(of({{"PBS_ARRAY_INDEX", "x"}}, "auto/8").find("expected a number"), std::string::npos);
  EXPECT_NE(of({}).find("found none of the variables"), std::string::npos);
}

TEST(FramePartTest, PartsHoldEveryFrameOnce) {
  for (const int frames : {0, 1, 5, 16, 17, 100}) {
    std::vector<cli::FrameLine> all(static_cast<size_t>(frames));
    for (int f = 0; f < frames; ++f) all[static_cast<size_t>(f)].frame = f;
    for (const int count : {1, 2, 3, 16, 120}) {
      std::vector<int> seen(all.size());
      size_t fewest = all.size(), most = 0;
      for (int index = 1; index <= count; ++index) {
        const auto own = FramesOfPart(all, FramePart{index, count});
        for (const cli::FrameLine& line : own) ++seen[static_cast<size_t>(line.frame)];
        fewest = std::min(fewest, own.size()), most = std::max(most, own.size());
      }
      EXPECT_EQ(seen, std::vector<int>(all.size(), 1)) << frames << " in " << count;
      EXPECT_LE(most - fewest, 1U);
    }
  }
}

class PartLineTest : public CliTest {};

TEST_F(PartLineTest, PartsMakeTheFilesOfOneProcess) {
  Works("--frames 1-7 --pattern perlin:seed={FRAME_NUMBER} 40x30 3 -d half -o in.#.exr");
  const std::string rest = " in.#.exr --saturate 1.2 --blur 5x5 -o ";
  Works("--frames 1-7" + rest + "out.#.exr");
  std::map<int, std::string> whole;
  for (int f = 1; f <= 7; ++f) {
    const std::string name = Path("out.000" + std::to_string(f) + ".exr");
    whole[f] = FileText(name);
    std::filesystem::remove(name);
  }
  for (int part = 3; part >= 1; --part)
    Works("--frames 1-7 --part " + std::to_string(part) + "/3 --parallel-frames auto" + rest + "out.#.exr");
  for (int f = 1; f <= 7; ++f)
    EXPECT_TRUE(FileText(Path("out.000" + std::to_string(f) + ".exr")) == whole[f])
        << "byte for byte, frame " << f;
  const CommandResult task = RunCommand({"env", "SLURM_ARRAY_TASK_ID=2", "SLURM_ARRAY_TASK_MAX=5",
                                         TESSERA_PROGRAM, "--part", "auto", "in.#.exr", "-o", "task.#.exr"},
                                        directory_.path());
  EXPECT_EQ(task.exit_code, 0) << task.err;
  EXPECT_TRUE(directory_.Names().contains("task.0002.exr"));
  EXPECT_TRUE(directory_.Names().contains("task.0007.exr"));
  EXPECT_FALSE(directory_.Names().contains("task.0003.exr"));
  EXPECT_EQ(Tessera("--part 9/9 in.#.exr -o none.#.exr").exit_code, 0) << "a part may have no frames";
  EXPECT_FALSE(directory_.Names().contains("none.0001.exr"));
}

TEST_F(PartLineTest, LinesWhosePartsWouldWaitAreRefused) {
  Works("--frames 1-3 --pattern checker 8x8 3 -o in.#.exr");
  for (const auto& [line, reason] : std::vector<std::pair<std::string, std::string>>{
           {"--part 1/2 in.#.exr -o one.exr", "of several frames"},
           {"--part 1/2 in.1-2#.exr -o in.2-3#.exr", "reads what one before it writes"},
           {"--part 1/2 in.0001.exr -o out.exr", "found no frames"},
           {"--part 3/2 in.#.exr -o out.#.exr", "part 3 of 2"},
           {"--part auto --safe in.#.exr -o out.#.exr", "--safe"},
           {"--parallel-frames 0 in.#.exr -o out.#.exr", "from 1 to 256"},
           {"--parallel-frames 257 in.#.exr -o out.#.exr", "from 1 to 256"},
           {"--parallel-frames some in.#.exr -o out.#.exr", "expected auto"}}) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 2) << line;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
  }
  EXPECT_EQ(Tessera("--part 1/1 in.#.exr -o one.exr").exit_code, 0) << "one part is all of it";
}

TEST_F(PartLineTest, SharedMemoryLeavesTheBits) {
  Works("--frames 1-6 --pattern perlin:seed={FRAME_NUMBER} 400x300 3 -d half -o in.#.exr");
  // Of one and a half megabytes a frame: short of memory, on the edge of it, with enough.
  for (const char* memory : {"1", "2", "4", "6", "64"}) {
    const std::string line = std::string("--threads 2 --max-memory ") + memory;
    const std::string rest = " in.#.exr --blur:sigma=20 --warp 1,.1,0,0,1,0,0,0,1 -d float -o ";
    Works(line + rest + "one.#.exr");
    const std::string first = FileText(Path("one.0001.exr"));
    for (int f = 1; f <= 6; ++f)
      std::filesystem::rename(Path("one.000" + std::to_string(f) + ".exr"),
                              Path("kept." + std::to_string(f)));
    Works(line + " --parallel-frames 6" + rest + "one.#.exr");
    for (int f = 1; f <= 6; ++f) {
      EXPECT_TRUE(FileText(Path("one.000" + std::to_string(f) + ".exr")) ==
                  FileText(Path("kept." + std::to_string(f))))
          << memory << " MB, frame " << f;
    }
  }
}

TEST_F(PartLineTest, AnErrorOfOneFrameIsAsOneByOne) {
  Works("--frames 1-8 --pattern checker 64x64 3 -o in.#.exr");
  std::ofstream(Path("in.0004.exr")) << "torn";
  for (const std::string parallel : {"", " --parallel-frames 5"}) {
    CommandResult result = Tessera("--frames 1-8" + parallel + " in.#.exr --mulc 2 -o out.#.exr");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("in.0004.exr"), std::string::npos) << result.err;
    EXPECT_TRUE(directory_.Names().contains("out.0003.exr"));
    EXPECT_FALSE(directory_.Names().contains("out.0005.exr")) << "no frame after it";
    result = Tessera("--frames 1-8 --skip-bad-frames" + parallel + " in.#.exr --mulc 2 -o out.#.exr");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(directory_.Names().contains("out.0008.exr"));
    EXPECT_FALSE(directory_.Names().contains("out.0004.exr"));
    for (int f = 1; f <= 8; ++f) std::filesystem::remove(Path("out.000" + std::to_string(f) + ".exr"));
  }
}

}  // namespace
}  // namespace tessera::testing
