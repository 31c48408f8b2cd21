// Look-ups over what pixels cover, in double.
#include "reference/probes.h"

#include <algorithm>
#include <cmath>

namespace tessera::reference {

Vector3 MeanStep(std::optional<Vector3> before, std::optional<Vector3> after) {
  const auto number = [](const std::optional<Vector3>& v) { return v && Dot(*v, *v) <= 1e100; };
  if (!number(before) && !number(after)) return {};
  if (!number(before)) return *after;
  if (!number(after)) return *before;
  const double b = Dot(*before, *before), a = Dot(*after, *after);
  Vector3 sum = {};
  if (a + b == 0) return sum;
  const bool back = Dot(*before, *after) < -0x1p-30 * std::sqrt(a * b);
  for (size_t k = 0; k < 3; ++k)
    sum[k] = (*before)[k] * (a / (a + b)) + (back ? -1 : 1) * (*after)[k] * (b / (a + b));
  return sum;
}

Ellipse EllipseOf(const Vector3& across, const Vector3& down) {
  const double twice = 2 * Dot(across, down), more = Dot(across, across) - Dot(down, down);
  // A circle's axes are the pixel's.
  const bool round = std::hypot(twice, more) <= 0x1p-29 * (Dot(across, across) + Dot(down, down));
  const double angle = round ? 0 : 0.5 * std::atan2(twice, more);
  const double x = std::cos(angle), y = std::sin(angle);
  Ellipse e;
  for (size_t k = 0; k < 3; ++k) {
    e.major[k] = x * across[k] + y * down[k];
    e.minor[k] = x * down[k] - y * across[k];
  }
  e.longer = std::sqrt(Dot(e.major, e.major));
  // The area is the cross product's length.
  const Vector3 normal = Cross(across, down);
  e.shorter = e.longer > 0 ? std::sqrt(Dot(normal, normal)) / e.longer : 0;
  return e;
}

Probes ProbesOver(const Ellipse& e, bool ewa, double anisotropy, double texel, double widest, int more) {
  Probes probes;
  const bool bell = ewa && e.longer > texel;
  const double longer = std::max(std::min(e.longer, widest * anisotropy), texel);
  const double shorter = std::max({std::min(e.shorter, widest), texel, longer / anisotropy});
  const int rows = bell ? 5 : 1;
  const double ratio = rows * longer / shorter - 0x1p-20;
  probes.doubtful = std::fabs(ratio - std::round(ratio)) < 1e-8;
  const int columns = static_cast<int>(std::clamp(std::ceil(ratio) + more, 1.0, rows * anisotropy));
  // Diameters, of a pixel or of its bell, less what a texel's breadth does by itself.
  const double size = bell ? 1.5 : 1;
  probes.width = size * longer / columns;
  const double length = e.longer > 0 ? size * std::sqrt(longer * longer - texel * texel) / e.longer : 0;
  const double breadth =
      e.shorter > 1e-6 * e.longer ? size * std::sqrt(shorter * shorter - texel * texel) / e.shorter : 0;
  double sum = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double u = (2 * i + 1.0) / columns - 1, v = (2 * j + 1.0) / rows - 1;
      const double weight = bell ? std::exp(-2 * (u * u + v * v)) - std::exp(-2.0) : 1;
      if (weight <= 0) continue;
      Probe probe{{}, weight};
      for (size_t k = 0; k < 3; ++k)
        probe.off[k] = u / 2 * length * e.major[k] + v / 2 * breadth * e.minor[k];
      probes.all.push_back(probe), sum += weight;
    }
  }
  for (Probe& p : probes.all) p.weight /= sum;
  return probes;
}

}  // namespace tessera::reference
