// What the README shows must be so: its C++ lines are those of the sample, its files exist, its shell lines
// run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace tessera::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = TESSERA_SOURCE_DIR;

std::string Contents(const fs::path& file) {
  std::ifstream stream(file);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The lines of the README's fenced blocks of a language.
std::vector<std::string> Block(const std::string& readme, const std::string& language) {
  std::vector<std::string> lines;
  const std::string fence = "```" + language + "\n";
  for (size_t at = readme.find(fence); at != std::string::npos; at = readme.find(fence, at + 1)) {
    const size_t begin = at + fence.size();
    std::istringstream text(readme.substr(begin, readme.find("\n```", begin) - begin));
    for (std::string line; std::getline(text, line);) lines.push_back(line);
  }
  return lines;
}

TEST(ReadmeTest, CppLinesAreTheSamples) {
  const std::vector<std::string> lines = Block(Contents(kRoot / "README.md"), "cpp");
  ASSERT_EQ(lines.size(), 5u);
  std::string text;
  for (const std::string& line : lines) text += "    " + line + "\n";
  EXPECT_THAT(Contents(kRoot / "samples/grade.cc"), ::testing::HasSubstr(text));
}

TEST(ReadmeTest, LinksLeadSomewhere) {
  for (const char* page : {"README.md", "CONTRIBUTING.md"}) {
    const std::string text = Contents(kRoot / page);
    const std::regex link("\\]\\(([^):#]+)\\)");
    for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
      EXPECT_TRUE(fs::exists(kRoot / (*it)[1].str())) << page << " links to " << (*it)[1];
    }
  }
}

TEST(ReadmeTest, FoldersAndProgramsThatAreNamedExist) {
  const std::string text = Contents(kRoot / "README.md");
  const std::regex folder("`((?:src|include|tests|bench|samples)/[a-z/]*)`");
  int found = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), folder), end; it != end; ++it, ++found) {
    EXPECT_TRUE(fs::exists(kRoot / (*it)[1].str())) << (*it)[1];
  }
  EXPECT_GE(found, 10);
}

TEST(ReadmeTest, ShellLinesRun) {
  const fs::path work =
      fs::path(::testing::TempDir()) / ("tessera_readme_" + std::to_string(std::random_device{}()));
  fs::create_directories(work);
  const auto run = [&](const std::string& arguments) {
    const std::string line = "cd '" + work.string() + "' && '" TESSERA_PROGRAM "' -q " + arguments;
    return std::system((line + " >output.txt 2>&1").c_str());
  };
  for (const char* input : {"in.exr", "a.png", "b.png", "shot.0001.exr"}) {
    ASSERT_EQ(run(std::string("--pattern ramp 64x48 3 --addc 0.1 -o ") + input), 0)
        << Contents(work / "output.txt");
  }
  for (int frame = 2; frame <= 100; ++frame) {
    char name[16];
    std::snprintf(name, sizeof name, "shot.%04d.exr", frame);
    fs::copy_file(work / "shot.0001.exr", work / name);
  }
  int lines = 0;
  for (const std::string& line : Block(Contents(kRoot / "README.md"), "sh")) {
    if (line.rfind("tessera ", 0) != 0) continue;
    ++lines;
    EXPECT_EQ(run(line.substr(line.find(' '))), 0) << line << "\n" << Contents(work / "output.txt");
    const size_t output = line.find("-o ");
    ASSERT_NE(output, std::string::npos) << line;
    std::string name = line.substr(output + 3);
    if (const size_t digits = name.find('#'); digits != std::string::npos) name.replace(digits, 1, "0100");
    EXPECT_TRUE(fs::exists(work / name)) << line;
  }
  EXPECT_EQ(lines, 12);
  fs::remove_all(work);
}

}  // namespace
}  // namespace tessera::house
