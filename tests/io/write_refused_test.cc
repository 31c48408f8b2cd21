// Memory that is refused while a file is made of bytes, every allocation of this thread in its turn: the file
// or std::bad_alloc, and never a file that was not there before. Images have encoders with threads, and
// libraries that end the process now and then; allocation_failures_test gives each a process.
#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <new>

#include "base/spool.h"
#include "files.h"
#include "support/watched_new.h"

namespace {

// How many more allocations of this thread are granted; below zero: all.
thread_local int64_t granted = -1;
thread_local bool refused = false;

}  // namespace

static void WatchAllocation() {
  if (granted < 0 || granted-- > 0) return;
  refused = true;
  throw std::bad_alloc();
}

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

// Copies for libraries that read files by their names: in a folder of their own, which is not there before.
TEST_F(WriteRefusedTest, SpoolsLeaveNothing) {
  const char* const was = std::getenv("TMPDIR");
  const std::string before = was == nullptr ? "" : was;
  setenv("TMPDIR", Path("").c_str(), 1);
  const int allocations = RefuseEach([&] {
    base::FileNames names;
    {
      const base::Spool spool(names, "lut", ".cube");
      const bool first = granted < 0;
      const int file = ::open(spool.file().c_str(), O_CREAT | O_WRONLY, 0600);
      EXPECT_GE(file, 0);
      ::close(file);
      // What a writer leaves beside it goes too.
      if (first) std::ofstream(spool.file() + "~") << "x";
    }
    granted = -1;
    EXPECT_THAT(Names(), IsEmpty());
  });
  was == nullptr ? unsetenv("TMPDIR") : setenv("TMPDIR", before.c_str(), 1);
  EXPECT_GT(allocations, 3);
}

}  // namespace
}  // namespace tessera
