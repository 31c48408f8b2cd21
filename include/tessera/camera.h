/// Cameras and lights as matrices: where a pixel looks, how deep a point lies, what a depth stands for. @file
#ifndef TESSERA_CAMERA_H_
#define TESSERA_CAMERA_H_

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

/// X, y, z.
using Vector3 = std::array<double, 3>;
/// Row-major, for column vectors: p' = M (x, y, z, 1).
using Matrix4 = std::array<double, 16>;

constexpr Matrix4 kIdentity4 = {1, 0, 0, 0, 0, 1, 0, 0,
                                0, 0, 1, 0, 0, 0, 0, 1};  ///< Leaves points where they are.

/// The matrix product a b.
Matrix4 Product(const Matrix4& a, const Matrix4& b);
/// Throws Error when the matrix is singular (or nearly: the residual |A A^-1 - 1| exceeds 1e-6) or not
/// finite.
Matrix4 Inverse(const Matrix4& m, const std::string& subject = "matrix");
/// Rows and columns exchanged.
Matrix4 Transposed(const Matrix4& m);
/// The four coordinates of M (p, 1), not divided.
std::array<double, 4> Transform(const Matrix4& m, const Vector3& p);
/// Scalar product.
double Dot(const Vector3& a, const Vector3& b);
/// Vector product, right-handed.
Vector3 Cross(const Vector3& a, const Vector3& b);
/// Unit length; a zero vector stays zero.
Vector3 Normalized(const Vector3& v);

/// A camera or a light's projection: a pinhole (lens shift and any aspect allowed) or a parallel projection.
/// World units; clip x right and y up in [-1, 1] across the display window after division by w; w
/// (perspective) grows forward. Immutable value.
class Camera {
 public:
  /// Looks down -z of world space, parallel, [-1, 1] across.
  Camera();
  /// From the world-to-clip matrix alone, or with the world-to-camera matrix, whose z (either sign) is then
  /// the direction of a parallel projection. Throws Error unless the matrix can be inverted (its z row may be
  /// anything for a perspective one: worldToNDC of some renderers leaves depth out).
  explicit Camera(const Matrix4& world_to_clip, const std::string& subject = "camera");
  /// From both matrices; Error as above.
  Camera(const Matrix4& world_to_camera, const Matrix4& world_to_clip, const std::string& subject = "camera");

  /// At `eye` towards `target`, `up` upwards; vertical field of view in degrees; width over height. Clip z
  /// runs from -1 at `near` to 1 at `far` (world units). Throws Error on degenerate directions, angles and
  /// ranges.
  static Camera Perspective(const Vector3& eye, const Vector3& target, const Vector3& up,
                            double field_of_view, double aspect, double near = 0.1, double far = 1000);
  /// The same without perspective; `height` world units across the window.
  static Camera Parallel(const Vector3& eye, const Vector3& target, const Vector3& up, double height,
                         double aspect, double near = 0.1, double far = 1000);
  /// 16 numbers: world to clip; 32: world to camera, world to clip. Row-major, column vectors.
  static Camera FromNumbers(std::span<const double> numbers, const std::string& subject = "camera");
  /// From the attributes worldToCamera and worldToNDC of an OpenEXR file (stored for row vectors); none when
  /// there is no worldToNDC. Throws Error on a matrix that no camera has.
  static std::optional<Camera> FromMetadata(const ImageSpec& spec);
  /// Adds (or replaces) both attributes.
  void ToMetadata(ImageSpec& spec) const;

  /// Row-major, for column vectors.
  const Matrix4& world_to_clip() const { return world_to_clip_; }
  /// Eye space: looks down -z unless the matrix given says otherwise.
  const Matrix4& world_to_camera() const { return world_to_camera_; }
  /// Whether rays meet in the eye.
  bool perspective() const { return perspective_; }
  /// The centre of projection; for a parallel one the point of depth 0 on its axis.
  const Vector3& eye() const { return eye_; }
  /// Unit vector in world space.
  const Vector3& forward() const { return forward_; }

  /// Points that project to (x, y): origin + t * direction; forward . direction = 1, so t is the planar depth
  /// and t |direction| the distance. Both are affine in x and y.
  struct Ray {
    Vector3 origin;     ///< world position
    Vector3 direction;  ///< world units per planar depth
  };
  /// Of a place in clip coordinates.
  Ray RayAt(double clip_x, double clip_y) const;
  /// Through the centre of pixel (x, y) of an image shown in `window` (x right, y down).
  Ray PixelRay(const Roi& window, double x, double y) const;
  /// Distance over planar depth at (x, y): 1 on the axis, 1 / cos of the angle elsewhere.
  double DistancePerDepth(double clip_x, double clip_y) const;
  /// The world point at this planar depth.
  Vector3 PointAt(double clip_x, double clip_y, double depth) const;
  /// Planar depths of the planes that clip the view.
  struct Planes {
    double near;  ///< where clip z is -1
    double far;   ///< where clip z is 1; may be infinite
  };
  /// From the matrix's z row; none where it says nothing of depth, or planes that are not across the view.
  std::optional<Planes> ClipPlanes() const;
  /// forward . (p - eye), positive in front; and |p - eye| (parallel: the planar depth).
  double PlanarDepth(const Vector3& p) const;
  /// To the eye; of a parallel camera the planar depth.
  double Distance(const Vector3& p) const;

 private:
  void SetUp(const std::string& subject);

  Matrix4 world_to_camera_, world_to_clip_;
  bool has_camera_ = false, perspective_ = false;
  Vector3 eye_, forward_;
  Vector3 origin_[3], direction_[3];  ///< constant, times x, times y
};

/// Clip coordinates of the centre of pixel (x, y) of an image shown in `window`.
std::array<double, 2> ClipOfPixel(const Roi& window, double x, double y);

/// What a depth channel holds.
enum class DepthKind : uint8_t {
  kPlanar,     ///< along the viewing axis, world units (OpenGL's eye z without its sign; Blender's Depth)
  kEuclidean,  ///< distance to the eye, along the ray
  kWindow,     ///< depth buffer in [0, 1], 0 near
  kReversedWindow,  ///< depth buffer in [0, 1], 1 near
};
/// Planar depth of a window depth: near far / (far - w (far - near)); `far` may be infinite: near / (1 - w).
double PlanarOfWindow(double window_depth, double near, double far);
/// The inverse of PlanarOfWindow.
double WindowOfPlanar(double planar_depth, double near, double far);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_CAMERA_H_
