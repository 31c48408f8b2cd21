// An aperture's shape as weights on pixels, for every level of radius: rows of steps.
#ifndef TESSERA_OPS_ACCUMULATE_APERTURE_H_
#define TESSERA_OPS_ACCUMULATE_APERTURE_H_

#include <cstdint>
#include <vector>

#include "tessera/image.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops {

// One row of a shape's weights. A weight holds from its column to before the next one's; the last one is 0.
struct ApertureRow {
  const int16_t* column = nullptr;  // from the shape's middle
  const double* step = nullptr;     // to this weight from the one before
  const double* weight = nullptr;
  int count = 0;  // 0: nothing in this row

  // At a column.
  double At(int x) const;
};

class Aperture {
 public:
  // `picture`: of ApertureShape::kPicture, whose first channel is read, a disc where that lets no light
  // through; else null.
  Aperture(const DepthOfFieldParams& p, const ConstImageView* picture);

  // Of a point whose level is above kSharpLevel, `dy` rows below it. Before the focus the shape is turned by
  // half a turn, as through a lens. A level's weights sum to 1.
  ApertureRow Row(int level, bool before_focus, int dy) const;

 private:
  struct Level {
    int reach = 0;
    std::vector<size_t> first;  // per row, into the steps; one more at the end
    std::vector<int16_t> columns;
    std::vector<double> steps, weights;
  };
  static Level Compressed(const std::vector<double>& dense, int reach, bool turned);

  bool turns_ = false;
  std::vector<Level> levels_[2];  // from kSharpLevel + 1 on; before the focus: the second, where it differs
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_APERTURE_H_
