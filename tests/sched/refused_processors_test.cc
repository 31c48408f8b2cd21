// Memory that oneTBB is refused when it counts the processors: refused to whoever asks, nobody waits.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "sched/scheduler.h"

namespace {
std::atomic<bool> refuse = false;
std::atomic<int> refused = 0;
}  // namespace

// That of the libraries, too.
void* operator new[](size_t size) {
  if (refuse) ++refused;
  void* const memory = refuse ? nullptr : std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }

namespace tessera::sched {
namespace {

// The only test of its process: oneTBB counts once.
TEST(RefusedProcessorsTest, NobodyWaitsForThem) {
  const auto nothing = [](int64_t, int) {};
  refuse = true;
  EXPECT_THROW(ParallelFor(8, 2, nothing), std::bad_alloc);
  refuse = false;
  if (refused == 0) GTEST_SKIP() << "this oneTBB counts without memory of new[]";
  EXPECT_THROW(ParallelFor(8, 2, nothing), std::bad_alloc);
  EXPECT_THROW(InnerFor(8, 2, nothing), std::bad_alloc);
  EXPECT_THROW(Pipeline(2, 2, {}), std::bad_alloc);
  EXPECT_THROW(ThreadCount(0), std::bad_alloc);
  EXPECT_EQ(ThreadCount(3), 3);
  int64_t sum = 0;
  ParallelFor(8, 1, [&](int64_t i, int) { sum += i; });
  EXPECT_EQ(sum, 28);
}

}  // namespace
}  // namespace tessera::sched
