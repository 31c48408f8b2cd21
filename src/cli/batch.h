// --batch: many lines, one process.
#ifndef TESSERA_CLI_BATCH_H_
#define TESSERA_CLI_BATCH_H_

#include <functional>
#include <string>
#include <vector>

namespace tessera::cli {

// Runs a line as a process of its own would. Returns the exit code, appends the names of the files that it
// wrote; throws as it fails.
using RunLine = std::function<int(const std::vector<std::string>& words, std::vector<std::string>& written)>;

// Reads jobs from standard input until its end and answers each with one line of JSON on standard output.
// `words` is the batch's own line: its options stand before those of every job. `jobs`: how many run at once;
// 0 for one a core. Returns the exit code.
int RunBatch(const std::vector<std::string>& words, int jobs, const RunLine& run);

// Whether one of them is --batch.
bool AsksForBatch(const std::vector<std::string>& words);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_BATCH_H_
