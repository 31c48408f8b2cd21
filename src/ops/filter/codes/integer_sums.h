// Sums over integer pixels, correctly rounded: float results too near to a half code to be trusted are summed
// anew.
#ifndef TESSERA_OPS_FILTER_CODES_INTEGER_SUMS_H_
#define TESSERA_OPS_FILTER_CODES_INTEGER_SUMS_H_

#include <span>
#include <vector>

#include "ops/filter/codes/found.h"
#include "ops/filter/window/window.h"
#include "tessera/image.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// A float holds neither sums of 16-bit codes nor ties of 8-bit ones. A result of integer pixels that lies
// within its error of the middle between two codes is summed anew from the codes and moved, by no more than
// its last two bits, to the side of the code that the exact sum rounds to (half to even): the sink then
// rounds correctly, and later operations see no step.
class IntegerSums {
 public:
  // `error`: of a float result, at samples in [0, 1].
  IntegerSums(PixelType type, const Kernel& correlation, const WindowOptions& options, double error);

  static bool Applies(PixelType type) { return type == PixelType::kUint8 || type == PixelType::kUint16; }
  // The largest code.
  static int Largest(PixelType type) { return type == PixelType::kUint8 ? 255 : 65535; }

  // `in` holds every pixel that the results `out` need; channels as in TileArgs.
  void Settle(const ConstImageView& in, std::span<const int> in_channels, const ImageView& out,
              std::span<const int> out_channels, const Roi& data_window, base::Arena& scratch) const;

 private:
  // The result in codes.
  double Exact(const ConstImageView& in, std::span<const int> in_channels, const Roi& window, int x, int y,
               int channel, std::span<int> shown) const;

  using FindHalves = void (*)(const float* row, int count, float largest, float band, Found& found);
  static FindHalves ChooseFindHalves();

  Kernel kernel_;
  WindowOptions options_;
  double largest_;  // code
  float band_;      // in codes
  std::vector<double> totals_;
  FindHalves find_halves_ = ChooseFindHalves();
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_CODES_INTEGER_SUMS_H_
