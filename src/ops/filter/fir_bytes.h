// Window sums over images of bytes: in floats, and exactly rounded all the same.
#ifndef TESSERA_OPS_FILTER_FIR_BYTES_H_
#define TESSERA_OPS_FILTER_FIR_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/arena.h"
#include "ops/filter/fir.h"
#include "ops/filter/fir_codes.h"

namespace tessera::ops {

// How the sums of a window are settled. Either its weights are small whole numbers over a divisor, so that
// floats hold the sums of bytes exactly, or floats are off by less than `band` codes, and the few results
// that lie so near to the middle between two codes are summed anew in double.
struct BytesWindow {
  bool usable = false;  // false: too many taps to sum anew
  float divisor = 0;    // 0: none
  DirectWindow whole;   // weights times divisor
  float band = 0;
};
// `weights` as in MakeCodesWindow, empty for separable windows; `error`: of a float result at samples in
// [0, 1].
BytesWindow MakeBytesWindow(int width, int height, const std::vector<double>& weights, double error);

// Whether every sample is one of the 256 codes / 255.
bool AreBytes(const float* samples, int count);

// As RunCodes does, for bytes: `sum` gives the float sums of a tile.
void RunBytes(const BytesWindow& window, const CodesWindow& exact, const FirTile& tile, base::Arena& scratch,
              const std::function<void(const FirTile&)>& sum);

// A rectangle of bytes, as FirTile has one of floats.
struct ByteTile {
  const uint8_t* in = nullptr;
  ptrdiff_t in_stride = 0;
  uint8_t* out = nullptr;
  ptrdiff_t out_stride = 0;
  int samples = 0, rows = 0;
  int channels = 1;
};
// From bytes to bytes.
void RunBytes(const BytesWindow& window, const CodesWindow& exact, const ByteTile& tile, base::Arena& scratch,
              const std::function<void(const FirTile&)>& sum);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FIR_BYTES_H_
