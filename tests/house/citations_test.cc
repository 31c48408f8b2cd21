// What texts cite has to be there: files that comments, help and documents name, and papers by name and year.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace tessera::house {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string Contents(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Every match of `pattern`'s group 1.
std::vector<std::string> Matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) {
    found.push_back((*it)[1].str());
  }
  return found;
}

// The text as a reader has it: marks of comments and breaks within string literals are gone.
std::string AsRead(const std::string& text) {
  static const std::regex kBreak(R"(\s*\n\s*(?:///?<?|#)?[ \t]*"?|"\s*\n\s*")");
  const std::string joined = std::regex_replace(text, std::regex(R"("[ \t]*\n[ \t]*")"), "");
  return std::regex_replace(joined, kBreak, " ");
}

// Documents that programs write; they are in no tree.
const std::set<std::string>& Written() {
  static const std::set<std::string> kNames = {"commands.md", "report.md", "out/lic.md"};
  return kNames;
}

// Citations by name and year, "Porter and Duff 1984" or "Segal et al. 1992", and the same of several papers.
std::vector<std::string> Papers(const std::string& text) {
  static const std::regex kCitation(
      R"(((?:van )?[A-Z][A-Za-z0-9-]+(?: and (?:Von )?[A-Z][A-Za-z-]+| et al\.)? (?:19[6-9]|20[0-2])\d)\b)");
  return Matches(text, kCitation);
}

struct House {
  fs::path root;
  std::vector<fs::path> files;
  std::string references;
};

House Scan(const fs::path& root) {
  House house{root, {}, {}};
  for (const char* room : {"src", "include", "tests", "bench", "samples", "cmake", "doc"}) {
    if (!fs::exists(root / room)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      static const std::set<std::string> kTexts = {".h",  ".cc",  ".c",     ".md", ".sh",
                                                   ".py", ".txt", ".cmake", ".in"};
      if (entry.is_regular_file() && kTexts.count(entry.path().extension().string()) != 0)
        house.files.push_back(entry.path());
    }
  }
  for (const char* page : {"README.md", "CONTRIBUTING.md"}) {
    if (fs::exists(root / page)) house.files.push_back(root / page);
  }
  // Lines are "| name year, name year | what it is |".
  house.references = Contents(root / "doc/references.md");
  return house;
}

bool Planted(const fs::path& file) {
  return file.filename() == "citations_test.cc" || file.filename() == "includes_test.cc";
}

// Every citation that leads nowhere, one line each.
std::vector<std::string> Dangling(const fs::path& root) {
  const House house = Scan(root);
  std::vector<std::string> dangling;
  std::set<std::string> known;
  for (const std::string& line : Matches(house.references, std::regex(R"(\n\| ([^|]*) \|)"))) {
    for (const std::string& paper : Matches(line + ",", std::regex(R"((\S[^,]*),)"))) known.insert(paper);
  }
  for (const fs::path& file : house.files) {
    if (Planted(file)) continue;
    const std::string name = fs::relative(file, root).string(), text = Contents(file);
    const auto there = [&](const std::string& path) {
      return fs::exists(root / path) || fs::exists(file.parent_path() / path) ||
             fs::exists(root / "src" / path) || fs::exists(root / "include" / path);
    };
    for (const std::string& page :
         Matches(text,
                 std::regex(R"((?:^|[^A-Za-z0-9_./-])/?((?:\.\.?/)*[A-Za-z0-9_-][A-Za-z0-9_./-]*\.md)\b)"))) {
      if (Written().count(page) == 0 && Written().count(fs::path(page).filename().string()) == 0 &&
          !there(page))
        dangling.push_back(name + ": " + page + " is not there");
    }
    static const std::regex kPath(
        R"((?:^|[\s"'`(])((?:src|include|tests|bench|samples|cmake|doc)/[A-Za-z0-9_./-]*\.(?:h|cc|c|py|sh|cmake|in))\b)");
    for (const std::string& path : Matches(text, kPath)) {
      if (!there(path)) dangling.push_back(name + ": " + path + " is not there");
    }
    // Documents by a word that nobody can look up.
    for (const std::string& word : Matches(text, std::regex(R"(\b(Spec:|ACCURACY|KERNELS\.|DESIGN\.))"))) {
      dangling.push_back(name + ": \"" + word + "\" names no document");
    }
    const bool cites =
        name.rfind("doc/", 0) == 0 || name.rfind("src/ops/", 0) == 0 || name.rfind("include/", 0) == 0;
    if (!cites || name == "doc/references.md") continue;
    for (const std::string& paper : Papers(AsRead(text))) {
      if (known.count(paper) == 0) dangling.push_back(name + ": " + paper + " is not in doc/references.md");
    }
  }
  return dangling;
}

TEST(CitationsTest, WhatIsCitedIsThere) {
  const std::vector<std::string> dangling = Dangling(TESSERA_SOURCE_DIR);
  std::string all;
  for (const std::string& line : dangling) all += line + "\n";
  EXPECT_THAT(dangling, IsEmpty()) << dangling.size() << " dangling:\n" << all;
}

TEST(CitationsTest, HelpCitesPapers) {
  // Not of files, which whoever has installed the program does not have.
  int sources = 0;
  for (const fs::path& file : Scan(TESSERA_SOURCE_DIR).files) {
    if (file.extension() != ".cc" || file.string().find("/src/ops/") == std::string::npos) continue;
    std::istringstream lines(Contents(file));
    std::string code;
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("//", line.find_first_not_of(' ')) != line.find_first_not_of(' ')) code += line + "\n";
    }
    const std::string text = AsRead(code);
    for (size_t at = text.find("Source"); at != std::string::npos; at = text.find("Source", at + 1)) {
      if (text.compare(at, 8, "Source: ") != 0 && text.compare(at, 9, "Sources: ") != 0) continue;
      ++sources;
      EXPECT_THAT(text.substr(at, text.find('"', at) - at), Not(HasSubstr(".md"))) << file;
    }
  }
  EXPECT_GE(sources, 40);
}

class DanglingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(::testing::TempDir()) / ("tessera_citations_" + std::to_string(std::random_device{}()));
    Plant(
        "doc/references.md",
        "| cited as | |\n|---|---|\n| Porter and Duff 1984 | Compositing |\n| A 1990, Segal et al. 1992 | B |\n");
    Plant("doc/maths/color.md", "Colours, after Porter and Duff 1984.\n");
    Plant("src/ops/good.cc", "// Over. Source: Porter and Duff 1984, 4; doc/maths/color.md.\n");
  }
  void TearDown() override { fs::remove_all(root_); }
  void Plant(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  void ExpectDangling(const std::string& path, const std::string& text, const std::string& what) {
    Plant(path, text);
    EXPECT_THAT(Dangling(root_), Contains(HasSubstr(path + ": " + what))) << text;
    fs::remove(root_ / path);
  }
  fs::path root_;
};

TEST_F(DanglingTest, GoodCitationsPass) { EXPECT_THAT(Dangling(root_), IsEmpty()); }

TEST_F(DanglingTest, DanglingOnesAreFound) {
  ExpectDangling("src/ops/a.cc", "// Source: spec/color.md.\n", "spec/color.md is not there");
  ExpectDangling("src/ops/a.cc", "// Spec: the pages.\n", "\"Spec:\" names no document");
  ExpectDangling("include/tessera/a.h", "/// Within ACCURACY's row.\n", "\"ACCURACY\" names no document");
  ExpectDangling("doc/maths/a.md", "See [it](fog.md).\n", "fog.md is not there");
  ExpectDangling("tests/a.cc", "// As in src/ops/gone.cc.\n", "src/ops/gone.cc is not there");
  ExpectDangling("src/ops/a.cc", "    \"Source: Williams 1978.\";\n", "Williams 1978 is not in");
  ExpectDangling("src/ops/a.cc", "    \"Source: Reeves et \"\n    \"al. 1987.\";\n",
                 "Reeves et al. 1987 is not in");
  ExpectDangling("include/tessera/a.h", "/// Source: van\n/// Wijk 1991.\n", "van Wijk 1991 is not in");
}

}  // namespace
}  // namespace tessera::house
