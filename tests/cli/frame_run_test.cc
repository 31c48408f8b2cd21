// Which lines have several frames under way at once.
#include "cli/frame_run.h"

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

int AtOnce(const std::string& words) {
  const std::vector<std::string> list = Words(words);
  const cli::Line line = cli::ParseLine(list);
  return cli::FramesAtOnce(line, cli::ExpandFrames(list, line));
}

TEST(FrameRunTest, PlainLinesHaveThreeWhereThereAreThreads) {
  const std::string line = "--no-progress --frames 1-9 a.#.exr --blur 5x5 b.#.exr --over -d half -o c.#.exr";
  EXPECT_EQ(AtOnce("--threads 1 " + line), 1);
  EXPECT_EQ(AtOnce("--threads 2 " + line), 3) << "one that waits for the one before it leaves no core idle";
  EXPECT_EQ(AtOnce("--threads 8 " + line), 3);
  EXPECT_EQ(AtOnce("--threads 8 --skip-bad-frames " + line), 3);
  EXPECT_EQ(AtOnce("--threads 8 --no-progress --frames 1 a.#.exr -o c.#.exr"), 1);
  EXPECT_EQ(AtOnce("--threads 8 --no-progress --frames 1-9 a.#.exr -o a.#.exr"), 3) << "in their places";
}

TEST(FrameRunTest, LinesThatTellOrAskForSomethingHaveOne) {
  for (const char* option : {"-v", "-n", "--runstats", "--explain", "--verify", "--max-memory 100",
                             "--limit seconds=60", "--limit memory=2000", "-u"}) {
    EXPECT_EQ(AtOnce(std::string("--no-progress ") + option + " --threads 8 --frames 1-9 a.#.exr -o c.#.exr"),
              1)
        << option;
  }
  for (const char* steps : {"--stats", "--printstats", "--echo x", "--sisplit --siappendall"}) {
    EXPECT_EQ(AtOnce("--no-progress --threads 8 --frames 1-9 a.#.exr " + std::string(steps) + " -o c.#.exr"),
              1)
        << steps;
  }
}

TEST(FrameRunTest, FramesThatMayReadWhatWasWrittenWait) {
  const std::string start = "--no-progress --threads 8 ";
  EXPECT_EQ(AtOnce(start + "--frames 1-3 acc.exr a.#.exr --add -o acc.exr"), 1);
  EXPECT_EQ(AtOnce(start + "a.1-3#.exr -o a.2-4#.exr"), 1);
  EXPECT_EQ(AtOnce(start + "a.1-3#.exr -o ./a.2-4#.exr"), 1);
  EXPECT_EQ(AtOnce(start + "a.2-4#.exr -o a.1-3#.exr"), 3) << "what is written was read before";
  EXPECT_EQ(AtOnce(start + "--frames 1-3 a.#.exr --lut a.0001.exr -o a.#.exr"), 1);
}

TEST(FrameRunTest, ParallelFramesAreAsManyAsAskedForAtMost) {
  const std::string line = " --no-progress --frames 1-40 a.#.exr --blur 5x5 -o c.#.exr";
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 7" + line), 7);
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 200" + line), 40) << "no more than there are";
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 1" + line), 1);
  EXPECT_EQ(AtOnce("--threads 1 --parallel-frames 7" + line), 1);
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames auto" + line), 3);
  EXPECT_EQ(AtOnce("--threads 6 --parallel-frames auto" + line), 7);
  EXPECT_EQ(AtOnce("--threads 64 --parallel-frames auto" + line), 16);
  EXPECT_EQ(AtOnce("--threads 2 --max-memory 100 --parallel-frames 7" + line), 7) << "each has its share";
  EXPECT_EQ(AtOnce("--threads 2 --max-memory 100 --autotrim --parallel-frames 7" + line), 1);
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 7 --verify" + line), 1);
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 7 --progress" + line), 7);
  EXPECT_EQ(AtOnce("--threads 2 --parallel-frames 7 --json" + line), 7);
}

}  // namespace
}  // namespace tessera::testing
