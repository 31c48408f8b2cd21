// All that is compared of one case.
#ifndef TESSERA_TESTS_RANDOM_COMPARE_H_
#define TESSERA_TESTS_RANDOM_COMPARE_H_

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "random/generate.h"
#include "tessera/render.h"

namespace tessera::random {

struct Finding {
  Check check = Check::kRules;
  std::string what;  // which variant, where, and the values
};

// How often what was compared.
struct Tally {
  std::array<int64_t, static_cast<size_t>(Check::kCount)> checks{};
  std::map<std::string, int64_t> rows;        // cases that hold the row and were compared
  std::map<std::string, int64_t> referenced;  // operations compared with their reference
  std::map<std::string, int64_t> rules_on, rules_off;  // cases where a rule was applied; where it was switched off
  int64_t refused = 0;                         // cases whose evaluation was refused
};

class Comparer {
 public:
  // `folder` for files that are written and read back.
  explicit Comparer(std::string folder) : folder_(std::move(folder)) {}
  // The first thing that is wrong with the case, of those asked for in Case::checks.
  std::optional<Finding> Run(const Case& c);
  Tally& tally() { return tally_; }

 private:
  std::string folder_;
  Tally tally_;
};

// compare_alone.cc: operation by operation, from the floats that the operations before have given.
std::optional<std::string> DifferEager(const Built& built, bool bits, bool reference, Tally& tally);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_COMPARE_H_
