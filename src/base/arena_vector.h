// std::vector in a worker's scratch memory: for what a stage gathers while it computes a tile.
#ifndef TESSERA_BASE_ARENA_VECTOR_H_
#define TESSERA_BASE_ARENA_VECTOR_H_

#include <cstddef>
#include <vector>

#include "base/arena.h"

namespace tessera::base {

// What a vector outgrows is given back with the tile.
template <typename T>
class ArenaAllocator {
 public:
  using value_type = T;
  ArenaAllocator(Arena& arena) : arena_(&arena) {}  // a vector is made of an arena
  template <typename U>
  ArenaAllocator(const ArenaAllocator<U>& other) : arena_(&other.arena()) {}

  T* allocate(size_t count) { return arena_->Allocate<T>(count); }
  void deallocate(T*, size_t) {}
  Arena& arena() const { return *arena_; }
  template <typename U>
  bool operator==(const ArenaAllocator<U>& other) const {
    return arena_ == &other.arena();
  }

 private:
  Arena* arena_;
};

template <typename T>
using ArenaVector = std::vector<T, ArenaAllocator<T>>;

}  // namespace tessera::base

#endif  // TESSERA_BASE_ARENA_VECTOR_H_
