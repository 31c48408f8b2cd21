// The program's own way to stderr.
#include "cli/messages.h"

#include <fcntl.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#include <sanitizer/common_interface_defs.h>
#endif

namespace tessera::cli {
namespace {

std::FILE*& Stream() {
  static std::FILE* stream = stderr;
  return stream;
}

}  // namespace

std::FILE* Messages() { return Stream(); }

void SilenceLibraries() {
  if (Stream() != stderr) return;
  const int own = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
  std::FILE* stream = own < 0 ? nullptr : fdopen(own, "w");
  if (stream != nullptr && nothing >= 0 && dup2(nothing, STDERR_FILENO) >= 0) {
    setvbuf(stream, nullptr, _IOLBF, BUFSIZ);
    Stream() = stream;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    __sanitizer_set_report_fd(reinterpret_cast<void*>(static_cast<intptr_t>(own)));
#endif
  }
  if (nothing >= 0) close(nothing);
}

}  // namespace tessera::cli
