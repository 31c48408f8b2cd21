/// Bump mapping in image space: heights to normals and to relief, tangent-space normal maps, combined
/// normals. @file
#ifndef TESSERA_OPS_BUMP_H_
#define TESSERA_OPS_BUMP_H_

#include <cstdint>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/ops/geometry.h"

TESSERA_API_BEGIN
namespace tessera {

/// Heights are the first channel of an image, in pixels (times `scale`), seen from above: x to the right, y
/// UP (against the rows), z towards the viewer. f_x and f_y are the height's derivatives per pixel; the
/// perturbed normal is (-f_x, -f_y, 1)/sqrt(1 + f_x^2 + f_y^2). Differences are taken first, in double:
/// adding a constant to all heights changes nothing. NaN reaches the pixels whose differences it takes part
/// in. Sources: McReynolds et al. 1997, 8.3 and 8.4; Peercy et al. 1997; doc/maths/bump.md. @file

/// How slopes are measured.
enum class Slope : uint8_t {
  kCentral,   ///< (f(x+1) - f(x-1))/2: error of second order
  kForward,   ///< f(x+1) - f(x): the papers' first form
  kSobel,     ///< Sobel's operator over 8
  kGaussian,  ///< derivative of a Gaussian (sigma 1) over 7 x 7 pixels, as the bump hardware paper's
};

/// Height to normals: channels X, Y, Z, unit length; `pack` gives (n + 1)/2. |error| <= 4 u.
struct HeightNormalsParams {
  double scale = 1;               ///< of the heights
  Slope slope = Slope::kCentral;  ///< how slopes are measured
  Wrap wrap = Wrap::kClamp;       ///< beyond the data window
  bool pack = false;              ///< to (n + 1)/2
};
/// Normals of a height image's first channel, as HeightNormalsParams says.
Node HeightToNormals(const Node& height, const HeightNormalsParams& params = {});

/// How the product of the perturbed normal with a direction D (unit: the light, or the halfway vector) is
/// found.
enum class BumpMethod : uint8_t {
  kNormals,  ///< from the slopes: (D_z - D_x f_x - D_y f_y)/sqrt(1 + f_x^2 + f_y^2)
  kShift,    ///< shift and subtract, about the pixel: E = f(p - s D/2) - f(p + s D/2), (E/s + D_z)/sqrt(...)
  kForward,  ///< E = f(p) - f(p + s D), as printed in the papers
};
/// What Bump gives.
enum class BumpOutput : uint8_t {
  kDiffuse,   ///< max(n'.L, 0)
  kSpecular,  ///< max(n'.H, 0)^exponent, H = (L + V)/|L + V| with V = +z; 0 where L + V = 0
  kEmboss,    ///< E + 1/2 (kNormals: E = -s (L_x f_x + L_y f_y)), not limited
};
/// Error unless the light is finite and not 0, shift in [0.001, 64], exponent in [0, 10000].
struct BumpParams {
  Vector3 light = {-1, 1, 1};                ///< any length
  double scale = 1;                          ///< of the heights
  BumpMethod method = BumpMethod::kNormals;  ///< how slopes enter
  BumpOutput output = BumpOutput::kDiffuse;  ///< what is computed
  double shift = 1;                          ///< s, in pixels
  double exponent = 20;                      ///< of kSpecular
  bool length = true;             ///< false: without the division by sqrt(...), as on hardware that had none
  Slope slope = Slope::kCentral;  ///< of kNormals and of the length
  Wrap wrap = Wrap::kClamp;       ///< beyond the data window
  int bits = 0;  ///< above 0: heights (limited to [0,1] before scaling) and result stored in so many bits
};
/// One channel, Y. |error| <= 4 u (1 + |E|/s) (kSpecular: times the exponent).
Node Bump(const Node& height, const BumpParams& params = {});

/// Height to ambient occlusion: the share of an even sky's light, cosines counted, that reaches each point; 1
/// on open ground. The mean over `directions` of cos^2 of the horizon's elevation, the steepest rise to a
/// pixel within `radius` along that ray. NaN hides nothing. Error unless |scale| <= 1e6, radius in [1, 255],
/// directions in [4, 64]. |error| <= 4 u (2 + directions / 8). Cost grows with radius directions. Source: Max
/// 1988.
struct HeightOcclusionParams {
  double scale = 1;          ///< of the heights
  int radius = 16;           ///< pixels
  int directions = 16;       ///< rays, the first to the right
  Wrap wrap = Wrap::kClamp;  ///< beyond the data window
};
/// One channel, Y, as HeightOcclusionParams says.
Node HeightToOcclusion(const Node& height, const HeightOcclusionParams& params = {});

/// Which curvature: half of the sum of the principal ones, or their product.
enum class CurvatureOutput : uint8_t { kMean, kGaussian };
/// Height to curvature, by differences of neighbours: the mean one is positive on hills, negative in hollows.
/// `pack` gives 1/2 + gain curvature / 2. Error unless |scale| and |gain| are at most 1e6. |error| <= 2 u
/// (|result| + 2^-26 of the differences that cancel).
struct HeightCurvatureParams {
  double scale = 1;                                 ///< of the heights
  CurvatureOutput output = CurvatureOutput::kMean;  ///< which
  double gain = 1;                                  ///< of the result
  bool pack = false;                                ///< to 1/2 + half
  Wrap wrap = Wrap::kClamp;                         ///< beyond the data window
};
/// One channel, Y, as HeightCurvatureParams says.
Node HeightToCurvature(const Node& height, const HeightCurvatureParams& params = {});

/// A tangent-space normal map (first three channels: along T, B, N) put on a surface: a T + b B + c N, unit
/// length, with N the normal image, T the tangent image made perpendicular to N, B = N x T (`left_handed`: T
/// x N). Where N is zero or not finite the result is 0, where T leaves no direction or the map is 0, N.
/// `packed` maps hold (n + 1)/2. With `inverse` the first image holds directions that are brought into the
/// surface's frame: (v.T, v.B, v.N), not normalised. Other channels of the map pass. |error| <= 4 u (inverse:
/// times |v|).
struct TangentNormalsParams {
  bool packed = true;        ///< the map holds (n + 1)/2
  bool left_handed = false;  ///< B = T x N
  bool inverse = false;      ///< into the surface's frame instead
};
/// A normal map on a surface, as TangentNormalsParams says.
Node TangentNormals(const Node& map, const Node& normals, const Node& tangents,
                    const TangentNormalsParams& params = {});

/// A normal map in a surface's parameters put on the surface P(u, v) by its derivatives, after Blinn. `map`:
/// (a, b, c) = (-f_u, -f_v, 1) of any length, f the height along N in the scene's unit, u and v the
/// parameters by which `pu` and `pv`, the images of the derivatives P_u and P_v (neither unit nor
/// perpendicular), are taken: n' = normalise(c |P_u x P_v| N + o scale (a (P_v x N) + b (N x P_u))), o = -1
/// where P_u x P_v is turned against N. On a square patch, |P_u| = |P_v| = k, the relief is 1/k as steep as
/// on a unit patch. Where N is zero or not finite the result is 0; where P_u and P_v give no area, or are not
/// finite, or the sum is 0, N. `packed` maps hold (n + 1)/2. Other channels of the map pass. |error| <= 4 u.
/// Source: Peercy et al. 1997, equations 1 to 6; doc/maths/bump.md.
struct SurfaceBumpParams {
  bool packed = true;  ///< the map holds (n + 1)/2
  double scale = 1;    ///< of the heights
};
/// A bump on a parametric surface, as SurfaceBumpParams says.
Node SurfaceBump(const Node& map, const Node& normals, const Node& pu, const Node& pv,
                 const SurfaceBumpParams& params = {});

/// A surface's normal V and a bump's B made one. kSum: normalise(k V + B) of unit vectors (hypertexture,
/// equation 7); V where |k V + B| < 1e-6 or B is zero. kTilt: normalise(V - k (B - (B.V) V)), B a gradient of
/// any length, which never turns by 90 degrees or more. Result 0 where V is zero or not finite. Other
/// channels of V's image pass. k > 0 for kSum. |error| <= 4 u (1 + 1/|k V + B|).
enum class CombineMethod : uint8_t { kSum, kTilt };
/// Parameters of CombineNormals; the methods are described at CombineMethod.
struct CombineNormalsParams {
  double k = 2;                                ///< weight of the surface's normal (kSum), of the bump (kTilt)
  CombineMethod method = CombineMethod::kSum;  ///< how they are made one
};
/// Two normals made one, as CombineMethod says.
Node CombineNormals(const Node& normals, const Node& bump, const CombineNormalsParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_BUMP_H_
