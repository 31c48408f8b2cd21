// What the lookup operations keep: the table beside the public parameters. Read by their references.
#ifndef TESSERA_MODEL_LOOKUP_SETTINGS_H_
#define TESSERA_MODEL_LOOKUP_SETTINGS_H_

#include <vector>

#include "tessera/table.h"

namespace tessera::model {

// Filters that read the levels of a mip chain; by coordinates of neighbours, so that colours have none.
constexpr bool HasMipChain(TableFilter filter) {
  return filter == TableFilter::kMipmap || filter == TableFilter::kTrilinear || filter == TableFilter::kEwa;
}

struct LookupSettings {
  Table table;  // empty: input 1 is the table, laid out as `layout` says
  TableLayout layout;
  LookupParams lookup;
};

struct Table3DSettings {
  Table table;
  LookupParams lookup;
};

struct Tables1DSettings {
  std::vector<Table> tables;  // one per channel; empty ones change nothing
  LookupParams lookup;
};

}  // namespace tessera::model

#endif  // TESSERA_MODEL_LOOKUP_SETTINGS_H_
