// Scratch memory for operations on whole images: an arena for each worker.
#ifndef TESSERA_BASE_WORKER_ARENAS_H_
#define TESSERA_BASE_WORKER_ARENAS_H_

#include <deque>

#include "base/arena.h"
#include "base/stage.h"

namespace tessera::base {

class WorkerArenas {
 public:
  explicit WorkerArenas(const graph::Workers& workers) {
    for (int i = 0; i < workers.count(); ++i) arenas_.emplace_back(workers.context());
  }
  Arena& operator[](int worker) { return arenas_[static_cast<size_t>(worker)]; }

 private:
  std::deque<Arena> arenas_;
};

}  // namespace tessera::base

#endif  // TESSERA_BASE_WORKER_ARENAS_H_
