// Places along a row that a kernel finds, in a worker's memory with room for all that there may be.
#ifndef TESSERA_OPS_FILTER_CODES_FOUND_H_
#define TESSERA_OPS_FILTER_CODES_FOUND_H_

#include <cstddef>

#include "base/arena.h"

namespace tessera::ops {

class Found {
 public:
  Found() = default;
  Found(base::Arena& scratch, int most) : at_(scratch.Allocate<int>(static_cast<size_t>(most))) {}
  void Add(int place) { at_[count_++] = place; }
  void Clear() { count_ = 0; }
  const int* begin() const { return at_; }
  const int* end() const { return at_ + count_; }

 private:
  int* at_ = nullptr;
  ptrdiff_t count_ = 0;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_FOUND_H_
