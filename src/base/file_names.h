// Names of files that are not finished yet: what a signal handler has to remove.
#ifndef TESSERA_BASE_FILE_NAMES_H_
#define TESSERA_BASE_FILE_NAMES_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// Whoever exchanges a pointer out owns it, so that a signal handler and a thread never both act on one; a
// name taken by a handler is not freed, because free is not safe there.
class FileNames {
 public:
  ~FileNames();

  void Remember(const std::string& name);
  void Forget(const std::string& name) noexcept;
  // Calls action(name) for every one, each once; async-signal-safe as far as the action is.
  template <typename Action>
  void TakeEach(const Action& action) {
    for (auto& slot : slots_) {
      if (const char* const name = slot.exchange(nullptr)) action(name);
    }
  }
  // Another number for every name.
  int64_t Next() { return count_++; }

 private:
  std::array<std::atomic<char*>, 1024> slots_ = {};
  static_assert(std::atomic<char*>::is_always_lock_free);
  std::atomic<int64_t> count_ = 0;
};

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_FILE_NAMES_H_
