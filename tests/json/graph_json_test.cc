// Graphs as JSON: what is written and read has the bits of what was asked for; what is no graph is refused.
#include "tessera/graph_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "graph/op.h"
#include "graph/origin.h"
#include "ops/registry.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Image Picture(int k, int width = 24, int height = 16, int channels = 4) {
  const Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c)
        image.at<float>(x, y, c) = static_cast<float>((7 * x + 13 * y + 5 * c + 11 * k + x * y) % 32) / 32;
    }
  }
  return image;
}

void ExpectSame(const Node& a, const Node& b) {
  ASSERT_EQ(a.spec().data_window, b.spec().data_window);
  EXPECT_EQ(a.spec().display_window, b.spec().display_window);
  EXPECT_EQ(a.spec().channels, b.spec().channels);
  EXPECT_EQ(a.spec().alpha, b.spec().alpha);
  const Image x = Render(a), y = Render(b);
  const auto bytes = static_cast<size_t>(x.spec().data_window.pixels()) * x.spec().channels.size() * 4;
  EXPECT_EQ(std::memcmp(x.view().data, y.view().data, bytes), 0) << "other bits";
}

std::map<std::string, Node> ImagesOf(const GraphJson& graph) {
  return {graph.inputs.begin(), graph.inputs.end()};
}

TEST(GraphJsonTest, EveryExampleComesBackWithItsBits) {
  int compared = 0;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      SCOPED_TRACE(op.name + " " + example);
      const int count = op.generator ? 0 : op.Operands(ops::ParseExample(op, example));
      std::vector<Node> inputs;
      for (int k = 0; k < count; ++k) inputs.push_back(FromImage(Picture(k)));
      ImageSpec spec(24, 16, 4);
      const Node made = op.generator ? Generate(op.name, spec, example) : Apply(op.name, inputs, example);
      const GraphJson graph = ToJson(made);
      const Node back = FromJson(graph.text, ImagesOf(graph));
      EXPECT_EQ(ToJson(back).text, graph.text);
      ExpectSame(made, back);
      ++compared;
    }
  }
  EXPECT_GT(compared, 600);
}

TEST(GraphJsonTest, IsWhatTheHeaderSays) {
  const Node plate = AsInput(FromImage(Picture(0)), "plate");
  ImageSpec spec(24, 16, 4);
  const Node soft = Apply("blur", {plate}, "sigma=3 method=direct");
  const GraphJson graph = ToJson(Apply("over", {soft, Generate("ramp", spec)}));
  EXPECT_EQ(
      graph.text,
      "{\n \"tessera_graph\": 1,\n \"inputs\": [\"plate\"],\n \"nodes\": [\n"
      "  {\"input\":\"plate\"},\n"
      "  {\"operation\":\"blur\",\"parameters\":{\"sigma\":[3],\"method\":\"direct\"},\"inputs\":[0]},\n"
      "  {\"operation\":\"ramp\",\"window\":[0,0,24,16],\"channels\":4},\n"
      "  {\"operation\":\"over\",\"inputs\":[1,2]}\n"
      " ],\n \"result\": 3\n}\n");
  EXPECT_THAT(GraphInputs(graph.text), ElementsAre("plate"));
}

TEST(GraphJsonTest, GeneratorsKeepTheirWindowsChannelsAndType) {
  ImageSpec spec(24, 16, 3, PixelType::kHalf);
  spec.data_window = {-3, 5, 21, 21}, spec.display_window = {0, 0, 30, 30};
  spec.channels = {"A", "u", "v"}, spec.alpha = 0;
  const Node made = Generate("white", spec, "color=1");
  const Node back = FromJson(ToJson(made).text);
  ExpectSame(made, back);
  EXPECT_EQ(back.spec().type, PixelType::kHalf);
}

TEST(GraphJsonTest, NodesThatAreSharedStayShared) {
  Node node = Apply("blur", {FromImage(Picture(0))}, "sigma=2");
  for (int k = 0; k < 40; ++k) node = Apply("max", {node, node});  // 2^40 of a tree
  const GraphJson graph = ToJson(node);
  EXPECT_EQ(graph.inputs.size(), 1u);
  const Node back = FromJson(graph.text, ImagesOf(graph));
  EXPECT_EQ(back.data()->inputs[0].data(), back.data()->inputs[1].data());
  ExpectSame(node, back);
}

TEST(GraphJsonTest, LongChainsAreWrittenReadAndLetGo) {
  Node node = FromImage(Picture(0));
  constexpr int kLong = 50000;
  for (int k = 0; k < kLong; ++k) node = Apply("addc", {node}, "0.25");
  const GraphJson graph = ToJson(node);
  const Node back = FromJson(graph.text, ImagesOf(graph));
  EXPECT_EQ(ToJson(back).text, graph.text);
}

TEST(GraphJsonTest, AnOperationThatChangesNothingIsLeftOut) {
  const Node image = FromImage(Picture(0));
  const ops::OpInfo& op = *ops::FindOp("ch");
  const Node same = Apply(op.name, {image}, op.identity);
  ExpectSame(image, same);
  const GraphJson graph = ToJson(same);
  ExpectSame(FromJson(graph.text, ImagesOf(graph)), image);
}

TEST(GraphJsonTest, NumbersKeepEveryBit) {
  for (const char* number : {"0.1", "-0", "1e-30", "16777217", "0.30000001192092896", "123456789.123"}) {
    const Node node = Apply("addc", {FromImage(Picture(0))}, number);
    const GraphJson graph = ToJson(node);
    ExpectSame(FromJson(graph.text, ImagesOf(graph)), node);
    EXPECT_EQ(graph::OriginOf(FromJson(graph.text, ImagesOf(graph)))->values, graph::OriginOf(node)->values)
        << number;
  }
}

TEST(GraphJsonTest, InputsHaveTheirNamesAndOthersGetOne) {
  const Node a = FromImage(Picture(0)), b = AsInput(FromImage(Picture(1)), "image");
  const GraphJson graph = ToJson(Apply("add", {a, b}));
  ASSERT_EQ(graph.inputs.size(), 2u);
  EXPECT_EQ(graph.inputs[0].first, "image2");
  EXPECT_EQ(graph.inputs[1].first, "image");
  EXPECT_THROW(ToJson(Apply("add", {AsInput(a, "x"), AsInput(b, "x")})), Error);
  EXPECT_THROW(AsInput(a, ""), Error);
  // What is computed may be an input too: the graph is then what comes after.
  const Node after = Apply("invert", {AsInput(Apply("blur", {a}, "sigma=1"), "soft")});
  EXPECT_THAT(ToJson(after).text, Not(HasSubstr("blur")));
}

TEST(GraphJsonTest, AnInputMayStandInSeveralNodes) {
  const std::string text = R"({"tessera_graph":1,"inputs":["a"],"nodes":[{"input":"a"},{"input":"a"},)"
                           R"({"operation":"add","inputs":[0,1]}],"result":2})";
  const Node sum = FromJson(text, {{"a", FromImage(Picture(0))}});
  ExpectSame(sum, Apply("mulc", {FromImage(Picture(0))}, "2"));
  EXPECT_THAT(GraphInputs(ToJson(sum).text), ElementsAre("a"));
}

TEST(GraphJsonTest, FilesAreWrittenByName) {
  const std::string file = ::testing::TempDir() + "graph_json_test.exr";
  Write(FromImage(Picture(3)), file);
  const Node node = Apply("mulc", {Read(file)}, "2");
  const GraphJson graph = ToJson(node);
  EXPECT_THAT(graph.inputs, IsEmpty());
  EXPECT_THAT(graph.text, HasSubstr("{\"file\":\"" + file + "\"}"));
  ExpectSame(FromJson(graph.text), node);
  std::filesystem::remove(file);
  try {
    FromJson(graph.text);
    ADD_FAILURE();
  } catch (const DataError& e) {
    EXPECT_EQ(e.subject(), file);
  }
}

TEST(GraphJsonTest, WhatHasNoNameIsRefused) {
  const Node image = FromImage(Picture(0));
  try {
    ToJson(Apply("addc", {GaussianBlur(image, 2)}, "1"));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("registry"));
  }
  EXPECT_THROW(ToJson(Node()), Error);
  EXPECT_THROW(Apply("ramp", {}), Error);
  EXPECT_THROW(Apply("add", {image}), Error);
  EXPECT_THROW(Generate("blur", ImageSpec(2, 2, 3)), Error);
  EXPECT_THROW(ToJson(Apply("table", {image}, "\xff\xfe.cube")), Error);
}

std::string WithNodes(const std::string& nodes, const std::string& result = "0") {
  return R"({"tessera_graph":1,"inputs":["image"],"nodes":[)" + nodes + "],\"result\":" + result + "}";
}

TEST(HostileGraphTest, IsRefusedWithWhatIsWrong) {
  const std::string in = R"({"input":"image"},)";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no JSON"},
      {"[]", "an object"},
      {"{}", "tessera_graph"},
      {R"({"tessera_graph":2,"nodes":[],"result":0})", "found 2 for tessera_graph"},
      {R"({"tessera_graph":"1","nodes":[],"result":0})", "tessera_graph"},
      {R"({"tessera_graph":1,"nodes":[],"result":0})", "0 nodes"},
      {R"({"tessera_graph":1,"nodes":[]})", "result"},
      {R"({"tessera_graph":1,"tessera_graph":1,"nodes":[],"result":0})", "twice"},
      {R"({"tessera_graph":1,"nodes":[{"input":"image"}],"result":0,"code":"x"})", "\"code\""},
      {R"({"tessera_graph":1,"inputs":["a","a"],"nodes":[],"result":0})", "names that differ"},
      {R"({"tessera_graph":1,"inputs":[3],"nodes":[],"result":0})", "found 3"},
      {WithNodes("3"), "node 0: found 3"},
      {WithNodes("{}"), "node 0"},
      {WithNodes(R"({"input":"other"})"), "expected one of the graph's: image"},
      {WithNodes(R"({"input":"image","file":"x"})"), "\"file\""},
      {WithNodes(in + R"({"operation":"blurr","inputs":[0]})"), "did you mean blur?"},
      {WithNodes(in + R"({"operation":7})"), "found 7 for operation"},
      {WithNodes(in + R"({"operation":"blur","inputs":[1]})"), "from 0 to 0"},
      {WithNodes(in + R"({"operation":"blur","inputs":[-1]})"), "found -1"},
      {WithNodes(in + R"({"operation":"blur","inputs":[18446744073709551615]})"),
       "found 18446744073709551615"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0.5]})"), "found 0.5"},
      {WithNodes(in + R"({"operation":"blur","inputs":0})"), "a list"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0,0]})"), "found 2 inputs, expected 1"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"window":[0,0,1,1]})"), "generator"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"sigmma":3}})"),
       "did you mean sigma?"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"sigma":"3"}})"),
       "sigma: found \"3\""},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"sigma":[3,[4]]}})"), "found [4]"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"sigma":-1}})"), "blur:sigma"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"bits":2.5}})"), "a whole number"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":{"method":3}})"), "text"},
      {WithNodes(in + R"({"operation":"blur","inputs":[0],"parameters":[]})"), "an object"},
      {WithNodes(in + R"({"operation":"saturate","inputs":[0]})"), "found no S"},
      {WithNodes(in + R"({"operation":"addc","inputs":[0],"parameters":{"VALUES":[1e999]}})"), "no JSON"},
      {WithNodes(in + R"({"operation":"table","inputs":[0],"parameters":{"FILE":"a\u0000b"}})"), "FILE"},
      {WithNodes(R"({"operation":"ramp"})"), "window"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4]})"), "channels"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4],"channels":3})"), "x0, y0, x1, y1"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,0,4],"channels":3})"), "no pixel"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,9999999999,4],"channels":3})"), "9999999999"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4],"channels":0})"), "found 0 for channels"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4],"channels":["R","R"]})"), "names that differ"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4],"channels":["R"],"alpha":1})"), "alpha"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4],"channels":3,"type":"double"})"), "type"},
      {WithNodes(R"({"operation":"ramp","window":[0,0,4,4],"channels":[]})"), "channels"},
      {WithNodes(R"({"file":"/no/such.exr"})"), "/no/such.exr"},
      {WithNodes(R"({"file":3})"), "found 3 for file"},
      {WithNodes(R"({"file":"x","subimage":-1})"), "found -1 for subimage"},
      {WithNodes(R"({"file":"x","formats":"all"})"), "\"formats\""},
      {WithNodes(R"({"input":"image"})", "1"), "result"},
      {WithNodes(R"({"input":"image"})", "\"0\""), "result"},
      {std::string(100000, '['), "no JSON"},
  };
  const Node image = FromImage(Picture(0));
  for (const auto& [text, word] : cases) {
    SCOPED_TRACE(text.substr(0, 200));
    try {
      FromJson(text, {{"image", image}});
      ADD_FAILURE() << "was accepted";
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr(word));
    }
  }
}

TEST(HostileGraphTest, EveryImageIsHeldAgainstThePolicy) {
  const std::string graph =
      R"({"tessera_graph":1,"nodes":[{"operation":"ramp","window":[0,0,5000,5000],"channels":3},)"
      R"({"operation":"crop","parameters":{"GEOM":"4x4"},"inputs":[0]}],"result":1})";
  EXPECT_EQ(FromJson(graph).spec().width(), 4);
  Context& context = Context::Default();
  const Policy before = context.policy();
  Policy strict = before;
  strict.pixels = 1000000;
  context.SetPolicy(strict);
  EXPECT_THROW(FromJson(graph), DataError);
  context.SetPolicy(before);
  EXPECT_EQ(FromJson(graph).spec().width(), 4);
}

TEST(HostileGraphTest, OpenInputsAreAskedFor) {
  const std::string graph = WithNodes(R"({"input":"image"})");
  EXPECT_THROW(FromJson(graph), Error);
  const Node image = FromImage(Picture(0));
  EXPECT_THROW(FromJson(graph, {{"image", image}, {"other", image}}), Error);
  EXPECT_THROW(FromJson(graph, {{"image", Node()}}), Error);
  ExpectSame(FromJson(graph, {{"image", image}}), image);
}

}  // namespace
}  // namespace tessera
