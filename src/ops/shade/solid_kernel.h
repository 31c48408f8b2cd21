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

// Cells of the noise that bends the rings, and of the fibres, across the block.
inline constexpr double kWoodBendCells = 2.5, kWoodAcross = 90, kWoodAlong = 3;

// What the mean of gradient noise of 3 dimensions over a footprint still has of the value in its middle:
// 1 / (1 + a s^2), s the footprint's length in cells; of |noise| likewise. Fitted to the mean correlation
// along a segment (measured .931, .768, .436 and .206 at 1/2, 1, 2 and 4 cells; |noise| .838, .576, .291,
// .147). The rest of the variance lies within the footprint.
inline constexpr double kNoiseFade = 0.29, kSizeFade = 0.75, kNoiseVariance = 0.068, kSizeVariance = 0.023;

// Footprints of procedures, in their periods: narrower ones count as this, wider ones as kWidest.
inline constexpr double kNarrowest = 0x1p-12, kNarrowestScreen = 0x1p-8, kWidest = 0x1p20;

struct SolidPlan {
  SolidParams params;
  int table_channels = 0;  // kTable: input 1 has so many
  int octaves = 0;         // with a footprint: inputs 2 .. 1 + octaves hold them one by one
  bool footprint = false;  // the last two inputs are the footprint's squares and mixed products
  double mean = 0;         // what a faded octave is worth
};
// Inputs: 0 the colour; kTable: 1 the looked-up texture; else 1 p, then the noise (marble and kNoise one, or
// octaves; wood the bend, likewise, and the grain), then the footprint.
std::unique_ptr<graph::PointStage> MakeSolidStage(const SolidPlan& plan);

// The footprint of a pixel: the sum of J J^T over the image's two axes, J the difference of p to a neighbour;
// of the two neighbours along an axis, weighted by each other's squared distance, so that one on another
// surface hardly counts and one that is no number does not. xx, yy, zz, or with `mixed` xy, xz, yz.
// `in`: rows y - 1, y, y + 1 from column x - 1 on, interleaved channels.
using FootprintFunction = void (*)(const float* const rows[3], int channels, int count, bool mixed,
                                   float* out);
FootprintFunction FindFootprint();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_SOLID_KERNEL_H_
