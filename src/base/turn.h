// Cosine and sine of an angle in degrees, whatever its size.
#ifndef TESSERA_BASE_TURN_H_
#define TESSERA_BASE_TURN_H_

#include <cmath>
#include <numbers>

namespace tessera {
namespace base {

struct Turn {
  double cosine = 1, sine = 0;
};

// Whole turns are taken off exactly first, so that 1e30 degrees are what they say; exact at multiples of 90.
// NaN for what is not finite.
inline Turn TurnOf(double degrees) {
  const double reduced = std::remainder(degrees, 360.0);  // exact, in [-180, 180]
  const double quarter = std::nearbyint(reduced / 90);
  const double rest = (reduced - 90 * quarter) * std::numbers::pi / 180;
  if (std::isnan(rest)) return {rest, rest};
  const double c = std::cos(rest), s = std::sin(rest);
  switch (static_cast<int>(quarter) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

}  // namespace base
}  // namespace tessera

#endif  // TESSERA_BASE_TURN_H_
