/// The accumulation buffer and what it is for: weighted sums of images, running totals, jitter, depth of
/// field. @file
#ifndef TESSERA_OPS_ACCUMULATE_H_
#define TESSERA_OPS_ACCUMULATE_H_

#include <cstdint>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/ops/filter.h"
#include "tessera/roi.h"

TESSERA_API_BEGIN
namespace tessera {

/// The operators are those of GL's accumulation buffer (Haeberli and Akeley 1990; OpenGL 2.1, 4.2.4;
/// McReynolds et al. 1997, 6.4, 7.5, 9.2); doc/maths/filter.md. u = 2^-24.
/// @file

/// How an accumulation buffer stores its numbers. kFixed models the papers' hardware: numbers in [-1, 1] with
/// `bits` binary places, every operation rounded to the nearest (half to even) and saturated, NaN stored as
/// 0.
struct AccumulationFormat {
  /// Floats, doubles or fixed point.
  enum class Store : uint8_t { kFloat, kDouble, kFixed };
  Store store = Store::kDouble;  ///< what a number is
  int bits = 24;                 ///< kFixed: 8 to 32
};

/// A x B pixels of accumulators. Images are views of any pixel type and stride with the buffer's window and
/// channel count, else Error; they are read as floats (integers as code / max). Not for use by several
/// threads at once.
class AccumulationBuffer {
 public:
  /// Zero everywhere. Error for an empty window, no channel, bits outside 8 to 32.
  AccumulationBuffer(const Roi& window, int channels, const AccumulationFormat& format = {});

  /// A = value.
  void Clear(double value = 0);
  void Load(const ConstImageView& image, double weight = 1);        ///< A = weight * image
  void Accumulate(const ConstImageView& image, double weight = 1);  ///< A = A + weight * image
  void Add(double value);                                           ///< A = A + value
  void Multiply(double factor);  ///< A = A * factor; the factor is not limited

  /// image = factor * A, limited to [0, 1] (NaN to 0) unless `clamp` is false; rounded to the image's type.
  void Return(const ImageView& image, double factor = 1, bool clamp = true) const;

  /// The pixels covered.
  const Roi& window() const { return window_; }
  /// Channels of a pixel.
  int channels() const { return channels_; }
  /// What is stored, exactly.
  double at(int x, int y, int channel) const;

 private:
  template <class F>
  void ForEachRow(const ConstImageView& image, F f);
  double Stored(double value) const;

  Roi window_;
  int channels_ = 0;
  AccumulationFormat format_;
  double step_ = 0;  ///< kFixed: the smallest difference
  std::vector<double> samples_;
};

/// The sum of weight[k] * image k in one pass, any number of images of equal windows and channel counts (else
/// Error names both). Accumulated in double: within 1 ULP of the exact sum's nearest float for up to 65,536
/// images. The weights are kept as asked, never normalised. With `bits` (8 to 32) an accumulation buffer of
/// that fixed-point format is modelled instead: load, accumulate in order, return without clamp. A NaN or
/// infinity where the weight is 0 has no effect.
struct WeightedSumParams {
  std::vector<double> weights;  ///< one per image
  int bits = 0;                 ///< 0: exact
};
/// A weighted sum of images, as WeightedSumParams says.
Node WeightedSum(const std::vector<Node>& images, const WeightedSumParams& params);
/// Their mean: WeightedSum with 1/n each.
Node Average(const std::vector<Node>& images, int bits = 0);

/// Mean of the last `length` images of a sequence: B_t = B_(t-1) + (I_t - I_(t-n)) / n, without drift: totals
/// are kept in double, a sample whose total loses a NaN, an infinity or most of its magnitude is summed anew,
/// and so is every sample once in `length` images. Error within 1 ULP after any number of images; exact for
/// integer images. Keeps the last `length` images as floats.
class RunningTotal {
 public:
  /// Error for an empty window, no channel, a length below 1.
  RunningTotal(const Roi& window, int channels, int length);

  /// Takes in an image of that window and channel count, of any type.
  void Push(const ConstImageView& image);
  /// The mean of the last min(length, images pushed); Error before the first.
  void Mean(const ImageView& out) const;
  /// Images so far.
  int64_t pushed() const { return pushed_; }

 private:
  void Resum(size_t sample);

  Roi window_;
  int channels_ = 0;
  size_t length_ = 0;
  int64_t pushed_ = 0;
  std::vector<Image> ring_;
  std::vector<double> total_;
};

/// Where the samples of a pixel lie, in [0, 1) pixels; subtract 1/2 for shifts of mean zero (of 3: 0.003).
/// For 2, 3, 4, 5, 6, 8, 9, 12 and 16 the sets of the SGI course notes, for other counts (up to 65,536) a
/// lattice of rank one with the widest smallest distance among those that have every x and every y once; its
/// mean is (1/2, 1/2). Error for other counts.
struct JitterPoint {
  double x = 0;  ///< in [0, 1) pixels
  double y = 0;  ///< in [0, 1) pixels
};
/// Places of `count` samples in a pixel, as JitterPoint says.
std::vector<JitterPoint> JitterSet(int count);

/// The range of a convolution's result, and of every partial sum in any order of taps, for samples in [low,
/// high].
struct AccumulationRange {
  double minimum = 0;  ///< of any partial sum
  double maximum = 0;  ///< of any partial sum
  double scale = 1;    ///< taps times this keep the buffer within [-1, 1]; 1 for a kernel of zeros
};
/// Range of sums under these taps, as AccumulationRange says.
AccumulationRange KernelRange(const std::vector<double>& taps, double low = 0, double high = 1);

/// Correlation by shift and accumulate, as on hardware without convolution: for every tap that is not 0 the
/// shifted image is accumulated with tap * scale (KernelRange), and returned with 1 / scale without clamp.
/// `taps` row-major, top row first, width x height, about `anchor` (default the middle, rounded down); beyond
/// the image is `border`, black as 0, not kRenormalize or kValid. With `bits` the buffer is fixed point of
/// that format: |error| <= taps * 2^-(bits+1) / scale for samples in [low, high]; beyond that range it
/// saturates. Error for taps that are not finite or not width * height.
struct ShiftAccumulateParams {
  std::vector<double> taps;  ///< row-major, top row first
  int width = 3;             ///< columns of taps
  int height = 3;            ///< rows of taps
  int anchor_x = -1;         ///< column over the pixel; -1: the middle
  int anchor_y = -1;         ///< row over the pixel; -1: the middle
  int bits = 0;              ///< 0: double
  double low = 0;            ///< smallest sample expected
  double high = 1;           ///< largest sample expected
  Wrap wrap = Wrap::kClamp;  ///< what lies beyond the image
};
/// Correlation by shifted sums, as ShiftAccumulateParams says.
Node ShiftAccumulate(const Node& image, const ShiftAccumulateParams& params);

/// How depth of field is computed.
enum class DepthOfFieldMethod : uint8_t {
  kLayers,  ///< discs are spread and composited by depth, over an estimate of what they uncover
  kGather   ///< a mean of the neighbours whose discs reach a pixel; near objects keep their edge
};
/// The opening of a lens.
enum class ApertureShape : uint8_t {
  kDisc,     ///< round
  kPolygon,  ///< regular, its corners on the disc's edge
  kPicture   ///< the first channel of a picture
};

/// Depth of field from colour and depth. A point at depth z is spread over the aperture's shape of radius
/// c(z) = aperture |1/focus - 1/z| pixels, at most max_radius; in levels of 1/8 pixel up to 8 pixels, of 1/64
/// above (model/defocus.h).
///
/// kLayers: each pixel's light goes to the pixels in the shape's area around it (rows of exact area, weights
/// that sum to 1; a shape within its own pixel moves nothing) and is composited from near to far, layer by
/// layer of c: what is nearer takes its share of a pixel first, so that near objects have soft edges over
/// what is sharp, and nothing far is drawn over what is near and sharp. Beside a surface that ends before a
/// farther one (a step in c of more than 1 pixel, within max_radius in one of eight directions) each pixel
/// has a hidden one of the farther surface beneath it: the mean of those found, by 1 / distance^2, at the
/// depth of the nearest; of each no more than four times the median of its first five pixels, so that lights
/// are not drawn out. What is left over is shared out. Before the focus the shape is turned by half a turn,
/// as a lens does. Light of a plane is conserved but for what leaves the picture; a constant picture stays
/// so. |error| <= 64 u V, V the largest |value| that is spread to the pixel. Cost O(max_radius) per pixel and
/// O(1) per layer present; O(max_radius^2) for pictures.
///
/// kGather: a pixel gathers every neighbour whose disc reaches it, weighted by coverage over area; what lies
/// behind the pixel is spread no further than the pixel itself is out of focus, so that sharp objects keep
/// their edges; radii are at least 1/2. |error| <= 64 u V. Cost O(max_radius^2).
///
/// Both: pixels that get nothing but themselves keep their bits. Alpha is treated as the colours, which
/// should be premultiplied. Infinite focus or depth counts as 1/z = 0; zero, negative or NaN depth: the pixel
/// keeps its bits and gives nothing to others. The image's and the depth's windows are equal, else Error.
/// Approximate at occlusions, as every method that has one image only: tests/ops/depth_of_field_test.cc holds
/// it against views through many places of the lens. Source: McReynolds et al. 1997, 9.2.
struct DepthOfFieldParams {
  double focus = 1;                                         ///< the depth that is sharp, > 0
  double aperture = 8;                                      ///< pixels times depth units: K of the papers
  double max_radius = 32;                                   ///< 0 to 128 pixels
  int depth_channel = 0;                                    ///< of the depth image
  DepthOfFieldMethod method = DepthOfFieldMethod::kLayers;  ///< how
  ApertureShape shape = ApertureShape::kDisc;               ///< kLayers: of the opening
  int blades = 6;                                           ///< kPolygon: corners, 3 to 16
  double rotation = 0;  ///< kPolygon: degrees, counter-clockwise as seen; 0: a corner points right
};
/// Blurred by distance from the focus, as DepthOfFieldParams says; not for ApertureShape::kPicture.
Node DepthOfField(const Node& image, const Node& depth, const DepthOfFieldParams& params);
/// Through an opening of `aperture`'s shape: its first channel, brightness the light that passes (negative
/// and not finite as 0), centred, its longer side the disc's diameter; the disc where it is black everywhere.
/// `params`: kLayers, its shape is kPicture whatever it says.
Node DepthOfField(const Node& image, const Node& depth, const Node& aperture,
                  const DepthOfFieldParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_ACCUMULATE_H_
