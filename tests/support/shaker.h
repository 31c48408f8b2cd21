// Another order of threads at every run: each is held up for a moment wherever it is, again and again.
#ifndef TESSERA_TESTS_SUPPORT_SHAKER_H_
#define TESSERA_TESTS_SUPPORT_SHAKER_H_

#include <signal.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/directory.h"

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

  void Shake(uint64_t seed) {
    std::mt19937_64 draw(seed);
    std::vector<std::string> threads;
    const auto self = std::to_string(::syscall(SYS_gettid));
    constexpr int kRounds = 16;  // before the threads are listed anew
    constexpr uint64_t kLongest = 500000, kBetween = 100000;
    for (int round = 0; !stop_; ++round) {
      if (round % kRounds == 0) threads = base::NamesIn("/proc/self/task");
      const std::string* const thread = threads.empty() ? nullptr : &threads[draw() % threads.size()];
      // Most of them short: a few instructions of another thread are what races need.
      pause_.store(draw() % 4 == 0 ? draw() % kLongest : draw() % 1000, std::memory_order_relaxed);
      if (thread != nullptr && *thread != self)
        ::syscall(SYS_tgkill, ::getpid(), std::stoi(*thread), kSignal);
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
