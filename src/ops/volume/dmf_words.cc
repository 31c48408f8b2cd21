// Chains of density modulation functions from words.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/number_lines.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/hypertexture.h"

namespace tessera {
namespace {

using Pairs = std::vector<std::array<double, 2>>;

struct Word {
  Dmf::Kind kind;
  size_t most;  // numbers
};
const std::map<std::string, Word>& Words() {
  static const std::map<std::string, Word> kWords = {
      {"bias", {Dmf::Kind::kBias, 1}},           {"gain", {Dmf::Kind::kGain, 1}},
      {"noise", {Dmf::Kind::kNoise, 4}},         {"turbulence", {Dmf::Kind::kTurbulence, 4}},
      {"threshold", {Dmf::Kind::kThreshold, 2}}, {"warp", {Dmf::Kind::kWarp, 4}},
      {"lift", {Dmf::Kind::kLift, 4}},           {"swell", {Dmf::Kind::kSwell, 4}},
      {"table", {Dmf::Kind::kTable, 128}}};
  return kWords;
}
// Quantities that are given with points, and regions: how many numbers these take.
const std::map<std::string, DmfInput::Kind>& Quantities() {
  static const std::map<std::string, DmfInput::Kind> kQuantities = {{"gradient", DmfInput::Kind::kGradient},
                                                                    {"light", DmfInput::Kind::kLight},
                                                                    {"eye", DmfInput::Kind::kEye},
                                                                    {"density", DmfInput::Kind::kDensity},
                                                                    {"height", DmfInput::Kind::kHeight}};
  return kQuantities;
}
struct Region {
  DmfInput::Kind kind;
  size_t numbers;
};
const std::map<std::string, Region>& Regions() {
  static const std::map<std::string, Region> kRegions = {{"half", {DmfInput::Kind::kPlane, 5}},
                                                         {"sphere", {DmfInput::Kind::kSphere, 5}},
                                                         {"band", {DmfInput::Kind::kHeight, 3}}};
  return kRegions;
}

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// The parts between separators outside of parentheses.
std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == separator && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  for (std::string& part : parts) part = Trimmed(part);
  return parts;
}

template <class Map>
std::string NamesOf(const Map& map) {
  std::string names;
  for (const auto& [word, unused] : map) names += (names.empty() ? "" : ", ") + word;
  return names;
}

// A name, or name(arguments).
class Term {
 public:
  explicit Term(const std::string& text) : text_(text), open_(text.find('(')) {}
  std::string name() const { return Trimmed(text_.substr(0, open_)); }

  [[noreturn]] void Refuse(const std::string& found, const std::string& expected) const {
    throw Error("dmf", "found " + found + " in \"" + text_ + "\", expected " + expected);
  }
  // check(number as written, number, numbers before it).
  template <class Check>
  std::vector<double> Numbers(const Check& check) const {
    std::vector<double> numbers;
    for (const std::string& word : Arguments()) {
      double v = 0;
      if (!IsNumber(word, v)) Refuse("\"" + word + "\"", "a finite number");
      check(word, v, numbers.size());
      numbers.push_back(v);
    }
    return numbers;
  }
  std::vector<double> Numbers() const {
    return Numbers([](const std::string&, double, size_t) {});
  }
  // Pairs of numbers, or a file of them, a pair a line; of two numbers alone, where `ramp`, from 0 to 1.
  Pairs Points(bool ramp) const {
    const std::vector<std::string> words = Arguments();
    double v = 0;
    Pairs pairs;
    if (words.size() == 1 && !words[0].empty() && !IsNumber(words[0], v)) {
      pairs = ReadPairs(words[0]);
    } else {
      const std::vector<double> numbers = Numbers();
      if (numbers.empty() || numbers.size() % 2 != 0)
        Refuse(std::to_string(numbers.size()) + " numbers", "pairs of numbers, or a file of them");
      if (ramp && numbers.size() == 2) {
        if (numbers[0] <= numbers[1]) return {{numbers[0], 0}, {numbers[1], 1}};
        return {{numbers[1], 1}, {numbers[0], 0}};
      }
      for (size_t i = 0; i < numbers.size(); i += 2) pairs.push_back({numbers[i], numbers[i + 1]});
    }
    return pairs;
  }

 private:
  static bool IsNumber(const std::string& word, double& v) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), v);
    return error == std::errc() && end == word.data() + word.size() && std::isfinite(v);
  }
  std::vector<std::string> Arguments() const {
    if (open_ == std::string::npos) return {};
    if (text_.find_first_of("()", open_ + 1) != text_.size() - 1 || text_.back() != ')') {
      Refuse("other than one pair of parentheses", "name(numbers)");
    }
    return Split(text_.substr(open_ + 1, text_.size() - open_ - 2), ',');
  }
  static Pairs ReadPairs(const std::string& file) {
    Pairs pairs;
    base::ReadNumberLines(file, "lines of two numbers", {"two numbers", 2, 2},
                          [&](std::span<const double> line, int) {
                            pairs.push_back({line[0], line[1]});
                          });
    return pairs;
  }

  const std::string& text_;
  const size_t open_;
};

// Where a step acts.
DmfInput InputOf(const std::string& text) {
  const bool outside = !text.empty() && text[0] == '~';
  const std::string own = Trimmed(text.substr(outside ? 1 : 0));
  const Term words(own);
  const std::string name = words.name();
  DmfInput input;
  const auto quantity = Quantities().find(name);
  const auto region = Regions().find(name);
  if (quantity != Quantities().end()) {
    input.kind = quantity->second;
    input.points = words.Points(true);
  } else if (region != Regions().end()) {
    input.kind = region->second.kind;
    const std::vector<double> n = words.Numbers();
    if (n.size() != region->second.numbers) {
      words.Refuse(std::to_string(n.size()) + " numbers", std::to_string(region->second.numbers));
    }
    const double soft = n.back();
    if (!(soft >= 0)) words.Refuse("a soft edge below 0", "0 or more");
    if (name == "band") {
      if (!(n[0] <= n[1])) words.Refuse("a band whose low end is above its high one", "the low one first");
      input.points = {{n[0] - soft, 0}, {n[0], 1}, {n[1], 1}, {n[1] + soft, 0}};
    } else {
      input.place = {n[0], n[1], n[2]};
      if (name == "half") {
        input.points = {{n[3] - soft, 0}, {n[3], 1}};
      } else {
        input.points = {{n[3], 1}, {n[3] + soft, 0}};
      }
    }
  } else {
    words.Refuse("\"" + name + "\"", "an input, one of " + NamesOf(Quantities()) + ", " + NamesOf(Regions()));
  }
  if (outside) {
    for (auto& point : input.points) point[1] = 1 - point[1];
  }
  return input;
}

// One step: name, or name(numbers), and what it is times.
Dmf One(const std::string& text) {
  const std::vector<std::string> parts = Split(text, '*');
  const Term words(parts[0]);
  const std::string name = words.name();
  const auto known = Words().find(name);
  if (known == Words().end()) {
    words.Refuse("\"" + name + "\"", "name(numbers), the name one of " + NamesOf(Words()));
  }
  const Word word = known->second;
  Dmf step;
  step.kind = word.kind;
  if (word.kind == Dmf::Kind::kTable) {
    step.table = words.Points(false);
  } else {
    // What the step's functions take: bias and gain have no value at the ends, noise no negative frequency.
    const std::vector<double> numbers =
        words.Numbers([&](const std::string& number, double v, size_t before) {
          const bool within = word.kind == Dmf::Kind::kBias || word.kind == Dmf::Kind::kGain;
          if (within && before == 0 && !(v > 0 && v < 1)) words.Refuse(number, "a number between 0 and 1");
          if (before == 1 && !(v >= 0 && v < 1e6)) words.Refuse(number, "a number from 0 to 1e6");
          if (before == 3 && !(v >= 1e-3 && v <= 1e3)) words.Refuse(number, "a number from 0.001 to 1000");
        });
    if (numbers.size() > word.most) {
      words.Refuse(std::to_string(numbers.size()) + " numbers", "at most " + std::to_string(word.most));
    }
    if (!numbers.empty()) step.amount = numbers[0];
    if (numbers.size() > 1)
      (step.kind == Dmf::Kind::kThreshold ? step.softness : step.frequency) = numbers[1];
    if (numbers.size() > 2) step.drift = {0, -numbers[2], 0};
    if (numbers.size() > 3) step.upright = 1 / numbers[3];
  }
  for (size_t i = 1; i < parts.size(); ++i) step.inputs.push_back(InputOf(parts[i]));
  return step;
}

}  // namespace

std::vector<Dmf> ParseDmf(const std::string& words) {
  std::vector<Dmf> chain;
  for (const std::string& step : Split(words, ',')) {
    if (step.empty()) {
      throw Error("dmf", "found an empty step in \"" + words + "\", expected steps as bias(.3), noise(.4,6)");
    }
    chain.push_back(One(step));
  }
  return chain;
}

}  // namespace tessera
