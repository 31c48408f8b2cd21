// --help, --help COMMAND, --help-search, --version, --list-commands, --man, --completion: all made from the
// commands' rows.
#ifndef TESSERA_CLI_HELP_H_
#define TESSERA_CLI_HELP_H_

#include <ostream>
#include <string>

#include "cli/layout.h"

namespace tessera::cli {

void PrintOverview(std::ostream& out, const Layout& layout = {});
// All about one command or generator, named with or without dashes. Throws UsageError with the nearest known
// one.
void PrintCommandHelp(std::ostream& out, const std::string& topic, const Layout& layout = {});
// `format`: tsv, json or markdown, as --list-commands documents them.
void PrintCommandList(std::ostream& out, const std::string& format);
void PrintVersion(std::ostream& out);
// The commands and patterns that `words` are about, the likeliest first: by names, aliases, what other
// programs call them, summaries, parameters and help. Throws DataError where there is none.
void PrintSearch(std::ostream& out, const std::string& words, const Layout& layout);
// A manual page for man(1).
void PrintManual(std::ostream& out);
// What bash, zsh or fish reads to complete lines.
void PrintCompletion(std::ostream& out, const std::string& shell);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_HELP_H_
