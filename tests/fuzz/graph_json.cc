// Graphs as JSON: whatever is read is written and read again as the same text.
#include "tessera/graph_json.h"

#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "ops/registry.h"

using namespace tessera;

namespace tessera::fuzz {
namespace {

const Node& Plate() {
  static const Image image(ImageSpec(5, 4, 4));
  static const Node node = AsInput(FromImage(image), "plate");
  return node;
}

}  // namespace

std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = {
      R"({"tessera_graph":1,"nodes":[{"file":"none.exr","part":"P"}],"result":0})",
      R"({"tessera_graph":1,"nodes":[{"operation":"ramp","window":[-1,0,4,4],"display":[0,0,9,9],"channels":["R","A"],"alpha":1,"type":"half"}],"result":0})"};
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      const int count = op.generator ? 0 : op.Operands(ops::ParseExample(op, example));
      const std::vector<Node> images(static_cast<size_t>(count), Plate());
      Try([&] {
        seeds.push_back(ToJson(op.generator ? Generate(op.name, ImageSpec(5, 4, 4), example)
                                            : Apply(op.name, images, example))
                            .text);
      });
    }
  }
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words = {"\"tessera_graph\"",
                                    "\"inputs\"",
                                    "\"nodes\"",
                                    "\"result\"",
                                    "\"input\"",
                                    "\"file\"",
                                    "\"part\"",
                                    "\"subimage\"",
                                    "\"operation\"",
                                    "\"parameters\"",
                                    "\"window\"",
                                    "\"display\"",
                                    "\"channels\"",
                                    "\"alpha\"",
                                    "1e999",
                                    "-1",
                                    "[",
                                    "]",
                                    "{",
                                    "}",
                                    ",",
                                    "\\u0000",
                                    "true",
                                    "null"};
  for (const ops::OpInfo& op : ops::Registry()) words.push_back("\"" + op.name + "\"");
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::Try([&] {
    std::map<std::string, Node> images;
    for (const std::string& name : GraphInputs(text)) images[name] = fuzz::Plate();
    const std::string once = ToJson(FromJson(text, images)).text;
    std::map<std::string, Node> again;
    for (const std::string& name : GraphInputs(once)) again[name] = fuzz::Plate();
    fuzz::Require(ToJson(FromJson(once, again)).text == once, "another graph the second time");
  });
  return 0;
}
