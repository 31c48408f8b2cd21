// Look-ups filtered over the footprint of a result pixel, whatever its direction: what a map that sees a
// picture obliquely needs. doc/maths/geometry.md, "Footprints".
#ifndef TESSERA_OPS_GEOMETRY_FOOTPRINT_H_
#define TESSERA_OPS_GEOMETRY_FOOTPRINT_H_

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/stage.h"
#include "graph/op.h"
#include "ops/geometry/gather.h"
#include "ops/geometry/pixel_footprint.h"
#include "tessera/image.h"

namespace tessera::ops {

enum class FootprintFilter { kTrilinear, kEwa };

// One level of a picture: pixels of 4 floats, each as large as cell_x by cell_y of the picture's.
struct FootprintLevel {
  std::vector<ConstImageView> groups;
  int width = 0, height = 0;
  double cell_x = 1, cell_y = 1;
  double cell() const { return cell_x > cell_y ? cell_x : cell_y; }
};

// The picture and its levels, down to one pixel.
class FootprintSource {
 public:
  FootprintSource(const ConstImageView& whole, Wrap wrap, const graph::Workers& workers);

  GatherSource picture;
  Wrap wrap;
  std::vector<FootprintLevel> levels;

 private:
  std::vector<Image> kept_;  // what the levels from 1 on show
};

struct FootprintJob {
  const FootprintSource& source;
  const double (&map)[9];  // of result centres to indices of the source: the centre of its first pixel is 0
  FootprintFilter filter;
  int anisotropy;
  ImageView out;
  std::span<const int> channels;  // of the source, for every channel of `out`
};
using FootprintFunction = void (*)(const FootprintJob&);

// For the SIMD target of this moment.
FootprintFunction ChooseFootprint();

// "trilinear" and "ewa".
bool IsFootprintFilter(const std::string& name);

// Input 0 whole, looked up where the map (of results to the source, both with centres at half-integers) says.
std::unique_ptr<graph::TileStage> MakeFootprintStage(const GatherMap& map, const std::string& filter,
                                                     int anisotropy, Wrap wrap,
                                                     const graph::StageContext& context);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_FOOTPRINT_H_
