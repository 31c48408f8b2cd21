// What line filters share: 32 tracks side by side, the rule beyond a line's ends, and the loops over an
// image.
#ifndef TESSERA_OPS_FILTER_LINES_EXTEND_H_
#define TESSERA_OPS_FILTER_LINES_EXTEND_H_

#include <cstddef>
#include <functional>
#include <vector>

#include "base/stage.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

inline constexpr int kTrackCount = 32;

// Tracks of `length` samples: columns (stride between steps) or RGBA rows (stride between rows).
struct TrackBlock {
  const float* in;
  float* out;
  ptrdiff_t in_stride, out_stride;  // floats
  int length;
};

// What lies beyond the ends of a line.
struct AxisBorder {
  enum Rule { kEdge, kValue, kMapped } rule = kEdge;
  float value = 0;

  AxisBorder(Wrap wrap, double border_value, int line_length);
  // The sample of the line that is shown at n, any integer; -1 for the value.
  int Shown(int n) const;

 private:
  Wrap mode_;
  int length_;
};

// filter(axis, block, rgba_rows, scale, scratch): one block of tracks; scratch holds length * kTrackCount
// floats.
using LineFilter =
    std::function<void(int axis, const TrackBlock&, bool rgba_rows, const float* scale, float* scratch)>;
// Runs a filter along the rows (axis 0) and then the columns (axis 1) of an image. `scale_of(axis, length)`
// gives factors per sample or nothing.
void FilterLines(bool rows, bool columns, const ConstImageView& in, const ImageView& out,
                 const graph::Workers& workers, const LineFilter& filter,
                 const std::function<std::vector<float>(int axis, int length)>& scale_of);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_LINES_EXTEND_H_
