// A worker's scratch memory: bump allocation, reset per tile, no allocation after the first tile.
#ifndef TESSERA_BASE_ARENA_H_
#define TESSERA_BASE_ARENA_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace tessera {
class Context;
}  // namespace tessera

namespace tessera::base {

inline constexpr size_t kAlignment = 64;  // a cache line and the widest vector

// How far beyond the end of a picture's memory or a tile's row a kernel may read, in bytes.
inline constexpr ptrdiff_t kReadMargin = 64;

// How memory is read; large pages pay for themselves sooner where every read may be in another page.
enum class Access : uint8_t { kStreamed, kScattered };

// Aligned bytes, uninitialised, and kReadMargin more that may be read; throws tessera::Error when memory is
// refused. Of Context::Default() where none is named.
std::shared_ptr<std::byte> AllocateAligned(size_t bytes, Access access = Access::kStreamed);
std::shared_ptr<std::byte> AllocateAligned(Context& context, size_t bytes, Access access = Access::kStreamed);

class Arena {
 public:
  // Takes its chunks from the context, which must outlive it; else from Context::Default().
  Arena();
  explicit Arena(Context& context) : context_(context) {}
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  // How much has been given out.
  struct Mark {
    size_t chunk = 0, used = 0;
  };

  // Uninitialised, kAlignment-aligned; valid until Reset, or until a mark set before is gone back to.
  template <typename T>
  T* Allocate(size_t count) {
    return reinterpret_cast<T*>(Bytes(count * sizeof(T)));
  }
  // Gives everything back; after the first round one chunk serves all.
  void Reset();
  Mark Here() const { return chunks_.empty() ? Mark{} : Mark{at_, chunks_[at_].used}; }
  // Takes back what was given out since; chunks stay until Reset.
  void BackTo(const Mark& mark);
  size_t capacity() const { return capacity_; }

 private:
  std::byte* Bytes(size_t bytes);

  struct Chunk {
    std::shared_ptr<std::byte> memory;
    size_t size = 0, used = 0;
  };
  Context& context_;
  std::vector<Chunk> chunks_;
  size_t at_ = 0;  // the chunk that is given from; those behind it are empty
  size_t capacity_ = 0;
};

}  // namespace tessera::base

#endif  // TESSERA_BASE_ARENA_H_
