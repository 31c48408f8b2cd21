// A kernel made ready to run: which method, its weights, and what happens at the image's edge.
#ifndef TESSERA_OPS_FILTER_WINDOW_WINDOW_H_
#define TESSERA_OPS_FILTER_WINDOW_WINDOW_H_

#include <memory>
#include <string>
#include <vector>

#include "base/stage.h"
#include "ops/filter/fft/fft.h"
#include "ops/filter/window/factor.h"
#include "ops/filter/window/sums.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// The data window of the result: smaller with Wrap::kValid.
Roi OutputWindow(const Roi& window, const Kernel& correlation, Wrap wrap);
// convolve(F, G) is correlate(F, G rotated by 180 degrees).
Kernel Reversed(const Kernel& kernel);
// Throws Error unless the kernel is 1x1 to 255x255, anchored inside and finite.
void RequireKernel(const std::string& op, const Kernel& kernel);

struct WindowOptions {
  FilterMethod method = FilterMethod::kAuto;
  Wrap wrap = Wrap::kClamp;
  double border_value = 0, bias = 0;
  int alpha = -1;  // channel that the bias is multiplied by
};

// The plan, which stages share: WindowRun runs it.
class Window {
 public:
  // `correlation` is applied as it stands. Throws Error when the method cannot do it.
  Window(const std::string& op, const Kernel& correlation, const WindowOptions& options);
  // A column times a row, each of any length; `left` and `top` taps lie before the pixel.
  Window(const std::vector<double>& row, int left, const std::vector<double>& column, int top,
         const WindowOptions& options);

  // Pixels under the kernel for `out`, beyond the data window too, and those of them that exist and are
  // needed.
  Roi Footprint(const Roi& out) const;
  Roi InputRoi(const Roi& out, const Roi& data_window) const;
  // The results whose footprints lie inside, or none.
  Roi Inner(const Roi& out, const Roi& data_window) const;
  // Method, size and error bound in a few words.
  std::string Describe() const;
  FilterMethod method() const { return method_; }
  // The weights; none where a column and a row of any length are larger than a kernel may be.
  const Kernel& kernel() const { return kernel_; }
  // Bound of |error| for samples in [0, 1].
  double ErrorBound() const;
  // Width and height of a tile that suits the method; `alone`: from a source's pixels to the result's.
  graph::TileSize PreferredTile(bool alone) const;
  const WindowOptions& options() const { return options_; }
  // The blocks of the transform lie on a grid from the data window's corner, whatever the tile.
  Roi WholeBlocks(const Roi& out, const Roi& data_window) const;

  // One set of weights, for all channels or for one.
  int planes() const { return static_cast<int>(planes_.size()); }
  const FftKernel& fft(int plane) const { return planes_[static_cast<size_t>(plane)].fft; }
  // Whether sums of such pixels are taken of their codes: where that costs more than it is worth, or what
  // borders and bias add is no whole code, IntegerSums mends sums of floats.
  bool SumsCodes(PixelType type) const;
  // What sums a plane's windows, in floats or, where it SumsCodes, correctly rounded.
  std::unique_ptr<const WindowSums> MakeSums(int plane, PixelType type) const;

  // Whether pixels near the edge need the weights that lie inside.
  bool TreatsEdges() const {
    return options_.wrap == Wrap::kRenormalize ||
           (options_.wrap == Wrap::kBlack && options_.border_value != 0);
  }
  // The sum of a plane's weights, and of those that lie inside for one pixel.
  double WeightOf(int plane) const;
  double WeightInside(int plane, const Roi& data_window, int x, int y) const;

 private:
  struct Plane {
    std::vector<double> weights;
    std::vector<Product> products;  // that are summed in place of the weights
    FftKernel fft;
    // For edges: sums of weights over the rectangles [0, x) x [0, y), or of a row's and a column's first
    // weights.
    std::vector<double> sums, row_sums, column_sums;
  };
  void Choose(const std::string& op);
  std::unique_ptr<const WindowSums> MakeFloatSums(const Plane& plane) const;
  double SumTo(const Plane& plane, int x, int y) const;

  WindowOptions options_;
  Kernel kernel_;
  FilterMethod method_ = FilterMethod::kDirect;
  int width_, height_, anchor_x_, anchor_y_;
  int terms_ = 0;
  double truncation_ = 0;
  std::vector<Plane> planes_;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_WINDOW_H_
