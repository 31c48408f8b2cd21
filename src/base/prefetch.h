// Fetching memory ahead of its use.
#ifndef TESSERA_BASE_PREFETCH_H_
#define TESSERA_BASE_PREFETCH_H_

namespace tessera::base {

// The cache line of `p`, which need not exist, into the second cache: the first one has few lines under way
// at a time, and rows whose distance is a multiple of a page drive each other out of it. Highway's Prefetch
// asks for the first. Inlined in any case: g++ takes a function that only asks for memory for one without
// effects, and drops calls that it has not inlined yet.
[[gnu::always_inline]] inline void PrefetchSecond(const void* p) { __builtin_prefetch(p, 0, 2); }

}  // namespace tessera::base

#endif  // TESSERA_BASE_PREFETCH_H_
