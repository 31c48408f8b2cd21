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
#include "ops/filter/fir_products.h"
#include "ops/filter/fir_whole.h"

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
  // Where bytes go to bytes, and of products where words go to words.
  WholeWindow words;
  ProductWindow product;
};
// `weights` as in MakeCodesWindow; `separable`: floats are summed by columns and rows; `error`: of a float
// result at samples in [0, 1].
BytesWindow MakeBytesWindow(int width, int height, const std::vector<double>& weights, bool separable,
                            double error);

// Whether every sample is one of the 256 codes / 255.
bool AreBytes(const float* samples, int count);

// As RunCodes does, for bytes and, with a divisor of words, 16-bit codes: `sum` gives the float sums of a
// tile.
void RunBytes(const BytesWindow& window, const CodesWindow& exact, int largest, const FirTile& tile,
              base::Arena& scratch, const std::function<void(const FirTile&)>& sum);

// From bytes to bytes.
void RunBytes(const BytesWindow& window, const CodesWindow& exact, const ByteTile& tile, base::Arena& scratch,
              const std::function<void(const FirTile&)>& sum);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FIR_BYTES_H_
