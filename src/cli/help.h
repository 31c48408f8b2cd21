// --help, --help COMMAND, --version, --list-commands: all made from the commands' rows.
#ifndef TESSERA_CLI_HELP_H_
#define TESSERA_CLI_HELP_H_

#include <ostream>
#include <string>

namespace tessera::cli {

void PrintOverview(std::ostream& out);
// All about one command or generator, named with or without dashes. Throws UsageError with the nearest known
// one.
void PrintCommandHelp(std::ostream& out, const std::string& topic);
// `format`: tsv, json or markdown, as --list-commands documents them.
void PrintCommandList(std::ostream& out, const std::string& format);
void PrintVersion(std::ostream& out);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_HELP_H_
