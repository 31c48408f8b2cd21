// A file without a name, mapped whole.
#include "base/paged_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

#include "base/arena.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::base {
namespace {

std::string Folder() {
  const char* const named = std::getenv("TMPDIR");
  if (named != nullptr && *named != '\0') return named;
  std::error_code error;
  if (std::filesystem::is_directory("/var/tmp", error) && ::access("/var/tmp", W_OK) == 0) return "/var/tmp";
  return std::filesystem::temp_directory_path(error).string();
}

int OpenNameless(const std::string& folder) {
#ifdef O_TMPFILE
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) return descriptor;
#endif
  // File systems without files that never had a name.
  std::string name = folder + "/tessera-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

// Bytes of mapped files that are resident; 0 where the system does not say.
size_t ResidentOfFiles(int statistics) {
  char text[128];
  const ssize_t count = statistics < 0 ? -1 : ::pread(statistics, text, sizeof(text), 0);
  if (count <= 0) return 0;
  // All pages, resident ones, those of files.
  const char *at = text, *const end = text + count;
  size_t pages = 0;
  for (int field = 0; field < 3; ++field) {
    while (at < end && *at == ' ') ++at;
    at = std::from_chars(at, end, pages).ptr;
  }
  return pages * static_cast<size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

PagedMemory::PagedMemory(size_t bytes, size_t budget) : bytes_(bytes), budget_(budget) {
  const std::string folder = Folder();
  const size_t all = bytes + 2 * static_cast<size_t>(kReadMargin);
  const auto refuse = [&](int code) {
    throw SystemError(folder, "cannot hold a temporary file of " + std::to_string(all) +
                                  " bytes: " + std::error_code(code, std::generic_category()).message() +
                                  "; expected a folder with that much room, which TMPDIR may name");
  };
  const int file = OpenNameless(folder);
  if (file < 0) refuse(errno);
  // A store to a page that has no room on disk would end the process. Some file systems fill up before they
  // say that there is not enough.
  struct statvfs room;
  const bool lacks = ::fstatvfs(file, &room) == 0 && room.f_bavail < all / room.f_frsize;
  const int code = lacks ? ENOSPC : ::posix_fallocate(file, 0, static_cast<off_t>(all));
  void* mapped = MAP_FAILED;
  int reason = code;
  if (code == 0) {
    mapped = ::mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (mapped == MAP_FAILED) reason = errno;
  }
  ::close(file);  // what is mapped stays
  if (mapped == MAP_FAILED) refuse(reason);
#ifdef MADV_NOHUGEPAGE
  // Else a byte that is read may bring in two megabytes of its neighbours.
  ::madvise(mapped, all, MADV_NOHUGEPAGE);
#endif
  mapped_ = static_cast<std::byte*>(mapped);
  data_ = mapped_ + kReadMargin;
  statistics_ = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  // As it was before there was any of these memories.
  static const size_t kOthers = ResidentOfFiles(statistics_);
  others_ = kOthers;
}

PagedMemory::~PagedMemory() {
  ::munmap(mapped_, bytes_ + 2 * static_cast<size_t>(kReadMargin));
  if (statistics_ >= 0) ::close(statistics_);
}

void PagedMemory::Trim() const {
  // Where nothing is counted, pages are given back whenever one is asked for.
  if (statistics_ >= 0 && ResidentOfFiles(statistics_) < others_ + budget_) return;
  ::madvise(mapped_, bytes_ + 2 * static_cast<size_t>(kReadMargin), MADV_DONTNEED);
}

std::shared_ptr<std::byte> PagedPool::Allocate(size_t bytes) {
  if (!IsPaged(bytes)) return nullptr;
  const auto memory = std::make_shared<const PagedMemory>(bytes, most_);
  const std::lock_guard lock(mutex_);
  all_.push_back(memory);
  some_ = true;
  return {memory, memory->data()};
}

void PagedPool::TrimAll() {
  const std::lock_guard lock(mutex_);  // who does not wait touches more pages meanwhile
  std::erase_if(all_, [](const auto& memory) { return memory.expired(); });
  some_ = !all_.empty();
  for (const auto& memory : all_) {
    if (const auto alive = memory.lock()) alive->Trim();
  }
}

std::shared_ptr<std::byte> AllocateWhole(Context& context, size_t bytes, Access access) {
  auto paged = context.paged().Allocate(bytes);
  return paged != nullptr ? paged : AllocateAligned(context, bytes, access);
}

std::shared_ptr<std::byte> AllocateZeros(Context& context, size_t bytes) {
  auto memory = context.paged().Allocate(bytes);
  if (memory != nullptr) return memory;
  memory = AllocateAligned(context, bytes);
  std::memset(memory.get(), 0, bytes);
  return memory;
}

}  // namespace tessera::base
