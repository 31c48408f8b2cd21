// Gardner's product of sums of sines on rows of a grid, by angle addition from tables per axis; and rings of
// water.
#ifndef TESSERA_OPS_NOISE_GARDNER_H_
#define TESSERA_OPS_NOISE_GARDNER_H_

#include <array>
#include <vector>

#include "ops/noise/texture_shade.h"
#include "tessera/ops/texture.h"
#include "tessera/roi.h"

namespace tessera::ops {

inline constexpr int kMaxGardnerTerms = 12;

// The sines of a texture: the clouds' own ones, or the parameters' for kGardner.
TextureParams GardnerOf(const TextureParams& params);
// How far the first sines have drifted, radians; looped, by whole turns.
double GardnerDrift(const TextureParams& params);

class GardnerRows {
 public:
  GardnerRows(const TextureParams& params, const Roi& columns);
  void Row(int y, int x0, int x1, float* out) const;

 private:
  double Angle(int axis, int term, double units) const;

  TextureParams params_;
  int x0_ = 0;
  // Per column and term: sine and cosine of f_i x, and those of the phases that x gives to the other factors.
  std::vector<std::array<float, 4>> columns_;
};

// Displacement x and y and height of three drops' rings, around 1/2.
Rgba Ripples(const TexturePlace& place, float rings, float time, uint32_t seed);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_GARDNER_H_
