// Memory that is refused while a file is made of bytes, every allocation of this thread in its turn: the file
// or std::bad_alloc, and never a file that was not there before. Images have encoders with threads, and
// libraries that end the process now and then; allocation_failures_test gives each a process.
#include <cstdlib>
#include <functional>
#include <new>

#include "files.h"

namespace {

// How many more allocations of this thread are granted; below zero: all.
thread_local int64_t granted = -1;
thread_local bool refused = false;

void* Take(size_t bytes, size_t alignment) {
  if (granted >= 0 && granted-- == 0) {
    refused = true;
    throw std::bad_alloc();
  }
  const size_t whole = (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
  void* const memory = std::aligned_alloc(alignment, whole);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

// Not inlined: the compiler would see memory of one function given to another.
#define TESSERA_APART __attribute__((noinline))
TESSERA_APART void* operator new(size_t bytes) { return Take(bytes, alignof(std::max_align_t)); }
TESSERA_APART void* operator new(size_t bytes, std::align_val_t alignment) {
  return Take(bytes, static_cast<size_t>(alignment));
}
TESSERA_APART void operator delete(void* memory) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, size_t) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
TESSERA_APART void operator delete(void* memory, size_t, std::align_val_t) noexcept { std::free(memory); }

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::IsEmpty;

class WriteRefusedTest : public FileTest {
 protected:
  // Runs it with one allocation refused, each in its turn, until it needs no more; how many there were.
  int RefuseEach(const std::function<void()>& write) {
    write();  // what is made once is made
    for (const std::string& name : Names()) std::filesystem::remove(Path(name));
    for (int n = 0;; ++n) {
      bool thrown = false;
      granted = n;
      refused = false;
      try {
        write();
      } catch (const std::bad_alloc&) {
        thrown = true;
      }
      granted = -1;
      if (!refused) return n;
      if (thrown) {
        EXPECT_THAT(Names(), IsEmpty()) << "allocation " << n;
      }
      for (const std::string& name : Names()) std::filesystem::remove(Path(name));
    }
  }
};

TEST_F(WriteRefusedTest, BytesLeaveNothing) {
  const std::vector<std::byte> bytes(100000);
  EXPECT_GT(RefuseEach([&] { PendingOutput(Path("a.icc"), bytes, false).Commit(); }), 5);
}

// What is never committed goes too.
TEST_F(WriteRefusedTest, OutputsThatAreDroppedLeaveNothing) {
  const std::vector<std::byte> bytes(100);
  RefuseEach([&] {
    std::vector<PendingOutput> outputs;
    for (const char* const name : {"a.icc", "b.icc", "c.icc"}) outputs.emplace_back(Path(name), bytes, false);
    std::vector<PendingOutput*> all;
    for (PendingOutput& output : outputs) all.push_back(&output);
    PendingOutput::CommitTogether(all);
  });
}

}  // namespace
}  // namespace tessera
