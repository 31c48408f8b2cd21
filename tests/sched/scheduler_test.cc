// The scheduler: every task once, order of the pipeline, its bound on what is alive, exceptions from each
// step.
#include "sched/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/shaker.h"

namespace tessera::sched {
namespace {

TEST(ParallelFor, CallsEveryTaskOnceOnWorkersInRange) {
  for (const int threads : {1, 2, 7}) {
    for (const int64_t count : {0, 1, 2, 1000}) {
      std::vector<int> called(static_cast<size_t>(count));
      std::atomic<bool> in_range = true;
      ParallelFor(count, threads, [&](int64_t i, int worker) {
        ++called[static_cast<size_t>(i)];
        if (worker < 0 || worker >= threads) in_range = false;
      });
      EXPECT_EQ(called, std::vector<int>(static_cast<size_t>(count), 1)) << threads;
      EXPECT_TRUE(in_range);
    }
  }
}

TEST(ParallelFor, TheCallerSeesWhatTasksWroteBeforeOneOfThemThrew) {
  for (const int threads : {1, 2, 7}) {
    std::vector<int> written(100);
    const auto run = [&] {
      ParallelFor(100, threads, [&](int64_t i, int) {
        written[static_cast<size_t>(i)] = 1;
        if (i == 50) throw std::runtime_error("task 50");
      });
    };
    EXPECT_THROW(run(), std::runtime_error);
    EXPECT_EQ(written[50], 1);
    for (const int w : written) EXPECT_TRUE(w == 0 || w == 1);
  }
}

TEST(InnerFor, CallsEveryTaskOnceOnWorkersInRangeFromWithinAPipelineAndWithout) {
  for (const int threads : {1, 2, 7}) {
    constexpr int64_t kTasks = 200;
    std::atomic<bool> in_range = true, busy = false, entered_twice = false;
    const auto call_all = [&] {
      std::vector<int> called(kTasks);
      InnerFor(kTasks, threads, [&](int64_t i, int worker) {
        ++called[static_cast<size_t>(i)];
        if (worker < 0 || worker >= threads) in_range = false;
      });
      return called == std::vector<int>(kTasks, 1);
    };
    EXPECT_TRUE(call_all()) << threads;
    int left = 40;
    std::atomic<int> wrong = 0;
    PipelineSteps steps;
    steps.read = [&]() -> std::shared_ptr<void> {
      wrong += !call_all();
      return left-- > 0 ? std::make_shared<int>(left) : nullptr;
    };
    steps.work = [](void*, int) {};
    // A writer that waits must not be given another of the pipeline's tasks, which might be to write.
    steps.write = [&](void*) {
      if (busy.exchange(true)) entered_twice = true;
      wrong += !call_all();
      busy = false;
    };
    Pipeline(threads, threads + 2, steps);
    EXPECT_EQ(wrong, 0);
    EXPECT_TRUE(in_range);
    EXPECT_FALSE(entered_twice);
  }
}

TEST(InnerFor, AFailureWithinAPipelineIsRethrown) {
  for (const int threads : {1, 2, 7}) {
    PipelineSteps steps;
    steps.read = [] { return std::make_shared<int>(0); };
    steps.work = [](void*, int) {};
    steps.write = [&](void*) {
      InnerFor(20, threads, [](int64_t i, int) {
        if (i == 10) throw std::runtime_error("task 10");
      });
    };
    EXPECT_THROW(Pipeline(threads, 4, steps), std::runtime_error);
  }
}

// Counts how many of it are alive.
struct Item {
  Item(int64_t n, std::atomic<int>& count) : number(n), alive(count) { ++alive; }
  ~Item() { --alive; }
  int64_t number;
  std::atomic<int>& alive;
  std::vector<int> pixels = std::vector<int>(1000);
};

// Runs 100 items; the step named throws at item 50. Returns the numbers written.
std::vector<int64_t> RunItems(int threads, int tokens, const char* failing, int* most_alive) {
  std::atomic<int> alive = 0;
  std::atomic<int> most = 0;
  std::vector<int64_t> written;
  int64_t next = 0;
  const auto fail = [&](const char* step, int64_t number) {
    if (std::string(step) == failing && number == 50) throw std::runtime_error(step);
  };
  const PipelineSteps steps{[&]() -> std::shared_ptr<void> {
                              fail("read", next);
                              if (next == 100) return nullptr;
                              auto item = std::make_shared<Item>(next++, alive);
                              most = std::max(most.load(), alive.load());
                              return item;
                            },
                            [&](void* at, int) {
                              auto* const item = static_cast<Item*>(at);
                              fail("work", item->number);
                              for (int& p : item->pixels) p = static_cast<int>(item->number);
                            },
                            [&](void* at) {
                              auto* const item = static_cast<Item*>(at);
                              fail("write", item->number);
                              for (const int p : item->pixels) EXPECT_EQ(p, item->number);
                              written.push_back(item->number);
                            }};
  if (*failing) {
    EXPECT_THROW(Pipeline(threads, tokens, steps), std::runtime_error) << failing;
  } else {
    Pipeline(threads, tokens, steps);
  }
  EXPECT_EQ(alive, 0) << "something is left behind";
  *most_alive = most;
  return written;
}

// Two stores in the wrong order, five microseconds apart, and whoever looks at them twenty later: it sees the
// first alone when the system takes the processor away just there, if ever.
TEST(Shaker, FindsARaceThatHidesBehindTheUsualOrder) {
  const testing::Shaker shaker(1);
  const auto begin = std::chrono::steady_clock::now();
  const auto spin = [](std::chrono::microseconds time) {
    const auto until = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < until) {
    }
  };
  std::atomic<int> asked = 0, ready = 0, written = 0;
  std::thread other([&] {
    for (int round = 1; round > 0; ++round) {
      while (asked < round && asked >= 0) {
      }
      if (asked < 0) return;
      ready = round;
      spin(std::chrono::microseconds(5));
      written = round;
    }
  });
  bool found = false;
  for (int round = 1; (!found || testing::Shaker::Pauses() < 100) &&
                      std::chrono::steady_clock::now() - begin < std::chrono::seconds(60);
       ++round) {
    asked = round;
    while (ready < round) {
    }
    spin(std::chrono::microseconds(20));
    found = found || written < round;
    while (written < round) {
    }
  }
  asked = -1;
  other.join();
  EXPECT_TRUE(found);
  EXPECT_GE(testing::Shaker::Pauses(), 100u);
}

TEST(Pipeline, WritesInOrderAndKeepsFewAlive) {
  for (const int threads : {1, 2, 7}) {
    int most_alive = 0;
    const std::vector<int64_t> written = RunItems(threads, 4, "", &most_alive);
    ASSERT_EQ(written.size(), 100u);
    for (size_t i = 0; i < 100; ++i) EXPECT_EQ(written[i], static_cast<int64_t>(i));
    EXPECT_LE(most_alive, 4);
  }
}

TEST(Pipeline, AFailureInAnyStepIsRethrownAndLeavesNothingBehind) {
  for (const int threads : {1, 2, 7}) {
    for (const char* step : {"read", "work", "write"}) {
      int most_alive = 0;
      const std::vector<int64_t> written = RunItems(threads, 4, step, &most_alive);
      EXPECT_LE(written.size(), 50u) << step;
      for (size_t i = 0; i < written.size(); ++i) EXPECT_EQ(written[i], static_cast<int64_t>(i)) << step;
    }
  }
}

}  // namespace
}  // namespace tessera::sched
