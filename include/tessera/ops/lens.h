/// What lenses and film do to a picture, and how it is undone: distortion, lateral colour, vignette, grain.
/// @file
#ifndef TESSERA_OPS_LENS_H_
#define TESSERA_OPS_LENS_H_

#include <array>
#include <cstdint>
#include <string>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// All are made of other operations and fuse as those do; a result's bound is what theirs make together. The
/// centre is that of the display window, or what `centre` says in its widths and heights; a radius of 1 is
/// half the display window's diagonal, the distance of a corner from the window's middle. Windows stay.
/// Formulas and sources: doc/maths/lens.md. @file

/// Models of a lens, from the radius r without distortion to that with it, s.
enum class LensModel : uint8_t {
  kBrown,     ///< s = r (1 + k1 r^2 + k2 r^4 + k3 r^6), and what lies off centre: p1, p2 (Brown 1966)
  kDivision,  ///< r = s / (1 + k1 s^2) (Fitzgibbon 2001)
};
/// Taken away, the result at r is the image at s; applied, the result at s is the image at r. The factor of a
/// radius is a table of 4,097 entries over its square, straight between; inverses are found in double, with
/// p1 and p2 in three steps. Beyond the image is black, as is what no point of it comes to. Error where r
/// does not grow with s over the picture.
struct LensParams {
  LensModel model = LensModel::kBrown;        ///< which
  std::array<double, 3> k = {0, 0, 0};        ///< radial; the division has one
  std::array<double, 2> p = {0, 0};           ///< of kBrown: off centre
  bool apply = false;                         ///< distorts, where false takes distortion away
  std::array<double, 2> centre = {0.5, 0.5};  ///< in the display window
  std::string filter;                         ///< empty: lanczos3
};
/// Another lens, as LensParams says.
Node Lens(const Node& image, const LensParams& params);
/// The factor of a radius: s / r where distortion is taken away, r / s where it is applied; p aside.
double LensFactor(const LensParams& params, double radius);

/// Red and blue are scaled about the centre so that at a radius of 1 they move outwards by that many pixels;
/// green, alpha and further channels keep their bits. The filter is Catmull and Rom's. Error for fewer than
/// three channels, and for moves of nine tenths of the radius and more.
struct AberrationParams {
  double red = 0;                             ///< pixels outwards
  double blue = 0;                            ///< pixels outwards
  std::array<double, 2> centre = {0.5, 0.5};  ///< in the display window
};
/// Lateral colour, as AberrationParams says: negative numbers take away what positive ones make.
Node Aberration(const Node& image, const AberrationParams& params);

/// R, G, B times (1 + strength r^2)^-2: the fourth power of the cosine, strength the squared tangent of the
/// angle that a corner is seen at. With `remove` divided by it. Error for strengths outside 0 to 100.
struct VignetteParams {
  double strength = 0.5;                      ///< 0: the image
  bool remove = false;                        ///< lightens corners
  std::array<double, 2> centre = {0.5, 0.5};  ///< in the display window
};
/// Darker towards the corners, as VignetteParams says.
Node Vignette(const Node& image, const VignetteParams& params);

/// R, G, B plus strength times 4 L (1 - L) times noise, L the luminance within [0, 1]: most in the middle
/// tones. The noise is white, blurred by a Gaussian of size / 2 pixels, of standard deviation 1; one for all
/// three, or one each with `color`. Error for a size outside 0 to 50, a strength that is negative.
struct GrainParams {
  double strength = 0.05;  ///< standard deviation where L is 1/2
  double size = 1.5;       ///< pixels across a grain; 0: single pixels
  bool color = false;      ///< three noises
  uint32_t seed = 0;       ///< another one for every frame
};
/// Film grain, as GrainParams says.
Node Grain(const Node& image, const GrainParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_LENS_H_
