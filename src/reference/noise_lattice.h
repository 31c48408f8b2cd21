// Noise of one octave in double precision: every kind and lattice, with slopes.
#ifndef TESSERA_REFERENCE_NOISE_LATTICE_H_
#define TESSERA_REFERENCE_NOISE_LATTICE_H_

#include <array>
#include <cstdint>
#include <vector>

#include "tessera/ops/noise.h"

namespace tessera::reference {

using NoiseCells = std::array<uint32_t, 4>;
using NoiseVector = std::array<double, 4>;

// Tessera's hash of a lattice point and its gradients.
uint32_t LatticeHash(const NoiseCells& cell, int dims, uint32_t seed);
NoiseVector LatticeGradient(uint32_t hash, int dims);
// final() of Bob Jenkins' lookup3, and the gradients of OSL's perlin noise.
uint32_t JenkinsFinal(uint32_t a, uint32_t b, uint32_t c);
NoiseVector OslGradient(uint32_t hash, int dims);

// A lattice position: cells modulo 2^32 or the period, and fractions.
struct NoisePlace {
  std::array<uint32_t, 4> cell = {};
  std::array<double, 4> fraction = {};
};

struct NoiseValue {
  double value = 0;
  double scale = 1;        // what its error bound is a multiple of
  double slope_scale = 0;  // and that of its slopes, where it is another
  std::array<double, 4> slope = {};
};

// One octave of simplex noise.
NoiseValue SimplexNoise(const NoiseParams& params, uint32_t seed, const NoiseCells& period, int channel,
                        const NoisePlace& place);

// One octave of Gabor noise from the impulses in the cells around a position: where they lie from it, in
// waves, with what is random about them. `cell`: the volume of a cell.
struct GaborImpulse {
  std::array<double, 3> away = {};
  double phase = 0;                // turns
  double azimuth = 0, height = 0;  // of a direction: around the third axis, and along it
};
NoiseValue GaborNoise(const NoiseParams& params, const std::vector<GaborImpulse>& impulses, double cell);

// A spot of kSpot in its cell: place in [0, 1), sign +-1; of octave 0 of a seed.
struct LatticeSpot {
  double x = 0, y = 0, sign = 1;
};
std::vector<LatticeSpot> LatticeSpots(int i, int j, uint32_t seed, double density);
// The seed of a noise's octave.
uint32_t OctaveSeed(uint32_t seed, int octave, int channel);

// One octave; `channel` is -1 but for OSL's colour noise. `tie`: where two points of cell noise are equally
// far, as floats have it, the other one is the nearest (1) or the second (2).
NoiseValue EvaluateNoise(const NoiseParams& params, uint32_t seed, const std::array<uint32_t, 4>& period,
                         int channel, const NoisePlace& place, int tie = 0);

// A whole noise at a pixel of its grid, read `right` and `down` of it, in widths of the frame.
NoiseValue GridNoise(const NoiseParams& params, int x, int y, double right = 0, double down = 0);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_NOISE_LATTICE_H_
