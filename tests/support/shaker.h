// Another order of threads at every run: each is held up for a moment wherever it is, again and again.
#ifndef TESSERA_TESTS_SUPPORT_SHAKER_H_
#define TESSERA_TESTS_SUPPORT_SHAKER_H_

#include <dirent.h>
#include <signal.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <thread>
#include <vector>

namespace tessera::testing {

// While it lives, threads of the process drawn at random sleep for up to half a millisecond within the
// handler of a signal, some thousands of times a second: between any two instructions, as a system under load
// would have it, once in years. System calls go on afterwards.
class Shaker {
 public:
  explicit Shaker(uint64_t seed) {
    struct sigaction action {};
    action.sa_handler = Pause;
    action.sa_flags = SA_RESTART;
    ::sigaction(kSignal, &action, &before_);
    thread_ = std::thread([this, seed] { Shake(seed); });
  }
  ~Shaker() {
    stop_ = true;
    thread_.join();
    // One that is on its way finds the handler.
    if (before_.sa_handler != SIG_DFL) ::sigaction(kSignal, &before_, nullptr);
  }
  static uint64_t Pauses() { return pauses_; }  // of all threads so far
  Shaker(const Shaker&) = delete;
  Shaker& operator=(const Shaker&) = delete;

 private:
  static constexpr int kSignal = SIGURG;  // nobody else's; ignored where there is no handler

  static void Pause(int) {
    const int error = errno;
    const timespec pause = {0, static_cast<long>(pause_.load(std::memory_order_relaxed))};
    ::nanosleep(&pause, nullptr);
    pauses_.fetch_add(1, std::memory_order_relaxed);
    errno = error;
  }

  static void Threads(std::vector<pid_t>& threads, pid_t but) {
    threads.clear();
    DIR* const tasks = ::opendir("/proc/self/task");
    if (tasks == nullptr) return;
    while (const dirent* const entry = ::readdir(tasks)) {
      const pid_t thread = std::atoi(entry->d_name);
      if (thread > 0 && thread != but) threads.push_back(thread);
    }
    ::closedir(tasks);
  }

  void Shake(uint64_t seed) {
    std::mt19937_64 draw(seed);
    std::vector<pid_t> threads;
    const auto self = static_cast<pid_t>(::syscall(SYS_gettid));
    constexpr int kRounds = 16;  // before the threads are listed anew
    constexpr uint64_t kLongest = 500000, kBetween = 100000;
    for (int round = 0; !stop_; ++round) {
      if (round % kRounds == 0) Threads(threads, self);
      // Most of them short: a few instructions of another thread are what races need.
      pause_.store(draw() % 4 == 0 ? draw() % kLongest : draw() % 1000, std::memory_order_relaxed);
      if (!threads.empty()) ::syscall(SYS_tgkill, ::getpid(), threads[draw() % threads.size()], kSignal);
      const timespec between = {0, static_cast<long>(draw() % kBetween)};
      ::nanosleep(&between, nullptr);
    }
  }

  inline static std::atomic<uint64_t> pause_{0}, pauses_{0};
  std::atomic<bool> stop_{false};
  struct sigaction before_ {};
  std::thread thread_;
};

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_SHAKER_H_
