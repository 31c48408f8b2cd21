// Means over boxes in one sweep: sums down the columns of a strip, sums along its rows, no difference taken.
#ifndef TESSERA_OPS_FILTER_BOX_STRIPS_H_
#define TESSERA_OPS_FILTER_BOX_STRIPS_H_

#include "graph/stage.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// Boxes up to this side go through the strips; the sums of larger ones would not stay near.
inline constexpr int kLargestStripBox = 255;

// As RunBox for sides up to kLargestStripBox. `largest`: 0, or the largest code of an integer image whose
// samples all are codes / largest; results then lie on the side of the code that the exact mean rounds to
// (half to even), as IntegerSums leaves them.
void RunBoxStrips(int width, int height, const ConstImageView& in, const ImageView& out, BorderMode border,
                  double border_value, int largest, const graph::Workers& workers);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_BOX_STRIPS_H_
