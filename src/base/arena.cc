// Aligned memory and the bump allocator.
#include "base/arena.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <mutex>
#include <string>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "tessera/error.h"

namespace tessera::base {
namespace {

#ifdef __linux__
constexpr size_t kPage = size_t{1} << 21;

#ifdef __SANITIZE_ADDRESS__
// What is read beyond the end, or after it was given back, shall show.
void* Map(size_t bytes) { return std::aligned_alloc(kPage, bytes); }
void Unmap(void* memory, size_t) { std::free(memory); }
#else
// Pages of their own, at a multiple of kPage, which the system can make large ones: what the C library hands
// out below 32 MB may have been used before and lie in small ones.
void* Map(size_t bytes) {
  const size_t most = bytes + kPage;
  void* const p = mmap(nullptr, most, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (p == MAP_FAILED) return nullptr;
  auto* const first = static_cast<std::byte*>(p);
  const size_t before = (kPage - reinterpret_cast<uintptr_t>(p) % kPage) % kPage;
  if (before > 0) munmap(first, before);
  munmap(first + before + bytes, kPage - before);
  madvise(first + before, bytes, MADV_HUGEPAGE);
  return first + before;
}
void Unmap(void* memory, size_t bytes) { munmap(memory, bytes); }
#endif

// Large memory that is given back is kept for the next one of its size: the system takes longer to clear a
// picture's pages than most operations take to fill them. It may take kept pages away when it runs short.
class KeptMemory {
 public:
  // Null where nothing of that size is kept.
  void* Take(size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(blocks_.rbegin(), blocks_.rend(),
                                    [&](const Block& block) { return block.bytes == bytes; });
    if (found == blocks_.rend()) return nullptr;
    void* const memory = found->memory;
    total_ -= bytes;
    blocks_.erase(std::next(found).base());
    return memory;
  }
  void Keep(void* memory, size_t bytes) {
    if (bytes > kMost) return Unmap(memory, bytes);
    madvise(memory, bytes, MADV_FREE);
    const std::lock_guard lock(mutex_);
    blocks_.push_back({memory, bytes});
    for (total_ += bytes; total_ > kMost; blocks_.erase(blocks_.begin())) {
      Unmap(blocks_.front().memory, blocks_.front().bytes);
      total_ -= blocks_.front().bytes;
    }
  }

 private:
#ifdef __SANITIZE_ADDRESS__
  static constexpr size_t kMost = 0;  // what is read after it was given back shall show
#else
  static constexpr size_t kMost = size_t{320} << 20;  // two pictures of 4096x2160 RGBA floats
#endif
  struct Block {
    void* memory;
    size_t bytes;
  };
  std::mutex mutex_;
  std::vector<Block> blocks_;  // the oldest first
  size_t total_ = 0;
};

// Never destroyed: pictures may outlive other globals.
KeptMemory& Kept() {
  static auto* const kKept = new KeptMemory;
  return *kKept;
}
#endif

// Whole pictures lie in large pages where the system has them: page walks cost streams a third of the
// bandwidth, and look-ups more. They begin at different places within their pages, each some lines further
// than the one before: the streams of several pictures would else compete for the same sets of the caches,
// and loads of one wait for stores to another whose addresses end alike (3x3 kernels take four times as
// long). Null where the system refuses.
std::shared_ptr<std::byte> AllocateLarge([[maybe_unused]] size_t bytes) {
#ifdef __linux__
  constexpr size_t kPlace = 68 * kAlignment;
  const size_t padded = (bytes + 16 * kPlace + kPage - 1) / kPage * kPage;
  if (padded < bytes) return nullptr;
  void* p = Kept().Take(padded);
  if (p == nullptr) {
    p = Map(padded);
    if (p == nullptr) return nullptr;
  }
  static std::atomic<uint32_t> places = 0;
  const size_t place = places.fetch_add(1, std::memory_order_relaxed) % 16;
  return {static_cast<std::byte*>(p) + place * kPlace, [p, padded](std::byte*) { Kept().Keep(p, padded); }};
#else
  return nullptr;
#endif
}

}  // namespace

std::shared_ptr<std::byte> AllocateAligned(size_t bytes, Access access) {
  const size_t padded = (bytes + kReadMargin + kAlignment - 1) / kAlignment * kAlignment;
  if (padded < bytes) throw Error("memory", "a size of " + std::to_string(bytes) + " bytes overflows");
  // A 33^3 table of colours, half a megabyte, is read a tenth faster from one page than from 140.
  if (padded >= (access == Access::kScattered ? size_t{256} << 10 : size_t{4} << 20)) {
    if (auto memory = AllocateLarge(padded)) return memory;
  }
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
