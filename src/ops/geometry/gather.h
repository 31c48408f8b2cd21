// Filtered look-ups in a whole image at coordinates of any origin: what the warps share.
#ifndef TESSERA_OPS_GEOMETRY_GATHER_H_
#define TESSERA_OPS_GEOMETRY_GATHER_H_

#include <cstdint>
#include <span>
#include <vector>

#include "base/stage.h"
#include "ops/geometry/filters.h"
#include "tessera/image.h"

namespace tessera::ops {

// The image that is looked up, its filter and what lies beyond it.
class GatherSource {
 public:
  static constexpr int kPhases = 8192;  // positions between two pixels at which weights are tabulated

  static constexpr double kWidest = 65536;  // pixels per axis that a reduction may take in

  GatherSource(const ConstImageView& whole, const FilterKernel& filter, Wrap wrap_x, Wrap wrap_y,
               bool renormalize, const graph::Workers& workers);

  Roi window;
  std::vector<ConstImageView> groups;  // four channels each, dense
  const FilterKernel* filter;
  Wrap wrap_x, wrap_y;
  bool renormalize;                  // black pixels beyond the image are left out instead of counted
  int taps = 0;                      // pixels per axis while nothing is reduced
  bool linear = false;               // two taps, weighted by their distance
  std::vector<float> phase_weights;  // (kPhases + 1) x taps
  double reach = 0;                  // of the filter, in pixels while nothing is reduced
  std::vector<double> fine;  // the filter every 1 / kPhases of a pixel from its centre, for reductions
  // From one row of `groups` to the next; 0 where rows are no whole number of pixels, or where there are more
  // pixels than an offset can tell.
  int pixels_per_row = 0;

 private:
  std::vector<Image> packed_;  // what `groups` shows where the source has not four channels
};

// Where result pixels look. A matrix (x, y, q) = (X, Y, 1) m of result centres, or, with `coordinates`, two
// channels of an image: x = x_scale * channel_x + x_per_pixel * X + x_offset, and so for y. Both give
// positions in pixels of the source, whose centres are at half-integers.
struct GatherMap {
  double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  bool projective = false;
  bool reduce = false;  // widen the filter by the matrix's derivatives
  bool from_image = false;
  double x_scale = 0, x_per_pixel = 0, x_offset = 0, y_scale = 0, y_per_pixel = 0, y_offset = 0;
};

struct GatherJob {
  const GatherSource& source;
  const GatherMap& map;
  ConstImageView coordinates;        // contains out.roi, dense
  int channel_x = 0, channel_y = 0;  // floats within a pixel of it
  ImageView out;
  std::span<const int> channels;  // of the source, for every channel of `out`
  base::Arena& scratch;
  bool stream = false;
};
using GatherFunction = void (*)(const GatherJob&);

// For the SIMD target of this moment.
GatherFunction ChooseGather();

// An index beyond the image by its wrap mode; -1 for black.
inline int WrappedIndex(int64_t i, int size, Wrap wrap) {
  if (i >= 0 && i < size) return static_cast<int>(i);
  switch (wrap) {
    case Wrap::kClamp:
      return i < 0 ? 0 : size - 1;
    case Wrap::kRepeat:
      return static_cast<int>((i % size + size) % size);
    case Wrap::kMirror: {
      const int64_t m = (i % (2 * int64_t{size}) + 2 * int64_t{size}) % (2 * int64_t{size});
      return static_cast<int>(m < size ? m : 2 * int64_t{size} - 1 - m);
    }
    default:
      return -1;
  }
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_GATHER_H_
