// An environment map's averages over wider and wider angles: a chain of cube maps, and lookups between two of
// them.
#ifndef TESSERA_OPS_ENVIRONMENT_MIPS_H_
#define TESSERA_OPS_ENVIRONMENT_MIPS_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/environment/atlas.h"
#include "ops/environment/lookup.h"

namespace tessera::ops {

// Level 0 is the map itself, level k > 0 the cube map cube(k), each of half the edge of the one before, the
// last of one texel a face. The first has texels wider than the map's by a factor of 1.4 to 2.8. Every texel
// is the mean of a grid of lookups in the map (the first), or of four texels by solid angle.
class EnvironmentMips {
 public:
  EnvironmentMips(const EnvironmentAtlas& map, const graph::Workers& workers);

  bool finite() const { return finite_; }  // the map's texels are numbers, all of them
  int last() const { return static_cast<int>(cubes_.size()); }
  const EnvironmentAtlas& cube(int level) const { return *cubes_[static_cast<size_t>(level) - 1]; }
  // log2 of the angle that a texel of the map, and of the first cube, is wide.
  double map_angle() const { return map_angle_; }
  double first_angle() const { return first_angle_; }

 private:
  std::vector<std::unique_ptr<const EnvironmentAtlas>> cubes_;
  double map_angle_ = 0, first_angle_ = 0;
  bool finite_;
};

// Unit directions of a row's pixels with a pixel more on either side, and 1 where there is one.
struct MirrorRow {
  alignas(64) double x[kDirectionRun], y[kDirectionRun], z[kDirectionRun];
  alignas(64) double valid[kDirectionRun];
};
inline constexpr int kMirrorPixels =
    kDirectionRun - 8;  // of a row: whole vectors are read beside every pixel

struct MipKernels {
  // Of the pixels x - 1 to x + kMirrorPixels of a run.
  void (*normalize)(const ReflectionRun& run, MirrorRow& row);
  // Per pixel of the middle row: its level, between 0 and last().
  void (*levels)(const EnvironmentMips&, const MirrorRow& above, const MirrorRow& row, const MirrorRow& below,
                 int count, double* level);
  // Mixes into RGBA looked up in the map what the cubes show, by the levels.
  void (*mix)(const EnvironmentMips&, const MirrorRow& row, const double* level, int count, float* rgba);
};
MipKernels ChooseMipKernels();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_MIPS_H_
