// Graphs as files of the command line: what is saved is run again with the same bits.
#include <fstream>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class GraphLineTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("a.exr", 90, 70, 4, OIIO::TypeFloat);
    MakePicture("b.exr", 90, 70, 4, OIIO::TypeHalf, 2);
  }
  void Same(const std::string& one, const std::string& other) {
    EXPECT_EQ(Oiiotool("--fail 0 --hardfail 0 " + one + " " + other + " --diff").exit_code, 0);
  }
  std::string Refused(const std::string& line, int exit_code) {
    const auto before = directory_.Names();
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, exit_code) << line << ": " << result.err;
    EXPECT_EQ(directory_.Names(), before) << line;
    return result.err;
  }
  void Save(const std::string& name, const std::string& text) { std::ofstream(Path(name)) << text; }
};

TEST_F(GraphLineTest, ALineAndItsGraphGiveTheSamePixels) {
  const std::vector<std::string> lines = {
      "a.exr --saturate 1.2 --blur:sigma=3:wrap=repeat",
      "a.exr b.exr --over --dup --flip --add --mulc 1,0.5,2,1",
      "--pattern checker:width=9:color1=0.1,0.3 90x70-5+3 4 a.exr --absdiff",
      "a.exr --ch R,A=1,G --resize 40x30",
      "--create 40x30 2 --addc 0.25",
      "a.exr --label x --pop x b.exr --max -i:ch=R,G,B,A x --sub",
  };
  for (const std::string& line : lines) {
    SCOPED_TRACE(line);
    Works(line + " -d float -o line.exr --save-graph g.json");
    Works("run g.json -d float -o graph.exr");
    Works("--load-graph g.json -d float -o loaded.exr");
    Same("line.exr", "graph.exr");
    Same("line.exr", "loaded.exr");
  }
}

TEST_F(GraphLineTest, OpenInputsAreGivenByName) {
  Save("g.json", R"({"tessera_graph":1,"inputs":["plate","light"],"nodes":[{"input":"light"},
      {"input":"plate"},{"operation":"sub","inputs":[1,0]}],"result":2})");
  Works("a.exr b.exr --sub -d float -o line.exr");
  Works("run g.json -i light=b.exr -i plate=a.exr -d float -o graph.exr");
  Works("a.exr --label plate --pop b.exr --label light --pop --load-graph g.json -d float -o labels.exr");
  Same("line.exr", "graph.exr");
  Same("line.exr", "labels.exr");
  EXPECT_NE(Refused("run g.json -i light=b.exr -o out.exr", 1).find("open input \"plate\""),
            std::string::npos);
  EXPECT_NE(Refused("run g.json -i light=b.exr -i plate=a.exr -i x=a.exr -o out.exr", 1)
                .find("no open input \"x\", expected plate, light"),
            std::string::npos);
  EXPECT_NE(Refused("run g.json -i a.exr -o out.exr", 2).find("NAME=FILE"), std::string::npos);
}

TEST_F(GraphLineTest, WhatIsNoGraphIsRefused) {
  EXPECT_NE(Refused("run", 2).find("found no graph"), std::string::npos);
  EXPECT_NE(Refused("run none.json -o out.exr", 1).find("none.json"), std::string::npos);
  EXPECT_NE(Refused("run a.exr -o out.exr", 1).find("no JSON"), std::string::npos);
  Save("wrong.json", R"({"tessera_graph":1,"nodes":[{"file":"a.exr"},
      {"operation":"blur","parameters":{"sigma":-3},"inputs":[0]}],"result":1})");
  const std::string message = Refused("run wrong.json -o out.exr", 1);
  EXPECT_NE(message.find("wrong.json: node 1 (blur:sigma)"), std::string::npos) << message;
}

TEST_F(GraphLineTest, WhatNoGraphHoldsIsNotSaved) {
  EXPECT_NE(Refused("a.exr --text hello --save-graph g.json", 2).find("drew"), std::string::npos);
  Works("a.exr --blur 3x3 -n --save-graph g.json");
  EXPECT_FALSE(std::filesystem::exists(Path("g.json")));
}

}  // namespace
}  // namespace tessera::testing
