// What an image on the stack carries besides pixels: its node's metadata under what the line has set since.
#ifndef TESSERA_CLI_METADATA_H_
#define TESSERA_CLI_METADATA_H_

#include <functional>
#include <string>
#include <vector>

#include "cli/session.h"

namespace tessera::cli {

// All items, in the order of the file and then of the line.
std::vector<Attribute> MetadataOf(const Entry& entry);
// The item of that name, upper and lower case the same, null for none. Points into `items`.
const Attribute* FindItem(const std::vector<Attribute>& items, const std::string& name);
// Its value in words, empty for none.
std::string ItemText(const Entry& entry, const std::string& name);

// Sets or replaces an item: what an image has as its state (colour space, alpha, orientation) becomes its
// state.
void SetItem(Entry& entry, Attribute item);
void EraseItem(Entry& entry, const std::string& name);
// The first gets the items that only the others have.
void MergeMetadata(std::vector<Entry>& operands);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_METADATA_H_
