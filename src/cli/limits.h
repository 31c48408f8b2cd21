// --limit and --safe: what a line may take, and what becomes of one that takes more.
#ifndef TESSERA_CLI_LIMITS_H_
#define TESSERA_CLI_LIMITS_H_

#include <sys/resource.h>

#include <optional>
#include <string>

#include "tessera/policy.h"

namespace tessera::cli {

struct Options;

struct Limits {
  std::optional<double> pixels, channels, frames, memory, seconds;  // memory in MiB
};

// What servers start from.
inline constexpr Limits kSafeLimits = {.pixels = static_cast<double>(SafePolicy().pixels),
                                       .channels = static_cast<double>(SafePolicy().channels),
                                       .frames = 1000,
                                       .memory = static_cast<double>(SafePolicy().reader_memory >> 20),
                                       .seconds = SafePolicy().reader_seconds};

// Takes KEY=VALUE,...; of limits that are given twice the smaller holds. Throws UsageError.
void AddLimits(const std::string& text, Limits& limits);

// Sets what each evaluation of a line is given: memory, and when it has to end.
void Limit(Options& options);
// What holds for the whole process while one of these lives: the policy, the system's limit of memory, the
// end of its time.
class ProcessLimits {
 public:
  explicit ProcessLimits(const Options& options);
  ~ProcessLimits();
  ProcessLimits(const ProcessLimits&) = delete;
  ProcessLimits& operator=(const ProcessLimits&) = delete;

 private:
  std::optional<rlim_t> memory_;  // what it was before
};

// Throws Error when the time is over. `words`: what is at hand from here on, for the message; empty: the
// same.
void RequireTime(const std::string& words = "");
// Throws DataError about the name of a sequence.
void RequireFrames(const Options& options, const std::string& name, size_t frames);
// Why there is no memory, with the limit where there is one.
std::string MemoryReason(const std::string& reason = "refused by the system");

}  // namespace tessera::cli

#endif  // TESSERA_CLI_LIMITS_H_
