// A file for what another reads by its name, gone with whoever made it or with the process.
#ifndef TESSERA_BASE_SPOOL_H_
#define TESSERA_BASE_SPOOL_H_

#include <string>

#include "base/file_names.h"

TESSERA_API_BEGIN
namespace tessera::base {

// The name of a file, which is not there yet, in a hidden folder of its own below that of temporary files.
// Folders that processes have left behind there are swept. Throws Error (system) where it cannot be made.
class Spool {
 public:
  // The file is called `stem` with the extension, whose dot is part of it.
  Spool(FileNames& names, const std::string& stem, const std::string& extension);
  ~Spool() { Remove(); }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  const std::string& file() const { return file_; }

 private:
  void Remove() noexcept;

  FileNames& names_;
  std::string folder_, file_;
};

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_SPOOL_H_
