// Every word of every choice, and both ways of every flag, of every operation with Verify: what the examples
// leave out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "support/pictures.h"
#include "support/run_command.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ops::Arguments;
using ops::OpInfo;
using ops::ParamInfo;
using ops::ParamType;
using ops::Words;
using testing::Picture;

const Roi kWindow{-5, 3, 43, 35};  // 48 x 32, off the origin

// Lines for words that no example of the row can take, and windows for their pictures.
struct More {
  const char* op;
  const char* words;
  Roi window = kWindow;
};
const Roi kCube{0, 0, 48, 8};
const More kMore[] = {
    {"value", "octaves=4"},
    {"simplex", "octaves=4"},
    {"cell", "octaves=4"},
    {"sparse", "octaves=4 freq=6"},
    {"spot", "octaves=4 freq=6"},
    {"hash", "octaves=4"},
    {"gabor", "octaves=4"},
    {"fog", "density=0.4 ramp=0,0.1,0.2,0.3,1,0.5,0.6,0.7"},
    {"layerfog", "layers=0,0.9,0.5,0 camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0"},
    {"layerfog", "layers=0,0.9,0.5,0 ramp=0,0.1,0.2,0.3,1,0.5,0.6,0.7"},
    {"convolve", "", {0, 0, 9, 9}},
    {"envmap", "map=cube", kCube},
    {"envconvert", "cube latlong 24x12", kCube},
};

// Words that nothing here can take, and where they are looked at. Without a word: all of the operation's.
struct Exception {
  const char* op;
  const char* choice;
  const char* why;
};
const Exception kExceptions[] = {
    {"emboss", "method=separable", "its kernel is no product"},
    {"laplacian", "method=separable", "its kernel is no product"},
    {"highpass", "method=separable", "its kernel is no product"},
    {"unsharp", "wrap=valid", "it keeps the size"},
    {"white", "pack=octaves", "it has none"},
    {"lut", "", "of files: tests/ocio"},
    {"ociofiletransform", "", "of files: tests/ocio"},
    {"ociolook", "", "of a configuration's looks: tests/ocio"},
    {"softshadow", "depth=planar", "of lights with planes: tests/ops/shadow_test.cc"},
    {"softshadow", "depth=euclidean", "of lights with planes: tests/ops/shadow_test.cc"},
    {"envmap", "camera=metadata", "of pictures that know their camera"},
    {"volume", "bigendian=0", "of raw files: below"},
    {"volume", "bigendian=1", "of raw files: below"},
    {"volume", "signed=0", "of raw files: below"},
    {"volume", "signed=1", "of raw files: below"},
    {"volume", "with=1", "above another volume: tests/ops/volume_scene_test.cc"},
};

const ParamInfo* Modifier(const OpInfo& op, const std::string& name) {
  for (const ParamInfo& p : op.modifiers) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

void Set(Words& words, const std::string& name, const std::string& value) {
  for (auto& [key, old] : words.modifiers) {
    if (key == name) {
      old = value;
      return;
    }
  }
  words.modifiers.emplace_back(name, value);
}

void Erase(Words& words, const std::string& name) {
  std::erase_if(words.modifiers, [&](const auto& m) { return m.first == name; });
}

// What an example of this row gives the parameter, or its default.
std::string SomeValue(const OpInfo& op, const ParamInfo& param) {
  for (const std::string& example : op.examples) {
    for (const auto& [key, value] : ops::SplitExample(op, example).modifiers) {
      if (key == param.name) return value;
    }
  }
  return param.type == ParamType::kFlag ? "1" : param.default_value;
}

// Writes what the parameter has a use with, and leaves out what it has none with.
void MeetConditions(const OpInfo& op, const ParamInfo& param, Words& words, int depth = 0) {
  if (depth > 4) return;
  std::istringstream conditions(param.only_with);
  for (std::string condition; conditions >> condition;) {
    const bool opposite = condition[0] == '!';
    if (opposite) condition.erase(0, 1);
    const size_t equals = condition.find('=');
    const std::string name = condition.substr(0, equals);
    const ParamInfo* const other = Modifier(op, name);
    if (other == nullptr) continue;
    if (opposite) {
      Erase(words, name);
    } else if (equals == std::string::npos) {
      const bool written = std::any_of(words.modifiers.begin(), words.modifiers.end(),
                                       [&](const auto& m) { return m.first == name; });
      if (!written) Set(words, name, SomeValue(op, *other));
      MeetConditions(op, *other, words, depth + 1);
    } else {
      const std::string values = "|" + condition.substr(equals + 1) + "|";
      std::string now = other->default_value;
      for (const auto& [key, value] : words.modifiers) {
        if (key == name) now = value;
      }
      if (values.find("|" + now + "|") == std::string::npos)
        Set(words, name, condition.substr(equals + 1, condition.find('|') - equals - 1));
      MeetConditions(op, *other, words, depth + 1);
    }
  }
}

// The row's operation with these words. Modifiers that have no use beside the others go, but for `kept`.
Node Made(const OpInfo& op, Words& words, const std::string& kept, const Roi& window) {
  for (int attempt = 0;; ++attempt) {
    try {
      const Arguments arguments = ops::ParseArguments(op, words.positional, words.modifiers);
      std::vector<Node> inputs;
      for (int k = 0; k < op.Operands(arguments); ++k)
        inputs.push_back(FromImage(Picture(window, 4, PixelType::kFloat, 7u * static_cast<uint32_t>(k) + 1)));
      const ImageSpec spec = Picture(window, 4, PixelType::kFloat, 0).spec();
      return op.make(inputs, arguments, op.generator ? &spec : nullptr);
    } catch (const Error& e) {
      const std::string what = e.what();
      const auto useless = std::find_if(words.modifiers.begin(), words.modifiers.end(), [&](const auto& m) {
        return m.first != kept && (e.subject().ends_with(":" + m.first) ||
                                   what.find("found " + m.first + "=") != std::string::npos);
      });
      if (attempt > 12 || useless == words.modifiers.end()) throw;
      words.modifiers.erase(useless);
    }
  }
}

std::string Text(const OpInfo& op, const Words& words) {
  std::string text = op.name;
  for (const auto& [key, value] : words.modifiers) text += ":" + key + "=" + value;
  for (const std::string& word : words.positional) text += " " + word;
  return text;
}

struct Choice {
  const ParamInfo* param;
  int position;  // of a positional argument, else -1
  std::string word;
};

std::vector<Choice> ChoicesOf(const OpInfo& op) {
  std::vector<Choice> all;
  const auto add = [&](const ParamInfo& p, int position) {
    if (p.type == ParamType::kChoice) {
      for (const std::string& word : p.choices) all.push_back({&p, position, word});
    } else if (p.type == ParamType::kFlag) {
      for (const char* word : {"0", "1"}) all.push_back({&p, position, word});
    }
  };
  for (size_t i = 0; i < op.arguments.size(); ++i) add(op.arguments[i], static_cast<int>(i));
  for (const ParamInfo& p : op.modifiers) add(p, -1);
  return all;
}

class VerifyChoices : public ::testing::TestWithParam<std::string> {};
std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const OpInfo& op : ops::Registry()) {
    if (!ChoicesOf(op).empty()) names.push_back(op.name);
  }
  return names;
}
INSTANTIATE_TEST_SUITE_P(Registry, VerifyChoices, ::testing::ValuesIn(Names()),
                         [](const auto& info) { return info.param; });

struct Line {
  std::string words;
  Roi window = kWindow;
};

// The row's examples, and what is wanted besides.
std::vector<Line> LinesOf(const OpInfo& op) {
  std::vector<Line> lines;
  for (const std::string& example : op.examples) lines.push_back({example});
  for (const More& more : kMore) {
    if (op.name == more.op) lines.push_back({more.words, more.window});
  }
  return lines;
}

const char* WhyNot(const OpInfo& op, const Choice& choice) {
  for (const Exception& e : kExceptions) {
    if (op.name == e.op && (*e.choice == 0 || choice.param->name + "=" + choice.word == e.choice))
      return e.why;
  }
  return nullptr;
}

TEST_P(VerifyChoices, AreRight) {
  const OpInfo& op = *ops::FindOp(GetParam());
  std::set<std::string> done;
  for (const Choice& choice : ChoicesOf(op)) {
    std::string why = "there is none";
    bool made = false;
    for (const Line& line : LinesOf(op)) {
      Words words = ops::SplitExample(op, line.words);
      if (choice.position < 0) {
        Set(words, choice.param->name, choice.word);
        MeetConditions(op, *choice.param, words);
      } else if (choice.position < static_cast<int>(words.positional.size())) {
        words.positional[static_cast<size_t>(choice.position)] = choice.word;
      } else {
        continue;
      }
      Node node;
      try {
        node = Made(op, words, choice.param->name, line.window);
      } catch (const Error& e) {
        why = e.what();
        continue;
      }
      made = true;
      const std::string text = Text(op, words);
      if (!done.insert(text).second) break;
      SCOPED_TRACE(text);
      try {
        const Image result = Render(node);
        const VerifyReport report =
            VerifyStored(node, result.view(), {.samples = 4, .tile_size = 12, .seconds = 5});
        EXPECT_TRUE(report.within_bound) << report.Summary();
        EXPECT_GT(report.samples, 0);
        EXPECT_LT(report.undecided, report.samples) << "nothing is judged";
      } catch (const Error& e) {
        ADD_FAILURE() << e.what();
      }
      break;
    }
    const char* const exception = WhyNot(op, choice);
    EXPECT_EQ(made, exception == nullptr)
        << choice.param->name << "=" << choice.word
        << (made ? " is an exception no more" : ": no line takes it: ") << (made ? "" : why);
  }
}

// The same numbers in either order of bytes, with a sign and moved up to have none, are the same picture.
TEST(RawVolumes, OfAnyOrderAndSignAreTheSame) {
  const testing::TemporaryDirectory directory;
  const auto picture = [&](const std::string& name, int moved, bool swapped, const std::string& words) {
    std::string bytes;
    for (int i = 0; i < 512; ++i) {
      const int value = (i * 37 + 11 * (i / 64)) % 4000 - 2000 + moved;
      const auto code = static_cast<uint16_t>(value & 0xffff);
      const char low = static_cast<char>(code & 255), high = static_cast<char>(code >> 8);
      bytes.push_back(swapped ? high : low), bytes.push_back(swapped ? low : high);
    }
    std::ofstream((directory.path() / name).string(), std::ios::binary) << bytes;
    const OpInfo& op = *ops::FindOp("volume");
    Words all = ops::SplitExample(op, "dims=8 type=uint16 size=20x16 " + words);
    Set(all, "file", (directory.path() / name).string());
    return Render(Made(op, all, "file", kWindow));
  };
  const Image want = picture("little.raw", 32768, false, "bigendian=0");
  for (const Image& other :
       {picture("big.raw", 32768, true, "bigendian=1"), picture("signed.raw", 0, false, "signed=1"),
        picture("both.raw", 0, true, "signed=1 bigendian=1")}) {
    for (int y = 0; y < 16; ++y)
      EXPECT_EQ(std::memcmp(want.view().At(0, y), other.view().At(0, y), 20 * 4 * 4), 0);
  }
  EXPECT_NE(
      std::memcmp(want.view().At(0, 7), picture("big.raw", 32768, true, "").view().At(0, 7), 20 * 4 * 4), 0);
}

}  // namespace
}  // namespace tessera
