// Aligned memory, large pages for whole pictures, and what is kept of them.
#include "base/pool.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <mutex>
#include <new>
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

struct Block {
  void* memory = nullptr;
  size_t bytes = 0;
};

// Blocks that were given back, the oldest first.
class Shelf {
 public:
  explicit Shelf(void (*give_back)(const Block&)) : give_back_(give_back) {}
  size_t total() const { return total_; }

  // One of at least that size and hardly more, the last that came; none of no memory.
  Block Take(size_t bytes) {
    const auto fits = [&](const Block& b) { return b.bytes >= bytes && b.bytes <= bytes + bytes / 4; };
    const auto found = std::find_if(blocks_.rbegin(), blocks_.rend(), fits);
    if (found == blocks_.rend()) return {};
    const Block block = *found;
    total_ -= block.bytes;
    blocks_.erase(std::next(found).base());
    return block;
  }
  void Keep(const Block& block, size_t most) {
    if (block.bytes > most) return give_back_(block);
    try {
      blocks_.push_back(block);
    } catch (const std::bad_alloc&) {
      return give_back_(block);  // destructors come here
    }
    total_ += block.bytes;
    Trim(most);
  }
  void Trim(size_t most) {
    size_t gone = 0;
    for (; total_ > most; ++gone) {
      total_ -= blocks_[gone].bytes;
      give_back_(blocks_[gone]);
    }
    blocks_.erase(blocks_.begin(), blocks_.begin() + static_cast<ptrdiff_t>(gone));
  }

 private:
  void (*give_back_)(const Block&);
  std::vector<Block> blocks_;
  size_t total_ = 0;
};

}  // namespace

// The system takes longer to clear a picture's pages than most operations take to fill them, and bands that
// go round stay in the caches. It may take kept large pages away when it runs short.
class Pool::Kept {
 public:
  ~Kept() { Limit(0); }

  Block Take(size_t bytes, bool large) {
    const std::lock_guard lock(mutex_);
    return (large ? large_ : small_).Take(bytes);
  }
  void Keep(const Block& block, bool large) {
    const std::lock_guard lock(mutex_);
    if (large) MayBeTaken(block.memory, block.bytes);
    (large ? large_ : small_).Keep(block, large ? most_ : MostSmall());
  }
  void Limit(size_t most) {
    const std::lock_guard lock(mutex_);
    most_ = kKeeps ? most : 0;
    large_.Trim(most_), small_.Trim(MostSmall());
  }
  void Release() {
    const std::lock_guard lock(mutex_);
    large_.Trim(0), small_.Trim(0);
  }
  size_t total() const {
    const std::lock_guard lock(mutex_);
    return large_.total() + small_.total();
  }
  size_t NextPlace() {
    const std::lock_guard lock(mutex_);
    return places_++ % 16;
  }

 private:
  size_t MostSmall() const { return most_ / 8; }

  mutable std::mutex mutex_;
  Shelf large_{[](const Block& b) { Unmap(b.memory, b.bytes); }};
  Shelf small_{[](const Block& b) { std::free(b.memory); }};
  size_t most_ = 0, places_ = 0;
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
  Block block = kept_->Take(padded, /*large=*/true);
  if (block.memory == nullptr) block = {Map(padded), padded};
  if (block.memory == nullptr) return nullptr;
  return {static_cast<std::byte*>(block.memory) + kept_->NextPlace() * kPlace,
          [block, kept = kept_](std::byte*) { kept->Keep(block, /*large=*/true); }};
}

// What is smaller still the C library keeps itself.
std::shared_ptr<std::byte> Pool::AllocateSmall(size_t bytes) {
  constexpr size_t kWorthKeeping = size_t{64} << 10;
  const bool keeps = bytes >= kWorthKeeping;
  Block block = keeps ? kept_->Take(bytes, /*large=*/false) : Block();
  if (block.memory == nullptr) block = {std::aligned_alloc(kAlignment, bytes), bytes};
  if (block.memory == nullptr)
    throw SystemError("memory", "the system refused " + std::to_string(bytes) + " bytes");
  if (!keeps) return {static_cast<std::byte*>(block.memory), std::free};
  return {static_cast<std::byte*>(block.memory),
          [block, kept = kept_](std::byte*) { kept->Keep(block, /*large=*/false); }};
}

std::shared_ptr<std::byte> Pool::Allocate(size_t bytes, Access access) {
  const size_t padded = (bytes + kReadMargin + kAlignment - 1) / kAlignment * kAlignment;
  if (padded < bytes) throw SystemError("memory", "a size of " + std::to_string(bytes) + " bytes overflows");
  // A 33^3 table of colours, half a megabyte, is read a tenth faster from one page than from 140.
  if (padded >= (access == Access::kScattered ? size_t{256} << 10 : size_t{1} << 20)) {
    if (auto memory = AllocateLarge(padded)) return memory;
  }
  return AllocateSmall(padded);
}

}  // namespace tessera::base
