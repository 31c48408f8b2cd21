// Registry rows of the lookup family: pixel textures and colour tables.
#ifndef TESSERA_OPS_LOOKUP_LOOKUP_OPS_H_
#define TESSERA_OPS_LOOKUP_LOOKUP_OPS_H_

#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/table.h"

namespace tessera::ops {

OpInfo LookupInfo();
OpInfo TableInfo();
OpInfo ColorMapInfo();

// Colour tables as written on a command line: a list of numbers, or a text file whose columns are one table
// each.
std::vector<Table> TablesOfText(const std::string& text);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_LOOKUP_OPS_H_
