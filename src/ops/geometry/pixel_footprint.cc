// Ellipses that pixels cover, from neighbours' coordinates, and grids of look-ups over them.
#include "ops/geometry/pixel_footprint.h"

#include <limits>

namespace tessera::ops {
namespace {

// Decisions that exact pictures would leave to rounding are taken by this much.
constexpr double kHair = 0x1p-30;

Vector3 Sum(double a, const Vector3& x, double b, const Vector3& y) {
  return {a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]};
}
double Product(const Vector3& x, const Vector3& y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; }
Vector3 Scaled(double a, const Vector3& x) { return {a * x[0], a * x[1], a * x[2]}; }

}  // namespace

FootprintSide FootprintSide::None() { return {{}, std::numeric_limits<double>::infinity()}; }
FootprintSide FootprintSide::Of(const Vector3& step) {
  const double square = Product(step, step);
  return square <= 1e100 ? FootprintSide{step, square} : None();
}

Vector3 StepBetween(const FootprintSide& before, const FootprintSide& after) {
  if (std::isinf(before.square)) return after.step;  // none either: 0
  if (std::isinf(after.square)) return before.step;
  const double both = before.square + after.square;
  if (!(both > 0)) return {};
  const bool back = Product(before.step, after.step) < -kHair * std::sqrt(before.square * after.square);
  return Sum(after.square / both, before.step, (back ? -1 : 1) * before.square / both, after.step);
}

PixelFootprint PixelFootprint::Of(const Vector3& across, const Vector3& down) {
  const double a = Product(across, across), b = Product(across, down), c = Product(down, down);
  const double d = std::sqrt((a - c) * (a - c) / 4 + b * b);
  PixelFootprint f;
  f.longer = (a + c) / 2 + d;
  // Twice the angle, in the pixel's plane, that the longer axis comes from; its half by that of the larger
  // cosine.
  const bool round = !(d > kHair * (a + c));
  const double twice = round ? 1 : (a - c) / (2 * d);
  double x = std::sqrt(std::max(0.0, (1 + twice) / 2)), y = std::sqrt(std::max(0.0, (1 - twice) / 2));
  if (!round && twice >= 0) y = b / (2 * d * x);
  if (!round && twice < 0) x = b / (2 * d * y);
  f.major = Sum(x, across, y, down), f.minor = Sum(-y, across, x, down);
  f.shorter = Product(f.minor, f.minor);
  return f;
}

ProbeGrid ProbeGrid::Of(const PixelFootprint& f, ProbeFilter filter, int anisotropy, double texel,
                        double widest) {
  // Of the circle whose image the ellipse is, in pixels: its bell spreads as much as a pixel's square.
  constexpr double kRadius = 0.75;
  ProbeGrid grid;
  const FootprintAxes axes(f.longer, f.shorter, texel, widest, anisotropy);
  const double length = std::sqrt(axes.longer), breadth = std::sqrt(axes.shorter);
  grid.bell = filter == ProbeFilter::kEwa && f.longer > texel * texel;
  grid.across = grid.bell ? kAcross : 1;
  grid.along = ProbeCount(length * grid.across, breadth, grid.across * anisotropy);
  grid.width = (grid.bell ? 2 * kRadius : 1) * length / grid.along;
  // A texel's breadth is what each look-up has by itself: so nothing jumps where footprints grow beyond it.
  const auto step = [&](const Vector3& axis, double square, double limited, int count) {
    const double extent = std::sqrt(std::max(0.0, limited - texel * texel));
    // Without a breadth there is no direction.
    if (!(square > 1e-12 * f.longer)) return Vector3{};
    return Scaled((grid.bell ? 2 * kRadius : 1) * extent / std::sqrt(square) / count, axis);
  };
  grid.step_along = step(f.major, f.longer, axes.longer, grid.along);
  grid.step_across = step(f.minor, f.shorter, axes.shorter, grid.across);
  return grid;
}

}  // namespace tessera::ops
