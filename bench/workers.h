// Threads that stay alive between runs, for the copy and for peers whose calls are single-threaded.
#ifndef TESSERA_BENCH_WORKERS_H_
#define TESSERA_BENCH_WORKERS_H_

#include <barrier>
#include <functional>
#include <thread>
#include <vector>

namespace tessera::bench {

// Run(f) calls f(0) ... f(count-1) at once, f(0) on the caller's thread, and returns when all have returned.
class Workers {
 public:
  explicit Workers(int count) : start_(count), end_(count) {
    for (int i = 1; i < count; ++i) {
      threads_.emplace_back([this, i] {
        for (;;) {
          start_.arrive_and_wait();
          if (!work_) return;
          (*work_)(i);
          end_.arrive_and_wait();
        }
      });
    }
  }
  ~Workers() {
    work_ = nullptr;
    start_.arrive_and_wait();
    for (std::thread& t : threads_) t.join();
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int count() const { return static_cast<int>(threads_.size()) + 1; }
  void Run(const std::function<void(int)>& work) {
    work_ = &work;
    start_.arrive_and_wait();
    work(0);
    end_.arrive_and_wait();
  }

 private:
  std::barrier<> start_, end_;
  const std::function<void(int)>* work_ = nullptr;
  std::vector<std::thread> threads_;
};

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_WORKERS_H_
