// Where a height's horizon is looked for: the pixels along rays to all sides.
#ifndef TESSERA_MODEL_HORIZON_H_
#define TESSERA_MODEL_HORIZON_H_

#include <cmath>
#include <numbers>
#include <vector>

namespace tessera::model {

// A pixel's offset, and how far away it is.
struct HorizonPlace {
  int dx = 0, dy = 0;
  double distance = 1;
};

// Ray k of `directions`: at steps of one pixel the nearest pixel, each once.
inline std::vector<HorizonPlace> HorizonRay(int k, int directions, int radius) {
  const double angle = 2 * std::numbers::pi * k / directions;
  std::vector<HorizonPlace> places;
  for (int r = 1; r <= radius; ++r) {
    // Off the ties of whole pixels, which the last bit of a sine would decide.
    const auto nearest = [](double v) { return static_cast<int>(std::lround(v * (1 - 1e-9))); };
    const int dx = nearest(r * std::cos(angle)), dy = nearest(r * std::sin(angle));
    if (!places.empty() && places.back().dx == dx && places.back().dy == dy) continue;
    places.push_back({dx, dy, std::hypot(dx, dy)});
  }
  return places;
}

}  // namespace tessera::model

#endif  // TESSERA_MODEL_HORIZON_H_
