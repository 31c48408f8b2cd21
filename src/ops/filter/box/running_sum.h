// Means over boxes of any size by running sums.
#ifndef TESSERA_OPS_FILTER_BOX_RUNNING_SUM_H_
#define TESSERA_OPS_FILTER_BOX_RUNNING_SUM_H_

#include "base/stage.h"
#include "ops/filter/lines/extend.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

using BoxTracksFunction = void (*)(int count, double factor, const TrackBlock&, bool rgba_rows,
                                   const AxisBorder&, const float* scale, float* scratch);
// Of one instruction set, chosen when a stage is made.
BoxTracksFunction ChooseBoxTracks();

// The mean of `width` x `height` pixels, (width - 1) / 2 and (height - 1) / 2 of them before the pixel, of
// the dense float image `in` into `out` (same window). NaN, infinities and large values leave no trace once
// out of the box.
void RunBox(BoxTracksFunction tracks, int width, int height, const ConstImageView& in, const ImageView& out,
            Wrap wrap, double border_value, const graph::Workers& workers);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_BOX_RUNNING_SUM_H_
