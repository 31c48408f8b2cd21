// The rules that rewrite a bound plan's steps into faster ones, each with a name, a precondition on layouts
// and a switch. Bits do not depend on them, but where a rule says that it rounds.
#ifndef TESSERA_GRAPH_RULES_H_
#define TESSERA_GRAPH_RULES_H_

#include <span>
#include <string>
#include <vector>

#include "graph/program.h"
#include "tessera/render.h"

namespace tessera::graph {

struct Rule {
  RuleInfo info;
  // Rewrites one step where its precondition holds, and says whether it did. Null for the rules about whole
  // images, which are asked for by name where those are evaluated.
  bool (*rewrite)(Program& program, size_t step) = nullptr;
};
std::span<const Rule> Rules();

// Names of the rules about whole images.
inline constexpr char kWholeInResult[] = "whole-in-result";
inline constexpr char kSourceAsWhole[] = "source-as-whole";

// The rules that are on.
class RuleSet {
 public:
  // `off`: RenderOptions::rules_off. Throws Error for a name that no rule has.
  explicit RuleSet(std::span<const std::string> off);
  bool IsOn(const std::string& name) const;
  // Rule after rule, each on every step.
  void Apply(Program& program) const;

 private:
  std::vector<std::string> off_;
};

// The rewrites, by name in rules.cc.
bool JoinOps(Program& program, size_t step);
bool WindowOfSamples(Program& program, size_t step);
bool SourceAsTile(Program& program, size_t step);
bool TileInResult(Program& program, size_t step);
bool MoveBytes(Program& program, size_t step);
bool AsSamples(Program& program, size_t step);
bool AllInOp(Program& program, size_t step);
bool LoadInOp(Program& program, size_t step);
bool StoreInOp(Program& program, size_t step);
bool WholeRows(Program& program, size_t step);
bool OnCodes(Program& program, size_t step);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RULES_H_
