/// Processes that read files which come from strangers, and may do nothing else. @file
#ifndef TESSERA_SANDBOX_H_
#define TESSERA_SANDBOX_H_

#include <functional>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Makes ready what Policy::sandbox asks for: a copy of this process, as it is now, that starts a process for
/// each file. To be called once, first thing in main(), while the process has one thread. It says nothing
/// where the system has no sandbox: reading what is to be read in one throws SystemError then. `load` is
/// called where a reader's process ended with kSandboxWantsLibraries.
void StartSandbox(std::function<void()> load = {});
/// Ends the copy, and whatever reads for it.
void EndSandbox();
/// Whether this is a process that reads for another.
bool InSandbox();
/// What such a process ends with where it wants what only the program itself can load.
inline constexpr int kSandboxWantsLibraries = 77;

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_SANDBOX_H_
