// Counts finished tiles for the caller's progress callback and turns its refusal into Cancelled.
#ifndef TESSERA_GRAPH_PROGRESS_H_
#define TESSERA_GRAPH_PROGRESS_H_

#include <algorithm>
#include <cstdint>
#include <functional>
#include <mutex>

#include "tessera/error.h"

namespace tessera::graph {

class Progress {
 public:
  Progress(const std::function<bool(double)>& callback, int64_t total)
      : callback_(callback), total_(std::max<int64_t>(1, total)) {}

  // One more tile is done; calls back from one thread at a time, with growing shares. Throws Cancelled.
  void Step() {
    if (!callback_) return;
    const std::lock_guard lock(mutex_);
    ++done_;
    if (cancelled_ || !callback_(static_cast<double>(done_) / static_cast<double>(total_))) {
      cancelled_ = true;
      throw Cancelled();
    }
  }

 private:
  const std::function<bool(double)>& callback_;
  const int64_t total_;
  std::mutex mutex_;
  int64_t done_ = 0;
  bool cancelled_ = false;
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PROGRESS_H_
