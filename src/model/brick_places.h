// In which bricks a voxel is, along one axis.
#ifndef TESSERA_MODEL_BRICK_PLACES_H_
#define TESSERA_MODEL_BRICK_PLACES_H_

#include <algorithm>

#include "model/volume_data.h"

namespace tessera::model {

// Of a voxel within the volume: the brick that it is a cell's first corner in.
inline int BrickOf(int v) { return v >> kBrickShift; }

struct BrickPlace {
  int brick, local;
};
// Of voxel v of n: as a voxel of its own, in the borders of the neighbours, and, if it is an outermost one,
// repeated in the volume's border.
class BrickPlaces {
 public:
  BrickPlaces(int v, int n) : last_(BrickOf(n - 1)) {
    Add(v);
    for (int b = 1; v == 0 && b <= kVolumeBefore; ++b) Add(-b);
    for (int b = 0; v == n - 1 && b < kVolumeBehind; ++b) Add(n + b);
  }
  const BrickPlace* begin() const { return places_; }
  const BrickPlace* end() const { return places_ + count_; }

 private:
  void Add(int v) {
    const int from = std::max((v - kVolumeBehind) >> kBrickShift, 0);
    const int to = std::min((v + kVolumeBefore) >> kBrickShift, last_);
    for (int b = from; b <= to; ++b) places_[count_++] = {b, v - b * kBrickEdge};
  }

  int last_, count_ = 0;
  BrickPlace places_[2 * (1 + kVolumeBorder)];
};

}  // namespace tessera::model

#endif  // TESSERA_MODEL_BRICK_PLACES_H_
