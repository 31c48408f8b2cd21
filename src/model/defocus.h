// How far out of focus a depth is: what depth of field and its reference both go by.
#ifndef TESSERA_MODEL_DEFOCUS_H_
#define TESSERA_MODEL_DEFOCUS_H_

#include <algorithm>
#include <cmath>

#include "tessera/ops/accumulate.h"

namespace tessera::ops {

// Radii come in levels: steps of 1/8 pixel up to 8 pixels, then of 1/64 of themselves. Up to kSharpLevel a
// disc lies within its own pixel.
inline constexpr int kSharpLevel = 4;
inline constexpr double kFarthestShift = 1e6;

inline int LevelOf(double radius) {
  return static_cast<int>(radius <= 8 ? std::lround(8 * radius)
                                      : 64 + std::lround(64 * std::log(radius / 8)));
}
// At most `largest`, of which `level` is not above the level.
inline double LevelRadius(int level, double largest) {
  return std::min(largest, level <= 64 ? level / 8.0 : 8 * std::exp((level - 64) / 64.0));
}

// What is behind the focus moves with the place on the lens, what is before it against that: the sign.
struct Defocus {
  float shift = 0;  // radius in pixels, negative before the focus, not limited
  int level = -1;   // of the limited radius; -1: no depth
  int layer = 0;    // of what may hide others, ascending from near to far; 0: sharp
};

inline Defocus DefocusOf(const DepthOfFieldParams& p, double depth) {
  Defocus d;
  if (!(depth > 0)) return d;
  const double shift = std::clamp(p.aperture * (1 / p.focus - 1 / depth), -kFarthestShift, kFarthestShift);
  d.shift = static_cast<float>(shift);
  const int whole = LevelOf(std::fabs(shift));
  d.level = std::min(whole, LevelOf(p.max_radius));
  const int layer = d.level <= kSharpLevel ? 0 : 1 + (whole - kSharpLevel - 1) / 4;
  d.layer = shift < 0 ? -layer : layer;
  return d;
}

// How far a disc reaches, in whole pixels; what is hidden is looked for no farther.
inline int LensReach(double largest) { return static_cast<int>(std::floor(largest + 0.5)); }

// A step of more than this from a pixel to its neighbour is where one surface ends before another.
inline constexpr float kSurfaceStep = 1;

}  // namespace tessera::ops

#endif  // TESSERA_MODEL_DEFOCUS_H_
