// Checks and converts the words of a command: numbers, lists, flags, choices; every refusal says what was
// expected.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string_view>

#include "base/number_text.h"
#include "ops/registry.h"
#include "ops/wrap.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

using base::NumberText;

std::string Quoted(std::string_view text) {
  constexpr size_t kLongest = 40;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown) {
    if (std::iscntrl(static_cast<unsigned char>(c))) c = '?';
  }
  return "\"" + shown + (text.size() > kLongest ? "…" : "") + "\"";
}

// "a", "a or b", "a, b or c".
std::string Alternatives(std::span<const std::string> words) {
  std::string text;
  for (size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

// The whole text as a number; a leading plus sign is allowed, as in C.
template <typename T>
std::optional<T> ParseWhole(std::string_view text) {
  text = Trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// One parameter being parsed: what messages are about, and the rules.
class ParamParser {
 public:
  ParamParser(std::string subject, const ParamInfo& param) : subject_(std::move(subject)), param_(param) {}

  Arguments::Value Parse(const std::string& text, bool given) const {
    Arguments::Value value;
    value.text = OwnWords(param_, text);
    value.given = given;
    switch (param_.type) {
      case ParamType::kNumber:
        value.numbers = {One(text, "a number")};
        break;
      case ParamType::kInteger:
        value.numbers = {Integer(text)};
        break;
      case ParamType::kFlag:
        if (text.empty()) value.text = "1";
        if (value.text != "0" && value.text != "1") Refuse("found " + Quoted(text) + ", expected 0 or 1");
        value.numbers = {value.text == "1" ? 1.0 : 0.0};
        break;
      case ParamType::kNumbers:
        value.numbers = List(text);
        break;
      case ParamType::kChoice:
        ParseChoice(text, value.text, value);
        break;
      case ParamType::kText:
        if (text.empty() && param_.min_count > 0)
          Refuse("found nothing, expected " + (param_.help.empty() ? "text" : param_.help));
        break;
    }
    return value;
  }

 private:
  [[noreturn]] void Refuse(const std::string& reason) const { throw Error(subject_, reason); }

  std::string Range() const {
    const bool low = param_.min > -1e38, high = param_.max < 1e38;
    if (low && high) return " from " + NumberText(param_.min) + " to " + NumberText(param_.max);
    if (low) return " of at least " + NumberText(param_.min);
    if (high) return " of at most " + NumberText(param_.max);
    return "";
  }

  double One(std::string_view text, const std::string& what) const {
    const auto value = ParseWhole<double>(text);
    if (!value) {
      Refuse(Trimmed(text).empty() ? "found nothing, expected " + what + Range()
                                   : "found " + Quoted(text) + ", expected " + what + Range());
    }
    if (!std::isfinite(*value)) Refuse("found " + Quoted(text) + ", expected a finite number" + Range());
    if (*value < param_.min || *value > param_.max) {
      Refuse("found " + Quoted(text) + ", expected " + what + " from " + NumberText(param_.min) + " to " +
             NumberText(param_.max));
    }
    return *value;
  }

  double Integer(std::string_view text) const {
    const auto value = ParseWhole<long long>(text);
    if (!value || static_cast<double>(*value) < param_.min || static_cast<double>(*value) > param_.max) {
      Refuse((Trimmed(text).empty() ? std::string("found nothing") : "found " + Quoted(text)) +
             ", expected a whole number" + Range());
    }
    return static_cast<double>(*value);
  }

  std::string ExpectedCounts() const {
    if (!param_.counts.empty()) {
      std::vector<std::string> words;
      for (int n : param_.counts) words.push_back(std::to_string(n));
      return Alternatives(words);
    }
    if (param_.min_count == param_.max_count) return std::to_string(param_.min_count);
    return std::to_string(param_.min_count) + " to " + std::to_string(param_.max_count);
  }

  std::vector<double> List(std::string_view text) const {
    std::vector<double> numbers;
    if (Trimmed(text).empty()) Refuse("found nothing, expected " + ExpectedCounts() + " numbers");
    // A list far too long is refused by its count, so it is not stored whole.
    const size_t count = 1 + static_cast<size_t>(std::count(text.begin(), text.end(), ','));
    const bool allowed = param_.counts.empty() ? count >= static_cast<size_t>(param_.min_count) &&
                                                     count <= static_cast<size_t>(param_.max_count)
                                               : std::find(param_.counts.begin(), param_.counts.end(),
                                                           static_cast<int>(count)) != param_.counts.end();
    if (!allowed) {
      Refuse("found " + std::to_string(count) + (count == 1 ? " number" : " numbers") + ", expected " +
             ExpectedCounts());
    }
    for (size_t begin = 0; begin <= text.size();) {
      const size_t end = std::min(text.find(',', begin), text.size());
      numbers.push_back(
          One(text.substr(begin, end - begin), "a number at position " + std::to_string(numbers.size() + 1)));
      begin = end + 1;
    }
    return numbers;
  }

  // What other programs call the types of pixels.
  static std::string OtherName(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    constexpr std::pair<const char*, const char*> kNames[] = {
        {"float16", "half"},  {"fp16", "half"},     {"f16", "half"},   {"halffloat", "half"},
        {"float32", "float"}, {"fp32", "float"},    {"f32", "float"},  {"single", "float"},
        {"u8", "uint8"},      {"uchar", "uint8"},   {"byte", "uint8"}, {"8", "uint8"},
        {"u16", "uint16"},    {"ushort", "uint16"}, {"16", "uint16"},  {"32", "float"}};
    for (const auto& [other, name] : kNames) {
      if (text == other) return name;
    }
    return "";
  }

  void ParseChoice(const std::string& text, const std::string& own, Arguments::Value& value) const {
    if (std::find(param_.choices.begin(), param_.choices.end(), own) != param_.choices.end()) return;
    if (param_.numbers_too && IsNumeric(text)) {
      value.numbers = List(text);
      return;
    }
    std::string reason = (text.empty() ? std::string("found nothing") : "found " + Quoted(text)) +
                         ", expected " + Alternatives(param_.choices);
    if (param_.numbers_too) reason += ", or " + ExpectedCounts() + " numbers";
    std::string near = OtherName(text);
    if (std::find(param_.choices.begin(), param_.choices.end(), near) == param_.choices.end())
      near = Nearest(text, param_.choices);
    if (!near.empty()) reason += "; did you mean " + near + "?";
    Refuse(reason);
  }

  std::string subject_;
  const ParamInfo& param_;
};

// Optimal string alignment distance, letters compared without case.
int EditDistance(std::string_view a, std::string_view b) {
  const auto same = [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  };
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  for (size_t j = 0; j <= b.size(); ++j) d[0][j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    for (size_t j = 1; j <= b.size(); ++j) {
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1)});
      if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1])) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

const Arguments::Value& Find(const Arguments& arguments, const std::string& name) {
  const auto it = arguments.values.find(name);
  if (it == arguments.values.end()) throw Error(name, "is not a parameter of this operation");
  return it->second;
}

// One of the conditions of ParamInfo::only_with.
struct Condition {
  bool holds = true;  // what is asked for
  std::string name;
  std::vector<std::string> values;  // none: written or not

  std::string Words() const {
    std::vector<std::string> words;
    for (const std::string& value : values) words.push_back(name + "=" + value);
    return values.empty() ? name + "=" : Alternatives(words);
  }
};

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::vector<Condition> ConditionsOf(const ParamInfo& param) {
  std::vector<Condition> conditions;
  for (std::string_view text : Split(param.only_with, ' ')) {
    Condition c;
    c.holds = text[0] != '!';
    text.remove_prefix(c.holds ? 0 : 1);
    const size_t equals = std::min(text.find('='), text.size());
    c.name = text.substr(0, equals);
    for (const std::string_view value : Split(text.substr(std::min(equals + 1, text.size())), '|'))
      c.values.emplace_back(value);
    conditions.push_back(std::move(c));
  }
  return conditions;
}

// Refuses what would be read by nobody.
void RequireUsed(const OpInfo& op, const Arguments& a) {
  const auto written = [&](const ParamInfo& p) {
    return a.Given(p.name) && (p.type != ParamType::kFlag || a.Text(p.name) != p.default_value);
  };
  const auto check = [&](const ParamInfo& param, const std::string& shown) {
    if (!written(param)) return;
    for (const Condition& c : ConditionsOf(param)) {
      const std::string& value = a.Text(c.name);
      const bool holds = c.values.empty()
                             ? std::any_of(op.modifiers.begin(), op.modifiers.end(),
                                           [&](const ParamInfo& p) { return p.name == c.name && written(p); })
                             : std::find(c.values.begin(), c.values.end(), value) != c.values.end();
      if (holds == c.holds) continue;
      if (!c.values.empty()) {
        throw Error(op.name, "found " + shown + " with " + c.name + "=" + value + ", expected " +
                                 (c.holds ? c.Words() : "another " + c.name + "="));
      }
      throw Error(op.name, "found " + shown + (c.holds ? " without " : " with ") + c.Words() + ", expected " +
                               (c.holds ? "both" : "one of them"));
    }
  };
  for (const ParamInfo& param : op.arguments) check(param, param.name);
  for (const ParamInfo& param : op.modifiers) check(param, param.name + "=");
}

// What messages about a parameter of the row are about.
std::string SubjectOf(const OpInfo& op, const ParamInfo& param) {
  const bool positional = std::any_of(op.arguments.begin(), op.arguments.end(),
                                      [&param](const ParamInfo& p) { return &p == &param; });
  if (!positional) return op.name + ":" + param.name;
  return op.arguments.size() == 1 ? op.name : op.name + " " + param.name;
}

// The default of an optional parameter; an empty one stays empty (no numbers), and is asked for through
// Given().
Arguments::Value DefaultValue(const std::string& subject, const ParamInfo& param) {
  if (param.default_value.empty()) return {};
  return ParamParser(subject, param).Parse(param.default_value, false);
}

}  // namespace

double Arguments::Number(const std::string& name) const {
  const Value& value = Find(*this, name);
  if (value.numbers.empty()) throw Error(name, "no number was given");
  return value.numbers[0];
}
int Arguments::Integer(const std::string& name) const { return static_cast<int>(Number(name)); }
bool Arguments::Flag(const std::string& name) const { return Number(name) != 0; }
const std::vector<double>& Arguments::Numbers(const std::string& name) const {
  return Find(*this, name).numbers;
}
const std::string& Arguments::Text(const std::string& name) const { return Find(*this, name).text; }
bool Arguments::Given(const std::string& name) const { return Find(*this, name).given; }

std::string Nearest(const std::string& word, std::span<const std::string> known) {
  constexpr size_t kLongestWord = 64;  // a longer word is no typing error
  if (word.empty() || word.size() > kLongestWord) return "";
  std::string best;
  int best_distance = std::max(1, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& candidate : known) {
    // The beginning of a name is as near as one wrong letter.
    const bool prefix = word.size() >= 3 && candidate.compare(0, word.size(), word) == 0;
    const int distance = prefix ? 1 : EditDistance(word, candidate);
    if (distance < best_distance && distance < static_cast<int>(candidate.size())) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string UseOf(const ParamInfo& param) {
  std::string text;
  for (const Condition& c : ConditionsOf(param))
    text += (text.empty() ? "" : ", ") + std::string(c.holds ? "only with " : "not with ") + c.Words();
  return text;
}

bool IsLeftOut(const ParamInfo& param, std::span<const std::pair<std::string, std::string>> modifiers) {
  const std::vector<Condition> conditions = ConditionsOf(param);
  return std::any_of(modifiers.begin(), modifiers.end(), [&](const auto& modifier) {
    return std::any_of(conditions.begin(), conditions.end(), [&](const Condition& c) {
      return !c.holds && c.values.empty() && c.name == modifier.first;
    });
  });
}

Arguments ParseArguments(const OpInfo& op, std::span<const std::string> positional,
                         std::span<const std::pair<std::string, std::string>> modifiers) {
  Arguments result;
  const size_t required = static_cast<size_t>(std::count_if(
      op.arguments.begin(), op.arguments.end(), [](const ParamInfo& p) { return p.default_value.empty(); }));
  if (positional.size() < required || positional.size() > op.arguments.size()) {
    std::string names;
    for (const ParamInfo& p : op.arguments) names += (names.empty() ? "" : " ") + p.name;
    throw Error(op.name, "found " + std::to_string(positional.size()) + " arguments, expected " +
                             std::to_string(op.arguments.size()) + (names.empty() ? "" : " (" + names + ")"));
  }
  for (size_t i = 0; i < op.arguments.size(); ++i) {
    const ParamInfo& param = op.arguments[i];
    const std::string subject = SubjectOf(op, param);
    result.values[param.name] = i < positional.size() ? ParamParser(subject, param).Parse(positional[i], true)
                                                      : DefaultValue(subject, param);
  }
  for (const ParamInfo& param : op.modifiers) {
    result.values[param.name] = DefaultValue(SubjectOf(op, param), param);
  }
  for (const auto& [key, text] : modifiers) {
    const ParamInfo* const param = FindModifier(op, key, text);
    if (param == nullptr) {
      std::vector<std::string> known, all;
      for (const ParamInfo& p : op.modifiers) {
        known.push_back(p.name);
        all.push_back(p.name);
        for (std::string& other : OtherNames(p)) all.push_back(std::move(other));
      }
      const std::string near = Nearest(key, all);
      std::string reason = "unknown modifier " + Quoted(key);
      if (known.empty()) {
        reason += ", it takes none";
      } else {
        reason += near.empty() ? ", expected " + Alternatives(known) : "; did you mean " + near + "?";
      }
      throw Error(op.name, reason);
    }
    result.values[param->name] = ParamParser(op.name + ":" + key, *param).Parse(text, true);
  }
  RequireUsed(op, result);
  return result;
}

Words SplitExample(const OpInfo& op, const std::string& example) {
  Words words;
  auto& [positional, modifiers] = words;
  for (size_t begin = 0; begin < example.size();) {
    const size_t end = std::min(example.find(' ', begin), example.size());
    const std::string word = example.substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) continue;
    const size_t equals = word.find('=');
    // Positional words come first and may hold an equals sign of their own ("R,A=1").
    if (positional.size() < op.arguments.size() && modifiers.empty() &&
        (equals == std::string::npos ||
         FindModifier(op, word.substr(0, equals), word.substr(equals + 1)) == nullptr)) {
      positional.push_back(word);
    } else {
      modifiers.emplace_back(word.substr(0, equals),
                             equals == std::string::npos ? "" : word.substr(equals + 1));
    }
  }
  return words;
}

Arguments ParseExample(const OpInfo& op, const std::string& example) {
  const Words words = SplitExample(op, example);
  return ParseArguments(op, words.positional, words.modifiers);
}

void CheckValue(const OpInfo& op, const ParamInfo& param, const std::string& text) {
  ParamParser(SubjectOf(op, param), param).Parse(text, true);
}

}  // namespace tessera::ops
