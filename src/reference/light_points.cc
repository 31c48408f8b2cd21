// Reference of small lights: a disc's part of a pixel by Green's theorem along the pixel's edges, a Gaussian
// by Simpson's rule.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/outline.h"

namespace tessera::reference {
namespace {

using Place = std::array<double, 2>;

// Twice the area of the sector between two directions.
double Sector(const Place& a, const Place& b, double r) {
  return r * r * std::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
}
// Twice the area between the middle of a disc and the part of an edge a b within it, the arc where it is not.
double Swept(const Place& a, const Place& b, double r) {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  const double square = dx * dx + dy * dy, along = a[0] * dx + a[1] * dy;
  const double root = along * along - square * (a[0] * a[0] + a[1] * a[1] - r * r);
  if (root <= 0) return Sector(a, b, r);
  const double t0 = std::clamp((-along - std::sqrt(root)) / square, 0.0, 1.0),
               t1 = std::clamp((-along + std::sqrt(root)) / square, 0.0, 1.0);
  const Place p = {a[0] + t0 * dx, a[1] + t0 * dy}, q = {a[0] + t1 * dx, a[1] + t1 * dy};
  if (!(t1 > t0)) return Sector(a, b, r);
  return (t0 > 0 ? Sector(a, p, r) : 0) + (p[0] * q[1] - p[1] * q[0]) + (t1 < 1 ? Sector(q, b, r) : 0);
}
double DiscOf(double x, double y, double r) {
  const Place corners[4] = {{x - 0.5, y - 0.5}, {x + 0.5, y - 0.5}, {x + 0.5, y + 0.5}, {x - 0.5, y + 0.5}};
  double sum = 0;
  for (size_t k = 0; k < 4; ++k) sum += Swept(corners[k], corners[(k + 1) % 4], r);
  return sum / 2;
}

double GaussianOf(double x, double deviation) {
  // A pixel is many deviations wide where a light is small: only what is near its middle counts.
  const double low = std::max(x - 0.5, -9 * deviation), high = std::min(x + 0.5, 9 * deviation);
  if (!(high > low)) return 0;
  constexpr int kSteps = 400;
  const double h = (high - low) / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = (low + i * h) / deviation;
    sum += (i == 0 || i == kSteps ? 1 : i % 2 != 0 ? 4 : 2) * std::exp(-0.5 * t * t);
  }
  return sum * h / 3;
}

void Evaluate(const Call& call) {
  const auto& [shown, p] =
      std::any_cast<const std::pair<std::vector<ShownLight>, LightPointsParams>&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    // Near before far: what each adds through those before it.
    double sum = 0, through = 1, size = 1;
    for (size_t k = shown.size(); k-- > 0;) {
      const ShownLight& s = shown[k];
      const double dx = x + 0.5 - s.x, dy = y + 0.5 - s.y, deviation = s.size / std::sqrt(8.0);
      double part = 0;
      if (p.shape == LightShape::kDisc) {
        if (std::max(std::fabs(dx), std::fabs(dy)) < 0.5 * s.size + 0.5) part = DiscOf(dx, dy, 0.5 * s.size);
      } else {
        const double reach = 5 * deviation + 0.5;
        if (std::max(std::fabs(dx), std::fabs(dy)) < reach)
          part = GaussianOf(dx, deviation) * GaussianOf(dy, deviation);
      }
      const double alpha = s.alpha * part, color = c < 3 ? s.color[static_cast<size_t>(c)] : 1;
      sum += through * alpha * color;
      if (c == 3 || !p.adds) through *= 1 - alpha;
      size += p.adds ? std::fabs(alpha * color) : 0;
      size = std::max(size, std::fabs(color));
    }
    return std::pair(sum, size);
  });
}

}  // namespace

std::vector<Entry> LightPointsEntries() { return {{"lightpoints", Evaluate}}; }

}  // namespace tessera::reference
