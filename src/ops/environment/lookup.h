// Lookups of directions in an environment map, a run of pixels at a time.
#ifndef TESSERA_OPS_ENVIRONMENT_LOOKUP_H_
#define TESSERA_OPS_ENVIRONMENT_LOOKUP_H_

#include <cstdint>

#include "ops/environment/atlas.h"

namespace tessera::ops {

inline constexpr int kDirectionRun = 64;

// Directions of any length but 0. Whole vectors are read: entries beyond the count hold anything finite.
struct Directions {
  alignas(64) double x[kDirectionRun], y[kDirectionRun], z[kDirectionRun];
  bool moderate = false;  // all lengths between 2^-20 and 2^20: floats hold them as they are
};

// How normals become directions. All of it in the normals' space but `matrix`.
struct ReflectionSetup {
  EnvironmentDirection direction = EnvironmentDirection::kReflection;
  double matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  bool rigid = true;  // it leaves lengths alone
  // From the eye to the point: position * use_position + base + column * x + row * y, x and y the pixel's
  // centre.
  double use_position = 0;
  double base[3] = {0, 0, -1}, column[3] = {}, row[3] = {};
  bool fresnel = false;
  double codes = 0;  // above 0: normals are held as (n + 1)/2 in so many steps
  double reflectance = 1;
};

// Planes of a run, and what comes of them.
struct ReflectionRun {
  alignas(64) float normal[3][kDirectionRun], position[3][kDirectionRun];
  Directions directions;
  alignas(64) float fresnel[kDirectionRun];
  alignas(64) float valid[kDirectionRun];  // 1, or 0 for background
  bool all_valid = true;
};

struct ReflectKernels {
  // Three interleaved channels (floats `at[0..2]` of pixels of `channels` floats) to planes, with a finite
  // rest.
  void (*planes)(const float* pixels, int channels, const int* at, int count, float (*plane)[kDirectionRun]);
  void (*reflect)(const ReflectionSetup&, int x, int y, int count, ReflectionRun&);
};
// Where a run's directions lie on a map: first texels and fractions of two by two, and how much of something
// else is to be mixed in.
struct Places {
  alignas(64) int32_t first[kDirectionRun], other[kDirectionRun];
  alignas(64) float fx[kDirectionRun], fy[kDirectionRun], other_fx[kDirectionRun], other_fy[kDirectionRun];
  alignas(64) float mix[kDirectionRun];
  bool polar = false;  // some may lie next to a lat-long map's pole
  bool mixed = false;  // some of `mix` are not 0
};

struct EnvironmentKernels {
  // Three planes' pixels [first, first + count), whole vectors, in the order of the pixels.
  void (*natural)(const float* const (&planes)[4], int first, int count, float (*plane)[kDirectionRun]);
  // RGBA in the order of the pixels to the result's planes or sink.
  void (*store)(const graph::PointArgs& args, int first, int count, const float* rgba);
  // RGBA per direction. Two passes, so that others may come between: the texels of large maps are asked for
  // in the first.
  void (*locate)(const EnvironmentAtlas&, const Directions&, int count, Places& places);
  void (*gather)(const EnvironmentAtlas&, const Places&, int count, float* rgba);
  void (*lookup)(const EnvironmentAtlas&, const Directions&, int count, float* rgba);  // both
  EnvironmentAtlas::ToHalf to_half;
};
// For the SIMD target of this moment.
EnvironmentKernels ChooseEnvironmentKernels();
ReflectKernels ChooseReflectKernels();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_LOOKUP_H_
