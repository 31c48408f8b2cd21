// Contestants that are measured together, and what the report says of each.
#ifndef TESSERA_BENCH_GROUP_H_
#define TESSERA_BENCH_GROUP_H_

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "harness.h"

namespace tessera::bench {

struct Outcome {
  std::vector<Measured> results;
  PixelType type = PixelType::kFloat;      // of the output; errors of integers are counted in codes too
  double pixels = 0;                       // times are given for one of them
  double bytes_moved = 1, copy_bytes = 1;  // by the task and by the copy, in one unit
  std::map<std::string, std::map<std::string, double>> counters;  // contestant -> what only some groups tell
};

// Registers PREFIX/CONTESTANT for each. `measure` is called once, when the first of them is asked for; one
// that it has no result for is reported as skipped, and what it throws as the reason.
void RegisterGroup(const std::string& prefix, const std::vector<std::string>& contestants,
                   std::function<Outcome()> measure);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_GROUP_H_
