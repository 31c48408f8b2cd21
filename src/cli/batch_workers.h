// --batch:jobs=N: several jobs at once, each in one of several processes.
#ifndef TESSERA_CLI_BATCH_WORKERS_H_
#define TESSERA_CLI_BATCH_WORKERS_H_

#include <string>
#include <vector>

#include "cli/batch_streams.h"

namespace tessera::cli {

// Answers every job of `lines` as RunBatch does, in their order. `common`: the batch's own line without
// --batch. Returns the exit code.
int RunWorkers(const std::vector<std::string>& common, int count, Lines& lines, int answers);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_BATCH_WORKERS_H_
