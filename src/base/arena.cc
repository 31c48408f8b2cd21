// The bump allocator.
#include "base/arena.h"

#include <algorithm>

#include "base/pool.h"
#include "tessera/context.h"

namespace tessera::base {

std::shared_ptr<std::byte> AllocateAligned(size_t bytes, Access access) {
  return AllocateAligned(Context::Default(), bytes, access);
}
std::shared_ptr<std::byte> AllocateAligned(Context& context, size_t bytes, Access access) {
  return context.pool().Allocate(bytes, access);
}

Arena::Arena() : Arena(Context::Default()) {}

std::byte* Arena::Bytes(size_t bytes) {
  const size_t size = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  const auto fits = [&](const Chunk& c) { return c.size - c.used >= size; };
  while (at_ + 1 < chunks_.size() && !fits(chunks_[at_])) ++at_;
  if (chunks_.empty() || !fits(chunks_[at_])) {
    constexpr size_t kMinChunk = size_t{1} << 18;
    const size_t chunk = std::max(size, std::max(kMinChunk, capacity_));
    chunks_.push_back({AllocateAligned(context_, chunk), chunk, 0});
    capacity_ += chunk;
    at_ = chunks_.size() - 1;
  }
  Chunk& c = chunks_[at_];
  std::byte* p = c.memory.get() + c.used;
  c.used += size;
  return p;
}

void Arena::BackTo(const Mark& mark) {
  for (size_t k = mark.chunk + 1; k < chunks_.size(); ++k) chunks_[k].used = 0;
  at_ = mark.chunk;
  if (!chunks_.empty()) chunks_[at_].used = mark.used;
}

void Arena::Reset() {
  if (chunks_.size() > 1) {
    const size_t total = capacity_;
    chunks_.clear();
    chunks_.push_back({AllocateAligned(context_, total), total, 0});
  }
  at_ = 0;
  if (!chunks_.empty()) chunks_.back().used = 0;
}

}  // namespace tessera::base
