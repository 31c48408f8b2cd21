// Reports of --json have the keys that doc/reports.md says, and the numbers of the reports for people.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

using nlohmann::json;

class JsonReportTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("a.exr", 61, 43, 3, OIIO::TypeHalf, 3);
    MakePicture("b.exr", 61, 43, 3, OIIO::TypeHalf, 4);
  }
  std::vector<json> Reports(const std::string& line, int code = 0) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, code) << result.err;
    std::vector<json> reports;
    std::istringstream lines(result.out);
    for (std::string text; std::getline(lines, text);) reports.push_back(json::parse(text));
    return reports;
  }
};

std::map<std::string, std::set<std::string>> Documented() {
  std::ifstream file(TESSERA_SOURCE_DIR "/doc/reports.md");
  std::map<std::string, std::set<std::string>> keys;
  const std::regex row("\\| `([a-z]+)` \\| .* \\| (.*) \\|"), key("`([a-z0-9_]+)`");
  std::smatch found;
  for (std::string line; std::getline(file, line);) {
    if (!std::regex_match(line, found, row)) continue;
    const std::string list = found[2];
    for (std::sregex_iterator it(list.begin(), list.end(), key), end; it != end; ++it)
      keys[found[1]].insert((*it)[1]);
  }
  return keys;
}

TEST_F(JsonReportTest, HaveTheKeysThatAreDocumented) {
  const auto documented = Documented();
  EXPECT_EQ(documented.size(), 13U);
  Works("a.exr --attrib oiio:subimagename x b.exr --attrib oiio:subimagename y --siappend -o parts.exr");
  std::set<std::string> seen;
  for (const auto& [line, code] : std::vector<std::pair<std::string, int>>{
           {"--json --info a.exr", 0},
           {"--json a.exr --printinfo", 0},
           {"--json a.exr --printstats", 0},
           {"--json a.exr b.exr --diff", 1},
           {"--json -a --diff a.exr parts.exr", 1},
           {"--json a.exr a.exr --pdiff", 0},
           {"--json a.exr --colorcount 0,0,0:1,1,1", 0},
           {"--json a.exr --rangecheck 0 1", 0},
           {"--json a.exr --saturate 0.5 --explain -o x.exr", 0},
           {"--json a.exr --saturate 0.5 --explain:cost=1 -o x.exr", 0},
           {"--json a.exr --saturate 0.5 --verify --runstats -o x.exr", 0},
           {"--json --frames 1-2 --part 1/1 --resume a.exr --saturate 0.5 -o x.#.exr", 0}}) {
    SCOPED_TRACE(line);
    for (const json& report : Reports(line, code)) {
      if (report["report"] == "diff" && report["verdict"] == "pass") continue;  // without `worst`
      const std::string kind = report.at("report");
      ASSERT_TRUE(documented.contains(kind)) << kind;
      std::set<std::string> keys;
      for (const auto& [key, value] : report.items()) {
        if (key != "report") keys.insert(key);
      }
      EXPECT_EQ(keys, documented.at(kind)) << kind;
      seen.insert(kind);
    }
  }
  EXPECT_EQ(seen.size(), documented.size());
}

TEST_F(JsonReportTest, PhasesAreNumbersThatAddUp) {
  const json phases = Reports("--json --threads 2 a.exr --saturate 0.5 --runstats -o x.exr").at(0)["phases"];
  double sum = phases["decode"].at(0)["busy"];
  EXPECT_EQ(phases["decode"][0]["file"], "a.exr");
  for (const char* phase : {"prepare", "compute", "encode", "wait"}) sum += double{phases[phase]};
  EXPECT_EQ(phases["threads"], 2);
  EXPECT_NEAR(sum, 2 * double{phases["seconds"]}, 1e-6);
  EXPECT_TRUE(phases["limit"].is_string());
}

TEST_F(JsonReportTest, CostsAreOfPassesAndLeaveNothing) {
  const auto temporary = [] {
    int found = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::temp_directory_path()))
      found += entry.path().filename().string().rfind("tessera-cost-", 0) == 0;
    return found;
  };
  const int before = temporary();
  const json cost = Reports("--json --threads 2 a.exr --saturate 0.5 --explain:cost=1 -o cost.png").at(0);
  EXPECT_EQ(cost["threads"], 2);
  EXPECT_EQ(cost["pixels"], 61 * 43);
  std::vector<std::string> names;
  double longest = 0, all = 0;
  int pass = 0;
  for (const json& part : cost["parts"]) {
    names.push_back(part["name"]);
    longest = std::max(longest, double{part["elapsed"]}), all += double{part["elapsed"]};
    EXPECT_GE(part["pass"], pass);
    pass = part["pass"];
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"start", "prepare", "decode a.exr", "compute", "encode cost.png"}));
  EXPECT_GE(cost["seconds"], longest);
  EXPECT_LE(cost["seconds"], all * (1 + 1e-9));
  EXPECT_GT(cost["memory"], 1 << 20);
  EXPECT_EQ(temporary(), before);
  EXPECT_FALSE(std::filesystem::exists(Path("cost.png")));
}

TEST_F(JsonReportTest, HoldWhatIsSo) {
  const json same = Reports("--json a.exr a.exr --diff").at(0);
  EXPECT_EQ(same["verdict"], "pass");
  EXPECT_EQ(same["max_error"], 0);
  EXPECT_TRUE(same["psnr"].is_null());
  EXPECT_FALSE(same.contains("worst"));
  const json differ = Reports("--json a.exr b.exr --diff", 1).at(0);
  EXPECT_EQ(differ["verdict"], "failure");
  EXPECT_GT(differ["over_fail"], 100);
  const json info = Reports("--json --info --hash a.exr").at(0);
  const json& image = info["images"][0];
  EXPECT_EQ(image["width"], 61);
  EXPECT_EQ(image["type"], "half");
  EXPECT_EQ(image["channels"], json({"R", "G", "B"}));
  EXPECT_EQ(image["sha1"].get<std::string>().size(), 40U);
  const json range = Reports("--json a.exr --rangecheck 0.2 0.7").at(0);
  EXPECT_GE(range["below"].get<int>() + range["above"].get<int>() + range["within"].get<int>(), 61 * 43);
  const json stats = Reports("--json a.exr --mulc 0 --printstats").at(0);
  EXPECT_TRUE(stats["constant"]);
  EXPECT_EQ(stats["channels"][2]["max"], 0);
  EXPECT_TRUE(Reports("--json a.exr --saturate 0.5 --verify -o x.exr").at(0)["within_bound"]);
  EXPECT_GT(json::parse(Works("--json --list-commands")).size(), 200U);
  EXPECT_TRUE(Works("--json -q a.exr --attrib Name \xff --printinfo").find("\xff") == std::string::npos);
}

}  // namespace
}  // namespace tessera::testing
