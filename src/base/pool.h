// Memory for pictures, kept for the next one when it is given back.
#ifndef TESSERA_BASE_POOL_H_
#define TESSERA_BASE_POOL_H_

#include <cstddef>
#include <memory>

#include "base/arena.h"

namespace tessera::base {

class Pool {
 public:
  // Keeps no more than `most` bytes.
  explicit Pool(size_t most);
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  // As AllocateAligned. The memory may outlive the pool.
  std::shared_ptr<std::byte> Allocate(size_t bytes, Access access = Access::kStreamed);

  void Limit(size_t most);
  // Gives all that is kept back to the system.
  void Release();
  size_t kept() const;

 private:
  class Kept;
  std::shared_ptr<std::byte> AllocateLarge(size_t bytes);
  std::shared_ptr<std::byte> AllocateSmall(size_t bytes);

  std::shared_ptr<Kept> kept_;  // the pool's, and that of every memory it handed out
};

}  // namespace tessera::base

#endif  // TESSERA_BASE_POOL_H_
