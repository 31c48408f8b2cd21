// Aligned memory, large pages for whole pictures, and what is kept of them.
#include "base/pool.h"

#include <algorithm>
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
#include "tessera/error_kind.h"

namespace tessera::base {
namespace {

[[maybe_unused]] constexpr size_t kPage = size_t{1} << 21;

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
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
void MayBeTaken(void* memory, size_t bytes) { madvise(memory, bytes, MADV_FREE); }
constexpr bool kKeeps = true;
#else
// What is read beyond the end, or after it was given back, shall show.
void* Map(size_t bytes) { return std::aligned_alloc(kPage, bytes); }
void Unmap(void* memory, size_t) { std::free(memory); }
void MayBeTaken(void*, size_t) {}
constexpr bool kKeeps = false;
#endif

}  // namespace

// The system takes longer to clear a picture's pages than most operations take to fill them. It may take kept
// pages away when it runs short.
class Pool::Kept {
 public:
  ~Kept() { Limit(0); }

  struct Block {
    void* memory = nullptr;
    size_t bytes = 0;
  };

  // One of at least that size and hardly more; none of no memory.
  Block Take(size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto fits = [&](const Block& b) { return b.bytes >= bytes && b.bytes <= bytes + bytes / 4; };
    const auto found = std::find_if(blocks_.rbegin(), blocks_.rend(), fits);
    if (found == blocks_.rend()) return {};
    const Block block = *found;
    total_ -= block.bytes;
    blocks_.erase(std::next(found).base());
    return block;
  }
  void Keep(void* memory, size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (bytes > most_) return Unmap(memory, bytes);
    MayBeTaken(memory, bytes);
    blocks_.push_back({memory, bytes});
    total_ += bytes;
    Trim(most_);
  }
  void Limit(size_t most) {
    const std::lock_guard lock(mutex_);
    most_ = kKeeps ? most : 0;
    Trim(most_);
  }
  void Release() {
    const std::lock_guard lock(mutex_);
    Trim(0);
  }
  size_t total() const {
    const std::lock_guard lock(mutex_);
    return total_;
  }
  size_t NextPlace() {
    const std::lock_guard lock(mutex_);
    return places_++ % 16;
  }

 private:
  void Trim(size_t most) {
    for (; total_ > most; blocks_.erase(blocks_.begin())) {
      Unmap(blocks_.front().memory, blocks_.front().bytes);
      total_ -= blocks_.front().bytes;
    }
  }

  mutable std::mutex mutex_;
  std::vector<Block> blocks_;  // the oldest first
  size_t total_ = 0, most_ = 0, places_ = 0;
};

Pool::Pool(size_t most) : kept_(std::make_shared<Kept>()) { Limit(most); }
Pool::~Pool() { Limit(0); }
void Pool::Limit(size_t most) { kept_->Limit(most); }
void Pool::Release() { kept_->Release(); }
size_t Pool::kept() const { return kept_->total(); }

// Whole pictures lie in large pages where the system has them: page walks cost streams a third of the
// bandwidth, and look-ups more. They begin at different places within their pages, each some lines further
// than the one before: the streams of several pictures would else compete for the same sets of the caches,
// and loads of one wait for stores to another whose addresses end alike (3x3 kernels take four times as
// long). Null where the system refuses.
std::shared_ptr<std::byte> Pool::AllocateLarge(size_t bytes) {
  constexpr size_t kPlace = 68 * kAlignment;
  const size_t padded = (bytes + 16 * kPlace + kPage - 1) / kPage * kPage;
  if (padded < bytes) return nullptr;
  Kept::Block block = kept_->Take(padded);
  if (block.memory == nullptr) block = {Map(padded), padded};
  if (block.memory == nullptr) return nullptr;
  return {static_cast<std::byte*>(block.memory) + kept_->NextPlace() * kPlace,
          [block, kept = kept_](std::byte*) { kept->Keep(block.memory, block.bytes); }};
}

std::shared_ptr<std::byte> Pool::Allocate(size_t bytes, Access access) {
  const size_t padded = (bytes + kReadMargin + kAlignment - 1) / kAlignment * kAlignment;
  if (padded < bytes) throw SystemError("memory", "a size of " + std::to_string(bytes) + " bytes overflows");
  // A 33^3 table of colours, half a megabyte, is read a tenth faster from one page than from 140.
  if (padded >= (access == Access::kScattered ? size_t{256} << 10 : size_t{4} << 20)) {
    if (auto memory = AllocateLarge(padded)) return memory;
  }
  void* p = std::aligned_alloc(kAlignment, padded);
  if (p == nullptr) throw SystemError("memory", "the system refused " + std::to_string(padded) + " bytes");
  return {static_cast<std::byte*>(p), std::free};
}

}  // namespace tessera::base
