// Gathering of discs over one row: the inner loop of depth of field.
#ifndef TESSERA_OPS_ACCUMULATE_DISC_KERNEL_H_
#define TESSERA_OPS_ACCUMULATE_DISC_KERNEL_H_

#include <cstddef>
#include <span>

namespace tessera::ops {

// Planes at a row's first pixel; rows lie `stride` floats apart, with 16 floats to read beyond their ends.
struct DiscRow {
  const float* radius = nullptr;   // of the circle of confusion, at least 1/2; 0: gives nothing
  const float* density = nullptr;  // 1 / its area
  const float* depth = nullptr;
  std::span<const float*> values;  // a plane per channel
  ptrdiff_t stride = 0;
  int width = 0;
  int reach = 0;           // pixels to look at, each way
  float largest = 0;       // radius among those
  float* sums = nullptr;   // per channel `padded` sums of weight * value, then `padded` sums of weights
  float* parts = nullptr;  // room for as many
  int padded = 0;          // the width in whole groups of 16
};
using DiscFunction = void (*)(const DiscRow&);

// For the SIMD target of this moment.
DiscFunction ChooseGatherDiscs();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ACCUMULATE_DISC_KERNEL_H_
