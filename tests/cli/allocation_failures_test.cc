// Memory that is refused, one allocation after the other: a reason and exit code 1, or the right picture; the
// old output stays and nothing else does. TESSERA_EVERY_ALLOCATION=TEXT goes through the last of them in the
// lines of failure_lines.h that hold the text, which takes long, and prints how they ended.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "cli/failure_lines.h"

namespace tessera {
namespace {

class AllocationFailuresTest : public FailureLinesTest {
 protected:
  testing::CommandResult With(const std::string& variable, const std::string& value,
                              const std::string& line) {
    std::vector<std::string> words = {"env", "LD_PRELOAD=" TESSERA_FAIL_ALLOCATION, variable + "=" + value,
                                      TESSERA_PROGRAM};
    for (const std::string& word : testing::Words(line)) words.push_back(word == "\"\"" ? "" : word);
    return testing::RunCommand(words, directory_.path());
  }
  std::vector<float> Pixels(const std::string& name) const {
    const OIIO::ImageBuf image = Load(name);
    std::vector<float> pixels(image.spec().image_pixels() * static_cast<size_t>(image.nchannels()));
    EXPECT_TRUE(image.get_pixels(image.roi(), OIIO::TypeFloat, pixels.data()));
    return pixels;
  }
  static std::set<std::string> NamesIn(const std::filesystem::path& directory) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory))
      names.insert(entry.path().filename());
    return names;
  }
  long Count(const std::string& line) {
    EXPECT_EQ(With("COUNT_ALLOCATIONS", Path("count"), line).exit_code, 0) << line;
    const long count = std::atol(testing::FileText(Path("count")).c_str());
    std::filesystem::remove(Path("count"));
    return count;
  }
};

TEST_F(AllocationFailuresTest, EndARunCleanly) {
  Works("--pattern ramp 32x32 3 -o a.exr");
  std::ofstream(Path("l.cube")) << "LUT_1D_SIZE 2\n0 0 0\n1 1 1\n";
  int refused = 0;
  constexpr long kRuns = 8, kLast = 2000;  // before the end; the libraries' own beginnings are earlier
  for (const std::string& line :
       {std::string("a.exr a.exr --accum .5,.5"), std::string("a.exr --blur:sigma=3 --resize 20x20"),
        std::string("a.exr --lut l.cube"), std::string("--pattern perlin 32x32 3 a.exr --over"),
        std::string("--volume:solid=body:size=16x16"), std::string("a.exr --verify --hue 30")}) {
    for (const std::string& output : {std::string("out.exr"), std::string("out.png")}) {
      SCOPED_TRACE(line + " -o " + output);
      const bool png = output == "out.png";
      const std::string whole = std::string("--threads ") + (png ? "2" : "1") + " --nosoftwareattrib " +
                                line + " -d " + (png ? "uint8" : "half") + " -o " + output;
      Works(whole);
      const std::vector<float> right = Pixels(output);
      const long count = Count(whole);
      ASSERT_GT(count, kLast);
      for (long i = 0; i < kRuns; ++i) {
        std::ofstream(Path(output)) << "old";
        const auto before = directory_.Names();
        const long number = count - i * (kLast / kRuns);
        const testing::CommandResult result = With("FAIL_ALLOCATION", std::to_string(number), whole);
        refused += result.exit_code == 1;
        EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1)
            << count - number << " before the end: " << result.exit_code << " " << result.err;
        EXPECT_EQ(result.exit_code == 1, !result.err.empty()) << result.err;
        // Of another packing perhaps, when the faster one had no memory.
        if (result.exit_code == 0) {
          EXPECT_TRUE(Pixels(output) == right) << count - number;
        } else {
          EXPECT_TRUE(testing::FileText(Path(output)) == "old") << count - number << result.err;
        }
        EXPECT_EQ(directory_.Names(), before) << count - number;
      }
    }
  }
  // A line may do without any of its eight (the fast codec falls back on the other, say), but not every line.
  EXPECT_GT(refused, 12);
}

TEST_F(AllocationFailuresTest, EndEveryLineCleanly) {
  const char* const text = std::getenv("TESSERA_EVERY_ALLOCATION");
  if (text == nullptr || *text == 0) GTEST_SKIP() << "only where TESSERA_EVERY_ALLOCATION asks for it";
  MakeInputs();
  std::filesystem::create_directory(Path("out"));
  constexpr long kLast = 4000, kStep = 13;
  int lines = 0, reasons = 0, right = 0, bad = 0;
  for (std::string line : LinesWith(text)) {
    for (size_t at = line.find('$'); at != std::string::npos; at = line.find('$')) line.replace(at, 1, "out");
    for (const std::string threads : {"1", "2"}) {
      const std::string whole = "--threads " + threads + " --nosoftwareattrib " + line;
      const long count = Count(whole);
      ++lines;
      const auto outputs = NamesIn(Path("out"));
      for (long number = count; number > std::max(count - kLast, 0L); number -= kStep) {
        for (const std::string& name : outputs) std::ofstream(Path("out/" + name)) << "old";
        const testing::CommandResult result = With("FAIL_ALLOCATION", std::to_string(number), whole);
        std::string why;
        if (result.exit_code != 0 && result.exit_code != 1) why = "exit code";
        if (result.exit_code == 1 && !result.err.starts_with("tessera: error: ")) why = "no reason";
        if (NamesIn(Path("out")) != outputs) why = "other files";
        for (const std::string& name : outputs) {
          const bool old = testing::FileText(Path("out/" + name)) == "old";
          // Of frames, those before it are whole.
          if (old != (result.exit_code != 0) && line.find("--frames") == std::string::npos)
            why = "wrong files";
        }
        ++(!why.empty() ? bad : result.exit_code == 1 ? reasons : right);
        EXPECT_EQ(why, "") << whole << "\n"
                           << count - number << " before the end: " << result.exit_code << " " << result.err;
      }
      for (const std::string& name : NamesIn(Path("out"))) std::filesystem::remove(Path("out/" + name));
    }
  }
  std::printf("%d lines: %d with a reason, %d with files, %d bad\n", lines, reasons, right, bad);
}

// OpenImageIO's file_size may not throw; what is thrown in it ends the process (asked for by its reader of
// WebP).
TEST_F(AllocationFailuresTest, WhatALibraryMayNotThrowIsAReason) {
  Works("--pattern ramp 48x40 3 -d uint8 -o a.webp");
  const std::string line = "--threads 1 --nosoftwareattrib a.webp --sobel -o out.webp";
  const long count = Count(line);
  for (long number = count - 190; number < count - 120; ++number) {
    const testing::CommandResult result = With("FAIL_ALLOCATION", std::to_string(number), line);
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1)
        << count - number << " before the end: " << result.exit_code << " " << result.err;
    EXPECT_EQ(result.exit_code == 1, result.err.starts_with("tessera: error: ")) << result.err;
  }
}

}  // namespace
}  // namespace tessera
