// From exceptions to exit codes.
#include "cli/outcome.h"

#include <new>

#include "cli/arguments.h"
#include "cli/limits.h"
#include "tessera/error_kind.h"

namespace tessera::cli {

Outcome Attempt(const std::function<int()>& work) try {
  return {work(), "", ""};
} catch (const UsageError& e) {
  return {kWrongLine, "usage", e.what()};
} catch (const Error& e) {
  const ErrorKind kind = KindOf(e);
  return {kFailed,
          kind == ErrorKind::kSystem      ? "system"
          : kind == ErrorKind::kCancelled ? "cancelled"
                                          : "data",
          e.what()};
} catch (const std::bad_alloc&) {
  return {kFailed, "system", "memory: " + MemoryReason()};
} catch (const std::exception& e) {
  return {kFailed, "internal", e.what()};
}

}  // namespace tessera::cli
