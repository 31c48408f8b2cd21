// Help, the command lists and the other commands that only inform: all of them cover the registry.
#include "cli/help.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/cli_test.h"
#include "ops/registry.h"
#include "tessera/targets.h"

namespace tessera::testing {
namespace {

class HelpTest : public CliTest {
 protected:
  // As the program prints it, which is started for some of them only.
  std::string Page(const std::string& name) {
    std::ostringstream page;
    cli::PrintCommandHelp(page, name);
    if (asked_++ % 40 == 0) EXPECT_EQ(Works("--help " + name), page.str());
    return page.str();
  }

 private:
  int asked_ = 0;
};

// Text with every run of blanks and line ends as one blank.
std::string OneLine(const std::string& text) {
  std::istringstream in(text);
  std::string line;
  for (std::string word; in >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

// What every page of help keeps to: lines of 100 columns, a blank after a sentence, counts that are read
// aloud.
void KeepsToTheRules(const std::string& page) {
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    const auto columns = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xc0) != 0x80; });
    EXPECT_LE(columns, 100) << line;
  }
  const std::string text = OneLine(page);
  std::smatch found;
  EXPECT_FALSE(std::regex_search(text, found, std::regex("[a-z0-9)]\\.[A-Z][a-z]+[ ,]"))) << found.str();
  EXPECT_FALSE(std::regex_search(text, found, std::regex("numbers, [^…:;.]*[0-9], [0-9]+ of them")))
      << found.str();
  EXPECT_FALSE(
      std::regex_search(text, found, std::regex("\\b1 (codes|images|channels|pixels|frames|texels)\\b")))
      << found.str();
}

TEST_F(HelpTest, EveryCommandHasAPage) {
  const std::string list = Works("--list-commands");
  std::istringstream lines(list);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "name\tgroup\ttakes\tgives\targuments\tmodifiers\tsummary");
  int commands = 0;
  while (std::getline(lines, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), '\t'), 6) << line;
    std::string name = line.substr(0, line.find('\t'));
    if (name.starts_with("pattern ")) name = name.substr(8);
    const std::string page = Page(name), summary = line.substr(line.rfind('\t') + 1);
    SCOPED_TRACE(name);
    KeepsToTheRules(page);
    EXPECT_NE(page.find(name), std::string::npos) << page;
    EXPECT_FALSE(summary.empty()) << line;
    EXPECT_NE(page.find(summary.substr(0, summary.find(' '))), std::string::npos) << page;
    ++commands;
  }
  EXPECT_GT(commands, 40);
}

TEST_F(HelpTest, TheOverviewKeepsToTheRules) {
  KeepsToTheRules(Works("--help"));
  EXPECT_NE(OneLine(Works("--help ccmatrix")).find("numbers, 9, 12, 16 or 20 of them"), std::string::npos);
}

TEST_F(HelpTest, FrameNumbersOutsideFileNamesAreTold) {
  EXPECT_NE(Works("--help").find("{FRAME_NUMBER}"), std::string::npos);
  EXPECT_NE(Works("--help frames").find("{FRAME_NUMBER/24}"), std::string::npos);
}

TEST_F(HelpTest, PagesAndListsHoldWhatTheRegistrySays) {
  const std::string tsv = Works("--list-commands"), json = Works("--list-commands:format=json"),
                    page = Works("--list-commands:format=markdown"), overview = Works("--help");
  for (const ops::OpInfo& op : ops::Registry()) {
    SCOPED_TRACE(op.name);
    const std::string listed = (op.generator ? "pattern " : "") + op.name;
    EXPECT_NE(tsv.find("\n" + listed + "\t"), std::string::npos);
    EXPECT_NE(json.find("{\"name\": \"" + listed + "\""), std::string::npos);
    EXPECT_NE(page.find("\n### " + listed + "\n"), std::string::npos);
    EXPECT_NE(overview.find("  " + std::string(op.generator ? "" : "--") + op.name), std::string::npos);
    const std::string help = Page(op.name);
    for (const auto* params : {&op.arguments, &op.modifiers}) {
      for (const ops::ParamInfo& p : *params) {
        EXPECT_NE(help.find(p.name), std::string::npos) << p.name;
        EXPECT_NE(OneLine(help).find(OneLine(p.help)), std::string::npos) << p.name;
        EXPECT_NE(json.find("\"name\": \"" + p.name + "\""), std::string::npos) << p.name;
      }
    }
    if (!op.examples.empty()) {
      EXPECT_NE(json.find("\"examples\": [\"" + op.examples[0]), std::string::npos) << op.examples[0];
      // A matrix does not fit into a line; and a pattern has no page where a command has its name.
      const bool fits = op.generator != help.starts_with("--") &&
                        std::any_of(op.examples.begin(), op.examples.end(),
                                    [&op](const std::string& e) { return e.size() + op.name.size() < 50; });
      EXPECT_TRUE(!fits || help.find("\nExamples\n  tessera ") != std::string::npos) << help;
    }
  }
}

// Each is accepted as it stands, with a shell's quotes.
TEST_F(HelpTest, ExamplesAreLinesThatWork) {
  Works("--pattern perlin:freq=3 96x64 4 -o in.exr");
  for (char name = 'a'; name <= 'z'; ++name) {
    std::filesystem::copy_file(Path("in.exr"), Path(std::string(1, name) + ".exr"));
  }
  std::ofstream(Path("look.json"))
      << R"({"tessera_graph":1,"inputs":["plate"],"nodes":[{"input":"plate"}],"result":0})";
  std::ofstream jobs(Path("jobs"));
  int lines = 0;
  std::vector<std::string> names;
  for (const ops::OpInfo& op : ops::Registry()) {
    if (op.generator) names.push_back(op.name);
  }
  std::istringstream list(Works("--list-commands"));
  for (std::string line; std::getline(list, line);) {
    const std::string name = line.substr(0, line.find('\t'));
    if (name != "name" && !name.starts_with("pattern ")) names.push_back(name);
  }
  for (const std::string& name : names) {
    std::istringstream page(Page(name));
    std::string line;
    while (std::getline(page, line) && line != "Examples") continue;
    for (; std::getline(page, line) && line.starts_with("  tessera "); ++lines)
      jobs << "-n " << line.substr(10) << "\n";
  }
  jobs.close();
  EXPECT_GT(lines, 350);
  const CommandResult result =
      RunCommand({"sh", "-c", "'" + std::string(TESSERA_PROGRAM) + "' --batch < jobs"}, directory_.path());
  std::istringstream answers(result.out);
  for (std::string answer; std::getline(answers, answer); --lines)
    EXPECT_NE(answer.find("\"exit_code\":0,"), std::string::npos) << answer;
  EXPECT_EQ(lines, 0);
}

TEST_F(HelpTest, SaysWhereAParameterHasAUse) {
  EXPECT_NE(Works("--help fog").find("default 100; only with mode=linear."), std::string::npos);
  EXPECT_NE(Works("--help blur").find("not with sigma="), std::string::npos);
}

TEST_F(HelpTest, JsonIsJson) {
  Works("--list-commands:format=json");
  const CommandResult result = RunCommand(
      {"sh", "-c",
       std::string("'") + TESSERA_PROGRAM + "' --list-commands:format=json | python3 -m json.tool"},
      directory_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.out.starts_with("[")) << result.out.substr(0, 80);
}

TEST_F(HelpTest, TopicsMayHaveDashes) {
  EXPECT_EQ(Works("--help --saturate"), Works("-help saturate"));
  EXPECT_NE(Works("--help o").find("-o"), std::string::npos);
  EXPECT_NE(Works("-h").find("Usage: tessera"), std::string::npos);
}

TEST_F(HelpTest, VersionAndTargets) {
  EXPECT_TRUE(Works("--version").starts_with("tessera "));
  std::istringstream lines(Works("--simd list"));
  std::vector<std::string> targets;
  for (std::string line; std::getline(lines, line);) targets.push_back(line);
  EXPECT_EQ(targets, SimdTargets());
}

}  // namespace
}  // namespace tessera::testing
