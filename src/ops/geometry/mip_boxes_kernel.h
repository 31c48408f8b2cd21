// What a strip of columns adds to every level of a chain of boxes.
#ifndef TESSERA_OPS_GEOMETRY_MIP_BOXES_KERNEL_H_
#define TESSERA_OPS_GEOMETRY_MIP_BOXES_KERNEL_H_

#include <vector>

namespace tessera::ops {

// A strip of at most kStrip pixels is summed in blocks of 1 (the samples themselves), 2, 4, ... pixels.
constexpr int kStripBlocks = 8;
constexpr int kStrip = 1 << kStripBlocks;
// Where a block of 2^size pixels lies among all blocks of a strip, in pixels; those of one pixel are not
// kept.
constexpr int BlockOffset(int size) { return kStrip - (kStrip >> (size - 1)); }

// The windows of one level, as far as they lie in a strip.
struct StripWindows {
  int first = 0, count = 0;
  bool begun = false;      // the first began in an earlier strip
  bool continues = false;  // the last goes on in the next
  // Of windows that are each one block, the place of the first one's; else -1, and window i is the sum of
  // blocks[begin[i]] to blocks[begin[i + 1]]: places, or ~pixel for a pixel by itself.
  int place = -1;
  std::vector<int> begin, blocks;
};

struct MipBoxFunctions {
  // `count` sums of two by two pixels of two rows, which are copied.
  void (*halve)(const float* a, const float* b, int count, int channels, float* copy_a, float* copy_b,
                double* sums);
  void (*halve_sums)(const double* a, const double* b, int count, int channels, double* sums);
  // Adds a row's samples to `sums`, or sets them; copies it where `copy` is not null.
  void (*accumulate)(const float* row, int count, bool set, double* sums, float* copy);
  // Sums a row's pixels in blocks.
  void (*sum_blocks)(const double* row, int pixels, int channels, double* blocks);
  // Adds the windows' sums of a row to `sums`, or sets them.
  void (*add)(const StripWindows& windows, const double* row, const double* blocks, int channels, bool set,
              double* sums);
  // Sums times `weight`, and a weight of each pixel where there are any, rounded once. `largest`: as of
  // ResampleJob.
  void (*round)(const double* sums, const double* weights, double weight, int pixels, int channels,
                int largest, float* out);
};

// For the SIMD target of this moment.
MipBoxFunctions ChooseMipBoxes();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_MIP_BOXES_KERNEL_H_
