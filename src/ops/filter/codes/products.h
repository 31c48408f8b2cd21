// Window sums of bytes and words under a symmetric column times a symmetric row of real weights, from codes
// to codes, correctly rounded.
#ifndef TESSERA_OPS_FILTER_CODES_PRODUCTS_H_
#define TESSERA_OPS_FILTER_CODES_PRODUCTS_H_

#include <vector>

#include "ops/filter/window/sums.h"

namespace tessera::ops {

// The two samples that share a weight are added first. Sums of bytes are taken in floats and are off by less
// than `band` codes, and those that lie so near to the middle between two codes are summed anew in double;
// where there would be too many of these, and of words, all are sums in double.
struct ProductWindow {
  bool usable = false;
  int width = 1, height = 1;  // odd
  std::vector<double> column, row;
  std::vector<float> float_column, float_row;
  float band = 0;  // 0: no sums in floats
};
// `weights`: row by row. Not usable where they are no such product, to the last bits of a double.
ProductWindow MakeProductWindow(int width, int height, const std::vector<double>& weights);

template <class T, class F>
struct ProductStrip;

// The kernels of one instruction set, chosen when a stage is made.
struct ProductFunctions {
  void (*bytes_in_floats)(const ProductWindow&, const ProductStrip<uint8_t, float>&);
  void (*bytes_in_doubles)(const ProductWindow&, const ProductStrip<uint8_t, double>&);
  void (*words_in_doubles)(const ProductWindow&, const ProductStrip<uint16_t, double>&);
};
ProductFunctions ChooseProducts();

// Rounded half to even, from 0 to the largest code.
void RunProducts(const ProductFunctions& functions, const ProductWindow& window, const ByteTile& tile,
                 base::Arena& scratch);
void RunProducts(const ProductFunctions& functions, const ProductWindow& window, const WordTile& tile,
                 base::Arena& scratch);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_PRODUCTS_H_
