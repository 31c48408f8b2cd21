// Runs a fuzz target without libFuzzer: files as they are, or seeds and what becomes of them.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "fuzz/coverage.h"
#include "fuzz/fuzz.h"
#include "fuzz/mutate.h"
#include "fuzz/seed_files.h"

#if defined(__SANITIZE_ADDRESS__)
extern "C" {
void __sanitizer_set_death_callback(void (*callback)());
// A refused allocation is a bad_alloc, as without sanitizers.
const char* __asan_default_options() {
  return "allocator_may_return_null=1:max_allocation_size_mb=2048:detect_leaks=0:handle_abort=0:"
         "quarantine_size_mb=16:malloc_context_size=8:detect_stack_use_after_return=0";
}
const char* __ubsan_default_options() { return "halt_on_error=1:print_stacktrace=1"; }
}
#endif

// A target's own way to change an input, as libFuzzer has it.
extern "C" __attribute__((weak)) size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most,
                                                                unsigned seed);

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr char kUsage[] =
    "fuzz_NAME [--runs N] [--seconds S] [--seed N] [--max-length N] [--timeout S] [--memory MB]\n"
    "          [--keep FOLDER] [FOLDER|FILE]...\n"
    "fuzz_NAME --seeds FOLDER   writes the inputs that are begun with, and FOLDER.dict\n"
    "Runs the target on its own seeds and those of FOLDERs, then on what mutations make of them, for so many\n"
    "runs or seconds; with FILEs on these alone. An input that ends it is left in finding_NAME_SEED.\n"
    "--timeout: seconds of processor time that one input may take, 20\n"
    "--memory: MB that the program may grow by for one input, 512\n"
    "--keep: where inputs are kept that took a new way, if the library was built with TESSERA_FUZZ\n";

struct Options {
  uint64_t runs = 1000, seed = 1;
  double seconds = 0;
  size_t max_length = 4096;
  int timeout = 20, memory = 512;
  std::string keep;
  std::vector<std::string> folders, files;
};

// What signal handlers see.
struct Running {
  const char* data = nullptr;
  size_t size = 0;
  volatile uint64_t number = 0;
  char name[512] = {};
  int timeout = 0;
} g_running;

void Say(const char* text) {
  const ssize_t ignored = ::write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

void KeepFinding() {
  if (g_running.data == nullptr) return;
  const int file = ::open(g_running.name, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const ssize_t written = file < 0 ? -1 : ::write(file, g_running.data, g_running.size);
  if (file >= 0) ::close(file);
  Say(written < 0 ? "the input that ended it cannot be written: " : "the input that ended it is in ");
  Say(g_running.name);
  Say("\n");
  g_running.data = nullptr;
}

void OnFault(int signal) {
  KeepFinding();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Every second of processor time.
void OnTick(int) {
  static uint64_t last = 0;
  static int ticks = 0;
  if (g_running.data == nullptr || g_running.number != last) {
    last = g_running.number, ticks = 0;
    return;
  }
  if (++ticks <= g_running.timeout) return;
  Say("finding: an input takes too long\n");
  std::abort();
}

void CatchFaults(const Options& o, const std::string& name) {
  std::snprintf(g_running.name, sizeof g_running.name, "%s", name.c_str());
  g_running.timeout = o.timeout;
  static std::vector<char> stack(1 << 16);
  const stack_t own = {.ss_sp = stack.data(), .ss_flags = 0, .ss_size = stack.size()};
  ::sigaltstack(&own, nullptr);
  struct sigaction action = {};
  action.sa_handler = OnFault;
  action.sa_flags = SA_ONSTACK;
  ::sigaction(SIGABRT, &action, nullptr);
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_set_death_callback(KeepFinding);  // the sanitizer has these signals
#else
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) ::sigaction(signal, &action, nullptr);
  const rlimit memory = {rlim_t{6} << 30, rlim_t{6} << 30};  // without end, a new throws
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  action.sa_handler = OnTick;
  action.sa_flags = SA_RESTART | SA_ONSTACK;
  ::sigaction(SIGPROF, &action, nullptr);
  const itimerval second = {{1, 0}, {1, 0}};
  ::setitimer(ITIMER_PROF, &second, nullptr);
}

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The most that the program has held, in MB.
long MostMemory() {
  rusage usage = {};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss >> 10;
}

class Runner {
 public:
  explicit Runner(const Options& o) : o_(o), draw_(o.seed, 0), words_(Words()) {}

  void Run(const std::string& input) {
    g_running.data = input.data(), g_running.size = input.size();
    g_running.number = g_running.number + 1;
    const double before = Now();
    LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
    longest_ = std::max(longest_, Now() - before);
    const long most = MostMemory();
    if (most - memory_ > o_.memory) Fail("an input takes " + std::to_string(most - memory_) + " MB");
    memory_ = most;
    g_running.data = nullptr;
    ++runs_;
    if (!TookANewWay()) return;
    inputs_.push_back(input);
    if (!o_.keep.empty()) WriteKept(input);
  }

  void RunAll(const std::string& name) {
    std::vector<std::string> seeds = Seeds();
    for (const std::string& folder : o_.folders) {
      for (const auto& entry : fs::directory_iterator(folder))
        seeds.push_back(Contents(entry.path().string()));
    }
    for (const std::string& seed : seeds) Run(seed);
    if (inputs_.empty()) inputs_ = std::move(seeds);  // there is no coverage to choose by
    if (inputs_.empty()) inputs_.emplace_back();
    for (double next = 60; !Ended();) {
      Run(Changed());
      if (Seconds() > next) next += 60, Report(name);
    }
    Report(name);
  }

  void Report(const std::string& name) const {
    rusage usage = {};
    ::getrusage(RUSAGE_SELF, &usage);
    const double cpu = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                       1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    std::printf(
        "%s: %llu executions in %.1f s, %.1f s of processor time, %.0f per second; %zu inputs, %zu blocks, longest "
        "%.3f s, %ld MB, seed %llu\n",
        name.c_str(), static_cast<unsigned long long>(runs_), Seconds(), cpu,
        static_cast<double>(runs_) / Seconds(), inputs_.size(), BlocksSeen(), longest_, usage.ru_maxrss >> 10,
        static_cast<unsigned long long>(o_.seed));
    std::fflush(stdout);
  }

 private:
  double Seconds() const { return Now() - start_; }
  bool Ended() const { return o_.seconds > 0 ? Seconds() >= o_.seconds : runs_ >= o_.runs; }

  std::string Changed() {
    // What was found last is looked at more.
    const int count = static_cast<int>(inputs_.size());
    const int from = draw_.Chance(0.3) ? std::max(0, count - 32) : 0;
    std::string input = inputs_[static_cast<size_t>(draw_.Between(from, count - 1))];
    if (LLVMFuzzerCustomMutator != nullptr && draw_.Chance(0.7)) {
      const size_t size = std::min(input.size(), o_.max_length);
      input.resize(o_.max_length);
      input.resize(LLVMFuzzerCustomMutator(reinterpret_cast<uint8_t*>(input.data()), size, input.size(),
                                           static_cast<unsigned>(draw_.Next())));
      return input;
    }
    const std::string compared = draw_.Chance(0.3) ? ComparedWith(draw_) : "";
    if (compared.empty()) {
      Mutate(draw_, input, draw_.Of(inputs_), words_, o_.max_length);
    } else {
      MutateOnce(draw_, input, compared, {compared});
    }
    if (input.size() > o_.max_length) input.resize(o_.max_length);
    return input;
  }

  void WriteKept(const std::string& input) {
    char name[32];
    std::snprintf(name, sizeof name, "%016llx",
                  static_cast<unsigned long long>(std::hash<std::string>()(input)));
    std::FILE* const file = std::fopen((fs::path(o_.keep) / name).c_str(), "wb");
    if (file == nullptr) return;
    std::fwrite(input.data(), 1, input.size(), file);
    std::fclose(file);
  }

  const Options& o_;
  random::Draw draw_;
  std::vector<std::string> words_, inputs_;
  uint64_t runs_ = 0;
  double longest_ = 0, start_ = Now();
  long memory_ = MostMemory();
};

// False where the line is wrong.
bool Parse(int argc, char** argv, Options& o) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (!word.starts_with("--")) {
      if (!fs::exists(word)) return false;
      (fs::is_directory(word) ? o.folders : o.files).push_back(word);
      continue;
    }
    if (i + 1 == argc) return false;
    const char* const value = argv[++i];
    if (word == "--runs") {
      o.runs = std::strtoull(value, nullptr, 10);
    } else if (word == "--seconds") {
      o.seconds = std::atof(value);
    } else if (word == "--seed") {
      o.seed = std::strtoull(value, nullptr, 10);
    } else if (word == "--max-length") {
      o.max_length = std::strtoull(value, nullptr, 10);
    } else if (word == "--timeout") {
      o.timeout = std::atoi(value);
    } else if (word == "--memory") {
      o.memory = std::atoi(value);
    } else if (word == "--keep") {
      fs::create_directories(o.keep = fs::absolute(value).string());  // a target may change the folder
    } else if (word == "--seeds") {
      WriteSeeds(value);
      WriteDictionary(std::string(value) + ".dict");
      std::exit(0);
    } else {
      return false;
    }
  }
  return true;
}

int Main(int argc, char** argv) {
  Options o;
  if (!Parse(argc, argv, o)) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  const std::string name = fs::path(argv[0]).filename().string();
  CatchFaults(o, fs::absolute("finding_" + name.substr(std::min<size_t>(5, name.size())) + "_" +
                              std::to_string(o.seed))
                     .string());
  Runner runner(o);
  if (o.files.empty()) {
    runner.RunAll(name);
    return 0;
  }
  for (const std::string& file : o.files) runner.Run(Contents(file));
  runner.Report(name);
  return 0;
}

}  // namespace
}  // namespace tessera::fuzz

int main(int argc, char** argv) { return tessera::fuzz::Main(argc, argv); }
