// All that is compared of one case.
#ifndef TESSERA_TESTS_RANDOM_COMPARE_H_
#define TESSERA_TESTS_RANDOM_COMPARE_H_

#include <optional>
#include <string>

#include "random/generate.h"
#include "random/samples.h"
#include "random/tally.h"

namespace tessera::random {

struct Finding {
  Check check = Check::kRules;
  std::string what;  // which variant, where, and the values
};

class Comparer {
 public:
  // `folder` for files that are written and read back.
  Comparer(std::string folder, Tally& tally) : folder_(std::move(folder)), tally_(tally) {}
  // The first thing that is wrong with the case, of those asked for in Case::checks.
  std::optional<Finding> Run(const Case& c);

 private:
  std::string folder_;
  Tally& tally_;
};

// compare_alone.cc: operation by operation, from the floats that the operations before have given: the bits
// of the graph at once; each operation within its bound of the double reference.
std::optional<std::string> DifferEager(const Built& built);
std::optional<std::string> BeyondReference(const Built& built, Tally& tally);
// What the operations' bounds together let a sample of the graph at once be off; 0 where that is not known.
OffFunction Tolerances(const Node& node);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_COMPARE_H_
