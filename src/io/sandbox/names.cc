// Calls of the system by a name, answered in a handler of SIGSYS: no reader of a library has to know.
#include "io/sandbox/names.h"

#ifdef TESSERA_SECCOMP

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace tessera::io::sandbox {
namespace {

std::string* g_file = nullptr;  // never freed
std::array<std::atomic<bool>, kOpened> g_open;

bool IsTheFile(long name) { return std::strcmp(reinterpret_cast<const char*>(name), g_file->c_str()) == 0; }

long Open(long name, long flags) {
  if (!IsTheFile(name)) return -ENOENT;
  if ((flags & O_ACCMODE) != O_RDONLY || (flags & (O_CREAT | O_TRUNC)) != 0) return -EACCES;
  if ((flags & O_DIRECTORY) != 0) return -ENOTDIR;
  for (int i = 0; i < kOpened; ++i) {
    if (g_open[static_cast<size_t>(i)].exchange(true)) continue;
    ::lseek(kFirstOpened + i, 0, SEEK_SET);
    return kFirstOpened + i;
  }
  return -EMFILE;
}

long Close(long descriptor) {
  if (descriptor < kFirstOpened || descriptor >= kFirstOpened + kOpened) return -EBADF;  // -1, say
  return g_open[static_cast<size_t>(descriptor - kFirstOpened)].exchange(false) ? 0 : -EBADF;
}

// fstat is the one of them that is allowed.
long Stat(long name, long to) {
  if (!IsTheFile(name)) return -ENOENT;
  return ::syscall(SYS_fstat, kFirstOpened, to) == 0 ? 0 : -errno;
}

long Access(long name, long mode) {
  if (!IsTheFile(name)) return -ENOENT;
  return (mode & (W_OK | X_OK)) != 0 ? -EACCES : 0;
}

long Answer(long call, const std::array<long, 6>& arguments) {
  const auto& [a, b, c, d, e, f] = arguments;
  switch (call) {
    case SYS_openat:
      return Open(b, c);
    case SYS_close:
      return Close(a);
    case SYS_newfstatat:
      // The C library's fstat.
      if ((d & AT_EMPTY_PATH) != 0 && *reinterpret_cast<const char*>(b) == '\0')
        return ::syscall(SYS_fstat, a, c) == 0 ? 0 : -errno;
      return Stat(b, c);
    case SYS_faccessat:
      return Access(b, c);
    case SYS_readlinkat:
      return IsTheFile(b) ? -EINVAL : -ENOENT;  // it is no link
#ifdef SYS_open
    case SYS_open:
      return Open(a, b);
    case SYS_stat:
    case SYS_lstat:
      return Stat(a, b);
    case SYS_access:
      return Access(a, b);
    case SYS_readlink:
      return IsTheFile(a) ? -EINVAL : -ENOENT;
#endif
    default:
      return -ENOSYS;
  }
}

extern "C" void OnTrap(int /*signal*/, siginfo_t* what, void* context) {
  const int kept = errno;
  mcontext_t& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  auto& r = machine.gregs;
  r[REG_RAX] =
      Answer(what->si_syscall, {r[REG_RDI], r[REG_RSI], r[REG_RDX], r[REG_R10], r[REG_R8], r[REG_R9]});
#elif defined(__aarch64__)
  auto& r = machine.regs;
  const auto at = [&](int i) { return static_cast<long>(r[i]); };
  r[0] = static_cast<unsigned long>(Answer(what->si_syscall, {at(0), at(1), at(2), at(3), at(4), at(5)}));
#endif
  errno = kept;
}

}  // namespace

void AnswerNames(const std::string& file, int input) {
  g_file = new std::string(file);
  const std::string self = "/proc/self/fd/" + std::to_string(input);
  for (int i = 0; i < kOpened; ++i) {
    const int own = ::open(self.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
    if (own < 0 || ::dup3(own, kFirstOpened + i, O_CLOEXEC) < 0)
      throw std::runtime_error("the file cannot be opened again");
    ::close(own);
  }
  struct sigaction action {};
  action.sa_sigaction = OnTrap;
  action.sa_flags = SA_SIGINFO | SA_NODEFER;
  if (::sigaction(SIGSYS, &action, nullptr) != 0) throw std::runtime_error("no handler of SIGSYS");
}

}  // namespace tessera::io::sandbox

#endif  // TESSERA_SECCOMP
