// What every worker has one of, made when it first has work.
#ifndef TESSERA_IO_CODEC_PER_WORKER_H_
#define TESSERA_IO_CODEC_PER_WORKER_H_

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace tessera::io {

template <typename T>
class PerWorker {
 public:
  PerWorker(int workers, std::function<std::unique_ptr<T>()> make)
      : make_(std::move(make)), items_(static_cast<size_t>(workers)) {}
  // Of the worker of that number; only that worker asks.
  T& Of(int worker) {
    std::unique_ptr<T>& item = items_[static_cast<size_t>(worker)];
    if (item == nullptr) item = make_();
    return *item;
  }

 private:
  std::function<std::unique_ptr<T>()> make_;
  std::vector<std::unique_ptr<T>> items_;
};

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_PER_WORKER_H_
