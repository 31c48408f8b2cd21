// OpenColorIO keeps the LUT files that it read for as long as the process lives, by their names alone.
#include <sys/stat.h>

#include <array>
#include <map>
#include <mutex>

#include "ocio/config.h"

namespace tessera::ocio {
namespace {

// What tells a file as it is from what it was.
using Stamp = std::array<int64_t, 7>;

Stamp StampOf(const std::string& file) {
  struct stat s {};
  if (::stat(file.c_str(), &s) != 0) return {};
  return {int64_t(s.st_dev), int64_t(s.st_ino), s.st_size,        s.st_mtim.tv_sec,
          s.st_mtim.tv_nsec, s.st_ctim.tv_sec,  s.st_ctim.tv_nsec};
}

}  // namespace

void ForgetIfChanged(const std::string& file) {
  // As many as the process has; OpenColorIO's cache is the process's too.
  constexpr size_t kMost = 4096;
  static std::mutex mutex;
  static std::map<std::string, Stamp> seen;
  const std::lock_guard lock(mutex);
  const Stamp now = StampOf(file);
  const auto [known, first] = seen.try_emplace(file, now);
  if (first ? seen.size() <= kMost : known->second == now) return;
  seen.clear();
  seen[file] = now;
  lib::ClearAllCaches();
}

}  // namespace tessera::ocio
