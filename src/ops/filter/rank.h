// What a kernel of order statistics is given.
#ifndef TESSERA_OPS_FILTER_RANK_H_
#define TESSERA_OPS_FILTER_RANK_H_

#include <cstddef>
#include <cstdint>

namespace tessera::ops {

enum class RankKind { kMedian, kDilate, kErode };

// A window of a tile: `in` covers the tile's samples and the window around them; what lies beyond the image
// is NaN (dilation, erosion) or the largest key (median). Strides and counts in samples.
struct RankTile {
  const float* in;
  ptrdiff_t in_stride;
  float* out;
  ptrdiff_t out_stride;
  int samples, rows, channels;
  const int32_t* columns_inside;  // per sample: columns of its window inside the image
  const int32_t* rows_inside;     // per row
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_RANK_H_
