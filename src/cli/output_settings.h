// What -o's modifiers and the settings before it say of how a file is written.
#ifndef TESSERA_CLI_OUTPUT_SETTINGS_H_
#define TESSERA_CLI_OUTPUT_SETTINGS_H_

#include <string>
#include <vector>

#include "cli/session.h"

namespace tessera::cli {

// In place of the one of that name.
void Replace(std::vector<Attribute>& list, const Attribute& item);
// Of -o's own modifiers.
std::vector<Attribute> OutputHints(const Step& step);
// Where the file is there and --no-clobber or -u leaves it; says so.
bool SkipsOutput(const std::string& file, const Session& session);
// --autotrim and --noautocrop.
void FitToFile(Entry& entry, const std::string& file, const Session& session);
// Has the file's time set to the metadata's once it is in its place.
void AdjustTime(const Entry& entry, const std::string& file, Session& session);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_OUTPUT_SETTINGS_H_
