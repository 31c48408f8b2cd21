// Distance fields drawn out along their columns.
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/number_text.h"
#include "model/volume_data.h"
#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {

Volume Drawn(const Volume& field, const DrawnParams& params) {
  if (field.empty()) throw Error("drawn field", "found an empty volume, expected a distance field");
  if (!params.slope) throw Error("drawn field", "found no slope, expected a function of x and z");
  if (!(params.depth >= 0)) {
    throw Error("drawn field", "found a depth of " + base::NumberText(params.depth) + ", expected 0 or more");
  }
  const VolumeSpec& spec = field.spec();
  Volume volume(spec);
  const model::VolumeData& from = *field.data();
  model::VolumeData& to = *volume.data();
  const auto width = static_cast<size_t>(spec.size[0]);
  const double deepest = params.iso - params.depth;
  std::vector<double> row(width), grows(width);
  for (int k = 0; k < spec.size[2]; ++k) {
    for (size_t i = 0; i < width; ++i) {
      const Vector3 p = spec.Position(static_cast<double>(i), 0, k);
      const double slope = params.slope(p[0], p[2]);
      if (!(slope >= 0))
        throw Error("drawn field", "found a slope of " + base::NumberText(slope) + ", expected 0 or more");
      grows[i] = slope * spec.spacing[1];
    }
    // What is drawn out of a voxel is what is drawn out of the next one that way, or its own.
    for (int at = 0; at < spec.size[1]; ++at) {
      const int j = params.down ? spec.size[1] - 1 - at : at;
      for (size_t i = 0; i < width; ++i) {
        const auto x = static_cast<int>(i);
        const double own = from.code_scale * from.Code(x, j, k) + from.code_bias;
        row[i] = at == 0 ? own : std::min(own, std::max(row[i], deepest) + grows[i]);
        to.SetCode(x, j, k, (row[i] - to.code_bias) / to.code_scale);
      }
    }
    from.Trim();
    to.Trim();
  }
  to.FillBorder();
  return volume;
}

}  // namespace tessera
