// Runs tiles and bands on threads; the only thing the engine knows about threading.
#ifndef TESSERA_SCHED_SCHEDULER_H_
#define TESSERA_SCHED_SCHEDULER_H_

#include <cstdint>
#include <functional>
#include <memory>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::sched {

// Threads that `requested` (0: all cores) stands for; at least 1.
int ThreadCount(int requested);

// Calls task(i, worker) for every i in [0, count), worker in [0, threads). The first exception is rethrown
// after the running tasks have ended. One thread runs serially on the caller.
void ParallelFor(int64_t count, int threads, const std::function<void(int64_t, int)>& task);

// The same from within a step of a Pipeline, by the pipeline's own threads as they come free: the caller
// takes up none of the pipeline's other work while it waits.
void InnerFor(int64_t count, int threads, const std::function<void(int64_t, int)>& task);

// The same tasks, serial, in a shuffled order that depends on `seed`: for tests of order independence.
void ShuffledFor(int64_t count, uint32_t seed, const std::function<void(int64_t, int)>& task);

// A three-step pipeline over items in order: `read` (serial, in order, null ends it), `work` (parallel),
// `write` (serial, in order). At most `tokens` items are alive. Exceptions as in ParallelFor.
struct PipelineSteps {
  std::function<std::shared_ptr<void>()> read;
  std::function<void(void*, int worker)> work;
  std::function<void(void*)> write;
};
void Pipeline(int threads, int tokens, const PipelineSteps& steps);

}  // namespace tessera::sched
TESSERA_API_END

#endif  // TESSERA_SCHED_SCHEDULER_H_
