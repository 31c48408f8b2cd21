// The order of events between threads, said where ThreadSanitizer can see it.
#ifndef TESSERA_SCHED_HANDOVER_H_
#define TESSERA_SCHED_HANDOVER_H_

#include <atomic>
#include <cstdint>

namespace tessera::sched {

// What one thread leaves, another finds. oneTBB orders the same events, but is not built with
// ThreadSanitizer, which would not know; the price is an atomic operation per tile. The functions are not
// inline because the scheduler's own file, full of oneTBB's templates, is compiled without it.
class Handover {
 public:
  void Leave();
  void Find() const;

 private:
  std::atomic<int64_t> passed_ = 0;
};

// Leaves, or finds, at the end of a scope, also when an exception ends it.
class Left {
 public:
  explicit Left(Handover& h) : handover_(h) {}
  ~Left() { handover_.Leave(); }
  Left(const Left&) = delete;
  Left& operator=(const Left&) = delete;

 private:
  Handover& handover_;
};
class Found {
 public:
  explicit Found(const Handover& h) : handover_(h) {}
  ~Found() { handover_.Find(); }
  Found(const Found&) = delete;
  Found& operator=(const Found&) = delete;

 private:
  const Handover& handover_;
};

}  // namespace tessera::sched

#endif  // TESSERA_SCHED_HANDOVER_H_
