// Averages of an environment map with Phong lobes: for a direction, or tabulated as a cube map.
#ifndef TESSERA_OPS_ENVIRONMENT_LOBE_H_
#define TESSERA_OPS_ENVIRONMENT_LOBE_H_

#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/environment/atlas.h"

namespace tessera::ops {

// Radiance with directions, sorted into blocks that lie together. Items of a block are a multiple of
// kLobeGroup, the last of which may be without weight.
inline constexpr int kLobeGroup = 8;

struct LobeSamples {
  struct Block {
    double axis[3];                         // unit
    double cos_radius = 1, sin_radius = 0;  // of the cone around the axis that holds the items
    double nearest[3];                      // the direction of the item closest to the axis
    int64_t first = 0, count = 0;
  };
  std::vector<Block> blocks;
  std::vector<double> x, y, z;          // unit directions
  std::vector<float> weight, color[4];  // solid angle; colour times it

  // The map's texels, four channels from `first` on; with `cells` above 0, where there are more texels than
  // cells of a cube map of that edge, those of a cell are taken together at their centre of weight.
  LobeSamples(const ConstImageView& picture, int first, const MapLayout& layout, int cells);
};

// sum L w max(d.omega, 0)^exponent / sum w max(d.omega, 0)^exponent for directions of any length; 0 where
// nothing has weight. Items below 1e-6 of the largest power are left out when `cut`.
using LobeFunction = void (*)(const LobeSamples&, double exponent, bool cut, const double* x, const double* y,
                              const double* z, int count, float* rgba);
LobeFunction ChooseLobe();

// Texels along a face's edge that keep the table's error at a tenth of a per cent of the contrast; at most
// 512.
int LobeTableSize(double exponent);
std::shared_ptr<const EnvironmentAtlas> MakeLobeTable(const ConstImageView& picture, int first,
                                                      const MapLayout& layout, double exponent, int size,
                                                      const graph::Workers& workers);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_LOBE_H_
