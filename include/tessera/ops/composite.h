/// Compositing: images laid over each other by alpha, blend equation, depth, stencil, threshold pattern or
/// mask. @file
#ifndef TESSERA_OPS_COMPOSITE_H_
#define TESSERA_OPS_COMPOSITE_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Pixels are premultiplied (colour times alpha); an image without alpha is opaque. Floats are never limited:
/// alpha beyond [0, 1], glows (alpha 0 with colour), NaN and infinities follow IEEE 754; integer results
/// saturate and are rounded once. Where data windows differ the result covers both, as oiiotool does, and an
/// image is transparent black beyond its own. Images have equal numbers of channels in the same order, else
/// Error. u = 2^-24. Sources: Porter and Duff 1984; OpenGL 4.6, 17.3.4 to
/// 17.3.6; W3C 2015; McReynolds et al. 1997, 10 and 14; doc/maths/composite.md. @file

/// The first over the second, to oiiotool's letter: a + (1 - clamp(alpha of a, 0, 1)) b in every channel but
/// depth, which is a's where that clamped alpha is not 0, else b's. |error| <= 3 u (|a| + |(1 - alpha) b|);
/// 8-bit results are correctly rounded. Error where neither has alpha, but for R, G, B alone, which are
/// opaque.
Node Over(const Node& a, const Node& b);

/// FillHoles has none.
struct FillHolesParams {};
/// What is transparent is filled smoothly from its surroundings, as oiiotool's --fillholes: the image is
/// halved by a triangle filter until one pixel is left, each level divided by its alpha where that is not 0,
/// then each laid over the next smaller one enlarged. Pixels of alpha 1 keep their bits; alpha becomes 1
/// wherever the image has anything. An image without alpha is returned unchanged. Held in memory whole, in
/// double. |error| <= 2 u |result|.
Node FillHoles(const Node& image);

/// As Over, but whichever image is nearer by its depth channel goes over the other: a where depth of a <=
/// depth of b (false for NaN). `depth` names the channel or is its number; empty: the first whose name ends
/// in Z or depth, else Error.
struct ZOverParams {
  bool zero_is_infinite = false;  ///< depth 0 counts as the largest float
  std::string depth = {};         ///< channel's name or number; empty: found by name
};
/// The nearer over the farther, as ZOverParams says.
Node ZOver(const Node& a, const Node& b, const ZOverParams& params = {});

/// Operators and modes of Blend; s is the foreground, d the background, both premultiplied.
enum class BlendMode : uint8_t {
  /// Porter-Duff: Fs s + Fd d.
  kClear,
  kSource,
  kDestination,
  kOver,
  kDestinationOver,
  kIn,
  kDestinationIn,
  kOut,
  kDestinationOut,
  kAtop,
  kDestinationAtop,
  kXor,
  kPlus,
  /// GL equations; factors default to one. kMin and kMax have none. kModulate: s d; kConstant: c s + (1 - c)
  /// d;
  /// kStraightOver: unpremultiplied s over d, which is premultiplied.
  kAdd,
  kSubtract,
  kReverseSubtract,
  kMin,
  kMax,
  kModulate,
  kConstant,
  kStraightOver,
  /// SVG and CSS: T + (1 - ad) s + (1 - as) d with T = as ad B(d/ad, s/as); kNormal is kOver.
  kNormal,
  kMultiply,
  kScreen,
  kOverlay,
  kDarken,
  kLighten,
  kColorDodge,
  kColorBurn,
  kHardLight,
  kSoftLight,
  kDifference,
  kExclusion,
  kHue,
  kSaturation,
  kColor,
  kLuminosity,
  kPlusLighter
};
/// "dst-over", "color-dodge", ...; every mode's name in the order above.
const std::vector<std::string>& BlendModeNames();

/// GL's factors of the source and the destination.
enum class BlendFactor : uint8_t {
  kDefault,  ///< what the mode says
  kZero,
  kOne,
  kSourceColor,
  kOneMinusSourceColor,
  kDestinationColor,
  kOneMinusDestinationColor,
  kSourceAlpha,
  kOneMinusSourceAlpha,
  kDestinationAlpha,
  kOneMinusDestinationAlpha,
  kSourceAlphaSaturate,
  kConstantColor,
  kOneMinusConstantColor,
  kConstantAlpha,
  kOneMinusConstantAlpha
};
/// "zero", "one", "src-color", "one-minus-src-color", ..., in the order above from kZero on.
const std::vector<std::string>& BlendFactorNames();

/// The factors serve kAdd, kSubtract and kReverseSubtract; those of alpha are the colours' where not given. A
/// factor of zero removes its image, NaN included. `constant` is the constant colour R, G, B, A.
///
/// Errors: Porter-Duff and GL 4 u, separable modes 8 u, non-separable ones 32 u, each times the sum of the
/// magnitudes of the formula's terms; 8-bit results of the Porter-Duff operators are correctly rounded. T is
/// 0 unless both alphas are positive. kColorDodge: T = 0 for d <= 0, as ad for s >= as; kColorBurn: as ad for
/// d >= ad, 0 for s <= 0. The non-separable modes need R, G, B (else Error), limit colours to [0, alpha] and
/// hand on further channels of the foreground; all others treat every channel as a colour but a depth
/// channel, which follows Over's rule.
struct BlendParams {
  BlendMode mode = BlendMode::kOver;                      ///< the operator
  BlendFactor source = BlendFactor::kDefault;             ///< factor of the foreground's colours
  BlendFactor destination = BlendFactor::kDefault;        ///< factor of the background's colours
  BlendFactor source_alpha = BlendFactor::kDefault;       ///< factor of the foreground's alpha
  BlendFactor destination_alpha = BlendFactor::kDefault;  ///< factor of the background's alpha
  std::array<double, 4> constant = {0, 0, 0, 0};          ///< the constant colour R, G, B, A
};
/// The foreground blended with the background, as BlendParams says.
Node Blend(const Node& foreground, const Node& background, const BlendParams& params);

/// GL's comparisons of an incoming value with a reference or stored one; all but kNotEqual and kAlways are
/// false for NaN.
enum class Comparison : uint8_t {
  kNever,
  kLess,
  kEqual,
  kLessOrEqual,
  kGreater,
  kNotEqual,
  kGreaterOrEqual,
  kAlways
};
/// "never", "less", "equal", "lequal", "greater", "notequal", "gequal", "always".
const std::vector<std::string>& ComparisonNames();

/// Pixels whose alpha compares so with `reference` (alpha OP reference) keep their bits, the others become 0
/// in every channel. Without alpha the image is opaque. Exact.
struct AlphaTestParams {
  Comparison test = Comparison::kGreater;  ///< alpha OP reference
  float reference = 0;                     ///< right side of the test
};
/// Pixels that pass a test of their alpha, as AlphaTestParams says.
Node AlphaTest(const Node& image, const AlphaTestParams& params);

/// Every pixel of the foreground whose depth compares so with the background's (scale * fg OP bg, bias added;
/// one rounding each) replaces it whole, depth included (squeezed as it was compared). Equal depths keep the
/// background under kLess; NaN never wins, but a background whose depth is NaN is always replaced. Channels
/// as ZOver. Exact.
struct DepthTestParams {
  Comparison test = Comparison::kLess;  ///< incoming OP stored
  float scale = 1;                      ///< of the incoming depth
  float bias = 0;                       ///< added to it
  std::string depth = {};               ///< channel, as ZOverParams::depth
};
/// Pixels that pass a test of their depth, as DepthTestParams says.
Node DepthTest(const Node& foreground, const Node& background, const DepthTestParams& params = {});

/// What happens to a stencil byte.
enum class StencilAction : uint8_t {
  kKeep,
  kZero,
  kReplace,
  kIncrement,
  kDecrement,
  kInvert,
  kIncrementWrap,
  kDecrementWrap
};
/// "keep", "zero", "replace", "incr", "decr", "invert", "incr-wrap", "decr-wrap".
const std::vector<std::string>& StencilActionNames();

/// The stencil image's first channel holds bytes as code / 255 (other values are rounded to the nearest code
/// in [0, 255], NaN to 0). The test is (reference & mask) OP (stencil & mask).
struct StencilParams {
  Comparison test = Comparison::kEqual;          ///< reference OP stencil
  int reference = 1;                             ///< 0 to 255
  int mask = 255;                                ///< bits that are compared, 0 to 255
  int write_mask = 255;                          ///< bits that actions may change
  StencilAction on_fail = StencilAction::kKeep;  ///< action where the test fails
  StencilAction on_pass = StencilAction::kKeep;  ///< action where it passes
};
/// The foreground's pixel where the test passes, the background's elsewhere. Exact.
Node StencilSelect(const Node& foreground, const Node& background, const Node& stencil,
                   const StencilParams& params);
/// The stencil after the actions: one channel. Increments and decrements saturate at 255 and 0 but for the
/// wrapping ones.
Node StencilUpdate(const Node& stencil, const StencilParams& params);

/// b where the threshold pattern is below t, else a: at t = 0 exactly a, at 1 exactly b, and pixels once
/// turned never turn back as t grows. kNoise: a hash of the pixel's position and `seed`, 2^24 levels;
/// kOrdered: the 16 x 16 Bayer matrix, 256 levels; kRight, kDown: a wipe towards that side; kImage: the
/// pattern's first channel, values in [0, 1) (NaN keeps a). A NaN t counts as 0. Exact.
enum class DissolvePattern : uint8_t { kNoise, kOrdered, kRight, kDown, kImage };
/// Parameters of Dissolve; the patterns are described at DissolvePattern.
struct DissolveParams {
  float t = 0.5f;                                     ///< how far, 0 to 1
  DissolvePattern pattern = DissolvePattern::kNoise;  ///< of the thresholds
  uint32_t seed = 0;                                  ///< of kNoise
};
/// From a to b through a threshold pattern, as DissolvePattern says; `pattern` for kImage.
Node Dissolve(const Node& a, const Node& b, const DissolveParams& params, const Node& pattern = {});

/// The thresholds of kNoise (a hash of position and seed, k / 2^24) or of kOrdered (Bayer's matrix, k / 256),
/// in every channel of an image of that spec.
struct ThresholdsParams {
  bool ordered = false;  ///< Bayer's matrix instead of the hash
  uint32_t seed = 0;     ///< of the hash
};
/// A threshold pattern as an image, as ThresholdsParams says.
Node Thresholds(const ImageSpec& spec, const ThresholdsParams& params = {});

/// Reveals `painted` through the mask's first channel: image + m (painted - image), exactly image at m = 0
/// and painted at m = 1. |error| <= 3 u (|image| + |m| (|painted| + |image|)). Painting with a brush is this
/// with an AirbrushMask.
Node Reveal(const Node& image, const Node& painted, const Node& mask);

/// Depth merge of n images of equal channels. nearest: the pixel with the smallest depth, whole; the first of
/// equal ones; NaN depths lose against numbers. over: the pixels sorted by depth, near to far (equal ones in
/// order, NaN last), each over what is behind it, depth that of the nearest with alpha; |error| <= 4 n u (sum
/// of |terms|).
struct ZCompositeParams {
  bool over = false;       ///< sorted and laid over each other instead of the nearest alone
  std::string depth = {};  ///< channel, as ZOverParams::depth
};
/// Images merged by depth, as ZCompositeParams says.
Node ZComposite(const std::vector<Node>& images, const ZCompositeParams& params = {});

/// How many of the images have something at a pixel: depth < far (NaN does not count). One channel. Exact.
struct DepthComplexityParams {
  float far = 1;           ///< what is not nearer does not count
  std::string depth = {};  ///< channel, as ZOverParams::depth
};
/// How many images cover a pixel, as DepthComplexityParams says.
Node DepthComplexity(const std::vector<Node>& images, const DepthComplexityParams& params = {});

/// Decals on a base, by the stencil method: where the base has alpha (> 0) the decal of the lowest priority
/// number among those with alpha > `threshold` is laid over the base (its own alpha counts); elsewhere the
/// base stays. The first decal is on top of later ones. At most 7, as stencils have 8 bits. |error| as Over.
struct DecalParams {
  float threshold = 0;  ///< decals show where their alpha is larger
};
/// Decals by priority, as DecalParams says.
Node Decals(const Node& base, const std::vector<Node>& decals, const DecalParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_COMPOSITE_H_
