// Names that say whose they are, and a look at who is still there.
#include "base/stale_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>

#include "base/directory.h"

namespace tessera::base {
const std::string& TemporaryMark() {
  // A process's number is its own among those of a host and of a container.
  static const std::string mark = [] {
    char host[256] = {};
    struct stat space {};
    ::gethostname(host, sizeof host - 1);
    ::stat("/proc/self/ns/pid", &space);
    uint32_t digest = 2166136261u;
    const std::string text = host + std::to_string(space.st_ino);
    for (const char c : text) digest = (digest ^ static_cast<unsigned char>(c)) * 16777619u;
    char code[16];
    std::snprintf(code, sizeof code, "%08x", digest);
    return ".tessera-" + std::string(code) + "-";
  }();
  return mark;
}

void SweepBeside(const std::string& target) noexcept try {
  static std::mutex mutex;
  static std::set<std::string> swept;
  const std::string directory = DirectoryOf(target);
  {
    const std::lock_guard lock(mutex);
    if (!swept.insert(directory).second) return;
  }
  DIR* const entries = ::opendir(directory.c_str());
  if (entries == nullptr) return;
  constexpr int kMostEntries = 1 << 16;
  for (int i = 0; i < kMostEntries; ++i) {
    const dirent* const entry = ::readdir(entries);
    if (entry == nullptr) break;
    const std::string_view name = entry->d_name;
    const size_t at = name.rfind(TemporaryMark());
    if (name[0] != '.' || at == std::string_view::npos) continue;
    const char* const number = name.data() + at + TemporaryMark().size();
    int process = 0;
    const auto [end, error] = std::from_chars(number, name.data() + name.size(), process);
    if (error != std::errc() || *end != '-' || process <= 0) continue;
    if (::kill(process, 0) == 0 || errno != ESRCH) continue;
    struct stat found;
    if (::fstatat(::dirfd(entries), entry->d_name, &found, AT_SYMLINK_NOFOLLOW) != 0 ||
        found.st_uid != ::geteuid()) {
      continue;
    }
    if (S_ISREG(found.st_mode)) ::unlinkat(::dirfd(entries), entry->d_name, 0);
    std::error_code code;
    if (S_ISDIR(found.st_mode)) std::filesystem::remove_all(directory + "/" + entry->d_name, code);
  }
  ::closedir(entries);
} catch (...) {  // a file that stays is no reason to fail
}

}  // namespace tessera::base
