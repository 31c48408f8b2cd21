// --limit: what is over it is refused with the limit, the file or command and what was found, and leaves
// nothing.
#include <fstream>

#include "cli/cli_test.h"

namespace tessera {
namespace {

class LimitsTest : public testing::CliTest {
 protected:
  void SetUp() override { MakePicture("a.exr", 60, 40, 4, OIIO::TypeFloat); }
  void Refused(const std::string& line, const std::string& message) {
    const auto before = directory_.Names();
    const testing::CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 1) << line << "\n" << result.err;
    EXPECT_EQ(result.err, "tessera: error: " + message + "\n") << line;
    EXPECT_EQ(directory_.Names(), before) << line;
  }
};

TEST_F(LimitsTest, Pixels) {
  const std::string over = ", over the limit pixels=2399";
  Works("--limit pixels=2400 a.exr -o out.exr");
  Refused("--limit pixels=2399 a.exr -o new.exr", "a.exr: found 60 x 40 pixels" + over);
  Refused("a.exr --resize 30x20 -o new.exr --limit pixels=2399", "a.exr: found 60 x 40 pixels" + over);
  Refused("--limit pixels=2399 --pattern ramp 100x24 3 -o new.exr",
          "--pattern ramp 100x24 3: found 100 x 24 pixels" + over);
  Refused("--limit pixels=3e3 a.exr --resize 60x60 -o new.exr",
          "--resize 60x60: found 60 x 60 pixels, over the limit pixels=3000");
  std::ofstream(Path("v.raw")) << std::string(1000, 'x');
  Refused("--limit pixels=999 --volume:file=v.raw:dims=10,10,10:size=8x8 -o new.exr",
          "--volume v.raw: found 10 x 10 x 10 voxels, over the limit pixels=999");
  Refused("--limit pixels=100 --volume:file=a.exr:slices=4:size=8x8 -o new.exr",
          "--volume a.exr: found 60 x 40 pixels, over the limit pixels=100");
}

TEST_F(LimitsTest, Channels) {
  Works("--limit channels=4 a.exr -o out.exr");
  Refused("--limit channels=3 a.exr --ch R -o new.exr", "a.exr: found 4 channels, over the limit channels=3");
  Refused("--limit channels=4 a.exr a.exr --chappend -o new.exr",
          "--chappend: found 8 channels, over the limit channels=4");
}

TEST_F(LimitsTest, Frames) {
  const std::string line = "--frames 1-3 a.exr -o f.#.exr";
  Works("--limit frames=3 " + line);
  Refused("--limit frames=2 " + line, "f.#.exr: found 3 frames, over the limit frames=2");
  Refused("--limit frames=2 f.#.exr -o g.#.exr", "f.#.exr: found 3 frames, over the limit frames=2");
  Refused("--limit frames=2 --motionblur f.1-3#.exr -o g.exr",
          "f.1-3#.exr: found 3 frames, over the limit frames=2");
}

TEST_F(LimitsTest, Memory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take what they like";
#endif
  Works("--limit memory=1000 a.exr -o out.exr");
  std::ofstream(Path("new.exr")) << "old";
  Refused(
      "--threads 1 --limit memory=300 --pattern ramp 5000x5000 4 --equalize -o new.exr",
      "new.exr: memory: the system refused 400000064 bytes, over the limit memory=300; its largest image is "
      "the result of --pattern ramp 5000x5000 4, 5000 x 5000 pixels");
  EXPECT_EQ(testing::FileText(Path("new.exr")), "old");
}

TEST_F(LimitsTest, Seconds) {
  const std::string over = ": found more than 0.3 s of work, over the limit seconds=0.3";
  std::ofstream(Path("new.tif")) << "old";
  const std::string long_work = "--limit seconds=.3 --pattern perlin:octaves=24 30000x30000 3 ";
  Works("--limit seconds=1000 a.exr -o out.exr");
  Refused(long_work + "-o new.tif", "new.tif" + over);
  EXPECT_EQ(testing::FileText(Path("new.tif")), "old");
  Refused(long_work + "--printstats -o new.tif", "--printstats" + over);
  // Frames after it are not even begun.
  Refused("--skip-bad-frames --frames 1-1000 " + long_work + "-o new.#.tif", "new.0001.tif" + over);
}

TEST_F(LimitsTest, JobsHaveTheirsAndNoMore) {
  std::ofstream(Path("jobs")) << "a.exr -o one.exr\n"
                                 "--limit pixels=1e9 a.exr --resize 100x100 -o two.exr\n"
                                 "--limit pixels=2399 a.exr -o three.exr\n"
                                 "a.exr -o four.exr\n"
                                 "--limit seconds=.01 --pattern perlin:octaves=24 1700x1700 4 -o five.exr\n"
                                 "a.exr -o six.exr\n"
                                 "--safe a.exr -o seven.exr\n";
  const testing::CommandResult result = testing::RunCommand(
      {"sh", "-c", TESSERA_PROGRAM " --batch --limit pixels=3e6,seconds=100 < jobs"}, directory_.path());
  std::vector<std::string> answers;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) answers.push_back(line);
  ASSERT_EQ(answers.size(), 7u) << result.out << result.err;
  const auto ok = [&](size_t job) { return answers[job].find("\"ok\":true") != std::string::npos; };
  EXPECT_TRUE(ok(0) && ok(1) && !ok(2) && ok(3) && !ok(4) && ok(5) && !ok(6)) << result.out;
  EXPECT_NE(answers[2].find("a.exr: found 60 x 40 pixels, over the limit pixels=2399"), std::string::npos);
  EXPECT_NE(answers[4].find("over the limit seconds=0.01"), std::string::npos) << answers[4];
  EXPECT_NE(answers[6].find("--safe: found in a job, expected on the program's own line"), std::string::npos);
}

// A job's end of time, and what its message is about, are its own.
TEST_F(LimitsTest, SecondsOfAJobEndWithIt) {
  std::ofstream(Path("first")) << "--limit seconds=.05 --pattern perlin:octaves=24 1700x1700 4 -o one.exr\n";
  std::ofstream(Path("rest")) << "a.exr --resize 70x70 -o two.exr\n"
                              << "--limit seconds=.001 a.exr -o three.exr\n"
                              << "a.exr -o four.exr\n";
  // The first one's alarm would be due meanwhile.
  const testing::CommandResult result = testing::RunCommand(
      {"sh", "-c", "(cat first; sleep 2.3; cat rest) | " TESSERA_PROGRAM " --batch"}, directory_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::vector<std::string> answers;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) answers.push_back(line);
  ASSERT_EQ(answers.size(), 4u) << result.out << result.err;
  EXPECT_NE(answers[0].find("over the limit seconds=0.05"), std::string::npos) << answers[0];
  EXPECT_NE(answers[1].find("\"ok\":true"), std::string::npos) << answers[1];
  EXPECT_EQ(answers[2].find("one.exr"), std::string::npos) << answers[2];
  EXPECT_EQ(answers[2].find("two.exr"), std::string::npos) << answers[2];
  EXPECT_NE(answers[3].find("\"ok\":true"), std::string::npos) << answers[3];
}

TEST_F(LimitsTest, AreNumbersOfKnownNames) {
  for (const char* limits : {"pixel=3", "pixels", "pixels=", "pixels=0", "pixels=1.5", "channels=3x",
                             "seconds=nan", "seconds=-1", "memory=1", "pixels=3,,frames=2", "pixels=3,"}) {
    const testing::CommandResult result = Tessera(std::string("--limit ") + limits + " a.exr -o new.exr");
    EXPECT_EQ(result.exit_code, 2) << limits << result.err;
    EXPECT_NE(result.err.find("tessera: error: --limit: found \""), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace tessera
