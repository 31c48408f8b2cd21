// The time of day jumps to and fro by weeks: nobody waits for it, and pictures are as they are.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <chrono>
#include <cstdlib>
#include <set>

#include "cli/failure_lines.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class ClockTest : public FailureLinesTest {
 protected:
  // With the outputs in the folder `own`.
  testing::CommandResult Run(const std::string& text, const std::string& own,
                             const std::vector<std::string>& before) {
    fs::create_directory(Path(own));
    std::string line = text;
    for (size_t at = line.find('$'); at != std::string::npos; at = line.find('$')) line.replace(at, 1, own);
    std::vector<std::string> words = {"env"};
    words.insert(words.end(), before.begin(), before.end());
    words.insert(words.end(), {TESSERA_PROGRAM, "--threads", "2"});
    for (const std::string& word : testing::Words(line)) words.push_back(word == "\"\"" ? "" : word);
    return testing::RunCommand(words, directory_.path());
  }
  testing::CommandResult Jumping(const std::string& line, const std::string& own) {
    return Run(line, own, {"LD_PRELOAD=" TESSERA_JUMP_CLOCK});
  }
  static std::set<std::string> Names(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
  }
};

TEST_F(ClockTest, JumpsMakeNoOtherPictures) {
  MakeInputs();
  // That the clock jumps at all.
  const auto tell = testing::RunCommand(
      {"env", "LD_PRELOAD=" TESSERA_JUMP_CLOCK, "sh", "-c", "date +%s; date +%s"}, directory_.path());
  ASSERT_EQ(tell.exit_code, 0) << tell.err;
  const long long now =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  EXPECT_GT(std::llabs(std::stoll(tell.out) - now), 60);
  const std::vector<std::string> lines = LinesWith("-o");
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    // OpenImageIO keeps what it has read by its name.
    const std::string first = "plain" + std::to_string(i), second = "jumping" + std::to_string(i);
    const testing::CommandResult plain = Run(line, first, {}), jumping = Jumping(line, second);
    ASSERT_EQ(plain.exit_code, 0) << line << plain.err;
    EXPECT_EQ(jumping.exit_code, 0) << line << jumping.err;
    const auto names = Names(Path(first));
    EXPECT_EQ(Names(Path(second)), names) << line;
    for (const std::string& name : names) {
      const OIIO::ImageBuf one(Path(first + "/" + name)), other(Path(second + "/" + name));
      const auto found = OIIO::ImageBufAlgo::compare(one, other, 0, 0);
      EXPECT_TRUE(!found.error && found.maxerror == 0) << line << " " << name;
    }
  }
}

TEST_F(ClockTest, LimitsAreOfTimeThatPasses) {
  Works("--pattern ramp 48x40 3 -d half -o a.exr");
  EXPECT_EQ(Jumping("--limit seconds=30 a.exr --blur 3x3 -o $/o.exr", "o").exit_code, 0);
  const auto begin = std::chrono::steady_clock::now();
  const testing::CommandResult result =
      Jumping("--limit seconds=.3 --pattern perlin:octaves=9 20000x20000 3 --median 9x9 -o $/o.exr", "o");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("over the limit seconds=0.3"), std::string::npos) << result.err;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

}  // namespace
}  // namespace tessera
