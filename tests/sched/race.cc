// Tasks that race on purpose, for the test that ThreadSanitizer would tell.
#include <cstdio>

#include "sched/scheduler.h"

int main() {
  int sum = 0;
  tessera::sched::ParallelFor(100000, 2, [&sum](int64_t i, int) { sum += static_cast<int>(i); });
  std::printf("%d\n", sum);
  return 0;
}
