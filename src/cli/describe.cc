// Commands in words: synopsis, operands, what a parameter may be.
#include "cli/describe.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "base/number_text.h"
#include "ops/wrap.h"

namespace tessera::cli {
namespace {

using base::NumberText;

// As many modifiers as have room in a line of help that has `used` columns without them; an ellipsis stands
// for the rest.
std::string Modifiers(const ops::OpInfo& row, size_t used, size_t columns) {
  const size_t room = columns - 6;  // an indent, brackets, the ellipsis
  std::string text;
  for (const ops::ParamInfo& p : row.modifiers) {
    const std::string next = ":" + p.name + "=" + p.default_value;
    if (used + text.size() + next.size() > room) {
      text += ":…";
      break;
    }
    text += next;
  }
  return text.empty() ? "" : "[" + text + "]";
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : ", ") + w;
  return text;
}
// "a, b or c".
std::string Alternatives(const std::vector<std::string>& words) {
  if (words.size() < 2) return Joined(words);
  return Joined({words.begin(), words.end() - 1}) + " or " + words.back();
}

std::string Count(const ops::ParamInfo& p) {
  if (!p.counts.empty()) {
    std::vector<std::string> words;
    for (int n : p.counts) words.push_back(std::to_string(n));
    // 8, 12, 16, …, 256
    constexpr size_t kShown = 3;
    bool steady = words.size() > 2 * kShown;
    for (size_t i = 2; i < words.size(); ++i) {
      steady = steady && p.counts[i] - p.counts[i - 1] == p.counts[1] - p.counts[0];
    }
    if (steady) {
      words.erase(words.begin() + kShown, words.end() - 1);
      words.insert(words.begin() + kShown, "…");
    }
    return Alternatives(words);
  }
  if (p.min_count == p.max_count) return std::to_string(p.min_count);
  return std::to_string(p.min_count) + " to " + std::to_string(p.max_count);
}

std::string Range(const ops::ParamInfo& p) {
  const bool low = p.min > -1e38, high = p.max < 1e38;
  if (low && high) return " from " + NumberText(p.min) + " to " + NumberText(p.max);
  if (low) return " of at least " + NumberText(p.min);
  if (high) return " of at most " + NumberText(p.max);
  return "";
}

// As a shell reads it.
std::string Quoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("_-+=:,./%@", c) != nullptr;
  });
  return plain ? word : "'" + word + "'";
}

}  // namespace

std::string Dashed(const std::string& name) { return (name.size() == 1 ? "-" : "--") + name; }

std::string Synopsis(const Command& command, size_t columns) {
  const std::string name = Dashed(command.info.name);
  std::string arguments;
  for (const ops::ParamInfo& p : command.info.arguments)
    arguments += command.optional_argument ? " [" + p.name + "]" : " " + p.name;
  return name + Modifiers(command.info, name.size() + arguments.size(), columns) + arguments;
}

std::string GeneratorSynopsis(const ops::OpInfo& generator, size_t columns) {
  return generator.name + Modifiers(generator, generator.name.size(), columns);
}

int Taken(const Command& command) {
  if (command.info.operands != nullptr) return -1;
  return command.effect == Effect::kApply || command.effect == Effect::kSwap ||
                 command.effect == Effect::kDup || command.effect == Effect::kPop ||
                 command.effect == Effect::kUse || command.effect == Effect::kSplit ||
                 command.effect == Effect::kJoin
             ? command.info.inputs
             : 0;
}

int Given(const Command& command) {
  switch (command.effect) {
    case Effect::kPush:
    case Effect::kApply:
    case Effect::kJoin:
      return 1;
    case Effect::kSplit:
      return -1;
    case Effect::kDup:
    case Effect::kSwap:
      return 2;
    case Effect::kUse:
      return command.info.inputs;
    default:
      return 0;
  }
}

std::string Operands(const Command& command) {
  const auto images = [](int n) {
    constexpr const char* kWords[] = {"no image", "one image", "two images", "three images", "four images"};
    return n >= 0 && n < 5 ? std::string(kWords[n]) : std::to_string(n) + " images";
  };
  switch (command.effect) {
    case Effect::kPush:
      return "Pushes one image.";
    case Effect::kApply:
      if (command.info.operands != nullptr) {
        return "Takes as many images from the stack as its arguments say, the last one on top, and pushes the result.";
      }
      return "Takes " + images(command.info.inputs) + " from the stack" +
             (command.info.inputs > 1 ? ", the last one on top," : "") + " and pushes the result.";
    case Effect::kSplit:
      return "Takes one image from the stack and pushes those that it holds.";
    case Effect::kJoin:
      return "Takes all images from the stack and pushes the result.";
    case Effect::kUse:
      return "Looks at " + images(command.info.inputs) + " on the stack.";
    default:
      return "";
  }
}

std::vector<std::string> ExampleLines(const ops::OpInfo& row) {
  std::vector<std::string> lines;
  for (const std::string& example : row.examples) {
    const auto [positional, modifiers] = ops::SplitExample(row, example);
    std::string called = row.generator ? row.name : Dashed(row.name), arguments;
    for (const auto& [key, value] : modifiers) called += ":" + key + "=" + value;
    for (const std::string& word : positional) arguments += " " + Quoted(word);
    std::string line = "tessera";
    if (row.generator) {
      line += " --pattern " + Quoted(called) + arguments + " 512x512 3";
    } else {
      const int images = row.Operands(ops::ParseExample(row, example));
      for (int k = 0; k < images; ++k)
        line += images == 1 ? " in.exr" : " " + std::string(1, static_cast<char>('a' + k % 26)) + ".exr";
      line += " " + Quoted(called) + arguments;
    }
    lines.push_back(line + " -o out.exr");
  }
  return lines;
}

std::vector<std::string> ExampleLines(const Command& command) {
  std::vector<std::string> lines = ExampleLines(command.info);
  for (const std::string& line : command.lines) lines.push_back("tessera " + line);
  return lines;
}

std::string TypeName(ops::ParamType type) {
  constexpr const char* kNames[] = {"number", "integer", "flag", "numbers", "choice", "text"};
  return kNames[static_cast<int>(type)];
}

std::string AllowedValues(const ops::ParamInfo& p) {
  std::string text;
  switch (p.type) {
    case ops::ParamType::kNumber:
      text = "A number" + Range(p);
      break;
    case ops::ParamType::kInteger:
      text = "A whole number" + Range(p);
      break;
    case ops::ParamType::kFlag:
      text = "0 or 1";
      break;
    case ops::ParamType::kNumbers:
      text =
          "Comma-separated numbers, " + Count(p) + " of them" + (Range(p).empty() ? "" : ", each" + Range(p));
      break;
    case ops::ParamType::kChoice:
      text = "One of " + Joined(p.choices) +
             (p.numbers_too ? ", or " + Count(p) + " comma-separated numbers" : "");
      break;
    case ops::ParamType::kText:
      break;
  }
  if (!p.default_value.empty()) text += (text.empty() ? "Default " : "; default ") + p.default_value;
  if (const std::string use = ops::UseOf(p); !use.empty())
    text +=
        (text.empty() ? std::string() + static_cast<char>(std::toupper(use[0])) + use.substr(1) : "; " + use);
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  for (const auto& [other, word] : ops::OtherChoices(p)) add(other + " is another word for " + word);
  for (const std::string& other : ops::OtherNames(p)) add("also written " + other + "=");
  return text.empty() ? "" : text + ".";
}

}  // namespace tessera::cli
