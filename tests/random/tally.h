// How often what was drawn and compared.
#ifndef TESSERA_TESTS_RANDOM_TALLY_H_
#define TESSERA_TESTS_RANDOM_TALLY_H_

#include <cstdint>
#include <map>
#include <string>

namespace tessera::random {

// Counters by name, of several kinds: "check types", "row blur", "rule join", ...
class Tally {
 public:
  void Add(const std::string& kind, const std::string& name, int64_t count = 1) {
    counts_[kind][name] += count;
  }
  int64_t Of(const std::string& kind, const std::string& name) const {
    const auto names = counts_.find(kind);
    if (names == counts_.end()) return 0;
    const auto count = names->second.find(name);
    return count == names->second.end() ? 0 : count->second;
  }
  const std::map<std::string, std::map<std::string, int64_t>>& counts() const { return counts_; }

 private:
  std::map<std::string, std::map<std::string, int64_t>> counts_;
};

// The kinds.
inline constexpr char kChecked[] = "check";         // comparisons that were made
inline constexpr char kCompared[] = "row";          // cases with the row in them that were compared
inline constexpr char kAccepted[] = "accepted";     // steps of the row that were drawn and accepted
inline constexpr char kRefused[] = "refused";       // and refused
inline constexpr char kTooLarge[] = "too large";    // and dropped for the size of their result
inline constexpr char kReferenced[] = "reference";  // operations that were compared with their reference
inline constexpr char kUndecided[] = "undecided";   // values of theirs that hang on a decision
inline constexpr char kApplied[] = "rule on";       // cases where a rewrite rule was applied
inline constexpr char kSwitchedOff[] = "rule off";  // and was switched off alone for comparison
inline constexpr char kFiles[] = "file";            // files that were read back, by extension
inline constexpr char kCases[] = "cases";           // "run", "refused", "cut", "verdicts", ...

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_TALLY_H_
