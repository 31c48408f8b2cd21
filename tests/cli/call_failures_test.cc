// Calls of the system that fail, one after the other: a reason and exit code 1, or the right picture; the old
// outputs stay and nothing else does. TESSERA_EVERY_CALL=TEXT goes through every call of every line that
// holds the text, which takes long (a minute each), and prints how they ended; TEXT -o is in all of them.
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "cli/failure_lines.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

struct Fault {
  const char* kind;
  int code;
};
constexpr Fault kFaults[] = {{"read", EIO},     {"write", EIO},  {"write", ENOSPC},  {"open", EIO},
                             {"open", ENOSPC},  {"rename", EIO}, {"rename", ENOSPC}, {"fsync", EIO},
                             {"fsync", ENOSPC}, {"close", EIO},  {"close", ENOSPC},  {"truncate", EIO},
                             {"thread", EAGAIN}};

class CallFailuresTest : public FailureLinesTest {
 protected:
  struct Outcomes {
    int reasons = 0, right = 0, bad = 0;
  };

  testing::CommandResult With(const std::string& own, const std::string& variable, const std::string& value,
                              const std::string& line) {
    // What waits without end is told by its exit code.
    std::vector<std::string> words = {"timeout",
                                      "--foreground",
                                      "300",
                                      "env",
                                      "TMPDIR=" + Path(own + ".scratch"),
                                      "LD_PRELOAD=" TESSERA_FAIL_CALL,
                                      variable + "=" + value,
                                      TESSERA_PROGRAM,
                                      "--threads",
                                      "2",
                                      "--nosoftwareattrib"};
    for (const std::string& word : testing::Words(line)) words.push_back(word == "\"\"" ? "" : word);
    return testing::RunCommand(words, directory_.path());
  }

  // How many calls there were of each kind.
  static std::map<std::string, long> Counts(const std::string& file) {
    std::map<std::string, long> count;
    std::ifstream stream(file);
    for (std::string kind; stream >> kind;) stream >> count[kind];
    return count;
  }

  // What a directory holds: of each file, its bytes.
  using Files = std::map<std::string, std::string>;
  static Files Held(const fs::path& directory) {
    Files files;
    for (const auto& entry : fs::directory_iterator(directory))
      files[entry.path().filename()] = testing::FileText(entry.path());
    return files;
  }
  static std::vector<float> Pixels(const fs::path& file) {
    OIIO::ImageCache* const cache = OIIO::ImageCache::create(/*shared=*/true);
    cache->invalidate(OIIO::ustring(file.string()), /*force=*/true);
    OIIO::ImageCache::destroy(cache);
    std::vector<float> all;
    for (int part = 0, parts = 1; part < parts; ++part) {
      OIIO::ImageBuf image(file.string(), part, 0);
      if (!image.read(part, 0, true, OIIO::TypeFloat)) return {};
      parts = image.nsubimages();
      std::vector<float> pixels(image.spec().image_pixels() * static_cast<size_t>(image.nchannels()));
      image.get_pixels(image.roi(), OIIO::TypeFloat, pixels.data());
      all.insert(all.end(), pixels.begin(), pixels.end());
    }
    return all;
  }
  // The same files, or other packings of the same pixels.
  bool Same(const fs::path& directory, const Files& right) {
    const Files found = Held(directory);
    if (found == right) return true;
    if (found.size() != right.size()) return false;
    const testing::TemporaryDirectory other;
    for (const auto& [name, bytes] : right) {
      if (!found.contains(name)) return false;
      std::ofstream(other.path() / name, std::ios::binary) << bytes;
      if (Pixels(directory / name) != Pixels(other.path() / name) || Pixels(directory / name).empty())
        return false;
    }
    return true;
  }
  // Of the line, or one that its files name, or of its temporary files; or the command that finds no font.
  static bool NamesAFile(const std::string& message, const std::string& own) {
    const std::string names[] = {"in/", own + "/", own + ".scratch/", "--text"};
    return std::any_of(std::begin(names), std::end(names),
                       [&](const std::string& name) { return message.find(name) != std::string::npos; });
  }

  // Outputs are in the directory `own`, temporary files of the program in one of its own.
  void Loop(const std::string& text, const std::string& own, bool every) {
    const fs::path outputs = directory_.path() / own;
    fs::create_directory(outputs);
    fs::create_directory(Path(own + ".scratch"));
    std::string line = text;
    for (size_t at = line.find('$'); at != std::string::npos; at = line.find('$')) line.replace(at, 1, own);
    const std::string counts = Path(own + ".counts");
    const testing::CommandResult whole = With(own, "COUNT_CALLS", counts, line);
    EXPECT_EQ(whole.exit_code, 0) << line << whole.err;
    if (whole.exit_code != 0) return;
    const Files right = Held(outputs);
    Files old;
    for (const auto& [name, bytes] : right) old[name] = "old";
    std::map<std::string, long> count = Counts(counts);
    Outcomes of_line;
    for (const Fault& fault : kFaults) {
      const long all = count[fault.kind], step = every ? 1 : std::max<long>(all / 2, 1);
      Outcomes outcomes;
      // The short loop looks at the last ones: what the libraries begin with is first.
      for (long number = all; number >= 1; number -= step) {
        for (const auto& [name, bytes] : old) std::ofstream(outputs / name) << bytes;
        const std::string call =
            std::string(fault.kind) + ":" + std::to_string(number) + ":" + std::to_string(fault.code);
        const testing::CommandResult result = With(own, "FAIL_CALL", call, line);
        const bool names = NamesAFile(result.err, own) || fault.code == EAGAIN;
        std::string why;
        if (result.exit_code == 1) {
          if (result.err.find("tessera: error: ") == std::string::npos || !names) why = "no reason";
          // Of frames, those before it are whole.
          Files now = Held(outputs);
          for (auto& [name, bytes] : now) {
            if (line.find("--frames") != std::string::npos && right.contains(name) && right.at(name) == bytes)
              bytes = "old";
          }
          if (now != old) why = "other files";
        } else if (result.exit_code != 0) {
          why = "exit code";
        } else if (!Same(outputs, right)) {
          why = "wrong files";
        }
        if (!fs::is_empty(Path(own + ".scratch"))) why = "scratch files";
        ++(!why.empty() ? outcomes.bad : result.exit_code == 1 ? outcomes.reasons : outcomes.right);
        EXPECT_EQ(why, "") << line << "\n"
                           << call << " of " << all << ": " << result.exit_code << " " << result.err;
        if (why.empty()) continue;
        for (const auto& [name, bytes] : Held(outputs)) {
          if (!right.contains(name)) fs::remove(outputs / name);
        }
      }
      const std::lock_guard lock(mutex_);
      const std::string row = std::string(fault.kind) + " " +
                              (fault.code == EIO      ? "EIO"
                               : fault.code == ENOSPC ? "ENOSPC"
                                                      : "EAGAIN");
      Outcomes& sum = table_[row];
      sum.reasons += outcomes.reasons, sum.right += outcomes.right, sum.bad += outcomes.bad;
      of_line.reasons += outcomes.reasons, of_line.right += outcomes.right, of_line.bad += outcomes.bad;
    }
    // Hours may pass before the sums are printed.
    if (every) Print(line, of_line);
  }

  static void Print(const std::string& what, const Outcomes& sum) {
    std::printf("%6d with a reason %6d with the right files %4d bad: %s\n", sum.reasons, sum.right, sum.bad,
                what.c_str());
    std::fflush(stdout);
  }

  std::map<std::string, Outcomes> table_;
  std::mutex mutex_;
};

TEST_F(CallFailuresTest, EndARunCleanly) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  const char* const variable = std::getenv("TESSERA_EVERY_CALL");
  const bool every = variable != nullptr && *variable != 0;
  MakeInputs();
  const std::vector<std::string> lines = every ? LinesWith(variable) : LinesInShort();
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t i = next++; i < lines.size(); i = next++) Loop(lines[i], "out" + std::to_string(i), every);
  };
  std::thread other(work);
  work();
  other.join();
  int failed = 0;
  for (const auto& [row, sum] : table_) {
    failed += sum.reasons;
    Print(row, sum);
  }
  if (!every) {
    EXPECT_GT(failed, 50);
  }
}

// A file that has lost its beginning is no format's any more.
TEST_F(CallFailuresTest, LostHeadersAreNoticed) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  Works("--pattern ramp 48x40 3 -d uint8 -o a.png");
  std::ofstream(Path("o.sgi")) << "old";
  for (const char* call : {"write:2:5", "write:3:5"}) {
    EXPECT_EQ(With("", "FAIL_CALL", call, "a.png -o o.sgi").exit_code, 1) << call;
    EXPECT_EQ(testing::FileText(Path("o.sgi")), "old") << call;
  }
}

// Nor are rows that OpenImageIO's writers go on without.
TEST_F(CallFailuresTest, LostRowsAreNoticed) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  // Of a whole time: the clock would be in the file, or what a writer takes for the seconds that it was not
  // given.
  ASSERT_EQ(testing::RunCommand({TESSERA_PROGRAM, "--pattern", "perlin", "61x43", "3", "-d", "uint8",
                                 "--attrib", "DateTime", "2020:01:01 00:00:00", "-o", "a.png"},
                                directory_.path())
                .exit_code,
            0);
  for (const std::string format : {"rla", "ico", "fits", "sgi"}) {
    const std::string line = "a.png -o o." + format;
    EXPECT_EQ(With("", "COUNT_CALLS", Path("counts"), line).exit_code, 0) << format;
    const std::string right = testing::FileText(Path("o." + format));
    std::map<std::string, long> count = Counts(Path("counts"));
    int refused = 0;
    for (long k = count["write"]; k >= 1; k -= std::max(count["write"] / 8, 1L)) {
      const testing::CommandResult result = With("", "FAIL_CALL", "write:" + std::to_string(k) + ":5", line);
      refused += result.exit_code == 1;
      // A write that is tried again, or whose bytes were there, is none that was lost.
      EXPECT_TRUE(result.exit_code == 1 || testing::FileText(Path("o." + format)) == right)
          << format << " " << k << ": " << result.exit_code << " " << result.err;
    }
    EXPECT_GE(refused, 2) << format;
  }
}

// Nor rows of images behind the first.
TEST_F(CallFailuresTest, LostRowsOfSeveralImagesAreNoticed) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  MakeInputs();
  fs::create_directory(Path("out"));
  fs::create_directory(Path("right"));
  Works("-a in/parts.exr --mulc .5 -o right/o.tif");
  const std::string line = "-a in/parts.exr --mulc .5 -o out/o.tif";
  EXPECT_EQ(With("", "COUNT_CALLS", Path("counts"), line).exit_code, 0);
  std::map<std::string, long> count = Counts(Path("counts"));
  int refused = 0;
  for (long k = count["write"]; k >= 1; k -= std::max(count["write"] / 20, 1L)) {
    const testing::CommandResult result = With("", "FAIL_CALL", "write:" + std::to_string(k) + ":5", line);
    refused += result.exit_code == 1;
    EXPECT_TRUE(result.exit_code == 1 || Pixels(Path("out/o.tif")) == Pixels(Path("right/o.tif")))
        << k << ": " << result.exit_code << " " << result.err;
  }
  EXPECT_GE(refused, 2);
}

// A library that waits for a disk asks nobody for the time.
TEST_F(CallFailuresTest, SecondsEndWhatWaits) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  Works("--pattern ramp 48x40 3 -d half -o a.exr");
  std::ofstream(Path("o.png")) << "old";
  const auto before = directory_.Names();
  for (const char* call : {"read:2:0", "write:1:0"}) {
    const testing::CommandResult result = With("", "FAIL_CALL", call, "--limit seconds=.1 a.exr -o o.png");
    EXPECT_EQ(result.exit_code, 1) << call;
    EXPECT_NE(result.err.find(": found more than 0.1 s of work, over the limit seconds=0.1\n"),
              std::string::npos)
        << call << result.err;
    EXPECT_EQ(directory_.Names(), before) << call;
    EXPECT_EQ(testing::FileText(Path("o.png")), "old") << call;
  }
}

// Frames are under way in other threads while a signal ends the process: what they begin after the files have
// been removed stays nowhere, also of libraries that open their files by name.
TEST_F(CallFailuresTest, ThreadsMakeNoFileBehindASignal) {
  if (With("", "COUNT_CALLS", Path("counts"), "--version").exit_code == 77) GTEST_SKIP() << "no seccomp here";
  Works("--pattern ramp 48x40 3 -d uint8 -o a.png");
  fs::create_directory(Path("out"));
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    const std::string format = round % 2 != 0 ? "tif" : "exr";
    testing::RunningCommand running(
        {"env", "LD_PRELOAD=" TESSERA_FAIL_CALL, "DELAY_EXIT=300", TESSERA_PROGRAM, "--no-fsync", "--threads",
         "2", "--frames", "1-20000", "a.png", "--mulc", ".5", "-o", "out/o.#." + format, "--flip", "-o",
         "out/p.#." + format},
        directory_.path());
    for (int i = 0; i < 6000 && Held(Path("out")).size() < 20u; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1 + round));
    kill(running.pid(), SIGTERM);
    EXPECT_EQ(running.Wait().exit_code, 128 + SIGTERM);
    const Files files = Held(Path("out"));
    EXPECT_GE(files.size(), 10u);
    for (const auto& [name, bytes] : files) {
      EXPECT_NE(name[0], '.') << "left: " << name;
      EXPECT_FALSE(bytes.empty()) << name;
      // The outputs of a frame come together.
      std::string other = name;
      other[0] = name[0] == 'o' ? 'p' : 'o';
      EXPECT_TRUE(files.contains(other)) << name << " without " << other;
      fs::remove(Path("out/" + name));
    }
  }
}

}  // namespace
}  // namespace tessera
