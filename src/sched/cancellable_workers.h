// The scheduler's threads for an operation's own work.
#ifndef TESSERA_SCHED_CANCELLABLE_WORKERS_H_
#define TESSERA_SCHED_CANCELLABLE_WORKERS_H_

#include "base/paged_memory.h"
#include "base/stage.h"
#include "sched/progress.h"
#include "sched/scheduler.h"
#include "tessera/context.h"

namespace tessera::sched {

// They stop between tasks when the evaluation is cancelled.
class CancellableWorkers final : public graph::Workers {
 public:
  // `shuffle`: serial, in a shuffled order.
  CancellableWorkers(int threads, Context& context, bool shuffle, const Progress& progress)
      : shuffle_(shuffle),
        threads_(shuffle ? 1 : ThreadCount(threads)),
        context_(context),
        progress_(progress) {}
  int count() const override { return threads_; }
  Context& context() const override { return context_; }
  void For(int64_t n, const std::function<void(int64_t, int)>& task) const override {
    const auto checked = [&](int64_t i, int worker) {
      progress_.Check();
      task(i, worker);
      context_.paged().Trim();
    };
    if (shuffle_) {
      ShuffledFor(n, 1, checked);
    } else {
      ParallelFor(n, threads_, checked);
    }
    progress_.Check();
  }

 private:
  const bool shuffle_;
  const int threads_;
  Context& context_;
  const Progress& progress_;
};

}  // namespace tessera::sched

#endif  // TESSERA_SCHED_CANCELLABLE_WORKERS_H_
