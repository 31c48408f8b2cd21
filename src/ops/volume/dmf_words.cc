// Chains of density modulation functions from words.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/ops/hypertexture.h"

namespace tessera {
namespace {

struct Word {
  Dmf::Kind kind;
  size_t most;  // numbers
};
const std::map<std::string, Word>& Words() {
  static const std::map<std::string, Word> kWords = {
      {"bias", {Dmf::Kind::kBias, 1}},           {"gain", {Dmf::Kind::kGain, 1}},
      {"noise", {Dmf::Kind::kNoise, 3}},         {"turbulence", {Dmf::Kind::kTurbulence, 3}},
      {"threshold", {Dmf::Kind::kThreshold, 2}}, {"warp", {Dmf::Kind::kWarp, 3}},
      {"lift", {Dmf::Kind::kLift, 3}},           {"swell", {Dmf::Kind::kSwell, 3}}};
  return kWords;
}

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// One step: name, or name(numbers).
Dmf One(const std::string& text) {
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw Error("dmf", "found " + found + " in \"" + text + "\", expected " + expected);
  };
  const size_t open = text.find('(');
  const std::string name = Trimmed(text.substr(0, open));
  const auto known = Words().find(name);
  if (known == Words().end()) {
    std::string names;
    for (const auto& [word, unused] : Words()) names += (names.empty() ? "" : ", ") + word;
    refuse("\"" + name + "\"", "name(numbers), the name one of " + names);
  }
  const Word word = known->second;
  std::vector<double> numbers;
  // What the step's functions take: bias and gain have no value at the ends, noise no negative frequency.
  const auto check = [&](const std::string& number, double v) {
    const bool within = word.kind == Dmf::Kind::kBias || word.kind == Dmf::Kind::kGain;
    if (within && numbers.empty() && !(v > 0 && v < 1)) refuse(number, "a number between 0 and 1");
    if (numbers.size() == 1 && !(v >= 0 && v < 1e6)) refuse(number, "a number from 0 to 1e6");
  };
  if (open != std::string::npos) {
    if (text.find_first_of("()", open + 1) != text.size() - 1 || text.back() != ')') {
      refuse("other than one pair of parentheses", "name(numbers)");
    }
    const std::string list = text.substr(open + 1, text.size() - open - 2);
    for (size_t at = 0; at <= list.size();) {
      const size_t comma = std::min(list.find(',', at), list.size());
      const std::string number = Trimmed(list.substr(at, comma - at));
      double v = 0;
      const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), v);
      if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(v)) {
        refuse("\"" + number + "\"", "a finite number");
      }
      check(number, v);
      numbers.push_back(v);
      at = comma + 1;
    }
  }
  if (numbers.size() > word.most) {
    refuse(std::to_string(numbers.size()) + " numbers", "at most " + std::to_string(word.most));
  }
  Dmf step;
  step.kind = word.kind;
  if (!numbers.empty()) step.amount = numbers[0];
  if (numbers.size() > 1) (step.kind == Dmf::Kind::kThreshold ? step.softness : step.frequency) = numbers[1];
  if (numbers.size() > 2) step.drift = {0, -numbers[2], 0};
  return step;
}

}  // namespace

std::vector<Dmf> ParseDmf(const std::string& words) {
  std::vector<Dmf> chain;
  int depth = 0;
  std::string word;
  const auto finish = [&] {
    const std::string step = Trimmed(word);
    if (step.empty()) {
      throw Error("dmf", "found an empty step in \"" + words + "\", expected steps as bias(.3), noise(.4,6)");
    }
    chain.push_back(One(step));
    word.clear();
  };
  for (char c : words) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0) {
      finish();
    } else {
      word += c;
    }
  }
  finish();
  return chain;
}

}  // namespace tessera
