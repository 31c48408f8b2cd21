// Aligned memory and the bump allocator.
#include "base/arena.h"

#include <cstdlib>
#include <string>

#include "tessera/error.h"

namespace tessera::base {

std::shared_ptr<std::byte> AllocateAligned(size_t bytes) {
  // Whole cache lines, and room for a full vector read past the last row.
  const size_t padded = (bytes + 2 * kAlignment - 1) / kAlignment * kAlignment;
  if (padded < bytes) throw Error("memory", "a size of " + std::to_string(bytes) + " bytes overflows");
  void* p = std::aligned_alloc(kAlignment, padded);
  if (p == nullptr) throw Error("memory", "the system refused " + std::to_string(padded) + " bytes");
  return {static_cast<std::byte*>(p), std::free};
}

std::byte* Arena::Bytes(size_t bytes) {
  const size_t size = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  if (chunks_.empty() || chunks_.back().size - chunks_.back().used < size) {
    constexpr size_t kMinChunk = size_t{1} << 18;
    const size_t chunk = std::max(size, std::max(kMinChunk, capacity_));
    chunks_.push_back({AllocateAligned(chunk), chunk, 0});
    capacity_ += chunk;
  }
  Chunk& c = chunks_.back();
  std::byte* p = c.memory.get() + c.used;
  c.used += size;
  return p;
}

void Arena::Reset() {
  if (chunks_.size() > 1) {
    const size_t total = capacity_;
    chunks_.clear();
    chunks_.push_back({AllocateAligned(total), total, 0});
  }
  if (!chunks_.empty()) chunks_.back().used = 0;
}

}  // namespace tessera::base
