// doc/oiiotool.md has every command of the installed oiiotool, and says of each what is so.
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class OiiotoolTableTest : public CliTest {};

struct Row {
  std::string here, words;
};

std::map<std::string, Row> Table() {
  std::ifstream file(TESSERA_SOURCE_DIR "/doc/oiiotool.md");
  std::map<std::string, Row> rows;
  const std::regex pattern("\\| `--?([a-z0-9_-]+)` \\| ([a-z ]+) \\| ?(.*) \\|");
  std::smatch found;
  for (std::string line; std::getline(file, line);) {
    if (std::regex_match(line, found, pattern)) rows[found[1]] = {found[2], found[3]};
  }
  return rows;
}

TEST_F(OiiotoolTableTest, HasEveryCommandOfOiiotoolsHelp) {
  const std::map<std::string, Row> rows = Table();
  std::istringstream help(Oiiotool("--help").out);
  const std::regex command("    --?([a-zA-Z0-9_-]+).*");
  std::smatch found;
  int count = 0;
  bool listed = false;
  for (std::string line; std::getline(help, line);) {
    listed = listed || line.starts_with("Options (general");
    if (!listed || !std::regex_match(line, found, command)) continue;
    EXPECT_TRUE(rows.contains(found[1])) << found[1];
    ++count;
  }
  EXPECT_GE(count, 190);
}

TEST_F(OiiotoolTableTest, SaysWhatIsSo) {
  std::map<std::string, std::string> aliases = {{"stats", "printstats"}};
  std::set<std::string> ours;
  std::istringstream list(Works("--list-commands"));
  for (std::string line; std::getline(list, line);) ours.insert(line.substr(0, line.find('\t')));
  for (const auto& [name, row] : Table()) {
    SCOPED_TRACE(name);
    if (row.here != "left out") {
      EXPECT_TRUE(row.here == "same" || row.here == "different") << row.here;
      EXPECT_EQ(row.here == "same", row.words.empty()) << row.words;
      EXPECT_TRUE(ours.contains(name) || aliases.contains(name));
      continue;
    }
    EXPECT_FALSE(ours.contains(name));
    const CommandResult asked = Tessera("--" + name);
    EXPECT_EQ(asked.exit_code, 2);
    EXPECT_NE(asked.err.find("a command of oiiotool that is not here; " + row.words), std::string::npos)
        << asked.err;
  }
}

}  // namespace
}  // namespace tessera::testing
