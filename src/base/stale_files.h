// Temporary files and folders that processes which are no more have left.
#ifndef TESSERA_BASE_STALE_FILES_H_
#define TESSERA_BASE_STALE_FILES_H_

#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// What the names of this machine's temporary files and folders have in common behind their dot and stem; the
// process's number and a dash follow.
const std::string& TemporaryMark();

// Removes those in the directory of `target` that processes of this machine left behind that are no more,
// folders with all they hold, once per directory.
void SweepBeside(const std::string& target) noexcept;

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_STALE_FILES_H_
