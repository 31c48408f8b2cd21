// Reference of Gabor noise: the sum over impulses as Lagae et al. 2009 write it, in double.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/gabor_lattice.h"
#include "reference/noise_lattice.h"

namespace tessera::reference {
namespace {

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector Unit(const Vector& v) {
  const double length = std::sqrt(Dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

// A kernel's envelope at a distance in waves, with its derivative by the square of the distance in radii.
struct Envelope {
  double value = 0, slope = 0;
};
Envelope EnvelopeAt(double t) {
  if (t >= 1) return {};
  const double gauss = std::exp(-model::kGaborEnd * t), end = 1 - std::pow(t, 8);
  return {gauss * end * end, gauss * (-model::kGaborEnd * end * end - 2 * end * 8 * std::pow(t, 7))};
}

// The integral of a kernel's square over space, its phase averaged out: Simpson's rule.
double Energy(int dims, double radius) {
  constexpr int kSteps = 2000;
  const double surface[] = {0, 2, 2 * std::numbers::pi, 4 * std::numbers::pi};
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double r = static_cast<double>(i) / kSteps, g = EnvelopeAt(r * r).value;
    const double weight = i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * std::pow(r, dims - 1) * g * g;
  }
  return 0.5 * surface[dims] * std::pow(radius, dims) * sum / (3.0 * kSteps);
}

// The turned direction of the parameters.
Vector Along(const NoiseParams& p) {
  Vector v = {p.direction[0], p.dims > 1 ? p.direction[1] : 0, p.dims > 2 ? p.direction[2] : 0};
  for (double& c : v)
    c /= std::max({std::fabs(p.direction[0]), p.dims > 1 ? std::fabs(p.direction[1]) : 0.0,
                   p.dims > 2 ? std::fabs(p.direction[2]) : 0.0});
  v = Unit(v);
  if (p.dims < 2) return v;
  const double angle = -std::fmod(p.angle, 360.0) * std::numbers::pi / 180;  // y is down
  return {std::cos(angle) * v[0] - std::sin(angle) * v[1], std::sin(angle) * v[0] + std::cos(angle) * v[1],
          v[2]};
}

}  // namespace

NoiseValue GaborNoise(const NoiseParams& p, const std::vector<GaborImpulse>& impulses, double cell) {
  const auto dims = static_cast<size_t>(p.dims);
  const double radius = model::GaborRadius(p.bandwidth);
  // A cell holds `per_cell` impulses; the mean of the noise's square is their density times a kernel's
  // energy.
  const int per_cell = model::GaborImpulsesPerCell(p.impulses, p.bandwidth, p.dims, cell);
  const double height = 1 / (3 * std::sqrt(per_cell / cell * Energy(p.dims, radius)));
  Vector along = {1, 0, 0}, first = {}, second = {};
  if (p.orientation != GaborOrientation::kIsotropic) along = Along(p);
  if (p.orientation == GaborOrientation::kHybrid && p.dims == 3) {
    // Perpendicular to it and to the first axis that is not near it.
    size_t least = 0;
    while (std::fabs(along[least]) > 0.59) ++least;
    Vector axis = {};
    axis[least] = 1;
    first = Unit(Cross(axis, along));
    second = Cross(along, first);
  }
  NoiseValue n;
  n.scale = 1;
  for (const GaborImpulse& impulse : impulses) {
    double square = 0;
    for (size_t a = 0; a < dims; ++a) square += impulse.away[a] * impulse.away[a];
    const double t = square / (radius * radius);
    const Envelope envelope = EnvelopeAt(t);
    Vector wave = along;
    const double c = std::cos(impulse.azimuth), s = std::sin(impulse.azimuth);
    if (p.orientation == GaborOrientation::kHybrid && p.dims == 2) wave = {-along[1], along[0], 0};
    if (p.orientation == GaborOrientation::kHybrid && p.dims == 3) {
      for (size_t a = 0; a < 3; ++a) wave[a] = c * first[a] + s * second[a];
    }
    if (p.orientation == GaborOrientation::kIsotropic && p.dims == 2) wave = {c, s, 0};
    if (p.orientation == GaborOrientation::kIsotropic && p.dims == 3) {
      const double rho = std::sqrt(std::max(0.0, 1 - impulse.height * impulse.height));
      wave = {rho * c, rho * s, impulse.height};
    }
    const double angle = 2 * std::numbers::pi * (Dot(wave, impulse.away) + impulse.phase);
    n.value += height * envelope.value * std::cos(angle);
    // Places are off by some u radii, waves turn within one: by the more the longer the kernel is.
    n.scale += height * envelope.value * (1 + 2 * radius);
    for (size_t a = 0; a < dims; ++a) {
      n.slope[a] += height * (-2 * envelope.slope * impulse.away[a] / (radius * radius) * std::cos(angle) +
                              2 * std::numbers::pi * wave[a] * envelope.value * std::sin(angle));
    }
  }
  n.slope_scale = n.scale;
  return n;
}

}  // namespace tessera::reference
