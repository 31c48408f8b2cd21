// Limits of the system, and its list of calls (libseccomp).
#include "io/sandbox/confine.h"

#include <stdexcept>

#ifdef TESSERA_SECCOMP

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <memory>
#include <type_traits>

#include "io/sandbox/names.h"

namespace tessera::io::sandbox {
namespace {

class Calls {
 public:
  Calls() : filter_(seccomp_init(SCMP_ACT_KILL_PROCESS)) {
    if (!filter_) throw std::runtime_error("no filter of system calls");
  }
  template <typename... Conditions>
  void Allow(int call, const Conditions&... conditions) {
    Add(SCMP_ACT_ALLOW, call, conditions...);
  }
  template <typename... Conditions>
  void Answer(int call, const Conditions&... conditions) {
    Add(SCMP_ACT_TRAP, call, conditions...);
  }
  template <typename... Conditions>
  void Refuse(int code, int call, const Conditions&... conditions) {
    Add(SCMP_ACT_ERRNO(static_cast<unsigned>(code)), call, conditions...);
  }
  void Load() {
    if (const int code = seccomp_load(filter_.get()); code != 0) {
      throw std::runtime_error("the system takes no filter of system calls (" + std::to_string(-code) + ")");
    }
  }

 private:
  template <typename... Conditions>
  void Add(uint32_t action, int call, const Conditions&... conditions) {
    // A call that this architecture has not is none that has to be allowed.
    const int code = seccomp_rule_add(filter_.get(), action, call, sizeof...(conditions), conditions...);
    if (code != 0 && code != -EDOM)
      throw std::runtime_error("the filter of system calls cannot be made (" + std::to_string(-code) + ")");
  }

  struct Release {
    void operator()(scmp_filter_ctx filter) const { seccomp_release(filter); }
  };
  std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, Release> filter_;
};

scmp_arg_cmp Is(unsigned argument, uint64_t value) { return {argument, SCMP_CMP_EQ, value, 0}; }
scmp_arg_cmp Bits(unsigned argument, uint64_t mask, uint64_t value) {
  return {argument, SCMP_CMP_MASKED_EQ, mask, value};
}

void AllowMemory(Calls& calls) {
  for (const int call : {SCMP_SYS(brk), SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise)})
    calls.Allow(call);
  // No code; and no memory that is shared but has no file, which no limit counts.
  calls.Allow(SCMP_SYS(mprotect), Bits(2, PROT_EXEC, 0));
  calls.Allow(SCMP_SYS(mmap), Bits(2, PROT_EXEC, 0), Bits(3, MAP_SHARED, 0));
  calls.Allow(SCMP_SYS(mmap), Bits(2, PROT_EXEC, 0), Bits(3, MAP_SHARED | MAP_ANONYMOUS, MAP_SHARED));
}

void AllowThreads(Calls& calls) {
  constexpr uint64_t kThread = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD;
  constexpr uint64_t kNever = CLONE_NEWNS | CLONE_NEWCGROUP | CLONE_NEWUTS | CLONE_NEWIPC | CLONE_NEWUSER |
                              CLONE_NEWPID | CLONE_NEWNET | CLONE_PTRACE | CLONE_VFORK;
  calls.Allow(SCMP_SYS(clone), Bits(0, kThread | kNever, kThread));
  calls.Refuse(ENOSYS, SCMP_SYS(clone3));  // its flags are in memory; the C library takes clone then
  for (const int call :
       {SCMP_SYS(futex), SCMP_SYS(set_robust_list), SCMP_SYS(rseq), SCMP_SYS(gettid), SCMP_SYS(sched_yield),
        SCMP_SYS(sched_getaffinity), SCMP_SYS(getcpu), SCMP_SYS(sigaltstack), SCMP_SYS(rt_sigprocmask),
        SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigreturn), SCMP_SYS(restart_syscall), SCMP_SYS(exit),
        SCMP_SYS(exit_group)})
    calls.Allow(call);
  // abort() is to be seen for what it is.
  calls.Allow(SCMP_SYS(tgkill), Is(0, static_cast<uint64_t>(::getpid())));
}

// Nothing of these changes anything outside.
void AllowQuestions(Calls& calls) {
  for (const int call :
       {SCMP_SYS(clock_gettime), SCMP_SYS(clock_getres), SCMP_SYS(clock_nanosleep), SCMP_SYS(nanosleep),
        SCMP_SYS(gettimeofday), SCMP_SYS(time), SCMP_SYS(times), SCMP_SYS(getrandom), SCMP_SYS(getpid),
        SCMP_SYS(getrusage), SCMP_SYS(sysinfo), SCMP_SYS(uname)})
    calls.Allow(call);
  calls.Allow(SCMP_SYS(prlimit64), Is(2, 0));  // sets none
  calls.Refuse(EPERM, SCMP_SYS(sched_setaffinity));
  calls.Refuse(EPERM, SCMP_SYS(prctl), Is(0, PR_SET_NAME));
  calls.Refuse(ENOTTY, SCMP_SYS(ioctl), Is(1, TCGETS));
  calls.Refuse(ENOENT, SCMP_SYS(getcwd));
}

void AllowFiles(Calls& calls) {
  // There are no others than the input, the socket and /dev/null, so all may be read.
  for (const int call :
       {SCMP_SYS(read), SCMP_SYS(readv), SCMP_SYS(pread64), SCMP_SYS(preadv), SCMP_SYS(lseek),
        SCMP_SYS(_llseek), SCMP_SYS(fstat), SCMP_SYS(fadvise64), SCMP_SYS(readahead)})
    calls.Allow(call);
  for (const uint64_t nothing : {STDOUT_FILENO, STDERR_FILENO}) {
    calls.Allow(SCMP_SYS(write), Is(0, nothing));
    calls.Allow(SCMP_SYS(writev), Is(0, nothing));
  }
  calls.Allow(SCMP_SYS(sendmsg), Is(0, kSocket));
  calls.Allow(SCMP_SYS(recvmsg), Is(0, kSocket));
  for (const uint64_t command : {F_GETFD, F_SETFD, F_GETFL}) calls.Allow(SCMP_SYS(fcntl), Is(1, command));
  for (const int call :
       {SCMP_SYS(open), SCMP_SYS(openat), SCMP_SYS(stat), SCMP_SYS(lstat), SCMP_SYS(newfstatat),
        SCMP_SYS(access), SCMP_SYS(faccessat), SCMP_SYS(readlink), SCMP_SYS(readlinkat)})
    calls.Answer(call);
  for (const int call : {SCMP_SYS(statx), SCMP_SYS(faccessat2), SCMP_SYS(openat2)})
    calls.Refuse(ENOSYS, call);  // the C library takes the older ones then
  // Of the input's own descriptors closing is answered too; all others have smaller numbers.
  calls.Answer(SCMP_SYS(close), Bits(0, kFirstOpened, kFirstOpened));
  calls.Allow(SCMP_SYS(close), Bits(0, kFirstOpened, 0));
}

// UndefinedBehaviorSanitizer, which has no macro, sees by a pipe whether memory is there.
void AllowSanitizers([[maybe_unused]] Calls& calls) {
#ifdef __SANITIZE_ADDRESS__
  for (const int call : {SCMP_SYS(pipe), SCMP_SYS(pipe2)}) calls.Allow(call);
  calls.Allow(SCMP_SYS(write), Bits(0, kFirstOpened, 0));
#endif
}

void SetLimit(decltype(RLIMIT_DATA) which, double most) {
  rlimit limit{};
  ::getrlimit(which, &limit);
  if (most < 1e18) limit.rlim_max = std::min(limit.rlim_max, static_cast<rlim_t>(most));
  limit.rlim_cur = std::min(limit.rlim_cur, limit.rlim_max);
  if (::setrlimit(which, &limit) != 0) throw std::runtime_error("the system takes no limits");
}

void CloseBetween(unsigned first, unsigned last) {
#ifdef SYS_close_range
  if (::syscall(SYS_close_range, first, last, 0) == 0) return;
#endif
  const long most = std::min<long>(::sysconf(_SC_OPEN_MAX), last);
  for (long descriptor = first; descriptor <= most; ++descriptor) ::close(static_cast<int>(descriptor));
}

}  // namespace

std::string WhyNotConfined() {
  return ::prctl(PR_GET_SECCOMP, 0, 0, 0, 0) >= 0 ? "" : "the system has no seccomp";
}

void KeepTwo(int& socket, int& input) {
  const int high_socket = ::fcntl(socket, F_DUPFD, kFirstOpened + kOpened),
            high_input = ::fcntl(input, F_DUPFD, kFirstOpened + kOpened),
            nothing = ::open("/dev/null", O_RDWR);
  if (high_socket < 0 || high_input < 0) throw std::runtime_error("it takes a hundred descriptors");
  if (nothing < 0) throw std::runtime_error("there is no /dev/null");
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nothing, stream);
  socket = ::dup2(high_socket, kSocket), input = ::dup2(high_input, kSocket + 1);
  CloseBetween(kSocket + 2, ~0U);
  if (socket != kSocket || input != kSocket + 1) throw std::runtime_error("it takes a hundred descriptors");
}

void Confine(const std::string& file, int input, const ChildLimits& limits) {
  AnswerNames(file, input);
  if (::close(input) != 0) throw std::runtime_error("the file cannot be closed");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // Sanitizers' shadows are counted too.
  SetLimit(RLIMIT_DATA, static_cast<double>(limits.memory));
#endif
  SetLimit(RLIMIT_CPU, std::ceil(limits.cpu_seconds));
  SetLimit(RLIMIT_FSIZE, 0);
  SetLimit(RLIMIT_CORE, 0);
  Calls calls;
  AllowMemory(calls), AllowThreads(calls), AllowQuestions(calls), AllowFiles(calls);
  AllowSanitizers(calls);
  calls.Load();
}

}  // namespace tessera::io::sandbox

#else

namespace tessera::io::sandbox {

std::string WhyNotConfined() {
#ifdef __linux__
  return "this build has none: libseccomp was not found";
#else
  return "this system has none: it is made of Linux's seccomp";
#endif
}
void KeepTwo(int&, int&) { throw std::runtime_error(WhyNotConfined()); }
void Confine(const std::string&, int, const ChildLimits&) { throw std::runtime_error(WhyNotConfined()); }

}  // namespace tessera::io::sandbox

#endif  // TESSERA_SECCOMP
