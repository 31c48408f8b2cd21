// One table lookup in double precision over entries that live anywhere.
#ifndef TESSERA_MODEL_TABLE_SAMPLE_H_
#define TESSERA_MODEL_TABLE_SAMPLE_H_

#include <cstdint>
#include <functional>
#include <span>

#include "tessera/table.h"

namespace tessera::model {

struct TableEntries {
  std::span<const int> sizes;
  int channels = 1;
  TableAlign align = TableAlign::kCentres;
  std::function<float(int64_t entry, int channel)> read;  // entry in memory order, axis 0 fastest
};

// As SampleTable.
void SampleEntries(const TableEntries& table, const LookupParams& params, const double* coords,
                   double* result);

}  // namespace tessera::model

#endif  // TESSERA_MODEL_TABLE_SAMPLE_H_
