// What is told of files as they are read: --info, --hash, --dumpdata.
#ifndef TESSERA_CLI_TELL_H_
#define TESSERA_CLI_TELL_H_

#include <string>

#include "cli/session.h"

namespace tessera::cli {

// By the line's options.
void TellInput(const Entry& entry, Session& session);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_TELL_H_
