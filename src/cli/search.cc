// --help-search: commands by what they are about, and by the names that other programs have for them.
#include <algorithm>
#include <cctype>

#include "cli/describe.h"
#include "cli/help.h"
#include "cli/left_out.h"
#include "cli/session.h"
#include "cli/synonyms.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

std::vector<std::string> WordsIn(const std::string& text) {
  std::vector<std::string> words;
  bool inside = false;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool part = std::isalnum(byte) != 0 || c == '_' || byte >= 0x80;
    if (part && !inside) words.emplace_back();
    if (part) words.back() += static_cast<char>(std::tolower(byte));
    inside = part;
  }
  return words;
}

// Without the usual endings, where enough is left: sharpening, sharpens and sharpen are one.
std::string StemOf(const std::string& word) {
  constexpr size_t kLeft = 4;
  for (const std::string ending : {"ing", "ed", "es", "s", "e"}) {
    if (word.size() >= ending.size() + kLeft && word.ends_with(ending))
      return word.substr(0, word.size() - ending.size());
  }
  return word;
}

bool Holds(const std::string& text, const std::string& stem) {
  const std::vector<std::string> words = WordsIn(text);
  return std::any_of(words.begin(), words.end(), [&](const std::string& w) { return w.starts_with(stem); });
}

bool IsCalled(const ops::OpInfo& row, const std::vector<std::string>& aliases, const std::string& word) {
  return row.name == word || std::find(aliases.begin(), aliases.end(), word) != aliases.end();
}

// How much the row is about a word; 0: not at all.
int Weight(const ops::OpInfo& row, const std::vector<std::string>& aliases, const std::string& word) {
  const std::string stem = StemOf(word);
  if (IsCalled(row, aliases, word)) return 100;
  const std::vector<std::string> called = SynonymsOf(row.name);
  for (size_t k = 0; k < called.size(); ++k) {
    if (called[k] == word || StemOf(called[k]) == stem) return 90;
  }
  if (row.name.find(stem) != std::string::npos) return 60;
  if (Holds(row.summary, stem)) return 40;
  for (const auto* params : {&row.arguments, &row.modifiers}) {
    for (const ops::ParamInfo& p : *params) {
      if (Holds(p.name, stem) || std::find(p.choices.begin(), p.choices.end(), word) != p.choices.end())
        return 20;
      if (Holds(p.help, stem)) return 10;
    }
  }
  return Holds(row.help, stem) || Holds(row.bound, stem) ? 10 : 0;
}

struct Found {
  int weight;
  std::string synopsis, summary;
};

}  // namespace

void PrintSearch(std::ostream& out, const std::string& words, const Layout& layout) {
  const std::vector<std::string> wanted = WordsIn(words);
  if (wanted.empty())
    throw UsageError("--help-search", "found no word, expected some, such as \"soft shadow\"");
  std::vector<Found> found;
  const auto look = [&](const ops::OpInfo& row, const std::vector<std::string>& aliases,
                        const auto& synopsis) {
    int weight = 0;
    for (const std::string& word : wanted) {
      const int one = Weight(row, aliases, word);
      if (one == 0) return;
      weight += one;
    }
    found.push_back({weight, synopsis(), row.summary});
  };
  for (const Command& c : Commands()) {
    // Its own page has the words of others for examples.
    if (c.info.name == "help-search") continue;
    look(c.info, c.aliases, [&] { return Synopsis(c, layout.columns); });
  }
  for (const ops::OpInfo* g : Generators())
    look(*g, {}, [&] { return "--pattern " + GeneratorSynopsis(*g, layout.columns - 10); });
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.weight > b.weight; });

  const std::string left_out = wanted.size() == 1 ? WhyLeftOut(wanted[0]) : "";
  if (!left_out.empty()) out << layout.Wrapped("oiiotool's --" + wanted[0] + ": " + left_out, 0);
  if (found.empty() && left_out.empty())
    throw DataError("--help-search " + words,
                    "no command is about all of these words, --help lists them all");
  constexpr size_t kMost = 12;
  for (size_t k = 0; k < std::min(found.size(), kMost); ++k)
    out << layout.Name(found[k].synopsis) << "\n" << layout.Wrapped(found[k].summary, 4);
  if (found.size() > kMost) {
    out << layout.Wrapped(
        std::to_string(found.size() - kMost) + " more mention it; further words leave fewer.", 0);
  }
}

}  // namespace tessera::cli
