// Where threads' time goes: a step says in which phase it is, also for those who help it (InnerFor).
#ifndef TESSERA_SCHED_PHASE_CLOCK_H_
#define TESSERA_SCHED_PHASE_CLOCK_H_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::sched {

// Phases are numbers below a count; any thread adds to them.
class PhaseClock {
 public:
  explicit PhaseClock(size_t phases) : spent_(phases) {}
  // Seconds of threads that did something in it.
  double Busy(size_t phase) const { return 1e-9 * static_cast<double>(spent_[phase].busy.load()); }
  // Seconds from its steps' begin to their end, whoever helped: of the clock, where one follows another.
  double Elapsed(size_t phase) const { return 1e-9 * static_cast<double>(spent_[phase].elapsed.load()); }

 private:
  friend class InPhase;
  struct Spent {
    std::atomic<int64_t> busy = 0, elapsed = 0;
  };
  std::vector<Spent> spent_;
};

// The calling thread is in that phase for as long as this lives. Without a clock nothing is looked at, which
// is how an evaluation runs that nobody asks about.
class InPhase {
 public:
  InPhase(PhaseClock* clock, size_t phase) : InPhase(clock, phase, true) {}
  ~InPhase() {
    if (clock_ != nullptr) End();
  }
  InPhase(const InPhase&) = delete;
  InPhase& operator=(const InPhase&) = delete;

 private:
  friend class PhaseHelpers;
  InPhase(PhaseClock* clock, size_t phase, bool step) : clock_(clock), phase_(phase), step_(step) {
    if (clock_ != nullptr) Begin();
  }
  using Time = std::chrono::steady_clock::time_point;
  void Begin();
  void End();
  void Stop(Time now);

  PhaseClock* const clock_;
  const size_t phase_;
  const bool step_;  // else a part of somebody's step
  InPhase* outer_ = nullptr;
  Time begun_, since_;
};

// What the calling thread's step hands to others: they are in its phase, the thread itself waits but for the
// parts that it takes.
class PhaseHelpers {
 public:
  PhaseHelpers();
  ~PhaseHelpers();
  PhaseHelpers(const PhaseHelpers&) = delete;
  PhaseHelpers& operator=(const PhaseHelpers&) = delete;
  bool any() const { return step_ != nullptr; }
  // A part of the step, on any thread.
  template <typename Task>
  void Run(const Task& task) const {
    const InPhase part(step_->clock_, step_->phase_, false);
    task();
  }

 private:
  InPhase* const step_;
};

}  // namespace tessera::sched
TESSERA_API_END

#endif  // TESSERA_SCHED_PHASE_CLOCK_H_
