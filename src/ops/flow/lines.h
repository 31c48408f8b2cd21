// What the streamline kernels are given: a prepared field, a texture, weights, and how lines are followed.
#ifndef TESSERA_OPS_FLOW_LINES_H_
#define TESSERA_OPS_FLOW_LINES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tessera/image.h"
#include "tessera/ops/flow.h"

namespace tessera::ops::flow {

// Kernels work on packets of kSide x kSide pixels of a grid that starts at the picture's first pixel. What is
// decided for a packet (the length of a step) is decided for all of its pixels alike, so that neither tiles
// nor the width of vectors matter.
inline constexpr int kSide = 4;
inline constexpr int kPacket = kSide * kSide;
inline constexpr int kMostChannels = 4;
// Pixels are visited in strips of this width: what the lines of one row of it read stays in the nearest cache
// until the next row's lines read most of it again.
inline constexpr int kStrip = 32;

// What a pixel holds for lines that go from pixel to pixel: signs of the direction, its x component as a
// share of |x| + |y|, and, for the library's own noise, the texture's code. Two bits for each axis say where
// the line goes: on, back or nowhere. A line that has come to a pixel without a vector stays there; so it
// does in kCellEnd, which masked pixels hold too, and reads nothing.
inline constexpr uint32_t kCellLeft = 1, kCellUp = 4, kCellStill = 2 + 8, kCellEnd = kCellStill;
inline constexpr int kCellUpShift = 2, kCellNoiseShift = 4, kCellShareShift = 12;
inline constexpr uint32_t kCellNoise = 255u << kCellNoiseShift;
inline constexpr uint32_t kCellShareMost = (1u << 20) - 1;
// What |x| + |y| is in units of the share: a little more than the largest share, so that what is left for y
// is never 0.
inline constexpr float kCellWhole = static_cast<float>(kCellShareMost) + 0x1p-4f;

inline constexpr int kCodeFrame = 8;
// Sums of the codes of so many taps, 8 bits each, are whole floats.
inline constexpr int kMostBoxTaps = 1 << 15;

// Everything about one picture, in pixels of the picture counted from its first one; shared by all threads.
struct Lines {
  int width = 0, height = 0;

  // Vectors (u, v), x right and y down, at the centres of the pixels, in a frame of one pixel that holds what
  // the border asks for. Finite; 0 where masked. Null for integrator kCell where only `cells` are wanted.
  const float* uv = nullptr;  // of pixel (0, 0)
  ptrdiff_t uv_row = 0;       // floats

  // `channels` floats of each pixel, at most kMostChannels; pixels texture_step, rows texture_row floats
  // apart.
  const float* texture = nullptr;
  // The library's own noise instead, where it is not in `cells`: codes of 8 bits, 255 for 1. With a
  // texture_step of 2 each is followed by the one of the pixel below, so that four bytes hold four
  // neighbours.
  const uint8_t* codes = nullptr;  // within a frame of kCodeFrame pixels
  float unit = 1;                  // what a texel of 1 stands for: 1/255 for codes
  ptrdiff_t texture_row = 0;
  int texture_step = 1, channels = 1;

  // 1 where there is no vector (NaN, alpha 0); null when there is no such pixel.
  const uint32_t* mask = nullptr;
  // For integrator kCell, in a frame of one pixel of kCellEnd: see below.
  const uint32_t* cells = nullptr;  // of pixel (0, 0)
  ptrdiff_t cell_row = 0;
  bool texture_in_cells = false;
  bool smooth = false;  // the texture changes little from pixel to pixel
  // Taps of each pixel, each way, where lines have different lengths; else null.
  const float* reach = nullptr;

  Wrap wrap = Wrap::kRenormalize;
  bool around_x = false, around_y = false;  // lines that leave one side come in at the other
  LicIntegrator integrator = LicIntegrator::kAdaptive;
  bool speed = false;      // vectors as they are; else directions
  bool linear = false;     // the texture between its pixels: bilinear; else nearest
  float smallest = 1e-6f;  // vectors shorter than this are 0
  float step = 1;          // between taps
  int parts = 1;           // steps of the integrator from tap to tap, where it takes one at a time
  int taps_at_once = 1;    // kAdaptive: taps of its longest step
  int taps_if_even = 1;    // and of one through a field that is smooth from pixel to pixel
  float turn = 0;          // kAdaptive: the largest change of direction within a step
  float error = 0;         // and the largest error of a step from tap to tap, in pixels; 0: any
  float farthest = 0;      // pixels that a line can lead away, upper bound

  int taps = 0;                          // each way
  std::vector<float> forward, backward;  // weights of taps 1 to taps
  float centre = 1;                      // weight of tap 0
  float sum = 1;                         // of all weights
  bool box = true;                       // all weights are 1
};

// The convolution along the lines of the pixels of `roi` (counted from the picture's first pixel):
// Lines::channels floats of each pixel, pixels `step`, rows `row` floats apart. A pixel whose line has no
// weight gets 0.
struct LineOutput {
  Roi roi;
  float* data = nullptr;
  ptrdiff_t row = 0;
  int step = 1;
};
using FollowLines = void (*)(const Lines&, const LineOutput&);
FollowLines FindDirectLines();
FollowLines FindCellLines();
// One part of the picture, one channel, by lines that its pixels share; `scratch` keeps its memory from part
// to part.
struct SharedScratch {
  // Of the part's pixels and of kPacket for all others: weighted values, weights and, of a smooth texture,
  // weighted places beside the pixel's centre.
  std::vector<float> sums;
  // kPacket lines side by side, from their last tap backward to their last one forward.
  std::vector<float> samples, weights;
  std::vector<float> beside_x, beside_y;  // of a smooth texture: how far off the pixel's centre
  std::vector<float> there;               // 1 where the line has a sample
  std::vector<int32_t> places;            // the part's pixels at the taps
};
// Side of the parts: what does not change with threads. Lines that leave a part are lost to it.
constexpr int SharedPartSide(int width, int height) { return width >= 1024 && height >= 1024 ? 512 : 256; }
using ShareLines = void (*)(const Lines&, const LineOutput&, SharedScratch&);
ShareLines FindSharedLines();

}  // namespace tessera::ops::flow

#endif  // TESSERA_OPS_FLOW_LINES_H_
