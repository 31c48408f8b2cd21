// The rows of the restore family, and what its filters share.
#ifndef TESSERA_OPS_RESTORE_RESTORE_OPS_H_
#define TESSERA_OPS_RESTORE_RESTORE_OPS_H_

#include <cstddef>
#include <vector>

#include "base/stage.h"
#include "ops/registry.h"
#include "tessera/ops/restore.h"

namespace tessera::ops {

OpInfo BilateralInfo();
OpInfo NonLocalMeansInfo();
OpInfo DebandInfo();
OpInfo AutoLevelsInfo();

// The channels that are compared: the first three but alpha, or the only one.
std::vector<int> ComparedChannels(const ImageSpec& image);
// Those and what else is asked for.
std::vector<bool> NeededToCompare(const std::vector<bool>& result, const ImageSpec& in);

// A tile's channels in planes of their own, those that are compared first. A pointer is to the plane's sample
// of the output's first pixel; whole vectors may be read and written to the right of every row.
struct WeighedTile {
  const float** in = nullptr;
  float** out = nullptr;
  ptrdiff_t stride = 0, out_stride = 0;
  int planes = 0, compared = 0, width = 0, height = 0;
};
// Planes of what lies within `reach` pixels of the output; and the results back into it.
WeighedTile ApartFor(const graph::TileArgs& args, const std::vector<int>& compared, int reach);
void Together(const WeighedTile& tile, const std::vector<int>& compared, const graph::TileArgs& args);

struct BilateralSetup {
  int radius = 0;
  float range = 0;           // the exponent of two of a squared distance of 1
  std::vector<float> space;  // the exponents of the window's pixels, row by row
};
using BilateralFunction = void (*)(const BilateralSetup& setup, const WeighedTile& tile);
BilateralFunction ChooseBilateral();

struct PatchSetup {
  int patch = 0, search = 0;  // half of them, without the centre
  float factor = 0,
        allowance = 0;  // of the sum of squares over a patch to an exponent of two; what is taken off
};
using PatchFunction = void (*)(const PatchSetup& setup, const WeighedTile& tile, base::Arena& scratch);
PatchFunction ChoosePatches();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_RESTORE_RESTORE_OPS_H_
