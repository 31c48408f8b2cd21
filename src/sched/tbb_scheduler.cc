// The scheduler on oneTBB; the only file that includes it.
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <numeric>
#include <random>
#include <vector>

#include "sched/handover.h"
#include "sched/phase_clock.h"
#include "sched/scheduler.h"

namespace tessera::sched {
namespace {

// oneTBB counts them when it is first asked for anything; where memory for that is refused (2021.8), whatever
// asks it afterwards waits for that count without end, the destructor of a global_control, too. So this comes
// first, and nothing after it where it has failed.
int Processors() {
  constexpr int kUnknown = 0, kRefused = -1;
  static std::atomic<int> known = kUnknown;
  static std::mutex mutex;
  if (known.load() == kUnknown) {
    const std::lock_guard lock(mutex);
    if (known.load() == kUnknown) {
      known.store(kRefused);
      known.store(std::max(1, tbb::info::default_concurrency()));
    }
  }
  if (known.load() == kRefused) throw std::bad_alloc();
  return known.load();
}

}  // namespace

int ThreadCount(int requested) { return requested > 0 ? requested : Processors(); }

namespace {

// Within the arena that the caller is in.
void ForEach(int64_t count, const std::function<void(int64_t, int)>& task) {
  Handover begun, ended;
  const Found all_ended(ended);
  begun.Leave();
  tbb::parallel_for(tbb::blocked_range<int64_t>(0, count, 1), [&](const tbb::blocked_range<int64_t>& r) {
    begun.Find();
    const Left left(ended);
    const int worker = tbb::this_task_arena::current_thread_index();
    for (int64_t i = r.begin(); i != r.end(); ++i) task(i, worker);
  });
}

void OneByOne(int64_t count, const std::function<void(int64_t, int)>& task) {
  for (int64_t i = 0; i < count; ++i) task(i, 0);
}

}  // namespace

void ParallelFor(int64_t count, int threads, const std::function<void(int64_t, int)>& task) {
  if (threads <= 1 || count <= 1) {
    OneByOne(count, task);
    return;
  }
  Processors();
  // More threads than cores are legal (the tests use them), so the process-wide limit is raised while we run.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  tbb::task_arena arena(threads);
  arena.execute([&] { ForEach(count, task); });
}

namespace {

void ForInner(int64_t count, int threads, const std::function<void(int64_t, int)>& task) {
  Processors();
  if (tbb::this_task_arena::max_concurrency() != threads) {  // outside of a pipeline
    ParallelFor(count, threads, task);
  } else {
    tbb::this_task_arena::isolate([&] { ForEach(count, task); });
  }
}

}  // namespace

void InnerFor(int64_t count, int threads, const std::function<void(int64_t, int)>& task) {
  if (threads <= 1 || count <= 1) {
    OneByOne(count, task);
    return;
  }
  const PhaseHelpers helpers;
  if (!helpers.any()) {
    ForInner(count, threads, task);
  } else {
    ForInner(count, threads, [&](int64_t i, int worker) { helpers.Run([&] { task(i, worker); }); });
  }
}

void ShuffledFor(int64_t count, uint32_t seed, const std::function<void(int64_t, int)>& task) {
  std::vector<int64_t> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), int64_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  for (const int64_t i : order) task(i, 0);
}

void Pipeline(int threads, int tokens, const PipelineSteps& steps) {
  if (threads <= 1) {
    while (const std::shared_ptr<void> item = steps.read()) {
      steps.work(item.get(), 0);
      steps.write(item.get());
    }
    return;
  }
  Processors();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  tbb::task_arena arena(threads);
  struct Carried {
    std::shared_ptr<void> band;
    Handover read, worked;
  };
  // The pipeline carries pointers: what is under way when a step throws is freed with these, oneTBB forgets
  // it.
  std::deque<Carried> items;
  using Item = Carried*;
  Handover begun, reading, writing, ended;
  const Found all_ended(ended);
  begun.Leave();
  arena.execute([&] {
    tbb::parallel_pipeline(
        static_cast<size_t>(tokens),
        tbb::make_filter<void,
                         Item>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) -> Item {
          begun.Find();
          reading.Find();
          const Left left(ended);
          Carried& item = items.emplace_back();
          item.band = steps.read();
          if (!item.band) control.stop();
          reading.Leave();
          item.read.Leave();
          return &item;
        }) & tbb::make_filter<Item, Item>(tbb::filter_mode::parallel, [&](Item item) {
          item->read.Find();
          const Left left(ended);
          steps.work(item->band.get(), tbb::this_task_arena::current_thread_index());
          item->worked.Leave();
          return item;
        }) & tbb::make_filter<Item, void>(tbb::filter_mode::serial_in_order, [&](Item item) {
          item->worked.Find();
          writing.Find();
          const Left left(ended);
          steps.write(item->band.get());
          item->band.reset();
          writing.Leave();
        }));
  });
}

}  // namespace tessera::sched
