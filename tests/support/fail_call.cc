// Loaded before the C library (LD_PRELOAD): the call of the kind and number in FAIL_CALL, as write:7:28
// (kind, number, errno), fails, or with an errno of 0 never returns; or the file in COUNT_CALLS is told how
// many there were of each kind when the program ends. DELAY_EXIT: milliseconds between _exit and the end, for
// other threads to go on in.
//
// The kernel hands the calls over (seccomp's SIGSYS), so that those that the C library makes for its own
// streams are among them. Standard streams are left alone.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

enum Kind : uint8_t { kRead, kWrite, kOpen, kRename, kFsync, kClose, kTruncate, kThread, kKinds };
constexpr std::array<const char*, kKinds> kNames = {"read",  "write", "open",     "rename",
                                                    "fsync", "close", "truncate", "thread"};

struct Call {
  long number;
  Kind kind;
};
constexpr Call kCalls[] = {
#ifdef SYS_open
    {SYS_open, kOpen},       {SYS_creat, kOpen},      {SYS_rename, kRename},
#endif
    {SYS_openat, kOpen},     {SYS_read, kRead},       {SYS_pread64, kRead},       {SYS_readv, kRead},
    {SYS_preadv, kRead},     {SYS_write, kWrite},     {SYS_pwrite64, kWrite},     {SYS_writev, kWrite},
    {SYS_pwritev, kWrite},   {SYS_renameat, kRename}, {SYS_renameat2, kRename},   {SYS_fsync, kFsync},
    {SYS_fdatasync, kFsync}, {SYS_close, kClose},     {SYS_ftruncate, kTruncate}, {SYS_truncate, kTruncate}};
constexpr size_t kCallCount = std::size(kCalls);

// In the sixth argument, which none of them has: a call that was looked at already.
constexpr uint32_t kSeen = 0x7e55e7a5;

std::array<std::atomic<long>, kKinds> counts;
Kind fail_kind = kKinds;
long fail_at = -1;
int fail_code = EIO;
long delay = 0;

// Whether it is the turn of this one.
bool Fails(Kind kind) { return ++counts[kind] == fail_at && kind == fail_kind; }

void OnCall(int /*signal*/, siginfo_t* info, void* place) {
  const int before = errno;
  auto& machine = static_cast<ucontext_t*>(place)->uc_mcontext;
#if defined(__x86_64__)
  const auto a = [&](int i) {
    constexpr int kRegisters[] = {REG_RDI, REG_RSI, REG_RDX, REG_R10, REG_R8};
    return static_cast<long>(machine.gregs[kRegisters[i]]);
  };
  auto& result = machine.gregs[REG_RAX];
#else
  const auto a = [&](int i) { return static_cast<long>(machine.regs[i]); };
  auto& result = machine.regs[0];
#endif
  Kind kind = kKinds;
  for (const Call& call : kCalls) {
    if (call.number == info->si_syscall) kind = call.kind;
  }
  const bool standard = (kind == kRead || kind == kWrite || kind == kClose) && a(0) <= STDERR_FILENO;
  const bool fails = kind != kKinds && !standard && Fails(kind);
  while (fails && fail_code == 0) pause();
  long value = -fail_code;
  if (!fails || kind == kClose) {  // a descriptor is closed whatever close says
    const long done = syscall(info->si_syscall, a(0), a(1), a(2), a(3), a(4), long{kSeen});
    if (!fails) value = done < 0 ? -errno : done;
  }
  result = static_cast<std::remove_reference_t<decltype(result)>>(value);
  errno = before;
}

void HandOver() {
  std::array<sock_filter, kCallCount + 5> filter{};
  size_t n = 0;
  filter[n++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[5]));
  filter[n++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kSeen, kCallCount + 1, 0);
  filter[n++] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  for (size_t i = 0; i < kCallCount; ++i) {
    filter[n++] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<uint32_t>(kCalls[i].number),
                           static_cast<uint8_t>(kCallCount - i), 0);
  }
  filter[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  filter[n++] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
  const sock_fprog program = {static_cast<unsigned short>(n), filter.data()};
  struct sigaction action {};
  action.sa_sigaction = OnCall;
  action.sa_flags = SA_SIGINFO | SA_RESTART | SA_NODEFER;  // handlers that run meanwhile make calls too
  if (sigaction(SIGSYS, &action, nullptr) != 0 || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) {
    std::fputs("fail_call: the kernel hands no calls over\n", stderr);
    syscall(SYS_exit_group, 77);
  }
}

__attribute__((constructor)) void Begin() {
  if (const char* const text = std::getenv("FAIL_CALL")) {
    char name[16] = {};
    if (std::sscanf(text, "%15[a-z]:%ld:%d", name, &fail_at, &fail_code) != 3) std::abort();
    for (int kind = 0; kind < kKinds; ++kind) {
      if (std::strcmp(name, kNames[static_cast<size_t>(kind)]) == 0) fail_kind = static_cast<Kind>(kind);
    }
  }
  if (const char* const text = std::getenv("DELAY_EXIT")) delay = std::atol(text);
  HandOver();
}

void End() {
  const char* const name = std::getenv("COUNT_CALLS");
  if (name == nullptr) return;
  std::array<long, kKinds> seen{};
  for (size_t kind = 0; kind < kKinds; ++kind) seen[kind] = counts[kind];
  std::FILE* const file = std::fopen(name, "w");
  if (file == nullptr) return;
  for (size_t kind = 0; kind < kKinds; ++kind) std::fprintf(file, "%s %ld\n", kNames[kind], seen[kind]);
  std::fclose(file);
}

}  // namespace

extern "C" {
[[noreturn]] void _exit(int code) {
  End();
  const timespec wait = {delay / 1000, delay % 1000 * 1000000};
  nanosleep(&wait, nullptr);
  for (;;) syscall(SYS_exit_group, code);
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) {
  if (Fails(kThread)) return fail_code;
  static const auto real = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  return real(thread, attributes, run, argument);
}
}
