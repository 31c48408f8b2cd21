// Ellipses that pixels' reflections cover.
#include "ops/environment/probes.h"

#include <cmath>

namespace tessera::ops {
namespace {

// From pixel i of a row to pixel j of another, or the way back.
FootprintSide Side(const MirrorRow& row, int i, const MirrorRow& other, int j, double sign) {
  if (other.valid[j] != 1) return FootprintSide::None();
  return FootprintSide::Of(
      {sign * (other.x[j] - row.x[i]), sign * (other.y[j] - row.y[i]), sign * (other.z[j] - row.z[i])});
}

// The level whose texels are as wide, and what is mixed in of the next.
void SetLevel(const EnvironmentMips& mips, PixelProbes* p) {
  const double angle = std::log2(p->grid.width), map = mips.map_angle(), first = mips.first_angle();
  if (!(angle > map)) return;
  const double level =
      angle < first ? (angle - map) / (first - map) : std::min(angle - first + 1, double{1} * mips.last());
  p->level = static_cast<int>(level);
  p->next = level - p->level;
}

}  // namespace

void FindReflectionProbes(const EnvironmentMips& mips, ProbeFilter filter, int anisotropy,
                          const MirrorRow& above, const MirrorRow& row, const MirrorRow& below, int count,
                          PixelProbes* probes) {
  const double texel = std::exp2(mips.map_angle());
  FootprintSide before = Side(row, 1, row, 0, -1);
  for (int k = 0; k < count; ++k) {
    const int i = k + 1;
    PixelProbes& p = probes[k];
    p = {};
    const FootprintSide after = Side(row, i, row, i + 1, 1);
    const Vector3 across = StepBetween(before, after);
    before = row.valid[i] == 1 ? after : FootprintSide::None();
    if (row.valid[i] != 1) continue;
    PixelFootprint f =
        PixelFootprint::Of(across, StepBetween(Side(row, i, above, i, -1), Side(row, i, below, i, 1)));
    if (!(f.longer > texel * texel)) continue;
    // No chord is longer than two; half as long is wide enough, and no sum with a direction is nothing.
    if (f.longer > 1) {
      const double over = 1 / std::sqrt(f.longer);
      for (double& v : f.major) v *= over;
      f.longer = 1;
    }
    p.plain = false;
    p.at[0] = row.x[i], p.at[1] = row.y[i], p.at[2] = row.z[i];
    p.grid = ProbeGrid::Of(f, filter, anisotropy, texel, 1);
    SetLevel(mips, &p);
  }
}

}  // namespace tessera::ops
