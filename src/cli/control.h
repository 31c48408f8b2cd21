// Lines that decide as they run: --if, --while, --for, --set; variables.
#ifndef TESSERA_CLI_CONTROL_H_
#define TESSERA_CLI_CONTROL_H_

#include <map>
#include <string>
#include <vector>

#include "cli/arguments.h"

namespace tessera::cli {

// Where the blocks of a line begin and end.
class Blocks {
 public:
  // Throws UsageError for an --else or an end without its beginning, and the other way round.
  explicit Blocks(const std::vector<Step>& steps);
  // Of a beginning: its --else, or its end where it has none. Of an --else and an end: the end, the
  // beginning.
  size_t Partner(size_t step) const { return partner_.at(step); }

 private:
  std::map<size_t, size_t> partner_;
};

// What a running line knows.
struct Flow {
  size_t next = 0;  // the step that is run next
  std::map<std::string, std::string> variables;
  std::map<size_t, double> loops;  // --for that are under way: their values
};

// Whether what a line has on its stack is known before it runs.
bool IsKnownAhead(const std::vector<Step>& steps);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_CONTROL_H_
