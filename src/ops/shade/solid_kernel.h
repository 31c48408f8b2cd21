// What the kernels of solid textures are made from.
#ifndef TESSERA_OPS_SHADE_SOLID_KERNEL_H_
#define TESSERA_OPS_SHADE_SOLID_KERNEL_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

// A colour ramp as sums of clamped segments: color + sum of slope_k * clamp(t - at_k, 0, at_{k+1} - at_k).
struct SolidStop {
  double at;
  double color[3];
};
inline constexpr SolidStop kMarbleRamp[] = {{0.0, {0.075, 0.085, 0.105}},
                                            {0.10, {0.24, 0.25, 0.27}},
                                            {0.35, {0.62, 0.61, 0.59}},
                                            {1.0, {0.90, 0.88, 0.84}}};
inline constexpr SolidStop kWoodRamp[] = {
    {0.0, {0.52, 0.27, 0.105}}, {0.55, {0.40, 0.18, 0.060}}, {1.0, {0.17, 0.062, 0.018}}};
// Marble's bands run across this direction of the block; wood's rings run around an axis along z through the
// middle.
inline constexpr double kMarbleAxis[3] = {0.8, 0.45, 0.3};
inline constexpr double kMarbleTurbulence = 0.9, kWoodBend = 0.55, kWoodGrain = 0.35, kWoodLate = 0.82;

struct SolidPlan {
  SolidParams params;
  int table_channels = 0;  // kTable: input 1 has so many
  int octaves = 0;         // level of detail: inputs 2 .. 1 + octaves hold them one by one
  bool spread = false;     // the last input is the distance between neighbouring p
  double mean = 0;         // what a faded octave of turbulence is worth
};
// Inputs: 0 the colour; kTable: 1 the looked-up texture; else 1 p, then the noise (marble and kNoise one, or
// octaves; wood the bend and the grain), then the spread.
std::unique_ptr<graph::PointStage> MakeSolidStage(const SolidPlan& plan);

// The largest distance along an axis of p to the neighbours on the same surface, along x and y: of both sides
// the smaller one. `in`: rows y - 1, y, y + 1 from column x - 1 on, interleaved channels.
using SpreadFunction = void (*)(const float* const rows[3], int channels, int count, float* out);
SpreadFunction FindSpread();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_SOLID_KERNEL_H_
