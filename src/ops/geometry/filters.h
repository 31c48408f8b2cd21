// The reconstruction filters, by oiiotool's names, and their weights for an axis of a resampling.
#ifndef TESSERA_OPS_GEOMETRY_FILTERS_H_
#define TESSERA_OPS_GEOMETRY_FILTERS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "base/stage.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {

struct FilterKernel {
  const char* name;
  double width;               // of the support, in pixels of the coarser image
  double (*value)(double x);  // at a distance from the centre; 0 outside the support; not normalised
  bool separable = true;      // else `value` is of the radius

  // Nearer to the edge of the support than this, in parts of its radius, is at the edge.
  static constexpr double kEdge = 0x1p-40;
  // The radius with which a pixel at the edge counts, or does not, as `value` has it.
  double Reach() const { return width / 2 * (value(width / 2) != 0 ? 1 + kEdge : 1 - kEdge); }
  // Whether a pixel's centre gets that pixel alone: then what moves nothing changes nothing.
  bool Interpolates() const {
    for (int k = 1; k <= width / 2; ++k) {
      if (value(k) > 1e-12 || value(k) < -1e-12) return false;
    }
    return true;
  }
  // `value`, or at an edge where it ends abruptly its limit from inside: what tables are interpolated to.
  double InsideValue(double x) const {
    const double inside = width / 2 * (1 - 2 * kEdge), limit = value(inside);
    return (x > inside || x < -inside) && (limit > 1e-6 || limit < -1e-6) ? limit : value(x);
  }
};

// Throws Error(subject, ...) for an unknown name, naming the nearest.
const FilterKernel& FindFilter(const std::string& subject, const std::string& name);
std::vector<std::string> FilterNames();

// Weights of one axis: result index i takes count[i] source indices from first[i] on.
struct AxisTaps {
  int begin = 0;  // the first result index
  std::vector<int> first, count;
  std::vector<int64_t> offset;  // of index i's weights
  std::vector<double> weights;
  bool halves = false;  // every result is the mean of the pixels 2 i + shift and 2 i + shift + 1
  bool moves = false;   // every result is the pixel i + shift
  int shift = 0;

  int First(int i) const { return first[static_cast<size_t>(i - begin)]; }
  int Count(int i) const { return count[static_cast<size_t>(i - begin)]; }
  const double* Weights(int i) const {
    return weights.data() + offset[static_cast<size_t>(i - begin)];  // where no index has any, none
  }
  // Source indices that results [i0, i1) read.
  void Range(int i0, int i1, int* s0, int* s1) const;
};

// How results map to sources along one axis.
struct AxisMap {
  int out0 = 0, out1 = 0;        // results wanted
  int source0 = 0, source1 = 0;  // the source's pixels
  double origin = 0,
         step = 1;   // result i's centre lies at origin + (i + 1/2) * step, source pixel j's at j + 1/2
  double scale = 1;  // filter distance per source pixel: at most 1, smaller when reducing
};

// Weights sum to 1 before what lies beyond the source is treated: kClamp adds it to the edge pixel,
// kBlack leaves it out, the others keep indices beyond the source. Zero weights at either end are cut off.
AxisTaps MakeAxisTaps(const AxisMap& map, const FilterKernel& filter, Wrap wrap);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_FILTERS_H_
