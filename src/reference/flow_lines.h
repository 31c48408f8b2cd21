// The lines of the reference of line integral convolution, tap by tap.
#ifndef TESSERA_REFERENCE_FLOW_LINES_H_
#define TESSERA_REFERENCE_FLOW_LINES_H_

#include <cmath>
#include <vector>

#include "reference/flow_scene.h"
#include "reference/flow_weights.h"

namespace tessera::reference::flow {

// Positions of taps 1 to n from a start; `parts` steps of the integrator for each.
inline std::vector<Point> Follow(const Scene& scene, const LicParams& p, Point at, double sign, int parts) {
  std::vector<Point> line;
  const double h = sign * p.step / parts;
  for (int i = 0; i < Taps(p); ++i) {
    for (int k = 0; k < parts; ++k) {
      const Point k1 = scene.Velocity(at);
      if (p.integrator == LicIntegrator::kEuler) {
        at = at + h * k1;
      } else if (p.integrator == LicIntegrator::kMidpoint) {
        at = at + h * scene.Velocity(at + 0.5 * h * k1);
      } else {
        const Point k2 = scene.Velocity(at + 0.5 * h * k1), k3 = scene.Velocity(at + 0.5 * h * k2);
        const Point k4 = scene.Velocity(at + h * k3);
        at = at + (h / 6) * (k1 + 2 * k2 + 2 * k3 + k4);
      }
    }
    line.push_back(at);
  }
  return line;
}

// The same from pixel to pixel; (fx, fy) is where in the first one the line starts.
inline std::vector<Point> FollowCells(const Scene& scene, const LicParams& p, int x, int y, double fx,
                                      double fy, double sign) {
  std::vector<Point> line;
  for (int i = 0; i < Taps(p); ++i) {
    const Point v = sign * scene.Code(x, y);
    if (v.x != 0 || v.y != 0) {
      const double left_x = v.x > 0 ? 1 - fx : fx, left_y = v.y > 0 ? 1 - fy : fy;
      const double size_x = std::fabs(v.x), size_y = std::fabs(v.y);
      // Into a corner: first along the larger component.
      const double to_x = left_x * size_y, to_y = left_y * size_x;
      if (to_x < to_y || (to_x == to_y && size_x > size_y)) {
        x += v.x > 0 ? 1 : -1, fx = v.x > 0 ? 0 : 1, fy += left_x / size_x * v.y;
      } else {
        y += v.y > 0 ? 1 : -1, fy = v.y > 0 ? 0 : 1, fx += left_y / size_y * v.x;
      }
    }
    line.push_back({static_cast<double>(x), static_cast<double>(y)});
    x = scene.X(x), y = scene.Y(y);
  }
  return line;
}

}  // namespace tessera::reference::flow

#endif  // TESSERA_REFERENCE_FLOW_LINES_H_
