// The list of rules, and their application.
#include "graph/rules.h"

#include <algorithm>

namespace tessera::graph {

std::span<const Rule> Rules() {
  static const std::vector<Rule> rules = {
      {{"join", "two operations in a row become one that keeps the pixels in registers"}, JoinOps},
      {{"typed-window", "a tile operation reads integer pixels of sources and writes those of the result"},
       WindowOfSamples},
      {{"source-as-tile", "a tile that only copies a source's floats is the source itself"}, SourceAsTile},
      {{"tile-in-result", "a tile that is only stored as floats is made where it is stored"}, TileInResult},
      {{"move-bytes", "channels that are only selected or joined are moved without a conversion"}, MoveBytes},
      {{"samples", "an operation that treats all channels alike takes rows of samples"}, AsSamples},
      {{"all-in-operation", "an operation reads the pixels of all its inputs and writes the result's itself"},
       AllInOp},
      {{"load-in-operation", "an operation reads the pixels of its first input itself"}, LoadInOp},
      {{"store-in-operation", "an operation writes the result's pixels itself"}, StoreInOp},
      {{"whole-rows", "an operation from pixels to pixels takes rows in one piece"}, WholeRows},
      {{"codes", "an affine operation from integers to the same integers works on codes", true}, OnCodes},
      {{kWholeInResult, "an operation on a whole image writes into the caller's floats"}},
      {{kSourceAsWhole, "an input that is wanted whole and in memory as floats is not copied"}},
  };
  return rules;
}

RuleSet::RuleSet(std::span<const std::string> off) : off_(off.begin(), off.end()) {
  for (const std::string& name : off_) {
    const auto is_named = [&](const Rule& rule) { return rule.info.name == name; };
    if (name == "all" || std::any_of(Rules().begin(), Rules().end(), is_named)) continue;
    std::string known = "all";
    for (const Rule& rule : Rules()) known += ", " + rule.info.name;
    throw Error("rules", "found \"" + name + "\", expected one of " + known);
  }
}

bool RuleSet::IsOn(const std::string& name) const {
  return std::none_of(off_.begin(), off_.end(),
                      [&](const std::string& off) { return off == "all" || off == name; });
}

void RuleSet::Apply(Program& program) const {
  for (const Rule& rule : Rules()) {
    if (rule.rewrite == nullptr || !IsOn(rule.info.name)) continue;
    for (size_t step = 0; step < program.steps.size(); ++step) {
      const size_t steps = program.steps.size();
      if (!rule.rewrite(program, step)) continue;
      // A rewrite may take its own step, or others, out of the list; what is left of it says who did.
      const size_t left = std::min(step, program.steps.size() - 1);
      program.steps[left].rules.push_back(rule.info.name);
      if (program.steps.size() < steps) step = left > 0 ? left - 1 : static_cast<size_t>(-1);
    }
  }
}

}  // namespace tessera::graph

namespace tessera {

const std::vector<RuleInfo>& RewriteRules() {
  static const std::vector<RuleInfo> infos = [] {
    std::vector<RuleInfo> list;
    for (const graph::Rule& rule : graph::Rules()) list.push_back(rule.info);
    return list;
  }();
  return infos;
}

}  // namespace tessera
