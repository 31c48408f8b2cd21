// Fetching memory ahead of its use.
#ifndef TESSERA_BASE_PREFETCH_H_
#define TESSERA_BASE_PREFETCH_H_

#include <cstddef>
#include <cstdint>

namespace tessera::base {

// The cache line of `p`, which need not exist, into the second cache: the first one has few lines under way
// at a time, and rows whose distance is a multiple of a page drive each other out of it. Highway's Prefetch
// asks for the first. Inlined in any case: g++ takes a function that only asks for memory for one without
// effects, and drops calls that it has not inlined yet.
[[gnu::always_inline]] inline void PrefetchSecond(const void* p) { __builtin_prefetch(p, 0, 2); }

// How far on a loop straight from memory to memory asks for its source. Half as far is too near, twice as far
// gains nothing more.
inline constexpr size_t kAheadBytes = 4096;

// The lines that such a loop will want when it has come kAheadBytes further than its `samples` samples at p;
// they need not exist. The processor's own prefetching comes too late beside stores around the cache that are
// narrower than a line, and sleeps beside arithmetic: without this a 4x4 matrix of halves takes 3 times as
// long on a Xeon of 2023 with AVX2, one of bytes twice as long with AVX-512. For the loop itself to call, or
// what is inlined in any case: a lambda that does this alone would be dropped too
// (tests/house/prefetches.py).
template <class T>
[[gnu::always_inline]] inline void PrefetchAhead(const T* p, int samples) {
  const uintptr_t at = reinterpret_cast<uintptr_t>(p) + kAheadBytes;
  for (size_t k = 0; k < static_cast<size_t>(samples) * sizeof(T); k += 64) {
    __builtin_prefetch(reinterpret_cast<const void*>(at + k));
  }
}

}  // namespace tessera::base

#endif  // TESSERA_BASE_PREFETCH_H_
