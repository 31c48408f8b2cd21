/// Grading by the controls that people know: exposure, white balance, lift and gain, levels, curves, keys.
/// @file
#ifndef TESSERA_OPS_GRADE_H_
#define TESSERA_OPS_GRADE_H_

#include <array>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// All are made of other operations (constants, matrices, curves, tables, channels): they fuse as those do,
/// and a result's bound is what theirs make together. They act on R, G, B, the first three channels; alpha
/// and further channels keep their bits. Greys, one or two channels, are taken as AsColors does
/// (ops/channels.h). Values are unbounded: nothing is limited but where it is said. Formulas and sources:
/// doc/maths/grade.md. @file

/// R, G, B.
using Rgb = std::array<double, 3>;

/// R, G, B times 2^stops, |stops| up to 60. MulConstant's bound.
Node Exposure(const Node& image, double stops);

/// Primaries of the image, which is linear.
enum class Primaries : uint8_t {
  kRec709,   ///< also sRGB's
  kRec2020,  ///< BT.2020
  kAp1,      ///< ACEScg
};
/// Light of a scene, and what it is to become. The white of a temperature is the CIE's daylight from 5,000 K,
/// Planck's radiator up to 4,000 K, mixed linearly in (u, v) between; tint is the distance from there at
/// right angles to the locus in the (u, v) diagram of 1960, in 1/3000, and positive ones take green away.
/// Whites are carried over by von Kries' scaling of Bradford's responses. Error for temperatures outside
/// 1,000 to 25,000 K and |tint| above 150.
struct WhiteBalanceParams {
  double kelvin = 6504;                      ///< of the light that is to become white
  double tint = 0;                           ///< positive: the light is greener than its locus
  double to = 6504;                          ///< of the white that it becomes; that of the primaries is usual
  Primaries primaries = Primaries::kRec709;  ///< of the image
};
/// Colours under another light, as WhiteBalanceParams says: one 3x3 matrix.
Node WhiteBalance(const Node& image, const WhiteBalanceParams& params);
/// That matrix, row-major, for column vectors.
std::array<double, 9> WhiteBalanceMatrix(const WhiteBalanceParams& params);

/// v = multiply (gain - lift) / (white - black) (x - black) + lift multiply + offset, then v^(1/gamma); v
/// below 0 is kept as it is, or 0 with `clamp_black`, `clamp_white` limits the result to 1. For each of R, G,
/// B. Error where black is white or a gamma is not positive.
struct GradeParams {
  Rgb black = {0, 0, 0};     ///< becomes lift
  Rgb white = {1, 1, 1};     ///< becomes gain
  Rgb lift = {0, 0, 0};      ///< of what is black
  Rgb gain = {1, 1, 1};      ///< of what is white
  Rgb multiply = {1, 1, 1};  ///< factor of all
  Rgb offset = {0, 0, 0};    ///< added to all
  Rgb gamma = {1, 1, 1};     ///< above 1 lifts the middle
  bool clamp_black = false;  ///< below 0 is 0
  bool clamp_white = false;  ///< above 1 is 1
};
/// Lift, gamma, gain and their kin, as GradeParams says.
Node Grade(const Node& image, const GradeParams& params);

/// The ASC's colour decision list, version 1.2: (slope x + offset)^power, then saturation by Rec.709's
/// weights. With `clamp` values are limited to [0, 1] before the power and at the end, as the ASC wants it;
/// without, values below 0 are kept from the power. Error for slopes below 0 and powers or a saturation that
/// are not positive, saturation may be 0.
struct CdlParams {
  Rgb slope = {1, 1, 1};   ///< factor
  Rgb offset = {0, 0, 0};  ///< added
  Rgb power = {1, 1, 1};   ///< exponent
  double saturation = 1;   ///< 0: grey
  bool clamp = true;       ///< as the ASC wants it
};
/// A grade by the numbers of a colour decision list, as CdlParams says.
Node Cdl(const Node& image, const CdlParams& params);

/// (x - black) / (white - black), limited to [0, 1] unless told otherwise, to 1/gamma, and from [0, 1] to
/// [out_black, out_white].
struct LevelsParams {
  Rgb black = {0, 0, 0};  ///< becomes out_black
  Rgb white = {1, 1, 1};  ///< becomes out_white
  double gamma = 1;       ///< above 1 lifts the middle
  double out_black = 0;   ///< what black becomes
  double out_white = 1;   ///< what white becomes
  bool clamp = true;      ///< to what black and white become
};
/// Levels, as LevelsParams says.
Node Levels(const Node& image, const LevelsParams& params);

/// L + (1 + amount (1 - s)) (x - L), L the luminance (Rec.709) and s = max - min of R, G, B limited to [0,
/// 1]: weak colours gain most. Five roundings.
Node Vibrance(const Node& image, double amount);

/// A curve through control points, x rising in [0, 1]: monotone cubic pieces, level beyond the first and the
/// last. Tabulated at 4,097 places, linear between: samples are limited to [0, 1] first, NaN is 0.
using CurvePoints = std::vector<std::array<double, 2>>;
/// One curve for R, G and B, and those of their own in its place; an empty one: the common one.
struct CurvesParams {
  CurvePoints all;    ///< of R, G and B; empty: none
  CurvePoints red;    ///< in its place
  CurvePoints green;  ///< in its place
  CurvePoints blue;   ///< in its place
};
/// Curves by control points, as CurvesParams says. Error for one point alone, x that do not rise or leave
/// [0, 1].
Node Curves(const Node& image, const CurvesParams& params);
/// The value of such a curve at x, in double.
double CurveThrough(const CurvePoints& points, double x);

/// What a screen is painted with.
enum class Screen : uint8_t { kGreen, kBlue };
/// How much of the screen's channel the others allow.
enum class SpillLimit : uint8_t {
  kAverage,  ///< their mean
  kLarger,   ///< the larger of both
  kSmaller,  ///< the smaller of both
};
/// The screen's channel goes down to that limit where it is above: to (1 - amount) s + amount min(s, limit).
struct DespillParams {
  Screen screen = Screen::kGreen;           ///< the channel
  SpillLimit limit = SpillLimit::kAverage;  ///< how much it may have
  double amount = 1;                        ///< 0: the image
};
/// Without the light of a screen, as DespillParams says.
Node Despill(const Node& image, const DespillParams& params);

/// A matte by colour difference: d = s - max of the other two is the screen's excess; from `keep` on the
/// matte falls until it is 0 at `drop`. The colours lose the excess (DespillParams of kLarger) and are
/// multiplied by the matte; the result's alpha is the matte (times the image's own where it has one).
struct KeyParams {
  Screen screen = Screen::kGreen;  ///< the channel
  double keep = 0.05;              ///< excess up to which all is kept
  double drop = 0.3;               ///< excess from which nothing is
  bool despill = true;             ///< whether colours lose the excess
};
/// R, G, B, A of what is before a screen, premultiplied, as KeyParams says. Error unless the image has three
/// channels and keep < drop.
Node Key(const Node& image, const KeyParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_GRADE_H_
