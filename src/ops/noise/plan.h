// A noise's parameters worked out: octaves with seeds, shifts and weights, and exact lattice positions.
#ifndef TESSERA_OPS_NOISE_PLAN_H_
#define TESSERA_OPS_NOISE_PLAN_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ops/noise/kernels.h"
#include "tessera/ops/noise.h"

namespace tessera::ops {

struct NoiseOctave {
  double scale = 1;                  // lacunarity^k
  double lattice[4] = {1, 1, 1, 1};  // lattice cells per cell of the first octave: scale, but for kGabor
  double shift[4] = {};
  float weight = 0;  // faded, with the mapping to the result's range
  uint32_t seed = 0;
  uint32_t period[4] = {};  // 0: none
};

struct NoisePlan {
  NoiseParams params;
  NoiseShape shape;
  double step[4] = {};               // per axis: cells per pixel on a grid, cells per unit at positions
  double shift[4] = {};              // offset, and on published lattices the seed's whole cells
  float bias = 0;                    // added to the sum of octaves
  std::vector<NoiseOctave> octaves;  // of nonzero weight
};

// One field makes every channel, or every channel has one: its parameters, and the channel it is made for.
bool HasFieldPerChannel(const NoiseParams& params);
NoiseParams FieldParams(const NoiseParams& params, int channel);
// Whether a noise's slopes are asked for.
inline bool HasSlopes(const NoiseParams& params) {
  return params.output == NoiseOutput::kGradient || params.output == NoiseOutput::kNormal;
}

// The result is this factor times the sum of the octaves, plus what is in the middle of its range: signed,
// and turbulence, the sum itself; billow and ridged by the sum of their weights, so that they fill [0, 1]
// however many octaves there are.
std::pair<double, double> ResultRange(const NoiseParams& params);
// What has channels enough for octaves side by side. Throws Error.
void CheckPacking(const std::string& op, const NoiseParams& params, int channels);

// What is special about kGabor: its kernel and impulses, with the factor that makes its standard deviation
// 1/3. Throws Error naming the parameter.
void CheckGabor(const std::string& op, const NoiseParams& params);
GaborShape GaborShapeOf(const NoiseParams& params);
double GaborHeight(const NoiseParams& params, const GaborShape& shape);

// Throws Error naming the parameter.
void CheckNoise(const std::string& op, const NoiseParams& params);
// `channel`: of kColor; 0 for the other outputs.
NoisePlan MakeNoisePlan(const NoiseParams& params, bool on_grid, int channel);

// A lattice coordinate: `cell` modulo 2^32, or in [0, period), and a fraction in [0, 1).
struct LatticePlace {
  uint32_t cell = 0;
  double fraction = 0;
};
// Pixels per cell of an octave, where they are a whole number; else 0.
int PixelsPerCell(const NoisePlan& plan, const NoiseOctave& octave);

// Of one octave at `units` steps (pixels) along an axis; exact to a rounding of the fraction.
LatticePlace PlaceOf(const NoisePlan& plan, const NoiseOctave& octave, int axis, double units);

// The mean of |n| of a kind, which faded octaves of a turbulence are replaced by: averages over grids, to
// about 0.01.
double MeanSize(NoiseKind kind, int dims);

// seed, octave and channel to the seed of a lattice.
uint32_t OctaveSeed(uint32_t seed, int octave, int channel);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_PLAN_H_
