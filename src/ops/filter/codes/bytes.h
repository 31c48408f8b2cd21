// Window sums over images of bytes: in floats, and exactly rounded all the same.
#ifndef TESSERA_OPS_FILTER_CODES_BYTES_H_
#define TESSERA_OPS_FILTER_CODES_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ops/filter/codes/codes.h"
#include "ops/filter/codes/found.h"
#include "ops/filter/codes/whole.h"
#include "ops/filter/fir/fir.h"

namespace tessera::ops {

// How the sums of a window are settled. Either its weights are small whole numbers over a divisor, so that
// floats hold the sums of bytes exactly, or floats are off by less than `band` codes, and the few results
// that lie so near to the middle between two codes are summed anew in double.
struct BytesWindow {
  bool usable = false;         // false: too many taps to sum anew
  float divisor = 0;           // 0: none
  DirectWindow whole;          // weights times divisor, or divisor_of_words
  float divisor_of_words = 0;  // where floats hold sums of 16-bit codes exactly too, else 0
  float band = 0;
  WholeWindow words;  // where bytes go to bytes
};
// `weights`: row by row, none where they are too many; `separable`: floats are summed by columns and rows;
// `error`: of a float result at samples in [0, 1].
BytesWindow MakeBytesWindow(int width, int height, const std::vector<double>& weights, bool separable,
                            double error);

// The kernels of one instruction set, chosen when a stage is made.
struct BytesFunctions {
  // The codes of `count` samples, what is none, to within `near`, as 0, and zeros up to `padded`, a multiple
  // of 16; whether all are codes. Null: none are kept.
  bool (*to_codes)(float largest, float near, const float* samples, int count, int padded, float* codes);
  void (*settle_whole)(float divisor, float largest, float* row, int count);
  void (*settle_sums)(float band, float* row, int count, Found& found);
  void (*codes_of_bytes)(const uint8_t* bytes, int count, float* codes);
  void (*bytes_of_whole)(float divisor, const float* sums, int count, uint8_t* out);
  void (*bytes_of_sums)(float band, const float* sums, int count, uint8_t* out, Found& found);
};
BytesFunctions ChooseBytes();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_BYTES_H_
