// Names of files that are not finished yet, which a signal handler has to remove, and when it may.
#ifndef TESSERA_BASE_FILE_NAMES_H_
#define TESSERA_BASE_FILE_NAMES_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// Whoever exchanges a pointer out owns it, so that a signal handler and a thread never both act on one; a
// name taken by a handler is put aside, because free is not safe there.
class FileNames {
 public:
  ~FileNames();

  void Remember(const std::string& name);
  void Forget(const std::string& name) noexcept;
  // Calls action(name) for every one, each once; async-signal-safe as far as the action is.
  template <typename Action>
  void TakeEach(const Action& action) {
    for (size_t i = 0; i < slots_.size(); ++i) {
      char* const name = slots_[i].exchange(nullptr);
      if (name == nullptr) continue;
      action(static_cast<const char*>(name));
      taken_[i].store(name);
    }
  }
  // Another number for every name.
  int64_t Next() { return count_++; }

  // While one lives, on any thread, the process does not end: a file is being made that the handler would
  // miss, or files are getting their names together. Short; they nest.
  class Step {
   public:
    explicit Step(FileNames& names) : names_(names) { names_.BeginStep(); }
    ~Step() { names_.EndStep(); }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

   private:
    FileNames& names_;
  };

  // For the handler of a signal that ends the process, async-signal-safe. True where no step is under way,
  // for one caller alone: threads that come to a step stay there from then on. False where the handler is to
  // return: another is ending the process, or the signal is kept (the first one) and handed to what OnKept
  // was given on the thread whose step ends last.
  bool MayEnd(int signal);
  void OnKept(void (*handler)(int)) { on_kept_.store(handler); }

 private:
  void BeginStep();
  void EndStep();

  // In one word, so that what a handler decides by is what it decides about.
  static constexpr uint32_t kStep = 1, kSteps = 0xffff, kSignal = 1u << 16, kSignals = 0xffu << 16,
                            kEnded = 1u << 31;
  std::atomic<uint32_t> state_ = 0;
  static_assert(std::atomic<uint32_t>::is_always_lock_free);
  std::atomic<void (*)(int)> on_kept_ = nullptr;

  std::mutex forgetting_;
  std::array<std::atomic<char*>, 1024> slots_ = {}, taken_ = {};
  static_assert(std::atomic<char*>::is_always_lock_free);
  std::atomic<int64_t> count_ = 0;
};

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_FILE_NAMES_H_
