// Standard input and output as files: -, png:-; and words from files: @FILE.
#ifndef TESSERA_CLI_PIPES_H_
#define TESSERA_CLI_PIPES_H_

#include <string>
#include <vector>

#include "cli/session.h"

namespace tessera::cli {

// The name of a file that holds all of standard input, for as long as the process lives. Throws Error.
const std::string& StandardInput();
// Whether an output's name, - or FORMAT:-, is standard output.
bool IsStandardOutput(const std::string& file);
// A file to write in place of it, whose contents go there once it is whole. Throws Error for no format.
std::string InPlaceOfStandardOutput(const std::string& file, Session& session);

// Words @FILE replaced by the words in that file: blanks and line ends part them, quotes and backslashes
// protect, # begins a comment. Throws Error.
std::vector<std::string> WithWordsOfFiles(const std::vector<std::string>& words);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_PIPES_H_
