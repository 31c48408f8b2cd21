// Sums of height differences around a pixel: what slopes and embossing are made of.
#ifndef TESSERA_OPS_BUMP_HEIGHT_H_
#define TESSERA_OPS_BUMP_HEIGHT_H_

#include <vector>

#include "tessera/ops/bump.h"

namespace tessera::ops {

// f(x + dx, y + dy) - f(x, y) counts `x`, `y` and `e` times in the slopes and in the emboss value; rows run
// downwards.
struct HeightTap {
  int dx = 0, dy = 0;
  double x = 0, y = 0, e = 0;
};

struct HeightSetup {
  std::vector<HeightTap> taps;
  int reach = 1;  // largest |dx| or |dy|
  double scale = 1;
  double direction[3] = {0, 0, 1};
  bool slopes_only = true;  // E is -(D_x f_x + D_y f_y) times `shift`
  double shift = 1, exponent = 1;
  bool length = true, pack = false;
  BumpOutput output = BumpOutput::kDiffuse;
  int bits = 0;
};

// Slopes' taps; those of the shifts of `method` along (dx, -dy) as well.
void AddSlopeTaps(Slope slope, HeightSetup& setup);
void AddShiftTaps(BumpMethod method, double dx, double dy, HeightSetup& setup);

struct HeightKernels {
  // `row` is the first pixel, rows `stride` floats apart. Whole vectors are read and written.
  void (*normals)(const HeightSetup&, const float* row, ptrdiff_t stride, int count, float* x, float* y,
                  float* z);
  void (*shade)(const HeightSetup&, const float* row, ptrdiff_t stride, int count, float* out);
};
HeightKernels ChooseHeightKernels();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_BUMP_HEIGHT_H_
