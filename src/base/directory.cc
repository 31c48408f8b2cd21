// Directories read by the system's own calls.
#include "base/directory.h"

#include <dirent.h>

#include <memory>
#include <string_view>

namespace tessera::base {

std::string DirectoryOf(const std::string& file) {
  const size_t slash = file.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
}

std::vector<std::string> NamesIn(const std::string& directory) {
  std::vector<std::string> names;
  const auto close = [](DIR* opened) { ::closedir(opened); };
  const std::unique_ptr<DIR, decltype(close)> opened(::opendir(directory.c_str()), close);
  while (const dirent* const entry = opened == nullptr ? nullptr : ::readdir(opened.get())) {
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  return names;
}

}  // namespace tessera::base
