// How far an evaluation is, for the caller's progress callback, and whether that has cancelled it.
#ifndef TESSERA_SCHED_PROGRESS_H_
#define TESSERA_SCHED_PROGRESS_H_

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>

#include "sched/watch.h"

namespace tessera::sched {

// Counts finished steps (tiles, bands, tasks) of finished passes. The callback is called from one thread at a
// time: after a step, with growing shares, and where none ends for long, with the share as it is.
class Progress {
 public:
  explicit Progress(const std::function<bool(double)>& callback);

  // So many passes are expected from here on.
  void Expect(int passes);
  // A pass of so many steps begins, or the one that began last has ended.
  void Begin(int64_t steps);
  void End();
  // The share is 1, and the callback is not called any more.
  void Finish();

  // One more step is done. Throws what Check throws.
  void Step();
  // Throws Cancelled, or what the callback threw, when the evaluation has to end.
  void Check() const;
  const std::atomic<bool>& cancelled() const { return cancelled_; }

 private:
  double Share() const;
  void Call(double share);

  const std::function<bool(double)> callback_;
  std::mutex mutex_;  // of everything but `cancelled_`
  double passes_ = 1, ended_ = 0;
  int64_t steps_ = 1, done_ = 0;
  double reported_ = 0;
  std::exception_ptr thrown_;
  std::atomic<bool> cancelled_ = false;
  std::optional<Watch> watch_;  // the last: looks at the others
};

}  // namespace tessera::sched

#endif  // TESSERA_SCHED_PROGRESS_H_
