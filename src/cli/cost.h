// --explain:cost=1: what an output is going to take.
#ifndef TESSERA_CLI_COST_H_
#define TESSERA_CLI_COST_H_

#include <string>

#include "cli/session.h"
#include "tessera/io.h"

namespace tessera::cli {

// Tries parts of it, writes rows of it to a file of that kind among the system's temporary ones, which is
// removed, and prints where the time will go.
void PrintCost(const Entry& entry, const std::string& file, const WriteOptions& write,
               const Options& options);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_COST_H_
