// Means over boxes of 8- and 16-bit codes: sums that run, exact in integers, and one division.
#ifndef TESSERA_OPS_FILTER_BOX_CODES_H_
#define TESSERA_OPS_FILTER_BOX_CODES_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "base/arena.h"
#include "base/stage.h"
#include "tessera/node.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// Sums of boxes up to this side fit in 32 bits, those of their columns of bytes in 16.
inline constexpr int kLargestCodesBox = 255;

// Rows of results that go through together.
inline constexpr int kBoxLines = 8;
// Sums down columns.
template <class T>
using ColumnSum = std::conditional_t<sizeof(T) == 1, uint16_t, uint32_t>;

// Results and the lines that their windows see.
template <class T>
struct BoxTile {
  // rows + height - 1 lines, each from the first sample under the first result's window on; a vector beyond
  // the last one's may be read.
  const T* const* lines = nullptr;
  int samples = 0, rows = 0, channels = 1;
  int width = 1, height = 1;  // of the box, in pixels
};

template <class T>
struct BoxCodesStrip;
struct BoxArea;

// The kernels of one instruction set for codes T, chosen when a stage is made.
template <class T>
struct BoxFunctions {
  bool (*may_multiply)(int area, float inverse);
  void (*means)(const BoxCodesStrip<T>&, const BoxArea&, T* out, ptrdiff_t out_stride);
  void (*sums)(const BoxCodesStrip<T>&, uint32_t* out, ptrdiff_t out_stride);
  void (*settle)(int area, const uint32_t* sums, int count, float* out);
};
BoxFunctions<uint8_t> ChooseByteBoxes();
BoxFunctions<uint16_t> ChooseWordBoxes();

// Means, rounded half to even.
template <class T>
void BoxMeans(const BoxFunctions<T>& functions, const BoxTile<T>& tile, T* out, ptrdiff_t out_stride,
              base::Arena& scratch);
// Means as floats of [0, 1] that a sink rounds as it would round the exact ones: moved from ties by no more
// than their last two bits.
template <class T>
void BoxMeans(const BoxFunctions<T>& functions, const BoxTile<T>& tile, float* out, ptrdiff_t out_stride,
              base::Arena& scratch);

// Whether the stage of codes can do a box: of an image that HoldsCodes.
bool SumsBoxOfCodes(const BoxParams& params, PixelType type);
// Of samples that are codes of that type, whether they come as such or as floats.
std::unique_ptr<graph::TileStage> MakeBoxOfCodesStage(const BoxParams& params, PixelType codes,
                                                      const ImageSpec& in);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_BOX_CODES_H_
