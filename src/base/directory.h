// What lies in a directory.
#ifndef TESSERA_BASE_DIRECTORY_H_
#define TESSERA_BASE_DIRECTORY_H_

#include <string>
#include <vector>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// The directory that a file's name stands for a file of: `.` where it names none.
std::string DirectoryOf(const std::string& file);

// The names of what lies in a directory, in no order; none where it is absent or may not be read. Throws
// std::bad_alloc, where std::filesystem::directory_iterator of gcc 12 ends the process.
std::vector<std::string> NamesIn(const std::string& directory);

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_DIRECTORY_H_
