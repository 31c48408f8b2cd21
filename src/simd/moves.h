// Bytes moved between rows of pixels without a look at what they mean. Plain header: the graph uses it
// without seeing Highway.
#ifndef TESSERA_SIMD_MOVES_H_
#define TESSERA_SIMD_MOVES_H_

#include <cstddef>

namespace tessera::simd {

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

// `count` pixels from from[0 .. inputs) to `to`, which may be one of them where the pixels are as long.
// `around`: writes around the cache.
void MovePixels(const Moves& moves, const std::byte* const* from, int count, std::byte* to, bool around);
// `bytes` of them; the ranges are the same or apart.
void CopyBytes(const std::byte* from, size_t bytes, std::byte* to, bool around);

}  // namespace tessera::simd

#endif  // TESSERA_SIMD_MOVES_H_
