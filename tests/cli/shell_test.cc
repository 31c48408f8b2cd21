// What the program tells shells and readers: --help-search, help on a terminal, --man, --completion.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/cli_test.h"
#include "cli/synonyms.h"
#include "ops/registry.h"

namespace tessera::testing {
namespace {

class ShellTest : public CliTest {
 protected:
  CommandResult Shell(const std::string& line) { return RunCommand({"sh", "-c", line}, directory_.path()); }
  bool Has(const std::string& program) { return Shell("command -v " + program).exit_code == 0; }
  std::string Program() const { return "'" + std::string(TESSERA_PROGRAM) + "'"; }
  void Keep(const std::string& name, const std::string& text) { std::ofstream(Path(name)) << text; }
};

std::vector<std::string> LinesOf(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST_F(ShellTest, SearchFindsWhatOthersCallIt) {
  const auto first = [&](const std::string& words) {
    const CommandResult result = Tessera(std::vector<std::string>{"--help-search", words});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return LinesOf(result.out).at(0);
  };
  EXPECT_TRUE(first("worley").starts_with("--pattern cell")) << first("worley");
  EXPECT_TRUE(first("Voronoi").starts_with("--pattern cell"));
  EXPECT_TRUE(first("saturate").starts_with("--saturate"));
  EXPECT_NE(Works("--help-search grade").find("--cdl"), std::string::npos);
  EXPECT_NE(Works("--help-search sharpening").find("--unsharp"), std::string::npos);
  EXPECT_TRUE(first("soft shadow").starts_with("--shadow") ||
              first("soft shadow").starts_with("--softshadow"));
  EXPECT_NE(Works("--help-search views").find("oiiotool's --views"), std::string::npos);
}

TEST_F(ShellTest, SearchThatFindsNothingSaysSo) {
  const CommandResult none = Tessera("--help-search zyzzyva");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("no command is about"), std::string::npos) << none.err;
  EXPECT_EQ(Tessera(std::vector<std::string>{"--help-search", "..."}).exit_code, 2);
  EXPECT_EQ(Tessera("--help-search").exit_code, 2);
}

TEST_F(ShellTest, SynonymsAreOfCommandsThatExist) {
  const std::string list = "\n" + Works("--list-commands");
  for (const auto& [words, names] : cli::Synonyms()) {
    EXPECT_FALSE(words.empty());
    std::istringstream in(names);
    for (std::string name; in >> name;) {
      EXPECT_TRUE(list.find("\n" + name + "\t") != std::string::npos ||
                  list.find("\npattern " + name + "\t") != std::string::npos)
          << name;
    }
  }
}

TEST_F(ShellTest, HelpFitsTheTerminal) {
  if (!Has("script")) GTEST_SKIP() << "no script(1)";
  const auto shown = [&](const std::string& set, const std::string& words) {
    return Shell("TERM=xterm script -qec \"stty cols 60; " + set + " '" + TESSERA_PROGRAM + "' " + words +
                 "\" /dev/null </dev/null")
        .out;
  };
  const std::string page = shown("", "--help hue");
  EXPECT_NE(page.find("\033[1;36m--hue\033[0m"), std::string::npos) << page;
  const std::regex escapes("\033\\[[0-9;]*m|\r");
  size_t columns = 0;
  for (const std::string& line : LinesOf(std::regex_replace(shown("", "--help blur"), escapes, ""))) {
    if (line.starts_with("  tessera ")) continue;  // an example, to be copied as it is
    const auto n = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xc0) != 0x80; });
    columns = std::max(columns, static_cast<size_t>(n));
  }
  EXPECT_LE(columns, 60u);
  EXPECT_GT(columns, 50u);
  EXPECT_EQ(shown("NO_COLOR=1", "--help hue").find('\033'), std::string::npos);
  EXPECT_EQ(shown("TERM=dumb", "--help hue").find('\033'), std::string::npos);
  EXPECT_EQ(Works("--help hue").find('\033'), std::string::npos);
}

TEST_F(ShellTest, ManualHoldsEveryCommand) {
  const std::string page = Works("--man");
  EXPECT_EQ(page, Works("--man"));
  Keep("tessera.1", page);
  if (Has("mandoc")) {
    const CommandResult lint = Shell("mandoc -T lint -W warning tessera.1 | grep -v 'missing date'");
    EXPECT_EQ(lint.out, "");
  }
  std::string shown;
  if (Has("groff")) {
    const CommandResult roff =
        Shell("groff -man -Tutf8 -ww -Wbreak -rLL=100n tessera.1 | sed 's/\\x1b\\[[0-9;]*m//g;s/.\\x08//g'");
    EXPECT_EQ(roff.err, "");
    shown = roff.out;
  } else if (Has("mandoc")) {
    shown = Shell("mandoc -T utf8 tessera.1 | col -b").out;
  } else {
    GTEST_SKIP() << "no groff and no mandoc";
  }
  for (const ops::OpInfo& op : ops::Registry())
    EXPECT_NE(shown.find(op.generator ? op.name : "--" + op.name), std::string::npos) << op.name;
  EXPECT_NE(shown.find("EXIT STATUS"), std::string::npos);
  EXPECT_NE(shown.find("[:preserve=luminance:weights=rec709] DEG"), std::string::npos);
}

TEST_F(ShellTest, BashCompletes) {
  if (!Has("bash")) GTEST_SKIP() << "no bash";
  Keep("picture.exr", "");
  Keep("complete", Works("--completion bash") + R"(
for line in "$@"; do
  COMP_LINE=$line COMP_POINT=${#line} COMPREPLY=()
  _tessera
  echo "${COMPREPLY[*]}"
done
)");
  const CommandResult result = Shell(
      "bash complete 'tessera in.exr --satur' 'tessera --hue:pre' 'tessera --hue:preserve=' "
      "'tessera --hue:preserve=none:w' 'tessera -d u' 'tessera --pattern che' 'tessera --pattern checker:wi' "
      "'tessera --help satu' 'tessera pic' 'tessera -hue:pre' 'tessera --completion f' 'tessera a --codec '");
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(result.out,
            "--saturate\npreserve=\nluminance none css\nweights=\nuint8 uint16\nchecker\nwidth=\nsaturate\n"
            "picture.exr\npreserve=\nfish\nauto oiio\n");
  // Where the user has taken : and = out of what parts words, whole words are wanted.
  EXPECT_EQ(
      Shell("COMP_WORDBREAKS=' ' bash -c 'COMP_WORDBREAKS=\" \"; . ./complete \"tessera --hue:pre\"'").out,
      "--hue:preserve=\n");
}

TEST_F(ShellTest, ZshCompletes) {
  if (!Has("zsh")) GTEST_SKIP() << "no zsh";
  Keep("_tessera", Works("--completion zsh"));
  const CommandResult result = Shell(
      "zsh -fc 'autoload -U compinit; compdef() { print bound $1 $2 }; source ./_tessera; "
      "_tessera_candidates --hue:preserve= in.exr; _tessera_candidates u -d; _tessera_candidates checker: --pattern'");
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(
      result.out,
      "bound _tessera tessera\n--hue:preserve=luminance\n--hue:preserve=none\n--hue:preserve=css\n"
      "uint8\nuint16\nhalf\nfloat\nchecker:color1=\nchecker:color2=\nchecker:width=\nchecker:height=\n");
}

TEST_F(ShellTest, FishCompletes) {
  if (!Has("fish")) GTEST_SKIP() << "no fish";
  Keep("tessera.fish", Works("--completion fish"));
  const auto completed = [&](const std::string& line) {
    const CommandResult result =
        Shell("HOME=. fish -N -c 'source tessera.fish; complete -C \"" + line + "\"'");
    EXPECT_EQ(result.err, "");
    return result.out;
  };
  EXPECT_EQ(completed("tessera in.exr --satur"), "--saturate\tChange saturation, keeping luminance\n");
  EXPECT_EQ(completed("tessera --hue:preserve=lu"), "--hue:preserve=luminance\n");
  EXPECT_EQ(completed("tessera -d uint"), "uint8\nuint16\n");
}

}  // namespace
}  // namespace tessera::testing
