// Loaded before the C library (LD_PRELOAD): refuses the allocation of the number in FAIL_ALLOCATION, or
// writes how many there were to the file in COUNT_ALLOCATIONS when the program ends.
//
// Two libraries do not look at what malloc gave them: OpenImageIO's ParamValue (2.4.7: a memcpy to nullptr
// for each attribute longer than 16 bytes) and libtiff. When it is their turn, the next one's is refused
// instead.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// glibc's own, below those that are replaced here.
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {

std::atomic<long> count = 0;
std::atomic<long> fail_at = -1;

__attribute__((constructor)) void Begin() {
  if (const char* const text = std::getenv("FAIL_ALLOCATION")) fail_at = std::atol(text);
}
void End() {
  const char* const name = std::getenv("COUNT_ALLOCATIONS");
  if (name == nullptr) return;
  char text[32];
  const int length = std::snprintf(text, sizeof text, "%ld\n", count.load());
  const int file = open(name, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0) return;
  if (write(file, text, static_cast<size_t>(length)) == length) close(file);
}

bool LooksAtNothing(const void* caller) {
  Dl_info info;
  if (dladdr(caller, &info) == 0 || info.dli_fname == nullptr) return false;
  return std::strstr(info.dli_fname, "libOpenImageIO") != nullptr ||
         std::strstr(info.dli_fname, "libtiff") != nullptr;
}

bool Refused(const void* caller) {
  if (++count != fail_at) return false;
  if (LooksAtNothing(caller)) {
    ++fail_at;
    return false;
  }
  errno = ENOMEM;
  return true;
}

}  // namespace

extern "C" {
[[noreturn]] void _exit(int code) {
  End();
  for (;;) syscall(SYS_exit_group, code);
}
void* malloc(size_t size) { return Refused(__builtin_return_address(0)) ? nullptr : __libc_malloc(size); }
void* calloc(size_t n, size_t size) {
  return Refused(__builtin_return_address(0)) ? nullptr : __libc_calloc(n, size);
}
void* realloc(void* p, size_t size) {
  return Refused(__builtin_return_address(0)) ? nullptr : __libc_realloc(p, size);
}
void* memalign(size_t alignment, size_t size) {
  return Refused(__builtin_return_address(0)) ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** p, size_t alignment, size_t size) {
  *p = memalign(alignment, size);
  return *p == nullptr ? ENOMEM : 0;
}
}
