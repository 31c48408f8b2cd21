// --resume: what counts as finished, and what does not.
#include <OpenImageIO/hash.h>

#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "cli/cli_test.h"
#include "cli/file_state.h"

namespace tessera::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST(Hash64Test, IsXxh64InAnyPieces) {
  // The specification's own values.
  EXPECT_EQ(cli::HashOf(""), "ef46db3751d8e999");
  EXPECT_EQ(cli::HashOf("abc"), "44bc2cf5ad770999");
  std::mt19937 random(1);
  std::string bytes(3000, 0);
  for (char& c : bytes) c = static_cast<char>(random());
  for (int k = 0; k < 300; ++k) {
    const size_t size = k < 100 ? static_cast<size_t>(k) : random() % bytes.size();
    cli::Hash64 hash;
    for (size_t at = 0; at < size;) {
      const size_t piece = std::min<size_t>(random() % 70, size - at);
      hash.Add(&bytes[at], piece);
      at += piece;
    }
    EXPECT_EQ(hash.Value(), OIIO::xxhash::XXH64(bytes.data(), size, 0)) << size;
  }
}

class ResumeTest : public CliTest {
 protected:
  static constexpr int kFrames = 5;

  void SetUp() override {
    Works("--frames 1-5 --pattern perlin:seed={FRAME_NUMBER} 40x30 3 -d half -o in.#.exr");
    Works("--frames 1-5" + rest_);
    for (int f = 1; f <= kFrames; ++f) {
      right_.push_back(FileText(Out(f)));
      fs::remove(Out(f));
    }
    EXPECT_EQ(Run(), (Tally{0, 5})) << "nothing was there";
    EXPECT_EQ(Run(), (Tally{5, 0})) << "all is";
  }
  void TearDown() override {
    for (int f = 1; f <= kFrames; ++f)
      EXPECT_TRUE(FileText(Out(f)) == right_[static_cast<size_t>(f) - 1]) << "frame " << f;
  }

  struct Tally {
    int left = 0, made = 0;
    bool operator==(const Tally&) const = default;
    friend std::ostream& operator<<(std::ostream& out, const Tally& t) {
      return out << t.left << " left, " << t.made << " made";
    }
  };
  Tally Run(const std::string& options = "--frames 1-5", const std::string& rest = "") {
    const CommandResult result = Tessera("--json --resume " + options + (rest.empty() ? rest_ : rest));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["report"], "frames");
    EXPECT_TRUE(report["failed"].empty());
    return {report["left"], report["made"]};
  }
  std::string Out(int frame) const { return Path("out.000" + std::to_string(frame) + ".exr"); }
  std::string Records(const std::string& part = "1-of-1") const {
    return Path("out.frames." + part + ".jsonl");
  }
  static void Put(const std::string& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }

  const std::string rest_ = " in.#.exr --saturate 1.2 -o out.#.exr";
  std::vector<std::string> right_;
};

TEST_F(ResumeTest, OutputsThatAreNotWhatWasWrittenAreMadeAgain) {
  Put(Out(1), right_[0].substr(0, right_[0].size() / 2));  // torn
  std::string other = right_[1];
  other[other.size() / 2] = static_cast<char>(other[other.size() / 2] ^ 1);  // altered, of its size
  Put(Out(2), other);
  fs::remove(Out(3));
  Put(Out(4), "");
  EXPECT_EQ(Run(), (Tally{1, 4}));
  fs::last_write_time(Out(5), fs::file_time_type::clock::now());
  EXPECT_EQ(Run(), (Tally{5, 0})) << "what it holds counts";
}

TEST_F(ResumeTest, AnotherLineOrInputMakesThemAgain) {
  EXPECT_EQ(Run("--frames 1-5", " in.#.exr --saturate 1.3 -o out.#.exr"), (Tally{0, 5}));
  EXPECT_EQ(Run(), (Tally{0, 5})) << "of another line";
  EXPECT_EQ(Run("--frames 2-4 --threads 1 -q --no-fsync --parallel-frames 2 --skip-bad-frames"),
            (Tally{3, 0}))
      << "that is not of the files";
  const std::string bytes = FileText(Path("in.0002.exr"));
  fs::last_write_time(Path("in.0002.exr"),
                      fs::last_write_time(Path("in.0002.exr")) + std::chrono::seconds(1));
  EXPECT_EQ(Run(), (Tally{4, 1})) << "an input's time";
  const auto time = fs::last_write_time(Path("in.0003.exr"));
  Put(Path("in.0003.exr"), FileText(Path("in.0003.exr")) + "x");
  fs::last_write_time(Path("in.0003.exr"), time);
  EXPECT_EQ(Run(), (Tally{4, 1})) << "an input's size";
}

TEST_F(ResumeTest, TornRecordsAreNone) {
  const std::string records = FileText(Records());
  for (const size_t cut :
       {records.size() - 1, records.size() - 30, records.size() / 2, size_t{1}, size_t{0}}) {
    Put(Records(), records.substr(0, cut));
    const Tally found = Run();
    EXPECT_EQ(found.left + found.made, 5);
    EXPECT_GE(found.made, cut < records.size() - 1 ? 1 : 0) << cut;
    EXPECT_EQ(Run(), (Tally{5, 0})) << "what was added behind a torn one counts";
  }
  std::string other = records;
  other[other.find("\"size") == std::string::npos ? 40 : other.find("\"size")] ^= 1;
  Put(Records(), other);
  EXPECT_EQ(Run().made, 1) << "a record that is not what was written";
  Put(Records(), "no records\n{}\n\n{\"frame\":1,\"check\":\"0123456789abcdef\"}\n");
  EXPECT_EQ(Run(), (Tally{0, 5}));
}

TEST_F(ResumeTest, PartsReadEachOthersRecords) {
  fs::remove(Records());
  EXPECT_EQ(Run("--frames 1-5 --part 2/2"), (Tally{0, 2}));
  EXPECT_TRUE(fs::exists(Records("2-of-2")));
  EXPECT_EQ(Run("--frames 1-5 --part 1/3"), (Tally{1, 1})) << "4, and 1";
  EXPECT_EQ(Run(), (Tally{3, 2}));
}

TEST_F(ResumeTest, SeveralProcessesAtOnceLeaveWholeRecords) {
  for (int k = 0; k < 3; ++k) {
    fs::remove(Records());
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] { EXPECT_EQ(Tessera("-q --resume --frames 1-5" + rest_).exit_code, 0); });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(Run(), (Tally{5, 0}));
  }
}

TEST_F(ResumeTest, FilesThatNoWordNamesCount) {
  // By an expression, and by a graph.
  Works("in.0001.exr --mulc 2 --save-graph look.json --pop");
  const std::string line = " --load-graph look.json in.000{1+1}.exr --add -o sum.#.exr";
  EXPECT_EQ(Run("--frames 1-2", line), (Tally{0, 2}));
  EXPECT_EQ(Run("--frames 1-2", line), (Tally{2, 0}));
  for (const char* input : {"in.0001.exr", "in.0002.exr", "look.json"}) {
    fs::last_write_time(Path(input), fs::last_write_time(Path(input)) + std::chrono::seconds(1));
    EXPECT_EQ(Run("--frames 1-2", line), (Tally{0, 2})) << input;
  }
  // One that was not there.
  const std::string other = " --missingfile black in.0001.exr late.exr --add -o late.#.exr";
  EXPECT_EQ(Run("--frames 1-1", other), (Tally{0, 1}));
  EXPECT_EQ(Run("--frames 1-1", other), (Tally{1, 0}));
  fs::copy(Path("in.0002.exr"), Path("late.exr"));
  EXPECT_EQ(Run("--frames 1-1", other), (Tally{0, 1}));
}

TEST_F(ResumeTest, FramesThatFailAreNotFinished) {
  const std::string right = FileText(Path("in.0003.exr"));
  const auto time = fs::last_write_time(Path("in.0003.exr"));
  Put(Path("in.0003.exr"), "torn");
  const CommandResult result = Tessera("--json --resume --skip-bad-frames --frames 1-5" + rest_);
  EXPECT_EQ(result.exit_code, 1);
  const json report = json::parse(result.out);
  EXPECT_EQ(report["left"], 4);
  EXPECT_EQ(report["failed"], json({3}));
  Put(Path("in.0003.exr"), right);
  fs::last_write_time(Path("in.0003.exr"), time);
  EXPECT_EQ(Run(), (Tally{5, 0})) << "as it was";
  // A verdict of the line's own.
  const std::string line = " in.#.exr in.0001.exr --diff -o diff.#.exr";
  EXPECT_EQ(Tessera("-q --resume --frames 2-2" + line).exit_code, 1);
  EXPECT_EQ(Tessera("-q --resume --frames 2-2" + line).exit_code, 1) << "is said again";
}

TEST_F(ResumeTest, WrongLinesAreRefused) {
  for (const auto& [line, reason] : std::vector<std::pair<std::string, std::string>>{
           {"--resume in.#.exr --mulc 2 -o in.#.exr", "among what its frame reads"},
           {"--resume in.#.exr --mulc 2 -o ./in.#.exr", "among what its frame reads"},
           {"--resume --no-clobber in.#.exr -o out.#.exr", "--no-clobber"},
           {"--resume -u in.#.exr -o out.#.exr", "-u"},
           {"--resume --safe in.#.exr -o out.#.exr", "--safe"},
           {"--resume in.#.exr --printstats", "found no -o"}}) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 2) << line << result.err;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
  }
  fs::create_symlink(Path("elsewhere"), Path("link.frames.1-of-1.jsonl"));
  const CommandResult result = Tessera("--resume --frames 1-1 in.#.exr -o link.#.exr");
  EXPECT_EQ(result.exit_code, 1) << "records do not go through links";
  EXPECT_FALSE(fs::exists(Path("elsewhere")));
}

}  // namespace
}  // namespace tessera::testing
