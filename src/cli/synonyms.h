// What other programs, papers and people call our commands.
#ifndef TESSERA_CLI_SYNONYMS_H_
#define TESSERA_CLI_SYNONYMS_H_

#include <string>
#include <utility>
#include <vector>

namespace tessera::cli {

// Words, blank-separated, and the commands and patterns that are meant by them, blank-separated.
const std::vector<std::pair<std::string, std::string>>& Synonyms();
// The words that mean the command or pattern of that name.
std::vector<std::string> SynonymsOf(const std::string& name);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_SYNONYMS_H_
