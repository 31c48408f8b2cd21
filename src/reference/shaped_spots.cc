// Reference of spot noise shaped by a surface's parameterisation: every pixel looks at the spots around it.
#include "tessera/ops/shaped_spots.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <numbers>
#include <vector>

#include "reference/noise_lattice.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

double CellPixels(const ShapedSpotParams& p) { return std::max(p.frame.width(), 1) / p.frequency; }

// The metric of the surface at a texel: dP/dx . dP/dx, dP/dx . dP/dy, dP/dy . dP/dy.
std::array<double, 3> Metric(const ImageD& position, const Roi& data, int x, int y) {
  const int x0 = std::max(x - 1, data.x0), x1 = std::min(x + 1, data.x1 - 1);
  const int y0 = std::max(y - 1, data.y0), y1 = std::min(y + 1, data.y1 - 1);
  std::array<double, 3> metric = {};
  for (int c = 0; c < std::min(position.channels, 3); ++c) {
    const double du = x1 > x0 ? (position.at(x1, y, c) - position.at(x0, y, c)) / (x1 - x0) : 0;
    const double dv = y1 > y0 ? (position.at(x, y1, c) - position.at(x, y0, c)) / (y1 - y0) : 0;
    metric[0] += du * du, metric[1] += du * dv, metric[2] += dv * dv;
  }
  return metric;
}

void Evaluate(const Call& call) {
  const auto& p = std::any_cast<const ShapedSpotParams&>(call.parameters);
  const double cell = CellPixels(p);
  const Roi& data = call.out_spec.data_window;
  // Campbell: density per cell^2 times the energy of a round spot of one cell, pi / 5.
  const double filling = 1 / (3 * std::sqrt(p.density * std::numbers::pi / 5));
  ForEachSample(call, [&](int x, int y, int) -> std::pair<double, double> {
    double sum = 0, off = 0;
    const auto at = [&](int pixel, int corner) {
      return static_cast<int>(std::floor((pixel - corner + 0.5) / cell));
    };
    const int i0 = at(x, p.frame.x0), j0 = at(y, p.frame.y0);
    for (int j = j0 - 1; j <= j0 + 1; ++j) {
      for (int i = i0 - 1; i <= i0 + 1; ++i) {
        for (const LatticeSpot& s : LatticeSpots(i, j, p.seed, p.density)) {
          const double cx = p.frame.x0 + (i + s.x) * cell, cy = p.frame.y0 + (j + s.y) * cell;
          const int tx = std::clamp(static_cast<int>(std::floor(cx)), data.x0, data.x1 - 1);
          const int ty = std::clamp(static_cast<int>(std::floor(cy)), data.y0, data.y1 - 1);
          const auto [e, f, g] = Metric(call.in[0], data, tx, ty);
          const double determinant = e * g - f * f, half = (e + g) / 2;
          if (!(determinant > 1e-6 * half * half) || !std::isfinite(determinant)) continue;
          const double least = determinant / (half + std::hypot((e - g) / 2, f));
          double square = least * cell * cell;  // of the radius on the surface
          if (p.radius > 0) square = std::min(square, p.radius * p.radius);
          const double height = filling * std::sqrt(std::sqrt(determinant) * cell * cell / square);
          const double dx = x + 0.5 - cx, dy = y + 0.5 - cy;
          const double t = 1 - (e * dx * dx + 2 * f * dx * dy + g * dy * dy) / square;
          if (!(t > 0)) continue;
          sum += s.sign * height * t * t;
          // Sums are doubles; what a nearly singular metric makes of their roundings is less than this.
          off += 0x1p-8 * height;
        }
      }
    }
    const double value = p.is_signed ? sum : 0.5 + 0.5 * sum;
    // The factor that all spots share is a float.
    return {value, std::fabs(value) + (p.is_signed ? 1 : 0.5) * std::fabs(sum) + off};
  });
}

Roi Input(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const ShapedSpotParams&>(parameters);
  const int reach = static_cast<int>(std::ceil(2 * CellPixels(p))) + 2;
  return {out.x0 - reach, out.y0 - reach, out.x1 + reach, out.y1 + reach};
}

}  // namespace

std::vector<Entry> ShapedSpotsEntries() { return {{"shapedspots", Evaluate, Input}}; }

}  // namespace tessera::reference
