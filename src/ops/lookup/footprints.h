// Lookups over what a pixel covers of a table: ellipses by the coordinates of neighbouring pixels, means of
// linear lookups in two levels of a mip chain.
#ifndef TESSERA_OPS_LOOKUP_FOOTPRINTS_H_
#define TESSERA_OPS_LOOKUP_FOOTPRINTS_H_

#include <cstddef>
#include <vector>

#include "ops/geometry/pixel_footprint.h"
#include "ops/lookup/lookup_stage.h"

namespace tessera::ops {

// Coordinate a of a pixel, after the division; NaN behind the projector.
float CoordinateAt(const LookupPlan& plan, const ConstImageView& coords, int x, int y, int a);

constexpr bool IsFootprintFilter(TableFilter filter) {
  return filter == TableFilter::kTrilinear || filter == TableFilter::kEwa;
}

class LookupFootprints {
 public:
  explicit LookupFootprints(const LookupPlan& plan);

  // Of the pixels (x .. x + count - 1, y); `coords` has their neighbours too.
  void Find(const ConstImageView& coords, int x, int y, int count, PixelProbes* probes) const;

  // Replaces kTexel floats of each pixel that needs more than one lookup. `look` turns the first coordinates
  // of a chunk, so many, into its results: look(level, count).
  template <int kTexel, class Chunk, class Look>
  void Gather(const PixelProbes* probes, int count, Chunk& chunk, float* result, const Look& look) const {
    constexpr int kRun = static_cast<int>(sizeof(chunk.coord[0]) / sizeof(float));
    const auto put = [&](int slot, const double(&at)[3], const Vector3& place) {
      for (int a = 0; a < plan_.dims; ++a)
        chunk.coord[a][slot] = static_cast<float>(at[a] + place[static_cast<size_t>(a)]);
    };
    GatherProbes<kRun, kTexel>(probes, count, result, put, [&](int level, int held) {
      look(level, held);
      return chunk.result;
    });
  }

 private:
  FootprintSide Side(const ConstImageView& coords, int x, int y, int nx, int ny, double sign) const;
  bool Locate(const ConstImageView& coords, int x, int y, PixelProbes* p) const;

  const LookupPlan& plan_;
  ProbeFilter filter_;
  double entries_[3] = {};     // per unit of a coordinate; 0 along axes of one entry
  std::vector<double> cells_;  // of every level, in entries of level 0
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_FOOTPRINTS_H_
