/// Atmosphere, shadows and solid textures on rendered pictures: from positions or depths (AOVs), cameras and
/// lights. @file
#ifndef TESSERA_OPS_SHADE_H_
#define TESSERA_OPS_SHADE_H_

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// Rules of all: positions are the first three channels of an image of the colour's data window (fewer:
/// Error), in world units unless said otherwise; they are never filtered. Alpha and channels beyond the third
/// keep their bits. Where a position or depth is NaN the pixel passes unchanged (a light sees it, visibility
/// 1). Matrices and eyes are used in double; distances, optical depths and projections are computed in double
/// from the positions as stored. @file

/// --- AOVs: what a renderer's channels are called. --- @file

/// What a renderer's channels hold.
enum class Aov : uint8_t {
  kColor,     ///< R,G,B (and A) of the beauty or combined pass
  kPosition,  ///< world position
  kRest,      ///< reference position of a deforming object (Pref)
  kNormal,    ///< world normal
  kDepth,     ///< depth; one channel
  kMist,      ///< fog factor; one channel
  kMotion,    ///< motion in pixels; two channels or more
  kId,        ///< object or material index; one channel
  kAlbedo,    ///< colour without light
};
/// The channels of an AOV in their order, found by the names that Blender (ViewLayer.Position.X), Arnold and
/// Karma (P.X), RenderMan (__Pworld.r, Pworld.x) and V-Ray (worldPosition.R) give them; letter case does not
/// matter and `layer`, when not empty, is the name's beginning. Empty when there are none. Of several the
/// first in file order.
std::vector<int> FindAov(const ImageSpec& spec, Aov aov, const std::string& layer = "");
/// Those channels as an image (X,Y,Z; R,G,B[,A]; Z; ...). Error listing the channels present when there are
/// none.
Node SelectAov(const Node& image, Aov aov, const std::string& layer = "");
/// Positions for the operations below: the position AOV, or else the first three channels. Error with fewer.
Node PositionsOf(const Node& image);

/// NaN in every channel where the first channel of `mask` is 0, negative or NaN: background that later
/// operations leave alone. Elsewhere the image's bits.
Node MaskAov(const Node& image, const Node& mask);

/// Depths of one kind as another, every channel; `camera` matters between planar and Euclidean ones, near and
/// far (world units, far may be infinite) between those and window depths. One rounding of the exact value
/// (relative to the distance; window depths: times the formula's conditioning). NaN and infinity stay.
struct DepthParams {
  DepthKind from = DepthKind::kPlanar;   ///< kind of the image
  DepthKind to = DepthKind::kEuclidean;  ///< kind of the result
  Camera camera = {};                    ///< between planar and Euclidean depths
  double near = 0.1;                     ///< world units, of window depths
  double far = 1000;                     ///< world units, of window depths; may be infinite
  bool parallel = false;                 ///< window depths are linear in planar ones, z = n + w (f - n)
};
/// Depths of another kind, as DepthParams says.
Node ConvertDepth(const Node& depth, const DepthParams& params);

/// World positions from a depth image (its first channel): X,Y,Z. Error per coordinate: one rounding of it
/// plus the depth's own times the ray. Infinite depths give infinite positions (0 where the ray has no part).
Node PositionFromDepth(const Node& depth, const DepthParams& params);

/// The first three channels as points: M (x,y,z,1), divided by w where `divide`, computed in double, each
/// rounded once (scale: sum of |products|). Positions where w is 0 become NaN.
struct TransformParams {
  Matrix4 matrix = kIdentity4;  ///< row-major, for column vectors
  bool divide = false;          ///< by w
};
/// Points through a matrix, as TransformParams says.
Node TransformPoints(const Node& position, const TransformParams& params);

/// --- Fog. --- @file

/// How transmittance T falls with distance.
enum class FogMode : uint8_t {
  kExp,            ///< T = exp(-density d)
  kExp2,           ///< T = exp(-(density d)^2)
  kLinear,         ///< T = clamp((end - d) / (end - start)); start == end is a step
  kTransmittance,  ///< the position image's first channel is T itself
};
/// Result = T C + (1 - T) A F: colour C (premultiplied by alpha A, 1 without), fog colour F. d is the
/// Euclidean distance to the eye, or with `distance` the position image's first channel. T = 1 keeps C's
/// bits, T = 0 gives A F exactly; the result lies between C and A F. d < 0 counts as 0, an infinite d gives
/// F. |error| <= 4 u (T |C| + (1 - T) |A F|); T itself within 2 ULP of the exact one for the stored
/// positions. Colours of fewer than three channels are greys, as AsColors takes them. `fog_color`, when
/// given, is F per pixel (R,G,B). `density_factor`'s first channel multiplies the density (kLinear and
/// kTransmittance: 1 - T): below 1 for pixels that emit light, 0 (or NaN) for pixels to be left alone. Cost:
/// about 5 ns per pixel and core. Errors: density below 0, ranges that are not finite. Source: Heidrich et
/// al. 1999, 5; doc/maths/fog.md.
struct FogParams {
  FogMode mode = FogMode::kExp;                   ///< how transmittance falls
  double density = 1;                             ///< per world unit, at least 0
  double start = 0;                               ///< kLinear: where fog begins
  double end = 100;                               ///< kLinear: where nothing else is left
  std::array<double, 3> color = {0.5, 0.5, 0.5};  ///< of the fog, R, G, B
  Vector3 eye = {};                               ///< world position
  bool distance = false;                          ///< the position image holds distances
};
/// The picture in fog, as FogParams says.
Node Fog(const Node& color, const Node& position, const FogParams& params, const Node& fog_color = {},
         const Node& density_factor = {});

/// Fog whose density depends on the height y alone. A straight ray spends equal time at every height, so
/// T = exp(-d m) with m the mean density between the eye's height and the point's: exact for every profile,
/// and the density itself at equal heights. |error| as Fog's; T within 4 ULP.
struct FogLayer {
  double height;   ///< world units
  double density;  ///< per world unit
};
/// A layer whose density falls off exponentially above its height.
struct ExponentialLayer {
  double height;   ///< above which the density falls
  double density;  ///< at that height, per world unit
  double falloff;  ///< density * exp(-(y - height) / falloff)
};
/// How density depends on height.
enum class FogProfile : uint8_t {
  kConstant,     ///< layers[k].density from its height up to the next one's, the last upwards, none below the
                 ///< first
  kLinear,       ///< straight between the layers' heights, the end values beyond: any sampled profile
  kExponential,  ///< the sum of `exponential`
};
/// Parameters of LayerFog and LayerFogByTable.
struct LayerFogParams {
  FogProfile profile = FogProfile::kConstant;     ///< how density depends on height
  std::vector<FogLayer> layers;                   ///< 1 to 4096, heights increasing
  std::vector<ExponentialLayer> exponential;      ///< of kExponential
  std::array<double, 3> color = {0.5, 0.5, 0.5};  ///< of the fog, R, G, B
  Vector3 eye = {};                               ///< world position
};
/// The picture in fog whose density depends on height, as FogLayer says.
Node LayerFog(const Node& color, const Node& position, const LayerFogParams& params,
              const Node& fog_color = {}, const Node& density_factor = {});
/// Any profile, sampled at `samples` heights between low and high.
std::vector<FogLayer> SampleProfile(const std::function<double(double)>& density, double low, double high,
                                    int samples);
/// Density at a height (at a layer's own lower bound: the layer's), and the mean between two.
double FogDensity(const LayerFogParams& params, double height);
/// Mean density between the heights a and b.
double MeanFogDensity(const LayerFogParams& params, double a, double b);

/// The papers' layered fog: transmittance by a table, for comparison. Beyond the table's distance T is
/// continued as an exponential (kMeanOfHeight) or clamped (the others, as hardware did).
enum class FogTable : uint8_t {
  kMeanOfHeight,          ///< 1-D: mean density against the point's height; exp per pixel
  kDistanceHeight,        ///< 2-D: T against distance and height, for this eye
  kDistanceHeightHeight,  ///< 3-D: T against distance, height and the eye's height
};
/// Form and size of the tables of LayerFogByTable.
struct FogTableParams {
  FogTable form = FogTable::kMeanOfHeight;  ///< what the table is over
  int size = 64;                            ///< entries per axis, 2 to 4096 (3-D: 256)
  double distance = 100;                    ///< length of the distance axis, world units
  double low = 0;                           ///< lower end of the height axis
  double high = 10;                         ///< its upper end
  int bits = 0;  ///< coordinates and table quantised to so many bits, 2 to 16; 0: floats
};
/// LayerFog with its transmittance read from a table, as FogTable says.
Node LayerFogByTable(const Node& color, const Node& position, const LayerFogParams& params,
                     const FogTableParams& table);

/// --- Shadows and projected light. --- @file

/// Which comparisons are averaged.
enum class ShadowFilter : uint8_t {
  kBox,       ///< `size` x `size` comparisons around the point, each weighted 1 / size^2
  kBilinear,  ///< the four nearest texels' comparisons, bilinear weights
};
/// Visibility of positions from a light: one channel named V, 1 lit. (x,y,z,w) = light (P,1); the map is
/// looked up at s = (x/w + 1)/2, t = (1 - y/w)/2 and compared with r = (z/w + 1)/2: lit where r <= m + bias.
/// Comparisons are filtered, depths never. Lit: outside the map and its depth range (`dark_outside`: dark
/// beside the map), where the map is 1 or more, infinite or NaN (nothing hit), where the position is NaN.
/// Dark: w <= 0, behind the light. r and m + bias are rounded to float once each: no misjudgement outside |r
/// - m - bias| < 4 u. A negative `bias` is worked out from the map: how much deeper each texel's own surface
/// is within the taps' distance, by the slope, bend and twist of the depths around it or as the map has it,
/// plus the map's quantisation step and what half-float positions have lost.
/// Cost: size 1 4 ns, size 3 7 ns per pixel and core; the map is prepared once. Errors: a matrix that is not
/// finite or singular. Sources: Williams 1978; Reeves et al. 1987; Segal et al. 1992; doc/maths/shadow.md.
struct ShadowParams {
  Matrix4 light = kIdentity4;                ///< world to the light's clip space
  double bias = -1;                          ///< added to the map's depths; negative: worked out from the map
  int size = 1;                              ///< 1 to 64
  ShadowFilter filter = ShadowFilter::kBox;  ///< which comparisons are averaged
  bool dark_outside = false;                 ///< beside the map nothing is lit

  /// The map's and the positions' precision where the images' types do not tell; 0: from the types.
  int map_bits = 0;
  int position_bits = 0;  ///< of the positions, likewise
};
/// Visibility from a light by its depth map, as ShadowParams says.
Node Shadow(const Node& position, const Node& light_depth, const ShadowParams& params);

/// The mean of the visibilities of several light samples: jittered lights, 1 to 256 maps and matrices.
Node SoftShadow(const Node& position, const std::vector<Node>& light_depths,
                const std::vector<Matrix4>& lights, const ShadowParams& params);

/// Light of a small area light sample on a diffuse surface, without its shadow, one channel:
/// (area / pi) max(cos at receiver, 0) max(cos at light, 0) / max(r^2, area); multiply by the visibility and
/// sum over samples before adding the ambient term. `normal`: unit normals, same window. A zero `direction`
/// sends light equally to all sides (its cosine is 1).
struct LightSample {
  Vector3 position = {};   ///< world position
  Vector3 direction = {};  ///< of the light's normal; 0: equally to all sides
  double area = 1;         ///< of this sample
};
/// Light of one sample of an area light, as LightSample says.
Node DiffuseLight(const Node& position, const Node& normal, const LightSample& light);

/// Light that a slide or a spot throws on positions, three channels: slide(s,t) / (kc + kl d + kq d^2) times
/// max(0, cos of the angle to the axis)^exponent; 0 behind the light and beyond its frame |x|, |y| <= w that
/// a slide fills. d: distance to the light. The denominator is at least 1e-20. `slide` may be empty: white
/// (`cone` degrees half angle when positive, with a soft rim of `rim` degrees inside it).
struct SpotlightParams {
  Camera light = {};                              ///< the light's projection
  std::array<double, 3> color = {1, 1, 1};        ///< R, G, B
  std::array<double, 3> attenuation = {1, 0, 0};  ///< kc, kl, kq
  double exponent = 0;                            ///< of the cosine to the axis
  double cone = 0;                                ///< half angle in degrees; 0: the light's frame
  double rim = 0;                                 ///< degrees over which the cone fades
};
/// Light of a slide or a spot, as SpotlightParams says.
Node Spotlight(const Node& position, const SpotlightParams& params, const Node& slide = {});

/// --- Solid textures. --- @file

/// How a solid's colour S meets the picture's colour C.
enum class SolidBlend : uint8_t { kModulate, kReplace, kOver, kAdd };
/// Where a solid's colour comes from.
enum class SolidKind : uint8_t { kTable, kMarble, kWood, kNoise, kContours, kHalftone };
/// Colour C at position P textured by a solid: p = (P - low) / (high - low) per axis (an axis without extent:
/// 1/2; with `uniform` all axes by the longest), rotated about the block's centre (1/2,1/2,1/2), then a
/// lookup in a 3-D table or a procedure at p. Blend: C S, S (premultiplied by C's alpha), S over C, C + S A.
/// Alpha keeps its bits. Marble and wood have `frequency` bands or rings across the block; kNoise is grey.
/// kContours draws lines where plane . p is a multiple of 1 / frequency, `width` of the spacing wide, in
/// `ink`; kHalftone compares C's luminance with a screen of `frequency` cells fixed to the solid, and is ink
/// or C's white accordingly. |error| of p: one rounding of double; procedures 5e-5. Cost: table 9, marble of
/// 4 octaves 20 ns per pixel and core. Sources: Peachey 1985; Perlin 1985; doc/maths/solid.md.
struct SolidParams {
  SolidKind kind = SolidKind::kMarble;  ///< table or procedure
  Vector3 low = {0, 0, 0};              ///< corner of the block, world units
  Vector3 high = {1, 1, 1};             ///< opposite corner
  bool uniform = false;                 ///< one scale for all axes, the longest's

  /// Rotation, row-major; rows should be orthonormal (a mirror image is allowed).
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  SolidBlend blend = SolidBlend::kModulate;  ///< how the solid meets the picture
  double frequency = 4;                      ///< bands, rings, lines or cells across the block
  int octaves = 4;                           ///< of noise
  uint32_t seed = 0;                         ///< of noise
  double strength = 1;                       ///< of marble's and wood's turbulence

  /// The texture's mean over what a pixel covers of the solid, from the differences of neighbouring
  /// positions: bands, rings, lines and screens by their integrals along their own argument, octaves of noise
  /// by the part that such a mean keeps of them; tables by mip level, unless their filter (kTrilinear, kEwa)
  /// has the shape of what is covered as well.
  bool level_of_detail = false;
  Vector3 plane = {0, 1, 0};              ///< kContours: the lines' direction
  double width = 0.1;                     ///< kContours: of a line, in spacings
  std::array<double, 3> ink = {0, 0, 0};  ///< of lines and screens, R, G, B
  LookupParams lookup = {};               ///< kTable
};
/// The picture textured by a solid, as SolidParams says.
Node SolidTexture(const Node& color, const Node& position, const SolidParams& params);
/// The same with a 3-D table of 1 (grey), 3 or 4 (premultiplied) channels: an image of slices stacked along
/// y.
Node SolidTexture(const Node& color, const Node& position, const Node& table, const TableLayout& layout,
                  const SolidParams& params);
/// p alone, three channels.
Node SolidCoordinates(const Node& position, const SolidParams& params);
/// Rotation by `degrees` about an axis of any length but 0, rebuilt from the angle each time.
std::array<double, 9> RotationAbout(const Vector3& axis, double degrees);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_SHADE_H_
