// A kernel made ready to run: which method, its weights as floats, and what happens at the image's edge.
#ifndef TESSERA_OPS_FILTER_WINDOW_WINDOW_H_
#define TESSERA_OPS_FILTER_WINDOW_WINDOW_H_

#include <memory>
#include <string>
#include <vector>

#include "base/stage.h"
#include "ops/filter/codes/bytes.h"
#include "ops/filter/codes/codes.h"
#include "ops/filter/fft/fft.h"
#include "ops/filter/fir/fir.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

// The engine's rule for a border; kRenormalize and constants start from black, kValid never looks outside.
graph::Border EngineBorder(BorderMode border);
// The data window of the result: smaller with BorderMode::kValid.
Roi OutputWindow(const Roi& window, const Kernel& correlation, BorderMode border);
// convolve(F, G) is correlate(F, G turned by 180 degrees).
Kernel Turned(const Kernel& kernel);
// Throws Error unless the kernel is 1x1 to 255x255, anchored inside and finite.
void RequireKernel(const std::string& op, const Kernel& kernel);

struct WindowOptions {
  FilterMethod method = FilterMethod::kAuto;
  BorderMode border = BorderMode::kClamp;
  double border_value = 0, bias = 0;
  int alpha = -1;  // channel that the bias is multiplied by
};

// The kernels of one instruction set, chosen when a stage is made: a window is shared by stages.
struct WindowFunctions {
  FirFunctions fir;
  CodesFunctions codes;
  BytesFunctions bytes;
  FftFunctions fft;
};
WindowFunctions ChooseWindowFunctions();

class Window {
 public:
  // `correlation` is applied as it stands. Throws Error when the method cannot do it.
  Window(const std::string& op, const Kernel& correlation, const WindowOptions& options);

  // Pixels under the kernel for `out`, beyond the data window too, and those of them that exist and are
  // needed. A column times a row, each of any length; `left` and `top` taps lie before the pixel.
  Window(const std::vector<double>& row, int left, const std::vector<double>& column, int top,
         const WindowOptions& options);

  Roi Footprint(const Roi& out) const;
  Roi InputRoi(const Roi& out, const Roi& data_window) const;
  // Computes args.out from args.in[0], which covers InputRoi; edges are extended here, where they are needed.
  // `largest`: 0, or the largest code of integer pixels, whose sums are then exact and rounded once.
  void Run(const WindowFunctions& functions, const graph::TileArgs& args, const Roi& data_window,
           int largest = 0) const;
  // Whether Run takes codes of such pixels: where that costs more than it is worth, or what borders and bias
  // add is no whole code, IntegerSums mends sums of floats.
  bool SumsCodes(PixelType type) const;
  // Whether Run, where it sums codes, goes from bytes to bytes, or from words to words, too.
  bool SumsAsTheyAre(PixelType type) const {
    if (planes_.size() != 1) return false;
    const BytesWindow& bytes = planes_[0].bytes;
    return type == PixelType::kUint8 ? bytes.usable || bytes.product.usable
                                     : bytes.divisor_of_words == 0 && bytes.product.usable;
  }
  // The same for a whole image, tile by tile.
  void RunWhole(const WindowFunctions& functions, const ConstImageView& in, const ImageView& out,
                const graph::Workers& workers) const;
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

 private:
  struct Plane {
    DirectWindow direct;
    SeparableWindow separable;
    FftKernel fft;
    CodesWindow codes;
    BytesWindow bytes;
    // For edges: sums of weights over the rectangles [0, x) x [0, y), or of a row's and a column's first
    // weights.
    std::vector<double> sums, row_sums, column_sums;
  };
  void Choose(const std::string& op, const Kernel& kernel);
  // The blocks of the transform lie on a grid from the data window's corner, whatever the tile.
  Roi WholeBlocks(const Roi& out, const Roi& data_window) const;
  void RunBlocks(const WindowFunctions& functions, const graph::TileArgs& args, const Roi& data_window) const;
  void RunPlane(const WindowFunctions& functions, const Plane& plane, const FirTile& tile,
                base::Arena& scratch, int largest) const;
  void RunPart(const WindowFunctions& functions, const graph::TileArgs& args, const ConstImageView& in,
               const Roi& part, int largest) const;
  template <class T>
  CodeTile<T> TileOfCodes(const graph::TileArgs& args, const ConstImageView& in, const Roi& part) const;
  void RunPlanes(const WindowFunctions& functions, const graph::TileArgs& args, const ConstImageView& in,
                 const ImageView& out, int largest) const;
  void Finish(const graph::TileArgs& args, const Roi& data_window) const;
  // Whether pixels near the edge need the weights that lie inside.
  bool TreatsEdges() const {
    return options_.border == BorderMode::kRenormalize ||
           (options_.border == BorderMode::kBlack && options_.border_value != 0);
  }
  double WeightInside(const Plane& plane, const Roi& data_window, int x, int y) const;

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
