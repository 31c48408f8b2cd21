// Chains of density modulation functions from words.
#include <cctype>
#include <charconv>
#include <map>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/ops/hypertexture.h"

namespace tessera {
namespace {

struct Word {
  Dmf::Kind kind;
  int most;  // numbers
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

Dmf One(const std::string& text) {
  const size_t open = text.find('(');
  const std::string name = Trimmed(text.substr(0, open));
  const auto known = Words().find(name);
  if (known == Words().end()) {
    std::string names;
    for (const auto& [word, unused] : Words()) names += (names.empty() ? "" : ", ") + word;
    throw Error("dmf", "found \"" + name + "\", expected one of " + names);
  }
  std::vector<double> numbers;
  if (open != std::string::npos) {
    if (text.back() != ')') throw Error("dmf", "found \"" + text + "\" without a closing parenthesis");
    const std::string list = text.substr(open + 1, text.size() - open - 2);
    for (size_t at = 0; at <= list.size();) {
      const size_t comma = std::min(list.find(',', at), list.size());
      const std::string word = Trimmed(list.substr(at, comma - at));
      double v = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), v);
      if (error != std::errc() || end != word.data() + word.size()) {
        throw Error("dmf", "found \"" + word + "\" in " + name + ", expected a number");
      }
      numbers.push_back(v);
      at = comma + 1;
    }
  }
  if (static_cast<int>(numbers.size()) > known->second.most) {
    throw Error("dmf", "found " + std::to_string(numbers.size()) + " numbers in " + name +
                           ", expected at most " + std::to_string(known->second.most));
  }
  Dmf step;
  step.kind = known->second.kind;
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
    if (!Trimmed(word).empty()) chain.push_back(One(Trimmed(word)));
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
  if (chain.empty()) throw Error("dmf", "found nothing, expected steps as bias(.3), noise(.4,6)");
  return chain;
}

}  // namespace tessera
