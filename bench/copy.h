// The yardstick: how fast this machine moves bytes from one buffer to another, as STREAM's copy does.
#ifndef TESSERA_BENCH_COPY_H_
#define TESSERA_BENCH_COPY_H_

#include <cstddef>

namespace tessera::bench {

// Plain memcpy, which chooses its own way of writing.
void CopyPlain(const std::byte* from, std::byte* to, size_t bytes);

// Writes whole cache lines around the cache, so that the destination is not read first. Falls back to memcpy
// on processors without such stores and for the unaligned edges.
void CopyStreaming(const std::byte* from, std::byte* to, size_t bytes);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_COPY_H_
