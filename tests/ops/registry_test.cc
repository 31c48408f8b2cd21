// The list of operations, and what its argument parser accepts and refuses.
#include "ops/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/wrap.h"
#include "reference/reference.h"
#include "support/cases.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"

namespace tessera::ops {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Modifiers = std::vector<std::pair<std::string, std::string>>;

Arguments Parse(const std::string& op, const std::vector<std::string>& words,
                const Modifiers& modifiers = {}) {
  const OpInfo* const info = FindOp(op);
  if (info == nullptr) throw Error(op, "is not in the registry");
  return ParseArguments(*info, words, modifiers);
}

// The message of the Error that parsing throws.
std::string Refusal(const std::string& op, const std::vector<std::string>& words,
                    const Modifiers& modifiers = {}) {
  try {
    Parse(op, words, modifiers);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RegistryTest, RowsAreComplete) {
  std::set<std::string> names;
  for (const OpInfo& op : Registry()) {
    SCOPED_TRACE(op.name);
    EXPECT_TRUE(names.insert(op.name).second) << "twice";
    EXPECT_NE(op.make, nullptr);
    EXPECT_FALSE(op.summary.empty());
    EXPECT_FALSE(op.help.empty());
    EXPECT_FALSE(op.bound.empty());
    // A row whose argument is a file or a config of the user's has nothing to show without one.
    const bool needs_file = std::any_of(op.arguments.begin(), op.arguments.end(), [](const ParamInfo& p) {
      return p.name == "FILE" || p.name == "LOOK";
    });
    EXPECT_TRUE(needs_file || !op.examples.empty());
    EXPECT_EQ(op.generator, op.inputs == 0);
    for (const std::string& example : op.examples) EXPECT_NO_THROW(ParseExample(op, example)) << example;
    for (const ParamInfo& p : op.modifiers) EXPECT_FALSE(p.help.empty()) << p.name;
  }
}

// Operations below a node that have no reference of their own and need one.
void CollectMissing(const Node& node, std::set<std::string>& missing) {
  const graph::NodeData& d = *node.data();
  const graph::OpKind kind = d.op->Kind();
  const bool arithmetic =
      kind != graph::OpKind::kSource && kind != graph::OpKind::kShuffle && kind != graph::OpKind::kCrop;
  if (arithmetic && reference::Find(d.op->Name()) == nullptr) missing.insert(d.op->Name());
  for (const Node& input : d.inputs) CollectMissing(input, missing);
}

TEST(RegistryTest, EveryOperationHasAReference) {
  // A row without one of its own composes operations that have.
  for (const OpInfo& op : Registry()) {
    if (op.family == "channels" || reference::Find(op.name) != nullptr) continue;
    for (const std::string& example : op.examples) {
      const Arguments arguments = ParseExample(op, example);
      const std::vector<Node> inputs(static_cast<size_t>(op.Operands(arguments)),
                                     FromImage(Image(ImageSpec(8, 4, 4))));
      std::set<std::string> missing;
      CollectMissing(op.make(inputs, arguments, nullptr), missing);
      EXPECT_TRUE(missing.empty()) << op.name << " " << example << ": " << *missing.begin();
    }
  }
  EXPECT_EQ(reference::Find("no-such-operation"), nullptr);
}

TEST(RegistryTest, RegisterReplacesAndKeepsPointers) {
  reference::Register({"registry-test", nullptr, nullptr});
  const reference::Entry* const entry = reference::Find("registry-test");
  ASSERT_NE(entry, nullptr);
  const reference::Function f = [](const reference::Call&) {};
  reference::Register({"registry-test", f, nullptr});
  EXPECT_EQ(reference::Find("registry-test"), entry);
  EXPECT_EQ(entry->evaluate, f);
}

TEST(ArgumentsTest, NumbersAreParsedWhole) {
  EXPECT_THAT(Parse("addc", {"1,-2.5,+3e-2, .5"}).Numbers("VALUES"), ElementsAre(1, -2.5, 0.03, 0.5));
  EXPECT_TRUE(Parse("addc", {"1"}).Given("VALUES"));
  EXPECT_THAT(Parse("clamp", {}).Numbers("min"), ElementsAre());
  EXPECT_FALSE(Parse("clamp", {}).Given("min"));
  EXPECT_EQ(Parse("quantize", {"8"}).Integer("BITS"), 8);
  EXPECT_FALSE(Parse("quantize", {"8"}).Flag("dither"));
  EXPECT_TRUE(Parse("quantize", {"8"}, {{"dither", ""}}).Flag("dither"));
  EXPECT_TRUE(Parse("quantize", {"8"}, {{"dither", "1"}}).Flag("dither"));
}

TEST(ArgumentsTest, RefusalsNameParameterFoundAndExpected) {
  EXPECT_EQ(Refusal("ccmatrix", {"1,0,0,0,1,0,0,0"}), "ccmatrix: found 8 numbers, expected 9, 12, 16 or 20");
  EXPECT_THAT(Refusal("addc", {"nan"}), HasSubstr("addc: found \"nan\", expected a finite number"));
  EXPECT_THAT(Refusal("addc", {"inf"}), HasSubstr("expected a finite number"));
  EXPECT_THAT(Refusal("addc", {"1,-inf"}), HasSubstr("expected a finite number"));
  EXPECT_THAT(Refusal("addc", {"1e999"}), HasSubstr("found \"1e999\""));
  EXPECT_THAT(Refusal("addc", {"1e39"}), HasSubstr("found \"1e39\""));
  EXPECT_THAT(Refusal("addc", {""}), HasSubstr("addc: found nothing"));
  EXPECT_THAT(Refusal("addc", {"1,,2"}), HasSubstr("found nothing, expected a number at position 2"));
  EXPECT_THAT(Refusal("addc", {"1,"}), HasSubstr("found nothing"));
  EXPECT_THAT(Refusal("addc", {"1x"}), HasSubstr("found \"1x\""));
  EXPECT_THAT(Refusal("addc", {"0x10"}), HasSubstr("found \"0x10\""));
  EXPECT_THAT(Refusal("addc", {"+-1"}), HasSubstr("found \"+-1\""));
  EXPECT_EQ(Refusal("addc", {}), "addc: found 0 arguments, expected 1 (VALUES)");
  EXPECT_EQ(Refusal("add", {"1"}), "add: found 1 arguments, expected 0");
  EXPECT_EQ(Refusal("quantize", {"0"}), "quantize: found \"0\", expected a whole number from 1 to 24");
  EXPECT_EQ(Refusal("quantize", {"25"}), "quantize: found \"25\", expected a whole number from 1 to 24");
  EXPECT_EQ(Refusal("quantize", {"8.5"}), "quantize: found \"8.5\", expected a whole number from 1 to 24");
  EXPECT_EQ(Refusal("quantize", {"99999999999999999999"}),
            "quantize: found \"99999999999999999999\", expected a whole number from 1 to 24");
  EXPECT_EQ(Refusal("quantize", {"8"}, {{"dither", "2"}}), "quantize:dither: found \"2\", expected 0 or 1");
  EXPECT_THAT(Refusal("hue", {"30"}, {{"preserve", "luminence"}}), HasSubstr("did you mean luminance?"));
}

// Every operation that says what lies beyond the edge says it as wrap=, and takes border= and the other words
// for its choices: the same pixels, in every example and with every choice.
TEST(ArgumentsTest, OneWordForWhatLiesBeyondTheEdge) {
  std::set<std::string> seen;
  for (const testing::Case& c : testing::AllCases()) {
    const OpInfo& op = *c.op;
    const ParamInfo* const wrap = FindModifier(op, "border", "clamp");
    ASSERT_EQ(wrap, FindModifier(op, "wrap", "clamp")) << op.name;
    if (wrap == nullptr || c.Operands() > 3) continue;
    SCOPED_TRACE(op.name + " " + c.example);
    std::string other = c.example;
    for (const auto& [word, old] :
         {std::pair("wrap=", "border="), {"wrap_t=", "border_t="}, {"bordervalue=", "border="}}) {
      const ParamInfo* const param = FindModifier(op, std::string(word, std::strlen(word) - 1), "0");
      if (param == nullptr || OtherNames(*param).empty()) continue;
      for (size_t at = 0; (at = (" " + other).find(std::string(" ") + word, at)) != std::string::npos; ++at) {
        other.replace(at, std::strlen(word), old);
        const size_t value = at + std::strlen(old);
        for (const auto& [choice, own] : OtherChoices(*param)) {
          if (other.compare(value, own.size(), own) == 0) other.replace(value, own.size(), choice);
        }
      }
    }
    if (other == c.example) continue;
    seen.insert(op.name);
    const Roi window{-3, 2, 9, 11};
    const Image own = Render(c.Make(window, 4, PixelType::kFloat));
    const Image same = Render(testing::Case{&op, other}.Make(window, 4, PixelType::kFloat));
    testing::ExpectSameBits(same, own);
  }
  for (const char* const name :
       {"blur", "convolve", "unsharp", "sobel", "shift", "warp", "st_warp", "mip", "distort", "lookup", "lic",
        "transfer", "emboss", "laplacian", "highpass", "normalmap", "bump"})
    EXPECT_EQ(seen.count(name), 1U) << name;
  const Arguments a = Parse("lookup", {}, {{"border", "border,periodic"}, {"border", "0.5,0.25"}});
  EXPECT_EQ(a.Text("wrap"), "black,repeat");
  EXPECT_THAT(a.Numbers("bordervalue"), ElementsAre(0.5, 0.25));
  EXPECT_EQ(Parse("lic", {}, {{"border", "renormalize"}}).Text("wrap"), "stop");
  EXPECT_EQ(Parse("solid", {}, {{"wrap", "border"}}).Text("wrap"), "black");
  EXPECT_THAT(Refusal("blur", {"3"}, {{"border", "clmap"}}), HasSubstr("blur:border: found \"clmap\""));
  EXPECT_THAT(Refusal("blur", {"3"}, {{"boder", "clamp"}}), HasSubstr("did you mean border?"));
}

TEST(ArgumentsTest, WhatWouldBeReadByNobodyIsRefused) {
  EXPECT_EQ(Refusal("perlin", {}, {{"turbulence", "1"}, {"sum", "ridged"}}),
            "perlin: found turbulence= with sum=, expected one of them");
  EXPECT_EQ(Refusal("perlin", {}, {{"color", ""}, {"gradient", "1"}}),
            "perlin: found color= with gradient=, expected one of them");
  EXPECT_EQ(Refusal("perlin", {}, {{"gradient", "1"}, {"pack", "normal"}}),
            "perlin: found gradient= with pack=normal, expected pack=none");
  EXPECT_EQ(Refusal("perlin", {}, {{"turbulence", "0"}, {"sum", "ridged"}}), "accepted");
  EXPECT_EQ(Refusal("noiseat", {}, {{"type", "cell"}, {"fade", "linear"}}),
            "noiseat: found fade= with type=cell, expected type=perlin or type=value");
  EXPECT_EQ(Refusal("fog", {}, {{"start", "5"}}), "fog: found start= with mode=exp, expected mode=linear");
  EXPECT_EQ(Refusal("phong", {}, {{"bits", "8"}}), "phong: found bits= without table=, expected both");
  EXPECT_EQ(Refusal("solid", {}, {{"freq", "8"}}),
            "solid: found freq= with procedure=table, expected another procedure=");
  EXPECT_EQ(Refusal("blend", {"over"}, {{"src", "zero"}}),
            "blend: found src= with MODE=over, expected MODE=add, MODE=subtract or MODE=revsubtract");
  EXPECT_EQ(Refusal("unsharp", {}, {{"kernel", "median"}, {"wrap", "black"}}),
            "unsharp: found wrap= with kernel=median, expected another kernel=");
  EXPECT_EQ(Refusal("blur", {"3x3"}, {{"sigma", "2"}}), "blur: found SIZE with sigma=, expected one of them");
  EXPECT_EQ(Refusal("blur", {}, {{"sigma", "2"}, {"kernel", "gaussian"}}), "accepted");
  const OpInfo* const blur = FindOp("blur");
  EXPECT_EQ(UseOf(blur->arguments[0]), "not with sigma=");
  EXPECT_TRUE(IsLeftOut(blur->arguments[0], Modifiers{{"wrap", "black"}, {"sigma", "2"}}));
  EXPECT_FALSE(IsLeftOut(blur->arguments[0], Modifiers{{"wrap", "black"}}));
}

// What only_with asks about exists, or a parameter could never be written.
TEST(ArgumentsTest, ConditionsNameParametersAndChoices) {
  for (const OpInfo& op : Registry()) {
    std::vector<ParamInfo> all = op.arguments;
    all.insert(all.end(), op.modifiers.begin(), op.modifiers.end());
    for (const ParamInfo& p : all) {
      std::istringstream conditions(p.only_with);
      for (std::string word; conditions >> word;) {
        SCOPED_TRACE(op.name + ":" + p.name + " " + word);
        if (word[0] == '!') word.erase(0, 1);
        const size_t equals = std::min(word.find('='), word.size());
        const auto other = std::find_if(all.begin(), all.end(), [&](const ParamInfo& o) {
          return o.name == word.substr(0, equals) && o.name != p.name;
        });
        ASSERT_NE(other, all.end());
        std::istringstream values(word.substr(std::min(equals + 1, word.size())));
        for (std::string value; other->type == ParamType::kChoice && std::getline(values, value, '|');)
          EXPECT_THAT(other->choices, ::testing::Contains(value));
      }
    }
  }
}

TEST(ArgumentsTest, EveryNoiseTakesALattice) {
  for (const OpInfo& op : Registry()) {
    if (op.family != "noise" || op.modifiers.size() < 15) continue;  // textures have none
    EXPECT_EQ(Refusal(op.name, {}, {{"lattice", "tessera"}}), "accepted") << op.name;
  }
  EXPECT_EQ(Refusal("spot", {}, {{"lattice", "osl"}}), "spot:lattice: found \"osl\", expected tessera");
}

TEST(ArgumentsTest, UnknownModifiersNameTheNearest) {
  EXPECT_EQ(Refusal("quantize", {"8"}, {{"dithr", "1"}}),
            "quantize: unknown modifier \"dithr\"; did you mean dither?");
  EXPECT_EQ(Refusal("quantize", {"8"}, {{"zzz", "1"}}),
            "quantize: unknown modifier \"zzz\", expected dither or seed");
  EXPECT_EQ(Refusal("abs", {}, {{"x", "1"}}), "abs: unknown modifier \"x\", it takes none");
}

TEST(ArgumentsTest, NearestFindsTypingErrorsOnly) {
  const std::vector<std::string> known = {"saturate", "hue", "luminance", "min", "max"};
  EXPECT_EQ(Nearest("saturte", known), "saturate");
  EXPECT_EQ(Nearest("satruate", known), "saturate");
  EXPECT_EQ(Nearest("lum", known), "luminance");
  EXPECT_EQ(Nearest("Hue", known), "hue");
  EXPECT_EQ(Nearest("xyzzy", known), "");
  EXPECT_EQ(Nearest("", known), "");
  EXPECT_EQ(Nearest(std::string(100000, 'a'), known), "");
}

TEST(ChannelsTest, SelectionsFollowOiiotool) {
  const Node image = Constant(ImageSpec(2, 2, 4));
  const auto names = [&](const std::string& list) { return SelectChannels(image, list).spec().channels; };
  EXPECT_THAT(names("2,1,0"), ElementsAre("B", "G", "R"));
  EXPECT_THAT(names("r,g"), ElementsAre("R", "G"));
  EXPECT_THAT(names("R=G,newname=B,=0.75,Z=1"), ElementsAre("R", "newname", "B", "Z"));
  EXPECT_EQ(SelectChannels(image, "A,R").spec().alpha, 0);
  EXPECT_EQ(SelectChannels(image, "R,G,B").spec().alpha, -1);
  EXPECT_EQ(SelectChannels(image, "R,A=1.0").spec().alpha, 1);
  EXPECT_THAT(AppendChannels(image, image).spec().channels,
              ElementsAre("R", "G", "B", "A", "channel4", "channel5", "channel6", "channel7"));
  EXPECT_THAT(RenameChannels(image, {"", "x", "y", "z", "more"}).spec().channels,
              ElementsAre("R", "x", "y", "z"));
}

TEST(ChannelsTest, MissingChannelsListThosePresent) {
  const Node image = Constant(ImageSpec(2, 2, 3));
  const auto refusal = [&](const std::string& list) -> std::string {
    try {
      SelectChannels(image, list);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal("R,A"), "ch: found no channel \"A\", expected one of R,G,B");
  EXPECT_EQ(refusal("7"), "ch: found no channel \"7\", expected one of R,G,B");
  EXPECT_EQ(refusal("-1"), "ch: found no channel \"-1\", expected one of R,G,B");
  EXPECT_EQ(refusal("R,,B"), "ch: found an empty entry, expected one of R,G,B");
  EXPECT_THAT(refusal("R=nan"), HasSubstr("finite"));
}

TEST(ChannelsTest, Geometries) {
  const Roi base{3, 4, 13, 24};
  EXPECT_EQ(ParseGeometry("2x5", base), (Roi{3, 4, 5, 9}));
  EXPECT_EQ(ParseGeometry("2x5+10-20", base), (Roi{10, -20, 12, -15}));
  EXPECT_EQ(ParseGeometry("-1+2", base), (Roi{-1, 2, 9, 22}));
  EXPECT_EQ(ParseGeometry("1,2,3,4", base), (Roi{1, 2, 4, 5}));
  EXPECT_EQ(ParseGeometry("-3,-2,-3,-2", base), (Roi{-3, -2, -2, -1}));
  for (const char* bad :
       {"", "x", "2x", "2x5+1", "2x5+1+", "2x5+1+1x", "1,2,3", "1,2,3,4,5", "3,3,1,1", "0x5", "-2x5",
        "2147483647x2+2147483647+0", "99999999999999999999x1", "1,2,3,2147483648", "50%", "2x5+-1+1"}) {
    EXPECT_THROW(ParseGeometry(bad, base), Error) << bad;
  }
}

}  // namespace
}  // namespace tessera::ops
