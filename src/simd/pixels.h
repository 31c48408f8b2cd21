// Dispatch of the two loops that have a tail, pixels of any type and stride to float planes and back, and of
// moves of bytes between rows of pixels without a look at what they mean.
// A plain header: those who use it do not see Highway.
#ifndef TESSERA_SIMD_PIXELS_H_
#define TESSERA_SIMD_PIXELS_H_

#include <cstddef>
#include <cstdint>

#include "base/block.h"
#include "tessera/image.h"

namespace tessera::simd {

// `count` pixels (1 to kBlockPixels, any number) of one row. channel[i] is the byte offset of plane i's
// sample within a pixel, or kNoChannel.
inline constexpr ptrdiff_t kNoChannel = PTRDIFF_MIN;
struct LoadArgs {
  PixelType type = PixelType::kFloat;
  const std::byte* pixels = nullptr;
  ptrdiff_t pixel_stride = 0;
  ptrdiff_t channel[4] = {kNoChannel, kNoChannel, kNoChannel, kNoChannel};
  int count = 0;
  float* plane[4] = {};  // planes with kNoChannel are left alone
};
struct StoreArgs {
  PixelType type = PixelType::kFloat;
  std::byte* pixels = nullptr;
  ptrdiff_t pixel_stride = 0;
  ptrdiff_t channel[4] = {kNoChannel, kNoChannel, kNoChannel, kNoChannel};
  int count = 0;
  const float* plane[4] = {};
  bool stream = false;  // write around the cache where address and layout allow
};

// Functions of the current target (tessera/targets.h). Planes hold pixels in order(): position i of a plane
// is pixel order[i]; the order is a permutation within groups of kGroupPixels that makes RGBA transposes
// cheap. Unpacking is correctly rounded; packing rounds half to even of the exact product, saturates, NaN
// becomes 0.
struct PixelFunctions {
  void (*load)(const LoadArgs&);  // writes whole groups; padding is 0
  void (*store)(const StoreArgs&);
  const int32_t* order;  // kBlockPixels entries
};
PixelFunctions CurrentPixelFunctions();
// Waits for streaming stores of this thread; once per tile.
void FlushStreams();

inline constexpr int kMostMovedBytes = 16;  // of a pixel
inline constexpr int kMostMovedInputs = 4;

// Pixels put together from those of up to four inputs: where every byte of a result's pixel comes from.
struct Moves {
  struct Byte {
    int input = -1;         // -1: a constant
    int place = 0;          // within that input's pixel
    std::byte constant{0};  // without an input
  };
  int inputs = 0;
  int input_bytes[kMostMovedInputs] = {};  // of a pixel, 1 to kMostMovedBytes
  int result_bytes = 0;                    // of a pixel, 1 to kMostMovedBytes
  Byte result[kMostMovedBytes];
};

// Functions of the current target that move bytes without a look at what they mean.
struct MoveFunctions {
  // `count` pixels from from[0 .. moves.inputs) to `to`, which may be one of them where the pixels are as
  // long. `around`: writes around the cache.
  void (*move)(const Moves& moves, const std::byte* const* from, int count, std::byte* to, bool around);
  // `bytes` of them; the ranges are the same or apart.
  void (*copy)(const std::byte* from, size_t bytes, std::byte* to, bool around);
};
MoveFunctions CurrentMoveFunctions();

}  // namespace tessera::simd

#endif  // TESSERA_SIMD_PIXELS_H_
