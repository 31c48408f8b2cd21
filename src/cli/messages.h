// The program's own way to stderr.
#ifndef TESSERA_CLI_MESSAGES_H_
#define TESSERA_CLI_MESSAGES_H_

#include <cstdio>

namespace tessera::cli {

// Where errors, progress and -v go.
std::FILE* Messages();

// Codecs (libpng, libtiff) print to stderr on their own what OpenImageIO reports as well; an error is one
// line, so from here on only Messages() reaches stderr. Sanitizers keep theirs.
void SilenceLibraries();

}  // namespace tessera::cli

#endif  // TESSERA_CLI_MESSAGES_H_
