// One line of --batch: from its text to the words of a command line.
#ifndef TESSERA_CLI_BATCH_JOB_H_
#define TESSERA_CLI_BATCH_JOB_H_

#include <string>
#include <string_view>
#include <vector>

namespace tessera::cli {

struct Job {
  std::string id;  // JSON text, for the answer; empty where the line gives none
  std::vector<std::string> words;
};

// Whether the line is a job at all: an empty one and one that begins with # are none.
bool IsJob(std::string_view line);

// Words as a shell would take them, a JSON array of words, or a JSON object {"id": ..., "words": [...]}.
// Throws UsageError.
Job ParseJob(std::string_view line);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_BATCH_JOB_H_
