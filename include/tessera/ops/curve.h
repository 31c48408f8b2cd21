/// Curves of one channel evaluated by formula: powers, transfer functions of video and cameras, logarithms.
/// @file
#ifndef TESSERA_OPS_CURVE_H_
#define TESSERA_OPS_CURVE_H_

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// What a formula does with negative samples.
enum class Negatives : uint8_t {
  kMirror,  ///< f(-x) = -f(x)
  kExtend,  ///< the formula as it stands; its linear part goes on below 0
  kClamp,   ///< as 0
  kKeep,    ///< returned as they are
};

/// One curve as a formula. With v = in_scale x + in_offset:
///   kPower  out_scale v^exponent + out_offset; v below 0 counts as 0
///   kLog    out_scale log2(v) + out_offset;    v below `floor` counts as `floor`; log2(0) is -infinity
///   kExp    out_scale 2^v + out_offset
///   kPq, kPqInverse, kHlg, kHlgInverse: SMPTE ST 2084 and ARIB STD-B67 (BT.2100) between light and signal in
///   [0,1],
///           PQ light in units of 10,000 cd/m^2, HLG scene light; the other numbers are not used
///   kLinear slope x + offset
/// and slope x + offset for x < join. Evaluated in more than float's precision (double, two floats, or
/// polynomials that are fitted to the formula) and rounded once.
struct CurveFormula {
  /// The formulas, as above.
  enum class Kind : uint8_t { kLinear, kPower, kLog, kExp, kPq, kPqInverse, kHlg, kHlgInverse };
  Kind kind = Kind::kLinear;                               ///< which formula
  double in_scale = 1;                                     ///< factor before it
  double in_offset = 0;                                    ///< added to that product
  double exponent = 1;                                     ///< of kPower
  double out_scale = 1;                                    ///< factor after it
  double out_offset = 0;                                   ///< added to that product
  double floor = 0;                                        ///< kLog: smallest argument
  double join = -std::numeric_limits<double>::infinity();  ///< where the line below the curve ends
  double slope = 1;                                        ///< of that line
  double offset = 0;                                       ///< of that line
  Negatives negatives = Negatives::kExtend;                ///< what becomes of negative samples

  /// The same numbers throughout.
  bool operator==(const CurveFormula&) const = default;
};

/// Formulas on channels: one for all three colours, or one each for R, G, B (and a fourth for alpha, where
/// the image has it). An image with fewer than three channels uses the first formula for every channel but
/// alpha. Channels beyond keep their bits, alpha too unless it has a formula. NaN stays NaN, infinities
/// follow the limit. |error| <= 2 u (|result| + 2^-20 (|out_scale w| + |out_offset|)), u = 2^-24, w the
/// power, logarithm or exponential: 1 ULP except where a sum cancels to almost nothing. Monotone where the
/// formula is. Error for other counts of formulas and for numbers that are not finite (join may be infinite).
struct CurveParams {
  std::vector<CurveFormula> formulas;  ///< 1, 3 or 4
};
/// Samples through formulas, as CurveParams says.
Node ApplyCurve(const Node& image, const CurveParams& params);

/// Named curves between scene- or display-linear light and a signal. Constants as published; where published
/// pieces do not quite meet, the join is moved to where they do (sRGB: 0.00313066844 instead of 0.0031308;
/// Rec.709 with BT.2020's alpha 1.09929682680944, beta 0.018053968510807), so that every curve is continuous,
/// monotone over all floats, and the exact inverse of its inverse.
enum class TransferFunction : uint8_t {
  kSrgb,     ///< IEC 61966-2-1
  kRec709,   ///< BT.709 camera curve (also BT.601, BT.2020)
  kPq,       ///< SMPTE ST 2084; 1.0 is 10,000 cd/m^2
  kHlg,      ///< ARIB STD-B67 scene light to signal
  kAcesCct,  ///< S-2016-001
  kLog10,    ///< log10(x)
  kCineon,   ///< printing density 10 bits: black 95, white 685, 0.002 a code, gamma 0.6
  kLogC3,    ///< ARRI LogC3, EI 800
  kLogC4,    ///< ARRI LogC4
  kSLog3,    ///< Sony S-Log3
  kVLog,     ///< Panasonic V-Log
  kLog3G10,  ///< RED Log3G10
  kLog2,     ///< log2(x)
  kLn,       ///< ln(x)
};
/// Light to signal, and back. Default for negatives: mirrored for sRGB, Rec.709, PQ and HLG; the others as
/// they stand.
CurveFormula Encoding(TransferFunction curve);
/// Signal to light.
CurveFormula Decoding(TransferFunction curve);
/// Light to signal: ApplyCurve with Encoding(curve).
Node Encode(const Node& image, TransferFunction curve);
/// Signal to light: ApplyCurve with Decoding(curve).
Node Decode(const Node& image, TransferFunction curve);
/// Names as on the command line ("srgb", "rec709", ...), in the order of the enumeration.
const std::vector<std::string>& TransferFunctionNames();

/// x^exponent of the colours.
Node Power(const Node& image, double exponent, Negatives negatives = Negatives::kMirror);

/// Channel by channel x^c as C's pow: negative samples need a whole exponent, else NaN; pow(x, 0) = 1, even
/// of NaN. One value serves every channel, alpha included; of several the n-th is channel n's, and channels
/// beyond the list keep their bits: as oiiotool's --powc. |error| <= 3 u |result| (1.5 ULP; measured 0.7).
struct PowerConstants {
  std::vector<double> values;  ///< exponents in channel order
};
/// Samples to powers, as PowerConstants says.
Node PowerConstant(const Node& image, const std::vector<double>& values);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_CURVE_H_
