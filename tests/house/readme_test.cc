// What the README shows must be so: its C++ lines are those of the sample, its files exist, its commands are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "ops/registry.h"

namespace tessera::house {
namespace {

namespace fs = std::filesystem;
const fs::path kRoot = TESSERA_SOURCE_DIR;

std::string Contents(const fs::path& file) {
  std::ifstream stream(file);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The lines of the README's first fenced block of a language.
std::vector<std::string> Block(const std::string& readme, const std::string& language) {
  const size_t begin = readme.find("```" + language + "\n");
  if (begin == std::string::npos) return {};
  std::istringstream text(readme.substr(begin, readme.find("\n```", begin) - begin));
  std::vector<std::string> lines;
  std::string line;
  std::getline(text, line);
  while (std::getline(text, line)) lines.push_back(line);
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

TEST(ReadmeTest, FoldersOfTheTableExist) {
  const std::string text = Contents(kRoot / "README.md");
  const std::regex folder("`((?:src|include|tests|bench|samples)/[a-z/]*)`");
  int found = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), folder), end; it != end; ++it, ++found) {
    EXPECT_TRUE(fs::is_directory(kRoot / (*it)[1].str())) << (*it)[1];
  }
  EXPECT_GE(found, 10);
}

TEST(ReadmeTest, OperationsOfTheShellLinesAreRegistered) {
  const std::string text = Contents(kRoot / "README.md");
  for (const char* name : {"mulc", "saturate", "hue", "interp", "clamp", "mul"}) {
    EXPECT_NE(text.find(std::string("--") + name), std::string::npos) << name;
    EXPECT_NE(ops::FindOp(name), nullptr) << name;
  }
}

}  // namespace
}  // namespace tessera::house
