/// Linear colour operations: matrices, saturation, hue, luminance, CMY(K), YIQ, interpolation,
/// premultiplication. @file
#ifndef TESSERA_OPS_COLOR_H_
#define TESSERA_OPS_COLOR_H_

#include <optional>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// All act on the channels R, G, B (the first three) and, where said, on alpha; other channels pass through.
/// Values are linear light, unbounded: nothing is clamped. Of fewer than three channels Cmy, Brightness,
/// Contrast, Premultiply and Unpremultiply take greys as AsColors does (ops/channels.h); else Error naming
/// the channels present. Neighbours that are affine (all but Cmyk, Interpolate, Premultiply, Unpremultiply,
/// and a contrast about the image's own mean) fold into one matrix in double. A NaN or infinity in R, G or B
/// reaches R, G and B of its pixel in matrices (not in scale and bias); alpha is not touched by it. u =
/// 2^-24. Sources: Haeberli 1993; Haeberli and Voorhies 1994; McReynolds et al. 1997, 12.2;
/// doc/maths/color.md. @file

/// Weights of R, G, B in the luminance L = w . (R,G,B). They are divided by their sum when an operation is
/// built; Error when one is not finite or the sum's magnitude is below 1e-6. Zero and negative weights are
/// legal.
struct LuminanceWeights {
  double r = 0.2126;  ///< of red
  double g = 0.7152;  ///< of green
  double b = 0.0722;  ///< of blue
};
inline constexpr LuminanceWeights kRec709 = {0.2126, 0.7152, 0.0722};    ///< linear Rec.709 and sRGB data
inline constexpr LuminanceWeights kHaeberli = {0.3086, 0.6094, 0.0820};  ///< linear RGB of period monitors
inline constexpr LuminanceWeights kNtsc601 = {0.299, 0.587, 0.114};  ///< the Y of YIQ: gamma-encoded video

/// An angle in degrees.
struct Degrees {
  double value;  ///< degrees

  /// Explicit, so that a bare number is never taken for one.
  explicit constexpr Degrees(double v) : value(v) {}
};

/// `values` row-major: 9 (3x3), 12 (3x3, then the bias of R, G, B), 16 (4x4) or 20 (4x4, then the bias of R,
/// G, B, A). As oiiotool, a pixel is a ROW vector: (R,G,B,A)' = (R,G,B,A) M + bias; `transpose` makes it M
/// (R,G,B,A) + bias. An image without alpha takes part with the upper left 3x3 and the bias, as oiiotool.
/// `unpremult` divides R, G, B by alpha before and multiplies them by the same (input) alpha after; where
/// alpha is 0 it does neither. Error for other counts and for numbers that are not finite. A singular matrix
/// is legal. NaN and infinity pass between colour and alpha only where some entry couples them. |error| <= 4
/// u (sum of |m v| + |bias|).
struct ColorMatrixParams {
  std::vector<double> values;  ///< 9, 12, 16 or 20, row-major
  bool transpose = false;      ///< a pixel is a column vector
  bool unpremult = false;      ///< colours without their alpha
};
/// Colours through a matrix, as ColorMatrixParams says.
Node ColorMatrix(const Node& image, const ColorMatrixParams& params);

/// s p + (1 - s) L: s = 0 grey (three equal channels), 1 the input's bits, above 1 oversaturated, below 0
/// reflects the chroma through grey. Keeps L. |error| <= 8 u max(|R|,|G|,|B|) max(1, |s|).
struct SaturateParams {
  double saturation = 1;               ///< 0: grey, 1: the image
  LuminanceWeights weights = kRec709;  ///< of the luminance
};
/// More or less chroma about the luminance, as SaturateParams says.
Node Saturate(const Node& image, const SaturateParams& params);
/// The same by its numbers.
Node Saturate(const Node& image, double saturation, const LuminanceWeights& weights = kRec709);

/// Turns hue by an angle (reduced modulo 360 in double; multiples of 90 are exact, 0 keeps the input's bits).
/// kLuminance: H = 1 w^T + cos t P + sin t P [g]x with P = I - 1 w^T, which keeps L and greys;
/// kNone: the plain rotation about the grey axis, which keeps R + G + B. +120 turns red to green. kCss: the
/// matrix of SVG's hueRotate and CSS' hue-rotate() with its published coefficients, which keeps 0.213 R +
/// 0.715 G + 0.072 B; unlike theirs the result is not limited to [0,1]. |error| <= 8 u max(|R|,|G|,|B|), kCss
/// 8 u sum of |m v|.
enum class HuePreserve : uint8_t {
  kLuminance,  ///< the weighted luminance
  kNone,       ///< the grey axis alone
  kCss,        ///< what Filter Effects 1 keeps
};
/// An angle, and what the rotation keeps.
struct HueParams {
  double degrees = 0;                              ///< counter-clockwise, red to green
  HuePreserve preserve = HuePreserve::kLuminance;  ///< what the rotation keeps
  LuminanceWeights weights = kRec709;              ///< of the luminance, for kLuminance
};
/// Hues turned through the circle, as HueParams says.
Node RotateHue(const Node& image, const HueParams& params);
/// The same by its angle, luminance kept.
Node RotateHue(const Node& image, Degrees angle, const LuminanceWeights& weights = kRec709);

/// R = G = B = L; alpha kept. |error| <= 4 u sum of |w v|.
struct LuminanceParams {
  LuminanceWeights weights = kRec709;  ///< divided by their sum
};
/// Grey of the same luminance, as LuminanceParams says.
Node Luminance(const Node& image, const LuminanceParams& params = {});

/// (C,M,Y) = 1 - (R,G,B), alpha kept; its own inverse. One rounding. Meant for unpremultiplied colours.
struct CmyParams {};
/// Ink instead of light, as CmyParams says.
Node Cmy(const Node& image);

/// (C,M,Y) = 1 - (R,G,B), K = min(C,M,Y), C, M, Y less K. The result has exactly the four channels C, M, Y,
/// K, K being the fourth; alpha and further channels are dropped. In the minimum a number wins over NaN.
/// |error| <= 4 u max(1, |R|, |G|, |B|).
struct CmykParams {};
/// Ink with black, as CmykParams says.
Node Cmyk(const Node& image);

/// Y = 0.299 R + 0.587 G + 0.114 B, I = 0.596 R - 0.275 G - 0.321 B, Q = 0.212 R - 0.523 G + 0.311 B, in the
/// places of R, G, B; `inverse` is the inverse of exactly these numbers, computed in double. |error| <= 4 u
/// sum of |m v|.
struct YiqParams {
  bool inverse = false;  ///< from YIQ to RGB
};
/// To the YIQ of NTSC and back, as YiqParams says.
Node Yiq(const Node& image, const YiqParams& params = {});

/// (1 - x) first + x second, every channel; x may leave [0, 1]. x = 0 and x = 1 give the bits of the first
/// and the second image; equal images give themselves. Where the difference overflows the weighted sum is
/// used, so that FLT_MAX and -FLT_MAX meet at 0. |error| <= 4 u (|(1-x) first| + |x second|). The images have
/// equal data windows and channel counts, else Error names both.
struct InterpolateParams {
  double x = 0.5;  ///< 0: the first image, 1: the second
};
/// Between two images and beyond, as InterpolateParams says.
Node Interpolate(const Node& first, const Node& second, const InterpolateParams& params);
/// The same by its number.
Node Interpolate(const Node& first, const Node& second, double x);

/// x (R,G,B): interpolation from black. Alpha kept. One rounding of the product with x rounded to float.
struct BrightnessParams {
  double x = 1;  ///< 1 keeps the image
};
/// Colours scaled, as BrightnessParams says.
Node Brightness(const Node& image, const BrightnessParams& params);
/// The same by its number.
Node Brightness(const Node& image, double x);

/// pivot + x ((R,G,B) - pivot): interpolation from a constant grey. Without a pivot it is the image's mean
/// luminance over finite pixels (one pass of its own), and an image without finite pixels is returned
/// unchanged. Alpha kept. |error| <= 2 u (|x v| + |(1 - x) pivot|).
struct ContrastParams {
  double x = 1;                        ///< 1 keeps the image, 0 gives the pivot
  std::optional<double> pivot;         ///< the grey; none: the mean luminance
  LuminanceWeights weights = kRec709;  ///< of the mean luminance
};
/// Colours scaled about a grey, as ContrastParams says.
Node Contrast(const Node& image, const ContrastParams& params);
/// The same by its number, about the image's mean luminance.
Node Contrast(const Node& image, double x);

/// Contrast as oiiotool means it, on every channel, alpha included: r = (v - black) / (white - black), by
/// scontrast other than 1 bent into a sigmoid of that slope about sthresh that keeps 0 and 1, gives min +
/// r (max - min); a channel whose black is white becomes min below it and max from there on, NaN too. Lists
/// hold one value for all channels, or one per channel; channels beyond a list have its last value. As soon
/// as one scontrast is not 1 every channel is bent; one of 0 is the line. NaN stays NaN, infinities follow
/// the limit. Error for numbers that are not finite, for a sigmoid that is flat from black to white, and for
/// clamp with min above max. |error| <= 3 u (|result| + its terms), terms of a sigmoid divided by 2^20.
struct ContrastRemapParams {
  std::vector<double> black = {0};      ///< becomes min
  std::vector<double> white = {1};      ///< becomes max
  std::vector<double> min = {0};        ///< of the result
  std::vector<double> max = {1};        ///< of the result
  std::vector<double> scontrast = {1};  ///< slope of the sigmoid, 1 for none
  std::vector<double> sthresh = {0.5};  ///< where it is steepest, 0 at black and 1 at white
  bool clamp = false;                   ///< limits the result to [min, max]
};
/// Values from [black, white] to [min, max], as ContrastRemapParams says.
Node ContrastRemap(const Node& image, const ContrastRemapParams& params);

/// Sony Pictures Imageworks' logarithmic range, as OpenImageIO has it: |v| up to 0.18 stays, above it |v|
/// becomes a + b ln(c |v| + 1) with a = -0.54576886, b = 0.1835167, c = 284.35779, signs kept; 1 becomes
/// 0.4918, 100 1.336. Alpha and the depth channel Z are kept. With `luma`, of an image whose first three
/// channels are neither, R, G and B are scaled by the factor that their luminance (0.21264, 0.71517, 0.07219)
/// goes through; where that is not above 0 they become 0; other channels are kept. NaN stays NaN, infinities
/// stay. |error| <= 3 u |result|.
struct RangeParams {
  bool luma = false;  ///< colours keep their ratios
};
/// Highlights compressed, as RangeParams says.
Node RangeCompress(const Node& image, const RangeParams& params = {});
/// The inverse.
Node RangeExpand(const Node& image, const RangeParams& params = {});

/// R, G, B times alpha, or divided by it; alpha kept. One rounding. Unpremultiply leaves pixels with alpha 0
/// alone; tiny alphas (1e-40) divide, to infinity if need be; a NaN alpha gives NaN. An image without alpha
/// is returned unchanged. Unpremultiply marks the result as unpremultiplied (ColorState), the others
/// as premultiplied: writers store what it says. Repremultiply is Premultiply but for pixels with alpha 0,
/// which keep their colours (glows, fire): it undoes Unpremultiply.
struct PremultiplyParams {};
/// Colours times alpha, as PremultiplyParams says.
Node Premultiply(const Node& image);
/// Colours times alpha where that is not 0, as PremultiplyParams says.
Node Repremultiply(const Node& image);
/// Colours over alpha, as PremultiplyParams says.
Node Unpremultiply(const Node& image);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_COLOR_H_
