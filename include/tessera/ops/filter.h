/// Neighbourhood filters: convolution with any kernel, Gaussian, box and named blurs, gradients, sharpening,
/// median, dilation, erosion. @file
#ifndef TESSERA_OPS_FILTER_H_
#define TESSERA_OPS_FILTER_H_

#include <string>
#include <utility>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera {

/// All act on every channel alike, alpha included, and clamp nothing. NaN and infinity spread exactly over
/// the part of a kernel that has weight. S is the sum of |weight * sample| under the kernel, W and H its
/// width and height, u = 2^-24. Formulas and the papers' mistakes: doc/maths/filter.md. @file

/// How a result is computed. All give the same picture within their bounds; kAuto takes the cheapest that
/// stays within the bound of doc/accuracy.md.
enum class FilterMethod {
  kAuto,
  kDirect,     ///< every weight of the kernel
  kSeparable,  ///< one column and one row; error where the kernel is not their product
  kLowRank,    ///< a sum of such products, as many as float32 can tell apart; NaN spreads over the rectangle
  kFft,        ///< fast Fourier transform in blocks; blocks that hold NaN or infinity are computed directly
  kRecursive,  ///< Gaussian: three pairs of complex poles, constant time; box: running sums in double
  kDecimated,  ///< Gaussian with sigma of 16 and more: at a quarter of the resolution
};

/// A kernel of width x height weights, row by row, top row first. The weight at column anchor_x, row anchor_y
/// lies over the pixel that is computed. With `planes` above 1 there is one such set of weights per channel.
struct Kernel {
  int width = 1;                      ///< columns
  int height = 1;                     ///< rows
  int anchor_x = 0;                   ///< column over the pixel computed
  int anchor_y = 0;                   ///< row over the pixel computed
  int planes = 1;                     ///< sets of weights: 1, or one per channel
  std::vector<double> weights = {1};  ///< width * height * planes of them

  /// The weight at column x, row y.
  double at(int x, int y, int plane = 0) const {
    return weights[(static_cast<size_t>(plane) * height + static_cast<size_t>(y)) * width + x];
  }
};

/// A kernel by name. Of fixed size (doc/maths/filter.md; weights as printed, with the divisor that makes
/// their sum 1 where they are a mean or a smoothing): line_horizontal, line_vertical, line_left, line_right,
/// emboss_n .. emboss_nw, mean3, smooth3, smooth5 (1 4 6 4 1 binomial), smooth5_course, highpass3, highpass5,
/// highpass5_course, laplacian3, laplacian5, sobel_x, sobel_y, prewitt_x, prewitt_y, scharr_x, scharr_y. Of
/// any size, sampled at whole pixels and divided by their sum as oiiotool's --kernel: box, triangle, gaussian
/// (sigma width/4), sharp-gaussian, catmull-rom, blackman-harris, sinc, lanczos3, radial-lanczos3, mitchell,
/// bspline, disk, cubic, keys, simon, rifman, binomial, and laplacian (3x3 only, not divided). Sizes are
/// rounded up to whole odd numbers, at most 255. Throws Error: other sizes, other names (with the nearest
/// known one).
Kernel NamedKernel(const std::string& name, double width = 3, double height = 3);
/// The size as text, "7x5" or "7".
Kernel NamedKernel(const std::string& name, const std::string& size);
/// Every name that NamedKernel knows.
std::vector<std::string> KernelNames();

/// The kernel as a one-channel image whose data window has the anchor at pixel (0, 0), as oiiotool's
/// --kernel.
Node KernelImage(const Kernel& kernel);

/// result(x, y) = sum over i, j of weight(i, j) * image(x - i + anchor_x, y - j + anchor_y) / divisor + bias;
/// `correlate` adds i and j instead (what other programs often call convolution). divisor 0 stands for 1.
/// `bias` is multiplied by the pixel's alpha where there is one, as SVG's feConvolveMatrix has it.
/// `preserve_alpha` divides colours by alpha, convolves only them, and multiplies by alpha again. |error| <=
/// (6 + a) u S, where a additions come one after the other: direct H * ceil(W / 4), separable 3 + H +
/// ceil(W / 4), low rank 12 + 2 (H + ceil(W / 4)) + min(W, H); sums of differences, of kernels up to 5x5
/// whose sum is 0, have the largest sample times the sum of |weight| more in S. Cost grows with the kernel's
/// area up to some 10x10, then with its side (separable), or with its logarithm. Two samples that share a
/// weight of a symmetric row or column are added first: beyond half of the largest float they overflow. Error
/// when the kernel is larger than 255x255, empty, or holds NaN or infinity, or when its planes are neither 1
/// nor as many as there are channels. Flat images stay within 1 ULP under kernels up to 5x5 whose sum is 1, 3
/// ULP under larger ones, and give exactly 0 under kernels up to 5x5 whose sum is 0. Images of 8- and 16-bit
/// integers: the result, written as such, is the exact sum rounded once, half to even; blurs and BoxBlur with
/// kernels up to 255x255 too. With kFft |error| <= 16 u times the root of the sum of squared weights times
/// that of a block's squared deviations from its mean; blocks in which a sample deviates by more than 16
/// times the mean magnitude are transformed in double and keep to the bound of sums.
struct ConvolveParams {
  bool correlate = false;                     ///< the kernel as it lies, not turned by half
  double divisor = 0;                         ///< 0 stands for 1
  double bias = 0;                            ///< added to the sum
  bool preserve_alpha = false;                ///< colours alone, without their alpha
  Wrap wrap = Wrap::kClamp;                   ///< what lies beyond the image
  double border_value = 0;                    ///< the sample of kBlack
  FilterMethod method = FilterMethod::kAuto;  ///< how it is computed

  /// 8 to 32: an accumulation buffer in fixed point is modelled, see ShiftAccumulate; for one plane without
  /// bias, preserved alpha, border value or kRenormalize, else Error. 0: exact.
  int bits = 0;
};
/// The image under a kernel, as ConvolveParams says.
Node Convolve(const Node& image, const Kernel& kernel, const ConvolveParams& params = {});
/// The kernel is an image: its data window says where the anchor (pixel (0, 0)) is. One channel serves all,
/// or there are as many as the image has. `normalize` divides by the sum of the weights (not when that is 0).
/// As oiiotool with `correlate`.
Node Convolve(const Node& image, const Node& kernel, const ConvolveParams& params = {},
              bool normalize = true);
/// The operation that both make, for --explain and the reference.
struct Convolution {
  Kernel kernel;              ///< as given; of a kernel image only size and anchor
  ConvolveParams params;      ///< without preserve_alpha, which is a graph of its own
  bool kernel_image = false;  ///< the kernel is the second input
  bool normalize = false;     ///< it is divided by its sum
};

/// A Gaussian of standard deviation sigma in pixels, 0 to 10,000 (0 leaves an axis alone), normalised. Along
/// each axis the L1 distance of what is computed from the sampled Gaussian is below 1e-6 with kDirect and
/// kSeparable, 2e-5 with kRecursive (sigma of 2 and more), 1e-4 with kDecimated (16 and more), near every
/// border as in the middle. kAuto sums directly up to sigma 3, takes kRecursive below 16 and kDecimated from
/// there. Those two need whole images in memory; a NaN or infinity anywhere makes them sum directly instead,
/// which takes longer. Direct sums add two samples of one weight first, with Convolve's limit. Flat images
/// stay within 2 ULP. Error for other sigmas and methods.
struct GaussianParams {
  double sigma_x = 1;                         ///< pixels, 0 to 10,000
  double sigma_y = 1;                         ///< pixels, 0 to 10,000
  Wrap wrap = Wrap::kClamp;                   ///< what lies beyond the image
  double border_value = 0;                    ///< the sample of kBlack
  FilterMethod method = FilterMethod::kAuto;  ///< how it is computed

  /// 8 to 32: rows, then columns through an accumulation buffer of that many binary places (ShiftAccumulate),
  /// scaled apart; for sigma up to 24.9, kAuto or kDirect, and borders as with Convolve's bits, else Error.
  int bits = 0;
};
/// A Gaussian blur, as GaussianParams says.
Node GaussianBlur(const Node& image, const GaussianParams& params);
/// The same sigma both ways.
Node GaussianBlur(const Node& image, double sigma);

/// The mean of width x height pixels, at a cost that does not depend on the size. Sums are taken in double; a
/// NaN, an infinity or a much larger value leaves with the window: up to 255 pixels nothing is ever
/// subtracted (sums of blocks' ends and begins), beyond that running sums start afresh. |error| <= 2 u S.
/// Sizes 1 to 65,535; an even size has its anchor at (size - 1) / 2.
struct BoxParams {
  int width = 3;                              ///< pixels, 1 to 65,535
  int height = 3;                             ///< pixels, 1 to 65,535
  Wrap wrap = Wrap::kClamp;                   ///< what lies beyond the image
  double border_value = 0;                    ///< the sample of kBlack
  FilterMethod method = FilterMethod::kAuto;  ///< how it is computed
};
/// The mean of a rectangle, as BoxParams says.
Node BoxBlur(const Node& image, const BoxParams& params);

/// Differences of neighbours weighted 1 2 1, differences first: exactly 0 on flat images, 8 times the slope
/// on a ramp. kMagnitude sqrt(X^2 + Y^2); kDirection atan2(Y, X) in radians, y down, the direction of the
/// gradient; kXY both components, channel c becoming c.x and c.y. X and Y: |error| <= 4 u S with S the sum of
/// weights times differences.
enum class SobelOutput { kMagnitude, kDirection, kXY };
/// Parameters of Sobel; the outputs are described at SobelOutput.
struct SobelParams {
  SobelOutput output = SobelOutput::kMagnitude;  ///< what is given
  Wrap wrap = Wrap::kClamp;                      ///< what lies beyond the image
  int bits = 0;  ///< 8 to 32: X and Y are summed in an accumulation buffer, see ShiftAccumulate; else Error

  /// kFft: X and Y are convolutions by block transforms, with their error; all others but kRecursive and
  /// kDecimated, which are an Error, are the same differences and sums.
  FilterMethod method = FilterMethod::kAuto;

  /// X and Y are images of their own.
  bool by_parts() const { return bits != 0 || method == FilterMethod::kFft; }
};
/// Gradients, as SobelOutput says.
Node Sobel(const Node& image, const SobelParams& params = {});

/// image + contrast * (image - blurred), the difference set to 0 where it is below threshold, as oiiotool's
/// --unsharp; `kernel` is a name that NamedKernel knows, or "median".
struct UnsharpParams {
  std::string kernel = "gaussian";  ///< of the blur
  double width = 3;                 ///< of the kernel, pixels
  double contrast = 1;              ///< factor of the difference
  double threshold = 0;             ///< smaller differences count as 0
  Wrap wrap = Wrap::kClamp;         ///< what lies beyond the image
  int bits = 0;  ///< 8 to 32: blurred through an accumulation buffer, see Convolve; not with "median"
  FilterMethod method = FilterMethod::kAuto;  ///< of the blur, as Convolve has them; "median" has kAuto alone
};
/// Sharpened, as UnsharpParams says.
Node UnsharpMask(const Node& image, const UnsharpParams& params = {});

/// Order statistics of width x height pixels around each one, per channel; pixels beyond the image do not
/// take part, as oiiotool's --median, --dilate and --erode. The window starts max(1, size / 2) pixels before
/// the pixel. The median of an even number is the upper one. NaN ranks above every number in the median, and
/// loses to numbers in dilation (maximum) and erosion (minimum). Exact. Cost: of large medians in proportion
/// to the height, of bytes, of dilation and erosion hardly more for large windows than for small ones. Error
/// for sizes other than 1 to 255.
struct RankParams {
  int width = 3;   ///< pixels, 1 to 255
  int height = 3;  ///< pixels, 1 to 255
};
/// The middle sample of a window, as RankParams says.
Node Median(const Node& image, const RankParams& params);
/// The largest sample of a window, as RankParams says.
Node Dilate(const Node& image, const RankParams& params);
/// The smallest sample of a window, as RankParams says.
Node Erode(const Node& image, const RankParams& params);

/// Of a dilation and an erosion (Haralick et al. 1987).
enum class MorphologyOperator : uint8_t {
  kOpen,      ///< the erosion dilated: light spots that the window does not fit into go
  kClose,     ///< the dilation eroded: dark spots go
  kGradient,  ///< dilation - erosion
  kTopHat,    ///< image - open
  kBlackHat   ///< close - image
};
/// Grey-scale morphology per channel, alpha included; pixels beyond the image take no part, as OpenCV's
/// morphologyEx. Open and close are exact, differences rounded once. Cost: two to three dilations. Error
/// unless both sides of the window are odd, 1 to 255.
Node Morphology(const Node& image, MorphologyOperator op, const RankParams& window);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_FILTER_H_
