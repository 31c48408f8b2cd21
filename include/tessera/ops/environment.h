/// Environment maps and lighting from normals: reflections, gloss, conversion of maps, Phong, transformed
/// normals. @file
#ifndef TESSERA_OPS_ENVIRONMENT_H_
#define TESSERA_OPS_ENVIRONMENT_H_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// How a picture holds the radiance of all directions (x, y, z), y up. Row 0 is the upper edge; (s, t) runs
/// from the lower left corner, 0 to 1. The map is the picture's data window; texels have their centres at
/// half-integers.
///   kSphere         A mirrored ball seen from +z: s = x/m + 1/2, t = y/m + 1/2, m = 2 sqrt(x^2 + y^2 + (z +
///   1)^2). The
///                   rim is the single direction -z; texels beyond it are not looked at.
///   kParabolic      s = (x/(1 + z) + 1)/2, t = (y/(1 + z) + 1)/2, for z >= 0; nothing (0) behind.
///   kDualParabolic  Two of them side by side: left z >= 0, right z < 0 with (x, y)/(1 - z).
///   kLatLong        s = 1/2 - atan2(x, z)/(2 pi), t = 1/2 + asin(y)/pi: +z in the middle, +x a quarter to
///   its left, as
///                   OpenEXR's and OpenImageIO's latitude-longitude maps.
///   kCube           Six square faces oriented as OpenGL's cube maps. The picture's shape names the layout: a
///   strip of
///                   +x -x +y -y +z -z, 6:1 from left to right or 1:6 from top to bottom, or a cross around
///                   +z, 4:3
///                   (-x +z +x -z in the middle row) or 3:4 (+y, +z, -y, -z downwards in the middle column,
///                   -z turned by half). Error for other shapes.
///   kOctahedral     The octahedron |x| + |y| + |z| = 1 seen from +z, its rear half folded out over the
///                   square's corners: (s, t) = ((p, q) + 1)/2, p = x/(|x| + |y| + |z|), q alike, for z < 0
///                   (1 - |q|, 1 - |p|) with the signs of x and y.
/// Pictures through a lens that looks along +z, y up and, as in kLatLong, +x to the left. `field_of_view`
/// is the angle across the picture's width; texels are square, the height is what there is. A direction at
/// the angle a from the axis lies at r(a) from the picture's middle, in focal lengths:
///   kPerspective    tan a, for a < 90 degrees: what a pinhole sees
///   kEquidistant    a: of 360 degrees a light probe's angular map
///   kEquisolid      2 sin(a/2): equal areas; of 360 degrees kSphere with left and right exchanged
///   kStereographic  2 tan(a/2): angles are kept
///   kOrthographic   sin a, for a <= 90 degrees
///   kCylinder       longitudes across, the tangents of latitudes up; of 360 degrees its ends meet
/// Nothing (0) is seen beyond the picture's edges and beyond a projection's reach; the half texel next to an
/// edge is that texel's. As results, pixels that no direction belongs to are 0. Sources: Miyamoto 1964;
/// Haeberli and Segal 1993, 4.7; octahedral: Cigolle et al. 2014.
/// Lookups are bilinear and continuous over seams, edges and poles: texels are taken across the seam; the
/// half texel next to a latitude-longitude map's pole, and the last texel inside a sphere map's rim, run
/// towards the mean of the texels around it. Places are right within 1/1024 texel on maps 16,384 texels wide,
/// at seams and poles too. The result lies within the range of the texels read. NaN texels reach only results
/// in which they have weight. Sources: McReynolds et al. 1997, 9.3.2; Heidrich and Seidel
/// 1998; doc/maths/environment.md.
enum class EnvironmentMap : uint8_t {
  kSphere,
  kParabolic,
  kDualParabolic,
  kLatLong,
  kCube,
  kOctahedral,
  kPerspective,
  kEquidistant,
  kEquisolid,
  kStereographic,
  kOrthographic,
  kCylinder,
};

/// The lookup's direction.
enum class EnvironmentDirection : uint8_t {
  kReflection,  ///< u - 2 (n.u) n, u from the eye to the point
  kNormal,      ///< n itself
};

/// What a mirror shows of a map that has more texels than the picture shows.
enum class EnvironmentFilter : uint8_t {
  kBilinear,  ///< the four texels around the place: sharp, and restless where the map is looked at from afar

  /// An average as wide as the pixel's own reflection: trilinear, between the map and a chain of cube maps,
  /// each of half the edge, averaged by solid angle. The width is the angle to the directions looked up by
  /// the neighbouring pixels: the larger of across and down, each the smaller of its two sides, so that at an
  /// object's edge the side on the object counts; neighbours without a direction, or outside of the image, do
  /// not. Not together with a lobe. |error| is at most twice that of a bilinear lookup, of the map's largest
  /// texel.
  kMip,

  /// The ellipse that a pixel's reflection covers, in any direction: the mean of up to `anisotropy` lookups
  /// like those along its longer axis. Both differences to the neighbours on two sides count, each by the
  /// other's square, so that the far side of an object's edge hardly does. Where the ellipse is no longer
  /// than a texel is wide, as kBilinear, bit for bit. |error| as of kMip.
  kTrilinear,
  kEwa,  ///< the same with a Gaussian's weights over a grid of lookups in the ellipse (Heckbert 1989)
};

/// Error for a normal image of fewer than three channels, a singular matrix, numbers out of range.
struct EnvironmentParams {
  EnvironmentMap map = EnvironmentMap::kLatLong;                       ///< the map's projection
  EnvironmentDirection direction = EnvironmentDirection::kReflection;  ///< which direction is looked up

  /// From the normals' space to the map's, row-major; the upper 3x3 turns the looked-up direction.
  Matrix4 matrix = kIdentity4;
  /// To the viewer, in the normals' space; any length. Not used with a camera or an eye.
  Vector3 view = {0, 0, 1};
  /// Reflects rays of this camera: of the pixel, or, with a position image, from its eye to the position.
  std::optional<Camera> camera;
  /// With a position image: the eye, instead of a camera.
  std::optional<Vector3> eye;
  /// 0: a mirror. Above: the map is averaged with weights max(d.w, 0)^lobe around the direction d (over the
  /// map's texels, weighted by solid angle; texels that are not finite are left out), so that a white map
  /// stays white. 1 with kNormal is diffuse: irradiance over pi. At most 10,000.
  double lobe = 0;
  /// Texels along an edge of the cube that holds the averages; 0 lets the lobe decide (at most 1 % of the
  /// contrast off, typically 0.1 %); -1 sums the whole map for every pixel: exact and slow.
  int table = 0;
  EnvironmentFilter filter = EnvironmentFilter::kBilinear;  ///< for maps finer than the picture
  int anisotropy = 16;       ///< of kTrilinear, kEwa: an ellipse's longest length, in widths of it; 1 to 64
  double field_of_view = 0;  ///< of a lens's map, degrees across; 0: 90 perspective, 360 cylinder, 180 others

  /// Reflectance at normal incidence: the colour (not alpha) is multiplied by F = F0 + (1 - F0) (1 -
  /// |n.v|)^5.
  std::optional<double> fresnel;
  /// Above 0: normals pass through a framebuffer of so many bits, (n + 1)/2 rounded, as on the papers'
  /// hardware.
  int bits = 0;
};

/// Looks `map` up for every pixel of `normals` (first three channels, any length). The result has the map's
/// channels and the normals' windows. Where a normal is zero or not finite, or a direction is undefined, the
/// result is 0, so that adding it changes nothing. |error| <= 8 u times the largest texel read (kLatLong:
/// times 1 + w/8 + h/3, the place's own rounding). Cost: 7 to 11 ns per pixel and thread (half floats);
/// tables are built first.
Node Environment(const Node& normals, const Node& map, const EnvironmentParams& params = {});
/// The same with positions (first three channels) in the normals' space, and params.camera or params.eye.
Node Environment(const Node& normals, const Node& positions, const Node& map,
                 const EnvironmentParams& params);

/// A map that is prepared once, by the first render that needs it, for any number of lookups: the frames of a
/// sequence. Immutable; keeps a float copy of the pixels. `lobe`, `table`, `filter` and `field_of_view` as in
/// EnvironmentParams, whose own, and whose map, are not used with it.
class EnvironmentTexture {
 public:
  /// Parameters as in EnvironmentParams; Error as there.
  EnvironmentTexture(const Image& map, EnvironmentMap projection, double lobe = 0, int table = 0,
                     EnvironmentFilter filter = EnvironmentFilter::kBilinear, double field_of_view = 0);
  struct Data;
  /// The library's own.
  const std::shared_ptr<const Data>& data() const { return data_; }

 private:
  std::shared_ptr<const Data> data_;
};
/// The same with a map that is prepared already.
Node Environment(const Node& normals, const EnvironmentTexture& texture,
                 const EnvironmentParams& params = {});
/// The same with positions and a map that is prepared already.
Node Environment(const Node& normals, const Node& positions, const EnvironmentTexture& texture,
                 const EnvironmentParams& params);

/// Yaw, pitch and roll in degrees: a view along +z, y up, turned to the right (towards -x), then upwards,
/// then clockwise about its own axis, so that what it sees turns counter-clockwise.
using YawPitchRoll = std::array<double, 3>;
/// From directions as such a view has them to those of the space that it is turned in: Ry(-yaw) Rx(-pitch)
/// Rz(roll).
Matrix4 ViewRotation(const YawPitchRoll& degrees);

/// A map in another projection, of `width` x `height` pixels. Every pixel is the mean of a grid of bilinear
/// lookups, as many along each side as texels lie under it (by the mapping's derivatives, less a hundredth;
/// at most 64; 8 where a side reaches beyond a lens's picture), or `samples` along each side. Pixels outside
/// of a sphere map's disc have the colour of its rim, those of a parabolic map their own directions; the
/// empty squares of a cross are 0. A single parabolic map becomes one with zeros behind. A direction d of the
/// result is looked up at F^-1 M R d, F and R the views' rotations, M the matrix.
struct EnvironmentConvertParams {
  EnvironmentMap from = EnvironmentMap::kLatLong;  ///< projection of the map
  EnvironmentMap to = EnvironmentMap::kCube;       ///< projection of the result
  int width = 0;                                   ///< of the result, pixels
  int height = 0;                                  ///< of the result, pixels
  Matrix4 matrix = kIdentity4;                     ///< from the result's directions to the source's
  int samples = 0;                                 ///< along each side of a pixel; 0: by the mapping
  double from_field_of_view = 0;                   ///< of a lens's picture, as EnvironmentParams has it
  double to_field_of_view = 0;                     ///< of the result, alike
  YawPitchRoll from_rotation = {0, 0, 0};          ///< where the map's own +z looks
  YawPitchRoll rotation = {0, 0, 0};               ///< where the result's +z looks
};
/// A map in another projection, as EnvironmentConvertParams says.
Node ConvertEnvironment(const Node& map, const EnvironmentConvertParams& params);

/// Directions and places on a map of width x height texels, for programs that make or read maps themselves.
/// Places are in texels from the upper left corner; false where the map has none. DirectionOf gives unit
/// length; false where the place belongs to no direction. `field_of_view` as in EnvironmentParams.
bool PlaceOf(EnvironmentMap map, int width, int height, const Vector3& direction, double* x, double* y,
             double field_of_view = 0);
/// The direction of a place in texels, unit length; false where there is none.
bool DirectionOf(EnvironmentMap map, int width, int height, double x, double y, Vector3* direction,
                 double field_of_view = 0);

/// What is done to a normal image's first three channels, in this order: unpack, transform, reflect,
/// normalise, flip, pack.
struct NormalsParams {
  bool unpack = false;  ///< n = 2 c - 1, of codes in [0, 1]

  /// Of positions; normals take the inverse transpose of its upper 3x3. Error if that is singular.
  std::optional<Matrix4> matrix;
  std::optional<Vector3>
      reflect;            ///< the direction (v, to the viewer) mirrored at the normal: 2 (n.v) n - v (n.n)
  bool normalize = true;  ///< to unit length
  bool flip = false;      ///< -n
  bool pack = false;      ///< c = (n + 1)/2
};
/// Zero, NaN and infinite normals are not normalised: zero stays 0 (packed 1/2), the others stay NaN or
/// infinite. Other channels pass. |error| <= 2 u |result| (packed: 2 u).
Node TransformNormals(const Node& normals, const NormalsParams& params);

/// One light, after Phong. Everything in the normals' space.
enum class Highlight : uint8_t {
  kHalfway,     ///< max(s.n, 0)^e, s = (l + v)/|l + v| (Blinn)
  kReflection,  ///< max(r.l, 0)^e, r the viewer's mirrored direction (Phong)
};
/// Light, eye and material of Phong.
struct PhongParams {
  /// To a distant light (any length), or its place when `point`.
  Vector3 light = {0, 0, 1};
  bool point = false;                          ///< needs positions
  Vector3 view = {0, 0, 1};                    ///< to a distant viewer
  std::optional<Vector3> eye;                  ///< the viewer's place; needs positions
  std::array<double, 3> ambient = {0, 0, 0};   ///< R, G, B, light and material multiplied
  std::array<double, 3> diffuse = {1, 1, 1};   ///< R, G, B
  std::array<double, 3> specular = {0, 0, 0};  ///< R, G, B
  std::array<double, 3> emission = {0, 0, 0};  ///< R, G, B, added without light
  Highlight highlight = Highlight::kHalfway;   ///< whose formula
  double exponent = 0;                         ///< 0 to 10,000; x^0 = 1 for x > 0, 0^0 = 0
  std::array<double, 3> attenuation = {1, 0,
                                       0};  ///< 1 / (kc + kl d + kq d^2) of a point light; at least 1e-20

  /// Spotlight of a point light: where it shines, half the cone's angle in degrees (180: no
  /// cone), the exponent of its cosine. SVG's default spot: no cone, exponent 1. 180 and 0: no spot.
  Vector3 spot_direction = {0, 0, -1};
  double spot_cutoff = 180;  ///< half the cone's angle in degrees; 180: no spot
  double spot_exponent = 0;  ///< of the cosine to spot_direction

  /// 2 and more: the power is read from a table of so many entries, linearly, endpoint aligned, as the papers
  /// do. With `bits` above 0, its base, its entries and its result pass through a framebuffer of so many
  /// bits.
  int table = 0;
  int bits = 0;  ///< 0: floats
};
/// C = emission + a f (ambient + max(l.n, 0) diffuse + [l.n > 0] highlight specular), channels R, G, B. 0
/// where a normal is zero or not finite, or a position that is used is not finite; l + v = 0 has no
/// highlight. |error| <= 4 u (1 + exponent/2^24) times the sum of the terms' magnitudes. Table: |error| <= e
/// (e - 1)/(8 (N - 1)^2) more.
Node Phong(const Node& normals, const PhongParams& params);
/// The same with positions, for point lights and near viewers.
Node Phong(const Node& normals, const Node& positions, const PhongParams& params);

/// A map of max(d.light, 0)^exponent, one channel: Phong's highlight as a picture, to be looked up by
/// Environment with directions of reflection (exponent 1 and kNormal: the lit sphere).
Image PhongMap(EnvironmentMap map, int width, int height, const Vector3& light, double exponent,
               PixelType type = PixelType::kFloat);
/// The papers' 3-D form of the same: max(r.light, 0)^exponent / |r|^exponent over vectors r in [-1,1]^3,
/// which need not have unit length, as a kEnds table of `size`^3 entries to be looked up with (r + 1)/2:
///   Lookup(TransformNormals(normals, {.reflect = view, .normalize = false, .pack = true}),
///   PhongTable(...).table)
/// The errors told are those of the linear lookup against the power, over vectors of length 1/2 to 1. Error
/// unless size is 2 to 512.
FunctionTable PhongTable(int size, const Vector3& light, double exponent,
                         PixelType storage = PixelType::kFloat);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_ENVIRONMENT_H_
