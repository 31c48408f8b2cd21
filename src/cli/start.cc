// Starting over with the libraries that stand-ins are there for.
#include "cli/start.h"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "cli/batch.h"
#include "cli/messages.h"
#include "tessera/io.h"
#include "tessera/sandbox.h"

#ifdef TESSERA_REAL_LIBRARIES
// What every function of a stand-in calls: a file turned out to be theirs whatever its name is.
extern "C" [[noreturn]] __attribute__((visibility("default"))) void tessera_start_over();
#endif

namespace tessera::cli {
namespace {

// Set for the program that was started over: what LD_LIBRARY_PATH was before.
constexpr const char* kMark = "TESSERA_STARTED_OVER";
constexpr const char* kSearchPath = "LD_LIBRARY_PATH";

// As OpenImageIO lists them for its readers of movies and of OpenVDB files; and `mesh=`, which OpenVDB
// converts.
constexpr std::array<std::string_view, 12> kRare = {".avi", ".mov", ".qt",  ".mp4", ".m4a", ".3gp",
                                                    ".3g2", ".mj2", ".m4v", ".mpg", ".vdb", "mesh="};

// What libraries read before main() has begun.
constexpr std::array<std::string_view, 6> kReadBefore = {"OPENIMAGEIO_", "CUE_",  "OCIO",
                                                         "OMP_",         "GOMP_", "ACC_"};

char** g_line = nullptr;
bool g_started_over = false, g_left_environment = false, g_waived_sandbox = false;

[[noreturn]] void Fail(const char* why) {
  std::fprintf(Messages(), "tessera: error: %s\n", why);
  std::fflush(Messages());
  _exit(1);
}

#ifdef TESSERA_REAL_LIBRARIES
[[noreturn]] void StartOver() {
  if (g_started_over || g_line == nullptr)
    Fail("OpenVDB, FFmpeg or OpenCV: not found in " TESSERA_REAL_LIBRARIES
         ", where they were when this was built");
  const char* const before = std::getenv(kSearchPath);
  const std::string kept = before == nullptr ? "" : before;
  setenv(kMark, kept.c_str(), 1);
  setenv(kSearchPath, (std::string(TESSERA_REAL_LIBRARIES) + (kept.empty() ? "" : ":" + kept)).c_str(), 1);
  // By its name where that can be had, which is what lists of processes show.
  std::array<char, 4096> name{};
  if (readlink("/proc/self/exe", name.data(), name.size() - 1) > 0) execv(name.data(), g_line);
  execv("/proc/self/exe", g_line);
  Fail("the program cannot be started again to load OpenVDB, FFmpeg or OpenCV");
}
#endif

// As ParseLine will read it, a word of another command's included: that line has less then.
bool HasOption(char** argv, std::string_view name) {
  for (char** word = argv + 1; *argv != nullptr && *word != nullptr; ++word) {
    std::string_view text = *word;
    if (!text.starts_with('-')) continue;
    text.remove_prefix(text.starts_with("--") ? 2 : 1);
    if (text.substr(0, text.find(':')) == name) return true;
  }
  return false;
}

// Whether a line may have files read in a sandbox: also a job of --batch may.
bool MayNeedSandbox(char** argv) {
  return HasOption(argv, "safe") || HasOption(argv, "formats") || HasOption(argv, "batch");
}

// No variable is there for anybody from here on. What was read before is undone by starting over.
void LeaveEnvironment(char** argv) {
  static char* none[] = {nullptr};  // libraries expect a list
  bool read = false;
  for (char** variable = environ; variable != nullptr && *variable != nullptr; ++variable) {
    for (const std::string_view start : kReadBefore) read |= std::string_view(*variable).starts_with(start);
  }
  if (!read) {
    environ = none;
    g_left_environment = true;
    return;
  }
  execve("/proc/self/exe", argv, none);
  Fail("--safe: the program cannot be started again without the environment");
}

}  // namespace

bool AsksForRareLibraries(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [](std::string word) {
    for (char& c : word) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    return std::any_of(kRare.begin(), kRare.end(),
                       [&](std::string_view rare) { return word.find(rare) != std::string::npos; });
  });
}

bool HasLeftEnvironment() { return g_left_environment; }

bool HasWaivedSandbox() { return g_waived_sandbox; }

namespace {

// What may start over first.
void StartLibraries(char** argv) {
  const bool safe = HasOption(argv, "safe");
  if (const char* const before = std::getenv(kMark)) {
    g_started_over = true;
    *before == '\0' ? unsetenv(kSearchPath) : setenv(kSearchPath, std::string(before).c_str(), 1);
    unsetenv(kMark);
    if (safe) LeaveEnvironment(argv);
    return;
  }
  if (safe) LeaveEnvironment(argv);
#ifdef TESSERA_REAL_LIBRARIES
  std::vector<std::string> words;
  for (char** word = argv; *word != nullptr; ++word) words.emplace_back(*word);
  // Jobs may name such files, and a process with a thousand more to do does not start over.
  if (AsksForRareLibraries(words) || AsksForBatch(words)) StartOver();
#endif
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" void* __libc_malloc(size_t);
extern "C" void __libc_free(void*);

// Before the libraries' own constructors, of which OpenImageIO's alone touches 24 MB of heap one page at a
// time: large pages, where they are to be had, save some six thousand faults, on virtual machines half of the
// start. Not by malloc(), which somebody may have put his own in place of, with a constructor yet to run.
void PrepareHeap(int, char**, char**) {
  constexpr int kStart = 128 << 20, kLarge = 2 << 20;
  // Buffers of codecs that come and go with every chunk are used again, those of all threads there: given
  // back to the system each time, its clearing of their pages is a fifth of what some compressions take, and
  // a third of a progressive JPEG. What is allocated in loops is the engine's, not malloc()'s.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the C library's most
  mallopt(M_TRIM_THRESHOLD, 192 << 20);
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_TOP_PAD, kStart);
  __libc_free(__libc_malloc(1));  // may be refused
  mallopt(M_TOP_PAD, 128 << 10);
  const auto end = reinterpret_cast<uintptr_t>(sbrk(0)) / kLarge * kLarge;
  if (end <= kStart) return;
  madvise(reinterpret_cast<void*>(end - kStart + kLarge), kStart - kLarge, MADV_HUGEPAGE);  // may be refused
}
[[gnu::section(".preinit_array"), gnu::used]] void (*const g_prepare_heap)(int, char**,
                                                                           char**) = &PrepareHeap;
#endif

}  // namespace

void Start(char** argv) {
  g_line = argv;
  StartLibraries(argv);
  g_waived_sandbox = HasOption(argv, "no-sandbox");
  if (g_waived_sandbox || !MayNeedSandbox(argv)) return;
#ifdef TESSERA_REAL_LIBRARIES
  StartSandbox(tessera_start_over);
#else
  StartSandbox();
#endif
}

}  // namespace tessera::cli

#ifdef TESSERA_REAL_LIBRARIES
void tessera_start_over() {
  if (tessera::InSandbox()) _exit(tessera::kSandboxWantsLibraries);
  tessera::RemoveUnfinishedOutputs();
  dup2(fileno(tessera::cli::Messages()), STDERR_FILENO);
  tessera::cli::StartOver();
}
#endif
