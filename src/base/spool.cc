// A folder with one file, known to the handler of signals while it is there.
#include "base/spool.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "base/stale_files.h"
#include "tessera/error_kind.h"

namespace tessera::base {

Spool::Spool(FileNames& names, const std::string& stem, const std::string& extension) : names_(names) {
  // Not put together as a path: gcc 12's end the process where they get no memory.
  folder_ = std::filesystem::temp_directory_path().string() + "/." + stem + TemporaryMark() +
            std::to_string(::getpid()) + "-XXXXXX";
  SweepBeside(folder_);
  const FileNames::Step step(names_);
  if (::mkdtemp(folder_.data()) == nullptr) {
    throw SystemError(folder_,
                      "cannot be made: " + std::error_code(errno, std::generic_category()).message());
  }
  try {
    file_ = folder_ + "/" + stem + extension;
    names_.Remember(folder_);
    names_.Remember(file_);
  } catch (...) {
    Remove();
    throw;
  }
}

void Spool::Remove() noexcept {
  ::unlink(file_.c_str());
  if (::rmdir(folder_.c_str()) != 0 && errno != ENOENT) {
    try {  // whoever wrote the file has left another beside it
      std::error_code code;
      std::filesystem::remove_all(folder_, code);
    } catch (...) {  // no memory: the next process sweeps it
    }
  }
  names_.Forget(file_);
  names_.Forget(folder_);
}

}  // namespace tessera::base
