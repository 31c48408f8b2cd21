// Reference of opacity volumes.
#include "reference/volume_opacity.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::reference {

double OpacityVolume::Through(const Vector3& p, double skew) const {
  const Vector3 way = point_ ? Add(light_, p, -1) : light_;
  const Vector3 l = Normalized(way);
  // The way to where the box ends, or the light is, without what planes cut away.
  double begin = 0, end = point_ ? Length(way) : std::numeric_limits<double>::infinity();
  const Vector3 low = v_.Low(), high = v_.High();
  for (size_t a = 0; a < 3; ++a) {
    if (l[a] == 0) {
      if (p[a] < low[a] || p[a] > high[a]) return 1;
      continue;
    }
    end = std::min(end, ((l[a] > 0 ? high : low)[a] - p[a]) / l[a]);
    begin = std::max(begin, ((l[a] > 0 ? low : high)[a] - p[a]) / l[a]);
  }
  for (const CuttingPlane& plane : p_.planes) {
    const double above = Dot(plane.normal, p) - plane.offset, rise = Dot(plane.normal, l);
    if (rise > 0) begin = std::max(begin, -above / rise);
    if (rise < 0) end = std::min(end, -above / rise);
    if (rise == 0 && above < 0) return 1;
  }
  if (!(begin < end)) return 1;
  const bool hyper = p_.mode <= VolumeMode::kHyper;
  const double step = p_.scatter.step;
  double depth = 0;
  for (auto i = static_cast<int64_t>(begin / step);; ++i) {
    const double from = static_cast<double>(i) * step, to = from + step;
    if (from >= end) break;
    const double length = std::min(to, end) - std::max(from, begin);
    if (length <= 0) continue;
    const Vector3 at = Add(p, l, from + 0.5 * step);
    const Substance::Matter matter =
        hyper ? substance_.Hyper(at, skew) : substance_.Density(at, Add(p, l, from), Add(p, l, to), skew);
    depth += matter.material.extinction * length;
  }
  return std::exp(-depth);
}

const OpacityVolume::Share& OpacityVolume::Node(int x, int y, int z) const {
  if (nodes_.empty()) {
    nodes_.assign(
        static_cast<size_t>(size_[0]) * static_cast<size_t>(size_[1]) * static_cast<size_t>(size_[2]),
        {1, -1});
  }
  const size_t at = (static_cast<size_t>(z) * static_cast<size_t>(size_[1]) + static_cast<size_t>(y)) *
                        static_cast<size_t>(size_[0]) +
                    static_cast<size_t>(x);
  Share& node = nodes_[at];
  if (node.off >= 0) return node;
  const Vector3 low = v_.Low(), high = v_.High();
  const int place[3] = {x, y, z};
  Vector3 p;
  for (size_t a = 0; a < 3; ++a) p[a] = low[a] + (high[a] - low[a]) * place[a] / (size_[a] - 1);
  node = {Through(p), 0};
  // A march of floats is off by a small part of a voxel; at hard edges that is another sample's value.
  const double by = 1e-4 * std::min({v_.spacing[0], v_.spacing[1], v_.spacing[2]});
  for (size_t a = 0; a < 3; ++a) {
    for (const double side : {-by, by}) {
      Vector3 q = p;
      q[a] = std::clamp(q[a] + side, low[a], high[a]);
      node.off = std::max(node.off, std::fabs(Through(q) - node.through));
    }
  }
  if (!substance_.ReadsNormals()) return node;
  for (const double skew : {-1.0, 1.0}) node.off += std::fabs(Through(p, skew) - node.through);
  return node;
}

OpacityVolume::Share OpacityVolume::At(const Vector3& p) const {
  const Vector3 low = v_.Low(), high = v_.High();
  int cell[3];
  double f[3];
  for (size_t a = 0; a < 3; ++a) {
    const double u = std::clamp((p[a] - low[a]) / (high[a] - low[a]), 0.0, 1.0) * (size_[a] - 1);
    cell[a] = std::min(static_cast<int>(u), size_[a] - 2);
    f[a] = u - cell[a];
  }
  Share sum = {0, 0};
  for (int c = 0; c < 8; ++c) {
    const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
    const double w = (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
    if (w == 0) continue;
    const Share& node = Node(cell[0] + i, cell[1] + j, cell[2] + k);
    sum.through += w * node.through;
    sum.off += w * node.off;
  }
  return sum;
}

}  // namespace tessera::reference
