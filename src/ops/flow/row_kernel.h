// Rows of fields and noise brought to the form in which lines are followed.
#ifndef TESSERA_OPS_FLOW_ROW_KERNEL_H_
#define TESSERA_OPS_FLOW_ROW_KERNEL_H_

#include <cstdint>

namespace tessera::ops::flow {

// What a row of vectors holds; `squared`: of the longest one, where it is not too large for a float.
struct RowFound {
  float largest = 0, squared = 0;
  bool masked = false;
};

// Kernels on rows write whole SIMD vectors: what they read and write, but vectors given by a user, must have
// kRowSlack elements beyond the row's end.
inline constexpr int kRowSlack = 32;
struct RowKernels {
  // Pairs (u, v) as they were given; those that are not finite become 0. Without `to` they are only looked
  // at.
  RowFound (*copy_vectors)(const float* from, int width, float* to);
  // White noise of a row, 0 to 255.
  void (*white_codes)(uint32_t row_key, int width, uint32_t* to);
  // Lines::cells of a row; vectors shorter than `smallest` are 0, and so are those, as they were given, that
  // are not finite.
  void (*cell_codes)(const float* uv, const uint32_t* noise, int width, float smallest, uint32_t* to);
};
RowKernels FindRowKernels();

}  // namespace tessera::ops::flow

#endif  // TESSERA_OPS_FLOW_ROW_KERNEL_H_
