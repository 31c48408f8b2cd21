// Noise of one octave in double precision: every kind and lattice, with slopes.
#ifndef TESSERA_REFERENCE_NOISE_LATTICE_H_
#define TESSERA_REFERENCE_NOISE_LATTICE_H_

#include <array>
#include <cstdint>

#include "tessera/ops/noise.h"

namespace tessera::reference {

// A lattice position: cells modulo 2^32 or the period, and fractions.
struct NoisePlace {
  std::array<uint32_t, 4> cell = {};
  std::array<double, 4> fraction = {};
};

struct NoiseValue {
  double value = 0;
  double scale = 1;  // what its error bound is a multiple of
  std::array<double, 4> slope = {};
};

// One octave; `channel` is -1 but for OSL's colour noise.
NoiseValue EvaluateNoise(const NoiseParams& params, uint32_t seed, const std::array<uint32_t, 4>& period,
                         int channel, const NoisePlace& place);

// A whole noise at a pixel of its grid.
double GridNoise(const NoiseParams& params, int x, int y);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_NOISE_LATTICE_H_
