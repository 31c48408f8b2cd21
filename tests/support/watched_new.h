// Replaces operator new of the program whose one source includes it.
#ifndef TESSERA_TESTS_SUPPORT_WATCHED_NEW_H_
#define TESSERA_TESTS_SUPPORT_WATCHED_NEW_H_

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>

// Before each allocation, on its thread; the source defines it. What it throws refuses the memory.
static void WatchAllocation();

static void* TakeWatched(size_t bytes, size_t alignment) {
  WatchAllocation();
  const size_t whole = (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
  void* const memory = std::aligned_alloc(alignment, whole);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

// Not inlined: the compiler would see memory of one function given to another.
#define TESSERA_APART __attribute__((noinline))
TESSERA_APART void* operator new(size_t bytes) { return TakeWatched(bytes, alignof(std::max_align_t)); }
TESSERA_APART void* operator new(size_t bytes, std::align_val_t alignment) {
  return TakeWatched(bytes, static_cast<size_t>(alignment));
}
// Of the library it would call the first one; sanitizers have one of their own.
TESSERA_APART void* operator new(size_t bytes, const std::nothrow_t&) noexcept try {
  return TakeWatched(bytes, alignof(std::max_align_t));
} catch (const std::bad_alloc&) {
  return nullptr;
}
TESSERA_APART void operator delete(void* memory) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, size_t) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }
#undef TESSERA_APART

#endif  // TESSERA_TESTS_SUPPORT_WATCHED_NEW_H_
