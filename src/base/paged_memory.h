// Memory that lies in a nameless file, of which no more than a budget is resident.
#ifndef TESSERA_BASE_PAGED_MEMORY_H_
#define TESSERA_BASE_PAGED_MEMORY_H_

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "base/arena.h"

namespace tessera::base {

// The operating system brings pages in as they are touched, on any thread, by plain loads and stores, and
// keeps those that were given back in its cache of files for as long as nobody else needs the memory. The
// file is in $TMPDIR, else in /var/tmp (as these files are large), else where the system puts temporary
// files; it has no name, so that nothing is left behind however the process ends.
class PagedMemory {
 public:
  // Zeros, and kReadMargin more bytes that may be read before and behind. Its room on disk is taken at once.
  // Throws SystemError naming the folder where there is none, or the system refuses.
  PagedMemory(size_t bytes, size_t budget);
  ~PagedMemory();
  PagedMemory(const PagedMemory&) = delete;
  PagedMemory& operator=(const PagedMemory&) = delete;

  // Page-aligned but for the margin.
  std::byte* data() const { return data_; }
  size_t bytes() const { return bytes_; }
  size_t budget() const { return budget_; }
  // Gives all pages back where the process has more than the budget of such pages resident (of all
  // such memories together, as the system has one number for them). What they hold stays, and may be in use:
  // who touches a page next gets it back. Two microseconds where nothing is to be done; allocates nothing.
  void Trim() const;

 private:
  std::byte *mapped_ = nullptr, *data_ = nullptr;
  size_t bytes_, budget_;
  int statistics_ = -1;  // where the system counts resident pages; -1: it does not
  size_t others_ = 0;    // bytes of the program's own and its libraries' pages
};

// What a context holds whole and pages.
class PagedPool {
 public:
  // What is larger is paged, with about as much of all of it resident; 0: nothing is.
  void Limit(size_t most) { most_ = most; }
  bool IsPaged(size_t bytes) const {
    const size_t most = most_;
    return most != 0 && bytes > most;
  }
  // Null: it is not to be paged. Else zeros, as PagedMemory; they may outlive the pool.
  std::shared_ptr<std::byte> Allocate(size_t bytes);
  // Whether there has been any since the last TrimAll that found none.
  bool IsUsed() const { return some_.load(std::memory_order_relaxed); }
  // Keeps what is resident within the limit; for whoever has computed a tile. Costs a load where nothing is
  // paged.
  void Trim() {
    if (IsUsed()) TrimAll();
  }

 private:
  void TrimAll();

  std::atomic<size_t> most_ = 0;
  std::atomic<bool> some_ = false;
  std::mutex mutex_;
  std::vector<std::weak_ptr<const PagedMemory>> all_;
};

// As AllocateAligned, for what may be larger than memory.
std::shared_ptr<std::byte> AllocateWhole(Context& context, size_t bytes, Access access = Access::kStreamed);
// The same, zeros.
std::shared_ptr<std::byte> AllocateZeros(Context& context, size_t bytes);

}  // namespace tessera::base

#endif  // TESSERA_BASE_PAGED_MEMORY_H_
