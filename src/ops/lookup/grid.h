// A table as the lookup kernels read it: float entries of one or four samples, with enough of what lies
// beyond each axis around them that every tap is one load.
#ifndef TESSERA_OPS_LOOKUP_GRID_H_
#define TESSERA_OPS_LOOKUP_GRID_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/stage.h"
#include "tessera/table.h"

namespace tessera::ops {

// One axis of a grid. A coordinate s is reduced by the wrap, its position is v = s * scale + offset, clamped
// to [low, high]; the first entry is floor(v), at most last; entries first..last are in memory (and the taps
// around).
struct GridAxis {
  Wrap wrap = Wrap::kClamp;
  float scale = 1, offset = 0;
  float per_unit = 1;  // entries per unit of the coordinate
  float low = 0, high = 0;
  int last = 0;
  int first_stored = 0, last_stored = 0;
  int32_t stride = 1;  // in entries
  bool exact = false;  // products of coordinates and scale are exact: it is a power of two
  bool seams = true;   // some taps may not be in memory
};

class Grid {
 public:
  // From a table; copies it with its surroundings.
  Grid(const Table& table, const LookupParams& params, const graph::Workers* workers = nullptr);
  // From an image that outlives the grid: read in place when it is large and its entries are one or four
  // floats, otherwise copied.
  Grid(const ConstImageView& image, const TableLayout& layout, const LookupParams& params,
       const graph::Workers* workers);

  int dims() const { return dims_; }
  int channels() const { return channels_; }  // results that the table has: 1 to 4
  int texel() const { return texel_; }        // floats from entry to entry: 1 or 4
  // Whether every axis is kEnds and clamped to its edge, its last cell chosen at its own end; and whether all
  // products of coordinates and sizes are exact.
  bool ends_inside() const { return ends_inside_; }
  bool exact() const { return exact_; }
  // Whether every axis is clamped to its edge and two neighbours from any cell on are in memory.
  bool edges() const { return edges_; }
  // Bytes from the first to the last entry.
  int64_t bytes() const { return bytes_; }
  const GridAxis& axis(int a) const { return axes_[a]; }
  const float* data() const { return data_; }  // entry 0 of every axis
  // Whether no pixel needs SampleOne: every tap is in memory; all entries and their differences are finite.
  bool whole() const { return whole_; }
  bool finite() const { return finite_; }
  const LookupParams& params() const { return params_; }
  float border(int c) const { return c < 4 ? border_[c] : 0; }
  // The same lookup in double, entry by entry, for pixels at seams and for entries that are NaN or infinite.
  void SampleOne(const float* coords, float* result) const;

 private:
  void SetAxes(const std::vector<int>& sizes, TableAlign align);
  void SetSummary();  // when the axes are final
  template <class Read>
  void Copy(const std::vector<int>& sizes, TableAlign align, const graph::Workers* workers, const Read& read);

  int dims_ = 0, channels_ = 0, texel_ = 4;
  GridAxis axes_[4];
  const float* data_ = nullptr;
  std::shared_ptr<std::byte> memory_;
  bool whole_ = true, finite_ = true, ends_inside_ = false, exact_ = false, edges_ = false;
  int64_t bytes_ = 0;
  LookupParams params_;
  float border_[4] = {};
  Table table_;  // what SampleOne reads; empty when the image is read in place
  ConstImageView image_;
  std::vector<int> sizes_;
  TableAlign align_ = TableAlign::kCentres;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_GRID_H_
