// The table of other words for what lies beyond an edge.
#include "ops/wrap.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr char kWrap[] = "wrap";
// Names of parameters: the filters' and --lookup's of earlier lines.
constexpr std::pair<const char*, const char*> kNames[] = {
    {"border", kWrap}, {"border_t", "wrap_t"}, {"border", "bordervalue"}};
// oiiotool's, OpenGL's, the filters' for the same thing.
constexpr std::pair<const char*, const char*> kChoices[] = {
    {"periodic", "repeat"}, {"border", "black"}, {"renormalize", "stop"}};

// Where two words have one meaning, the first is the one that messages use.
constexpr std::pair<const char*, Wrap> kWords[] = {
    {"black", Wrap::kBlack},      {"clamp", Wrap::kClamp},         {"repeat", Wrap::kRepeat},
    {"mirror", Wrap::kMirror},    {"mirror101", Wrap::kMirror101}, {"renormalize", Wrap::kRenormalize},
    {"stop", Wrap::kRenormalize}, {"valid", Wrap::kValid},         {"glclamp", Wrap::kGlClamp}};

bool Has(const std::vector<std::string>& words, const char* word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

ParamInfo WrapModifier(std::vector<std::string> choices, const char* default_value, const char* help) {
  ParamInfo param;
  param.name = kWrap;
  param.type = ParamType::kChoice;
  param.default_value = default_value;
  param.help = help;
  param.choices = std::move(choices);
  return param;
}

Wrap WrapNamed(const std::string& word) {
  for (const auto& [known, wrap] : kWords) {
    if (word == known) return wrap;
  }
  throw Error("wrap", "found \"" + word + "\", expected a rule for what lies beyond an edge");
}

void RequireWrap(const std::string& op, Wrap wrap, std::initializer_list<Wrap> expected) {
  if (std::find(expected.begin(), expected.end(), wrap) != expected.end()) return;
  const auto word = [](Wrap w) -> std::string {
    for (const auto& [known, meaning] : kWords) {
      if (meaning == w) return known;
    }
    return std::to_string(static_cast<int>(w));
  };
  std::string words;
  size_t left = expected.size();
  for (const Wrap w : expected) {
    words += word(w);
    if (--left > 0) words += left == 1 ? " or " : ", ";
  }
  throw Error(op + ":wrap", "found " + word(wrap) + ", expected " + words);
}

void RequireImageWrap(const std::string& op, Wrap wrap) {
  RequireWrap(op, wrap, {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror});
}

std::vector<std::string> OtherNames(const ParamInfo& param) {
  std::vector<std::string> names;
  for (const auto& [other, name] : kNames) {
    // A filter's border= has always been the mode: only a list of colours shares the word.
    const bool shared = param.name == "bordervalue" && param.type != ParamType::kNumbers;
    if (param.name == name && !shared) names.emplace_back(other);
  }
  return names;
}

std::vector<std::pair<std::string, std::string>> OtherChoices(const ParamInfo& param) {
  std::vector<std::pair<std::string, std::string>> words;
  if (!param.name.starts_with(kWrap)) return words;
  for (const auto& [other, word] : kChoices) {
    const bool list = param.type == ParamType::kText && std::string_view(word) != "stop";
    if (list || (Has(param.choices, word) && !Has(param.choices, other))) words.emplace_back(other, word);
  }
  return words;
}

std::string OwnWords(const ParamInfo& param, const std::string& text) {
  const auto others = OtherChoices(param);
  if (others.empty()) return text;
  std::string own;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto other =
        std::find_if(others.begin(), others.end(), [&word](const auto& row) { return row.first == word; });
    own += (begin > 0 ? "," : "") + (other == others.end() ? word : other->second);
    begin = end + 1;
  }
  return own;
}

bool IsNumeric(const std::string& text) {
  return !text.empty() && (std::isdigit(static_cast<unsigned char>(text[0])) != 0 ||
                           std::string_view("+-.,").find(text[0]) != std::string_view::npos);
}

const ParamInfo* FindModifier(const OpInfo& op, const std::string& name, const std::string& text) {
  const ParamInfo* found = nullptr;
  for (const ParamInfo& p : op.modifiers) {
    if (p.name == name) return &p;
    const std::vector<std::string> others = OtherNames(p);
    if (!Has(others, name.c_str())) continue;
    if (found == nullptr || IsNumeric(text) == (p.type == ParamType::kNumbers)) found = &p;
  }
  return found;
}

}  // namespace tessera::ops
