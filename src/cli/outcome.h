// How a line ended.
#ifndef TESSERA_CLI_OUTCOME_H_
#define TESSERA_CLI_OUTCOME_H_

#include <functional>
#include <string>

namespace tessera::cli {

inline constexpr int kDone = 0, kFailed = 1, kWrongLine = 2;

struct Outcome {
  int code = kDone;
  // Of an error: usage (the line is wrong), data (it does not suit the files, or they do not hold what they
  // should), system (the system refused a file or memory), cancelled, internal.
  std::string kind;
  std::string message;  // empty where there was no error, whatever the code
};

// What `work` returns, or what it throws.
Outcome Attempt(const std::function<int()>& work);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_OUTCOME_H_
