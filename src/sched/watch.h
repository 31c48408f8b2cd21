// A thread that looks after something now and then.
#ifndef TESSERA_SCHED_WATCH_H_
#define TESSERA_SCHED_WATCH_H_

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace tessera::sched {

// Calls `look` every so often, on a thread of its own, until the end of its life.
class Watch {
 public:
  Watch(std::chrono::milliseconds every, std::function<void()> look);
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch();

 private:
  std::mutex mutex_;
  std::condition_variable end_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace tessera::sched

#endif  // TESSERA_SCHED_WATCH_H_
