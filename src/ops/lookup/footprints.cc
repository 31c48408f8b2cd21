// What pixels cover of a table.
#include "ops/lookup/footprints.h"

#include <cmath>
#include <limits>

namespace tessera::ops {

float CoordinateAt(const LookupPlan& plan, const ConstImageView& coords, int x, int y, int a) {
  const auto* const p = reinterpret_cast<const float*>(coords.At(x, y));
  const float v = p[plan.axes[static_cast<size_t>(a)]];
  if (!plan.params.projective) return v;
  const float q = p[plan.axes[static_cast<size_t>(plan.dims)]];
  return q >= std::numeric_limits<float>::min() ? v / q : std::numeric_limits<float>::quiet_NaN();
}

LookupFootprints::LookupFootprints(const LookupPlan& plan)
    : plan_(plan),
      filter_(plan.params.filter == TableFilter::kEwa ? ProbeFilter::kEwa : ProbeFilter::kTrilinear) {
  if (plan.groups.empty()) return;
  const auto& levels = plan.groups.front();
  const Grid& grid = *levels.front();
  for (int a = 0; a < grid.dims() && a < 3; ++a) {
    const GridAxis& axis = grid.axis(a);
    if (axis.scale != 0) entries_[a] = axis.per_unit;
  }
  for (const auto& level : levels) {
    double widest = 1;
    for (int a = 0; a < grid.dims() && a < 3; ++a) {
      if (!(entries_[a] > 0)) continue;
      // One entry of a table with entries at its ends stands for all of it.
      const double own = level->axis(a).per_unit;
      widest = std::max(widest, own > 0 ? entries_[a] / own : entries_[a] + 1);
    }
    cells_.push_back(widest);
  }
}

FootprintSide LookupFootprints::Side(const ConstImageView& coords, int x, int y, int nx, int ny,
                                     double sign) const {
  if (!plan_.window.Contains({nx, ny, nx + 1, ny + 1})) return FootprintSide::None();
  if (plan_.params.mask >= 0) {
    const float mask = reinterpret_cast<const float*>(coords.At(nx, ny))[plan_.params.mask];
    if (mask == 0 || std::isnan(mask)) return FootprintSide::None();
  }
  Vector3 step = {};
  for (int a = 0; a < plan_.dims; ++a) {
    if (!(entries_[a] > 0)) continue;
    const double here = CoordinateAt(plan_, coords, x, y, a), there = CoordinateAt(plan_, coords, nx, ny, a);
    step[static_cast<size_t>(a)] = sign * (there - here) * entries_[a];
  }
  return FootprintSide::Of(step);
}

// False where there is no place.
bool LookupFootprints::Locate(const ConstImageView& coords, int x, int y, PixelProbes* p) const {
  for (int a = 0; a < plan_.dims; ++a) {
    float s = CoordinateAt(plan_, coords, x, y, a);
    // Within a period, where a float tells a texel's parts apart.
    const Wrap wrap = plan_.groups.front().front()->axis(a).wrap;
    if (wrap == Wrap::kRepeat) s -= std::floor(s);
    if (wrap == Wrap::kMirror) s -= 2 * std::floor(0.5f * s);
    if (std::isnan(s)) return false;
    p->at[a] = s;
  }
  return true;
}

void LookupFootprints::Find(const ConstImageView& coords, int x, int y, int count,
                            PixelProbes* probes) const {
  FootprintSide before = Side(coords, x, y, x - 1, y, -1);
  for (int i = 0; i < count; ++i, ++x) {
    PixelProbes& p = probes[i];
    p = {};
    const FootprintSide after = Side(coords, x, y, x + 1, y, 1);
    const Vector3 across = StepBetween(before, after);
    before = i + 1 < count && plan_.params.mask >= 0 ? Side(coords, x + 1, y, x, y, -1) : after;
    const Vector3 down = StepBetween(Side(coords, x, y, x, y - 1, -1), Side(coords, x, y, x, y + 1, 1));
    const PixelFootprint footprint = PixelFootprint::Of(across, down);
    if (!(footprint.longer > 1) || !Locate(coords, x, y, &p)) continue;
    p.plain = false;
    p.grid = ProbeGrid::Of(footprint, filter_, plan_.params.anisotropy, 1, 4 * cells_.back());
    size_t k = 0;
    while (k + 1 < cells_.size() && cells_[k + 1] <= p.grid.width) ++k;
    if (k + 1 < cells_.size())
      p.next = std::max(0.0, (p.grid.width - cells_[k]) / (cells_[k + 1] - cells_[k]));
    p.level = static_cast<int>(k);
    for (size_t a = 0; a < 3; ++a) {  // to coordinates
      const double unit = entries_[a] > 0 ? 1 / entries_[a] : 0;
      p.grid.step_along[a] *= unit, p.grid.step_across[a] *= unit;
    }
  }
}

}  // namespace tessera::ops
