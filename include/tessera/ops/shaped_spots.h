/// Spot noise on a texture that a surface stretches: every spot is shaped by the Jacobian where it lies.
/// @file
#ifndef TESSERA_OPS_SHAPED_SPOTS_H_
#define TESSERA_OPS_SHAPED_SPOTS_H_

#include <cstdint>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Parameters of ShapedSpots.
struct ShapedSpotParams {
  uint32_t seed = 0;      ///< of places and signs
  double frequency = 8;   ///< lattice cells across the width, (0, 65536]; cells are at least a pixel wide
  double density = 2;     ///< spots per cell, (0, 8]
  double radius = 0;      ///< of a spot on the surface, in its units, as far as the spot's cell allows;
                          ///< 0: every spot as large as its cell allows
  bool is_signed = true;  ///< false: 1/2 + value/2
  Roi frame = {};         ///< filled in by ShapedSpots()
};

/// `position` holds the surface's point at every texel in its first two or three channels. Spots lie where
/// kSpot's of the same seed and frequency do, one cell long along the direction that the surface stretches
/// least, and round on the surface: a spot at c is (1 - |J (p - c)|^2 / R^2)^2 with the Jacobian J = dP/d(x,
/// y) of central differences at the texel of c. Its height is scaled so that the standard deviation is 1/3
/// everywhere (Campbell's theorem). Where the Jacobian is not finite, or stretches one direction 1000 times
/// as much as the other, there is no spot. The result has one channel and position's windows. Error: 1e-6
/// times the sum of heights around a pixel. Cost: 15 to 30 ns per pixel. Throws Error for parameters outside
/// the ranges, and for fewer than two channels. Source: van Wijk 1991, 4; doc/maths/noise.md.
Node ShapedSpots(const Node& position, const ShapedSpotParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_SHAPED_SPOTS_H_
