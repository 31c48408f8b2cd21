// See watch.h.
#include "sched/watch.h"

#include <utility>

namespace tessera::sched {

Watch::Watch(std::chrono::milliseconds every, std::function<void()> look)
    : thread_([this, every, look = std::move(look)] {
        std::unique_lock lock(mutex_);
        while (!end_.wait_for(lock, every, [this] { return ended_; })) {
          lock.unlock();
          look();
          lock.lock();
        }
      }) {}

Watch::~Watch() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  end_.notify_one();
  thread_.join();
}

}  // namespace tessera::sched
