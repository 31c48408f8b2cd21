// See progress.h.
#include "sched/progress.h"

#include <algorithm>
#include <chrono>

#include "tessera/error.h"

namespace tessera::sched {

constexpr std::chrono::milliseconds kLookEvery{40};

Progress::Progress(const std::function<bool(double)>& callback) : callback_(callback) {
  if (!callback_) return;
  watch_.emplace(kLookEvery, [this] {
    const std::lock_guard lock(mutex_);
    Call(std::max(reported_, Share()));
  });
}

void Progress::Expect(int passes) {
  const std::lock_guard lock(mutex_);
  passes_ = ended_ + passes;
}

void Progress::Begin(int64_t steps) {
  const std::lock_guard lock(mutex_);
  steps_ = std::max<int64_t>(1, steps);
  done_ = 0;
}

void Progress::End() {
  const std::lock_guard lock(mutex_);
  ended_ += 1;
  done_ = 0;
}

void Progress::Finish() {
  if (!callback_) return;
  watch_.reset();  // waits for a look that goes on, which takes the lock
  const std::lock_guard lock(mutex_);
  if (reported_ < 1) Call(1);
}

void Progress::Step() {
  if (!callback_) return;
  {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (const double share = Share(); share > reported_) Call(share);
  }
  Check();
}

void Progress::Check() const {
  if (!cancelled_.load(std::memory_order_acquire)) return;
  if (thrown_) std::rethrow_exception(thrown_);
  throw Cancelled();
}

double Progress::Share() const {
  const double pass = static_cast<double>(done_) / static_cast<double>(steps_);
  return std::min(1.0, (ended_ + std::min(1.0, pass)) / std::max(passes_, ended_ + 1));
}

void Progress::Call(double share) {
  if (cancelled_) return;
  reported_ = share;
  try {
    if (callback_(share)) return;
  } catch (...) {
    thrown_ = std::current_exception();
  }
  cancelled_.store(true, std::memory_order_release);
}

}  // namespace tessera::sched
