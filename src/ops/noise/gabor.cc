// What Gabor noise is made of: its parameters' check, cells of impulses, directions, and standard deviation.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "base/number_text.h"
#include "base/turn.h"
#include "model/gabor_lattice.h"
#include "ops/noise/plan.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

using Vector = std::array<double, 3>;

// The unit vector of `direction`, turned by `angle`: y is down, the angle counter-clockwise.
Vector DirectionOf(const NoiseParams& p) {
  Vector v = {};
  for (size_t a = 0; a < static_cast<size_t>(p.dims); ++a) v[a] = p.direction[a];
  const base::Turn turn = base::TurnOf(p.angle);
  if (p.dims >= 2) v = {turn.cosine * v[0] + turn.sine * v[1], turn.cosine * v[1] - turn.sine * v[0], v[2]};
  const double largest = std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
  for (double& c : v) c /= largest;
  const double length = std::hypot(v[0], v[1], v[2]);
  for (double& c : v) c /= length;
  return v;
}

// The mean over a kernel's ball of its Gaussian's square, times half (a wave's): what a kernel adds to the
// variance, as a share of the ball's volume. Midpoints: the integrand is smooth.
double KernelPower(int dims) {
  constexpr int kSteps = 4096;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = (i + 0.5) / kSteps, end = 1 - std::pow(r, 16);
    const double g = std::exp(-model::kGaborEnd * r * r) * end * end;
    sum += std::pow(r, dims - 1) * g * g;
  }
  return 0.5 * dims * sum / kSteps;
}

}  // namespace

void CheckGabor(const std::string& op, const NoiseParams& p) {
  const auto require = [&](bool valid, const char* name, double found, const std::string& expected) {
    if (!valid) throw Error(op + ":" + name, "found " + base::NumberText(found) + ", expected " + expected);
  };
  require(p.dims <= 3, "dims", p.dims, "1 to 3 for gabor noise");
  require(p.bandwidth >= model::kLeastBandwidth && p.bandwidth <= model::kMostBandwidth, "bandwidth",
          p.bandwidth, "0.05 to 100 octaves");
  require(p.impulses >= 1 && p.impulses <= 32, "impulses", p.impulses, "1 to 32");
  bool some = false;
  for (int a = 0; a < p.dims; ++a) {
    const double v = p.direction[static_cast<size_t>(a)];
    require(std::isfinite(v), "direction", v, "finite numbers");
    some = some || v != 0;
  }
  if (!some && p.orientation != GaborOrientation::kIsotropic) {
    throw Error(op + ":direction", "found no direction among the first " + std::to_string(p.dims) +
                                       " coordinates, expected one that is not 0");
  }
  if (p.dims == 1 && p.orientation == GaborOrientation::kHybrid) {
    throw Error(op + ":orientation",
                "found hybrid, expected dims=2 or 3: nothing is perpendicular to a line");
  }
  const double radius = model::GaborRadius(p.bandwidth);
  for (int a = 0; a < p.dims; ++a) {
    const int period = p.period[static_cast<size_t>(a)];
    require(period == 0 || period >= radius, "period", period,
            "0, or " + std::to_string(static_cast<int>(std::ceil(radius))) +
                " cells or more: a kernel of bandwidth=" + base::NumberText(p.bandwidth) + " is " +
                base::NumberText(std::round(radius * 100) / 100) + " in radius");
  }
}

GaborShape GaborShapeOf(const NoiseParams& p) {
  GaborShape shape;
  const double radius = model::GaborRadius(p.bandwidth);
  shape.radius = static_cast<float>(radius);
  double volume = 1;
  for (int a = 0; a < std::min(p.dims, 3); ++a) {
    const double length = model::CellsOfGabor(p.bandwidth, p.period[static_cast<size_t>(a)]).length;
    shape.across[a] = static_cast<float>(length / radius);
    volume *= length;
  }
  shape.impulses = model::GaborImpulsesPerCell(p.impulses, p.bandwidth, p.dims, volume);
  shape.orientation = p.orientation;
  if (p.dims == 1 && p.orientation == GaborOrientation::kIsotropic)
    shape.orientation = GaborOrientation::kAnisotropic;
  if (shape.orientation == GaborOrientation::kIsotropic) return shape;
  Vector along = p.orientation == GaborOrientation::kIsotropic ? Vector{1, 0, 0} : DirectionOf(p);
  if (p.orientation == GaborOrientation::kHybrid && p.dims == 2) {
    along = {-along[1], along[0], 0};
    shape.orientation = GaborOrientation::kAnisotropic;
  }
  std::copy_n(along.begin(), 3, shape.direction);
  if (shape.orientation != GaborOrientation::kHybrid) return shape;
  // Two directions perpendicular to it and to each other, by way of the first axis that it is not near. No
  // usual direction has this coordinate, so that roundings do not choose another axis.
  size_t axis = 0;
  while (std::fabs(along[axis]) > 0.59) ++axis;
  const size_t next = (axis + 1) % 3, last = (axis + 2) % 3;
  const double length = std::hypot(along[next], along[last]);
  Vector first = {};
  first[next] = -along[last] / length, first[last] = along[next] / length;
  for (size_t a = 0; a < 3; ++a) {
    const size_t b = (a + 1) % 3, c = (a + 2) % 3;
    shape.basis[0][a] = static_cast<float>(first[a]);
    shape.basis[1][a] = static_cast<float>(along[b] * first[c] - along[c] * first[b]);
  }
  return shape;
}

double GaborHeight(const NoiseParams& p, const GaborShape& shape) {
  double cell = 1;  // in balls of radius 1
  for (int a = 0; a < p.dims; ++a) cell *= shape.across[a];
  const double ball[] = {1, 2, std::numbers::pi, 4 * std::numbers::pi / 3};
  const double variance = shape.impulses / cell * ball[p.dims] * KernelPower(p.dims);
  return 1 / (3 * std::sqrt(variance));
}

}  // namespace tessera::ops
