// One lookup of a table in double, by definition: what the references of all lookups share.
#ifndef TESSERA_REFERENCE_TABLE_LOOKUP_H_
#define TESSERA_REFERENCE_TABLE_LOOKUP_H_

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/table.h"

namespace tessera::reference {

// A table as a function of entry and channel, without an idea of where it is stored.
struct Source {
  std::vector<int> sizes;
  int channels = 1;
  bool ends = false;
  std::function<double(int64_t entry, int channel)> read;
};
struct Found {
  std::vector<double> value;
  std::vector<double> largest;     // magnitude among the entries read
  std::vector<double> difference;  // of the largest and the smallest of them
  double units = 4;                // of 2^-24 times `largest` that the interpolation may be off
  double position_units = 0;       // of 2^-24 times `difference` that the rounding of positions adds

  // What the bound, stated for four dimensions, is a multiple of.
  double Scale(size_t c) const {
    constexpr double kBound = 4;
    return std::max((units * largest[c] + position_units * difference[c]) / kBound, kSmallestScale);
  }
};
Wrap WrapOf(const LookupParams& p, size_t axis);
Found LookUp(const Source& table, const LookupParams& p, const std::vector<double>& coords);
Source SourceOf(const Table& table);
Source SourceOf(const ImageD& image, const TableLayout& layout);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_TABLE_LOOKUP_H_
