// Memory that is refused while a file is written, every allocation of this thread in its turn: the picture or
// std::bad_alloc (Error where a library says it in its own way), and never a file that was not there before.
#include <dlfcn.h>

#include <cstdlib>
#include <functional>
#include <new>
#include <optional>

#include "files.h"

namespace {

// How many more allocations of this thread are granted; below zero: all.
thread_local int64_t granted = -1;
thread_local bool refused = false;

// OpenImageIO's own are granted: some are taken where nothing may be thrown.
bool OpenImageIos(const void* caller) {
  Dl_info info;
  return ::dladdr(caller, &info) != 0 && info.dli_fname != nullptr &&
         std::strstr(info.dli_fname, "libOpenImageIO") != nullptr;
}

void* Take(size_t bytes, size_t alignment, const void* caller) {
  if (granted >= 0 && !OpenImageIos(caller) && granted-- == 0) {
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
TESSERA_APART void* operator new(size_t bytes) {
  return Take(bytes, alignof(std::max_align_t), __builtin_return_address(0));
}
TESSERA_APART void* operator new(size_t bytes, std::align_val_t alignment) {
  return Take(bytes, static_cast<size_t>(alignment), __builtin_return_address(0));
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
      } catch (const Error&) {
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

TEST_F(WriteRefusedTest, ImagesLeaveNothing) {
  ImageSpec spec(32, 20, 3, PixelType::kUint8);
  const Node node = FromImage(Pattern(spec));
  for (const char* const file : {"a.exr", "a.png", "a.tif", "a.bmp"}) {
    WriteOptions options;
    options.render.threads = 1;
    options.sync = false;
    if (std::string(file) == "a.exr") options.type = PixelType::kHalf;
    EXPECT_GT(RefuseEach([&] { Write(node, Path(file), options); }), 50) << file;
  }
}

// It makes a file to learn what the format stores, and removes it.
TEST_F(WriteRefusedTest, AQuestionLeavesNothing) {
  const Node node = FromImage(Pattern(ImageSpec(32, 20, 3, PixelType::kUint8)));
  EXPECT_GT(RefuseEach([&] { StoredType(node, Path("a.exr")); }), 10);
}

TEST_F(WriteRefusedTest, SeveralImagesLeaveNothing) {
  const Node node = FromImage(Pattern(ImageSpec(32, 20, 3, PixelType::kUint8)));
  WriteOptions options;
  options.render.threads = 1;
  options.sync = false;
  EXPECT_GT(RefuseEach([&] { PendingOutput({{node}, {node}}, Path("a.tif"), options).Commit(); }), 50);
}

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
