// What every way to sum windows is: made ready for the weights of one plane and one instruction set.
#ifndef TESSERA_OPS_FILTER_WINDOW_SUMS_H_
#define TESSERA_OPS_FILTER_WINDOW_SUMS_H_

#include <cstddef>
#include <cstdint>

#include "base/arena.h"
#include "tessera/image.h"

namespace tessera::ops {

// A rectangle of samples. `in` points at the window's first tap of the first result; strides in samples; rows
// of `in` may be read up to 16 samples beyond the last tap of the last one. `stream`: write around the cache
// where addresses are aligned.
template <class T>
struct SampleTile {
  const T* in = nullptr;
  ptrdiff_t in_stride = 0;
  T* out = nullptr;
  ptrdiff_t out_stride = 0;
  int samples = 0, rows = 0;  // of the result
  int channels = 1;           // samples per pixel
  bool stream = false;
};
using FloatTile = SampleTile<float>;
using ByteTile = SampleTile<uint8_t>;
using WordTile = SampleTile<uint16_t>;

class WindowSums {
 public:
  virtual ~WindowSums() = default;
  virtual void Run(const FloatTile& tile, base::Arena& scratch) const = 0;
  // The same from codes to codes of integer pixels, where it is done.
  virtual bool Accepts(PixelType) const { return false; }
  virtual void Run(const ByteTile&, base::Arena&) const {}
  virtual void Run(const WordTile&, base::Arena&) const {}
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_SUMS_H_
