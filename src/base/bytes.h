// Bytes that have no value until they are written, many of them in large pages.
#ifndef TESSERA_BASE_BYTES_H_
#define TESSERA_BASE_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace tessera::base {

// What a vector grows by is neither cleared, which takes as long as some codecs do, nor, from a megabyte on,
// met by the system one small page at a time: on virtual machines a fault takes longer than a page's pixels.
template <typename T>
class UnsetAllocator {
 public:
  using value_type = T;
  UnsetAllocator() = default;
  template <typename U>
  UnsetAllocator(const UnsetAllocator<U>&) noexcept {}  // NOLINT: as the standard's

  T* allocate(size_t count) {
    const size_t bytes = count * sizeof(T);
    if (bytes < kMany) return std::allocator<T>().allocate(count);
    const size_t padded = (bytes + kPage - 1) / kPage * kPage;
    void* const memory = padded < bytes ? nullptr : std::aligned_alloc(kPage, padded);
    if (memory == nullptr) throw std::bad_alloc();
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
    madvise(memory, padded, MADV_HUGEPAGE);  // may be refused
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t count) noexcept {
    if (count * sizeof(T) < kMany) return std::allocator<T>().deallocate(memory, count);
    std::free(memory);
  }

  template <typename U>
  void construct(U* place) noexcept {
    ::new (static_cast<void*>(place)) U;
  }
  template <typename U, typename... Args>
  void construct(U* place, Args&&... args) {
    ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
  }
  template <typename U>
  bool operator==(const UnsetAllocator<U>&) const noexcept {
    return true;
  }

 private:
  static constexpr size_t kPage = size_t{1} << 21, kMany = size_t{1} << 20;
};

using Bytes = std::vector<uint8_t, UnsetAllocator<uint8_t>>;

}  // namespace tessera::base

#endif  // TESSERA_BASE_BYTES_H_
