/// Arithmetic of images and constants, channel by channel: sums, products, comparisons, limits, quantising.
/// @file
#ifndef TESSERA_OPS_ARITHMETIC_H_
#define TESSERA_OPS_ARITHMETIC_H_

#include <cstdint>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Two images of the same number of channels, else Error names both; a second image of one channel goes with
/// every channel of the first (Mad: not). The result covers both windows, 0 for a pixel that one lacks (Mad:
/// equal windows), and has the first's channel names, alpha and metadata. Each sample is computed by one
/// correctly rounded float32 operation; NaN and infinities follow IEEE 754, -0 included. Nothing is clamped.
Node Add(const Node& a, const Node& b);      ///< a + b
Node Sub(const Node& a, const Node& b);      ///< a - b
Node Mul(const Node& a, const Node& b);      ///< a * b
Node AbsDiff(const Node& a, const Node& b);  ///< |a - b|
Node Div(const Node& a, const Node& b);      ///< a / b; 0 where b is 0, whatever a is

/// The smaller and the larger sample, bit for bit. A number wins over NaN on either side, NaN only of two
/// NaNs; of -0 and +0 the second operand's is the result.
Node Min(const Node& a, const Node& b);
/// The larger sample, likewise.
Node Max(const Node& a, const Node& b);
/// Three images: a * b + c, one rounding on processors with fused multiply-add, two on others:
/// |error| <= 2 u (|a b| + |c|), u = 2^-24.
Node Mad(const Node& a, const Node& b, const Node& c);

/// An image and one constant per channel, in channel order (alpha and further channels included). One value
/// serves every channel; with two or more, channels beyond the list are as if the default stood there (0 for
/// add and subtract, 1 for multiply and divide, 0 for min, max and absolute difference), and values beyond
/// the last channel are ignored: as oiiotool. Values must be finite and within float32's range, else Error.
struct ChannelConstants {
  std::vector<double> values;  ///< in channel order
};
/// Image + c.
Node AddConstant(const Node& image, const std::vector<double>& values);
/// Image - c.
Node SubConstant(const Node& image, const std::vector<double>& values);
/// Image * c.
Node MulConstant(const Node& image, const std::vector<double>& values);
/// Image / c: times the rounded reciprocal. A divisor of 0 multiplies by 0: numbers become 0, NaN and
/// infinities NaN. Error for one whose reciprocal leaves float32's range.
Node DivConstant(const Node& image, const std::vector<double>& values);
/// The smaller of both.
Node MinConstant(const Node& image, const std::vector<double>& values);
/// The larger of both.
Node MaxConstant(const Node& image, const std::vector<double>& values);
/// Abs(image - c).
Node AbsDiffConstant(const Node& image, const std::vector<double>& values);

/// |image|, every channel; -0 gives +0, NaN stays NaN.
Node Abs(const Node& image);

/// Channels [first, last) become 1 - value; `last` beyond the channel count means all that there are.
/// Defaults: the colour channels, sparing alpha, as oiiotool. Error unless 0 <= first <= last.
struct InvertParams {
  int first = 0;  ///< channel
  int last = 3;   ///< channel behind the last
};
/// 1 - value, as InvertParams says.
Node Invert(const Node& image, const InvertParams& params = {});

/// Limits per channel, read like the constants above, but a channel beyond a list is not limited on that side
/// and an empty list limits nothing. clamp_alpha limits alpha to [0, 1] as well. A limit wins over NaN (the
/// lower one where there are both); a channel without limits keeps its bits. Error where a minimum exceeds
/// its maximum.
struct ClampParams {
  std::vector<double> min;   ///< lower limits
  std::vector<double> max;   ///< upper limits
  bool clamp_alpha = false;  ///< alpha to [0, 1] as well
};
/// Limited from below and above, as ClampParams says.
Node Clamp(const Node& image, const ClampParams& params);

/// Thresholds per channel, read like the constants above.
struct ThresholdParams {
  std::vector<double> values;  ///< what is exceeded, one for all channels or one each
  double softness = 0;         ///< width of the ramp from 0 to 1 around them, 1e-30 to 1e30; 0: a step
};
/// 1 where a sample is above its threshold, else 0 (the threshold itself and NaN too); with a softness
/// (sample - threshold) / softness + 1/2 between 0 and 1. A step is exact, a ramp off by 4 u (|threshold| /
/// softness + 1).
Node Threshold(const Node& image, const ThresholdParams& params);

/// What becomes of samples that are NaN or infinite.
enum class FixNanMode : uint8_t {
  kNone,   ///< nothing
  kBlack,  ///< 0
  kBox3,   ///< the mean of the finite ones among the nine pixels around, within the image; 0 of none
  kError,  ///< a DataError while the result is computed, where any of its pixels has one
};
/// Of FixNan.
struct FixNanParams {
  FixNanMode mode = FixNanMode::kBox3;  ///< what is done
};
/// Samples mended; finite ones keep their bits. Each looks at the image as it was: the order of pixels does
/// not matter. The mean is summed in double and rounded once.
Node FixNan(const Node& image, FixNanMode mode);

/// Every channel to the nearest of 2^bits codes in [0, 1]: code / (2^bits - 1), correctly rounded; code is
/// the exact product value * (2^bits - 1) rounded half to even, the value first limited to [0, 1], NaN to 0:
/// what storing as an integer of that depth and reading back does. With `dither` an offset in [-1/2, 1/2) of
/// a code, from a hash of (x, y, channel, seed), is added before rounding: the mean of a flat area is kept,
/// codes 0 and the last are kept, and the pattern depends on nothing but position and seed. Error unless 1 <=
/// bits <= 24.
struct QuantizeParams {
  int bits = 8;         ///< 1 to 24
  bool dither = false;  ///< with an offset before rounding
  uint32_t seed = 0;    ///< of the offsets
};
/// Rounded to codes, as QuantizeParams says.
Node Quantize(const Node& image, const QuantizeParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_ARITHMETIC_H_
