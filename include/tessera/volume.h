/// Volumes: sampled scalar fields in three dimensions, solids as formulas, and distance fields made of
/// either. @file
#ifndef TESSERA_VOLUME_H_
#define TESSERA_VOLUME_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

/// Voxel (i, j, k), counted from 0, has its centre at origin + (i, j, k) * spacing in world units; i runs
/// right, j up, k towards the viewer of the default camera. A sample stands for the value scale * v + bias, v
/// the stored number (integers as code / (2^bits - 1)).
struct VolumeSpec {
  std::array<int, 3> size = {0, 0, 0};  ///< voxels along x, y, z
  PixelType type = PixelType::kFloat;   ///< of the stored numbers
  Vector3 spacing = {1, 1, 1};          ///< world units from centre to centre
  Vector3 origin = {0, 0, 0};           ///< centre of voxel (0, 0, 0)
  double scale = 1;                     ///< of stored numbers
  double bias = 0;                      ///< added to the product

  /// Most bytes of samples in memory. Larger volumes are paged: bricks of 32x32x32 cells, 1.3 times as large,
  /// in a nameless file in $TMPDIR, else /var/tmp, no more of it resident than this, give or take what a
  /// thread reads for a few pixels. 0: all in memory. Values and pictures are the same bits.
  size_t memory = 0;

  /// A volume centred at 0 whose longest side measures 2.
  static VolumeSpec Centred(const std::array<int, 3>& size, PixelType type = PixelType::kFloat,
                            const Vector3& proportions = {1, 1, 1});
  /// World position of a place in voxels.
  Vector3 Position(double i, double j, double k) const {
    return {origin[0] + i * spacing[0], origin[1] + j * spacing[1], origin[2] + k * spacing[2]};
  }
  /// Corners of the box of all voxels, half a voxel beyond the outermost centres.
  Vector3 Low() const { return Position(-0.5, -0.5, -0.5); }
  /// The opposite corner.
  Vector3 High() const { return Position(size[0] - 0.5, size[1] - 0.5, size[2] - 0.5); }
};

namespace model {
class SolidNode;
struct VolumeData;
}  // namespace model

/// An immutable scalar field, cheap to copy (samples are shared). Rows of x lie one after the other, then
/// slices; the outermost voxels are repeated around it (one before, two behind), which costs 3 voxels an
/// axis. NaN samples count as `scale * 0 + bias` and are counted. Fewer than 2^38 voxels; volumes of 2^31 and
/// more, that border included, are paged as if VolumeSpec::memory were at most 1 GB.
class Volume {
 public:
  Volume() = default;
  /// Zero everywhere. All constructors throw Error: sizes of at least 1, positive spacing, finite numbers,
  /// memory, a null function or pointer.
  explicit Volume(const VolumeSpec& spec);
  /// f(position in world units) at every voxel. f is called from this thread only.
  Volume(const VolumeSpec& spec, const std::function<double(const Vector3&)>& f);
  /// From size[0] * size[1] * size[2] samples of `type` in memory, x fastest; converted to spec.type where
  /// different (then scale and bias are those of the stored numbers).
  Volume(const VolumeSpec& spec, const void* samples, PixelType type);
  /// `slices` images stacked along y, the first on top and nearest z = 0; a slice's upper row has the largest
  /// y. One channel of the image is taken; its type is kept. `memory` as VolumeSpec::memory.
  static Volume FromImage(const ConstImageView& stack, int slices, int channel = 0,
                          const Vector3& proportions = {1, 1, 1}, size_t memory = 0);

  /// Whether there are no voxels.
  bool empty() const { return data_ == nullptr; }
  /// Size, place and scale.
  const VolumeSpec& spec() const;
  /// Value of a voxel; the nearest one beyond the sides.
  double At(int i, int j, int k) const;
  /// Trilinear between voxel centres in double, the nearest value beyond them, at a position in voxels (i, j,
  /// k).
  double Sample(double i, double j, double k) const;
  /// Trilinear interpolation of central differences at voxels, per voxel (half as large at the outermost
  /// voxels).
  Vector3 Gradient(double i, double j, double k) const;
  /// Smallest and largest value; samples that were NaN.
  std::array<double, 2> Range() const;
  /// Samples that were NaN.
  int64_t nan_samples() const;
  /// Bytes of the samples, and of everything that hangs on them.
  size_t bytes() const;

  /// The library's own.
  const std::shared_ptr<model::VolumeData>& data() const { return data_; }

 private:
  std::shared_ptr<model::VolumeData> data_;
};

/// How a file without a header of its own is read.
struct RawVolumeParams {
  std::array<int, 3> size = {0, 0, 0};  ///< 0: the file describes itself
  PixelType type = PixelType::kUint8;   ///< of the numbers in the file
  int64_t header = 0;                   ///< bytes skipped
  bool big_endian = false;              ///< byte order of the file
  bool is_signed = false;  ///< 16-bit integers with sign: value in [-32768, 32767] / 65535 + 32768 / 65535
};
/// A volume file that OpenImageIO reads (OpenVDB), a stack of slices (`#` or %03d stands for the number, from
/// the first file that exists), an image of slices one above the other (`slices`), or raw samples (raw.size
/// given). `spacing` as for VolumeSpec::proportions, times the size of a voxel that the file gives (OpenVDB);
/// the longest side measures 2. `part` is the name or number of one of several grids or images of a file. Of
/// a sparse grid the box of its active voxels is read. Throws Error naming the file; all but raw samples need
/// the component tessera::io.
struct VolumeFileParams {
  RawVolumeParams raw;          ///< how a raw file is read; without a size the file describes itself
  int slices = 0;               ///< in one image; 0: the file says
  int channel = 0;              ///< of an image
  Vector3 spacing = {1, 1, 1};  ///< proportions of a voxel
  std::string part = {};        ///< grid or image of a file; empty: the first
  size_t memory = 0;            ///< as VolumeSpec::memory: rows or slices of the file are read one by one
};
/// A volume of a file, as VolumeFileParams says.
Volume ReadVolume(const std::string& file, const VolumeFileParams& params = {});
/// The samples alone, x fastest, as ReadVolume with the same size and type reads them.
void WriteRawVolume(const Volume& volume, const std::string& file);

/// A solid as its signed distance, negative inside, in world units: |grad d| <= 1 everywhere, = 1 where
/// exact. Values, cheap to copy. Unions are exact outside, intersections and differences inside; elsewhere,
/// and in smooth blends, the magnitude is a lower bound.
class Solid {
 public:
  /// Exact.
  static Solid Sphere(const Vector3& centre, double radius);
  static Solid Ellipsoid(const Vector3& centre, const Vector3& radii);  ///< lower bound

  /// Exact; corners rounded by `rounding`.
  static Solid Box(const Vector3& centre, const Vector3& half_size, double rounding = 0);
  static Solid Torus(const Vector3& centre, double radius, double tube);  ///< axis y

  /// Exact.
  static Solid Capsule(const Vector3& from, const Vector3& to, double radius);
  static Solid Cone(const Vector3& from, const Vector3& to, double from_radius,
                    double to_radius);                       ///< rounded ends
  static Solid Plane(const Vector3& normal, double offset);  ///< inside: normal . p < offset

  /// Any function with |grad| <= 1, on which DistanceField counts.
  static Solid Function(std::function<double(const Vector3&)> distance);

  /// At a world position; negative inside.
  double Distance(const Vector3& p) const;
  /// Moved, world units.
  Solid Translated(const Vector3& by) const;
  /// About an axis through 0, counter-clockwise seen against it.
  Solid Rotated(const Vector3& axis, double degrees) const;
  /// About 0; by is positive.
  Solid Scaled(double by) const;
  Solid Grown(double by) const;  ///< offset surface

  /// What lies within half the thickness of the surface.
  Solid Shell(double thickness) const;

  /// What is in either.
  friend Solid Union(const Solid& a, const Solid& b);
  /// What is in both.
  friend Solid Intersection(const Solid& a, const Solid& b);
  /// What is in a alone.
  friend Solid Difference(const Solid& a, const Solid& b);
  /// Blended over `radius` world units (polynomial of degree 2): min(a, b) - max(radius - |a - b|, 0)^2 / (4
  /// radius).
  friend Solid SmoothUnion(const Solid& a, const Solid& b, double radius);
  /// The intersection, blended likewise.
  friend Solid SmoothIntersection(const Solid& a, const Solid& b, double radius);
  /// From words: "torus(0,0,0,.6,.2) | sphere(0,.5,0,.3)", | union, & intersection, - difference, with a
  /// blend radius as |.1 or &.1, left to right, parentheses; or a ready-made name ("body", "knot"). Throws
  /// Error.
  static Solid Parse(const std::string& words);

 private:
  friend Volume DistanceField(const Solid& solid, const VolumeSpec& spec, double range);
  explicit Solid(std::shared_ptr<const model::SolidNode> node) : node_(std::move(node)) {}
  std::shared_ptr<const model::SolidNode> node_;
};

/// Distances at voxels. Integer types hold distances within +-`range` world units (default: an eighth of the
/// longest side), clamped; float and half hold them as they are. Cost: each block of 8^3 voxels asks only the
/// parts of the solid that matter there, 10 to 40 ns a voxel; blocks beyond the range of clamped fields are
/// filled at once.
Volume DistanceField(const Solid& solid, const VolumeSpec& spec, double range = 0);
/// How Drawn draws a field out.
struct DrawnParams {
  bool down = false;  ///< towards smaller y; else towards larger
  double iso = 0;     ///< the surface

  /// Distances below iso - depth count as that, so that thick bodies are drawn no further than thin ones.
  double depth = 1e30;
  /// How much a distance grows for each unit gone, of the column at world x and z: what is `d` inside is
  /// drawn -d / slope beyond. At least 0; infinite where nothing is drawn. Called from this thread only.
  std::function<double(double x, double z)> slope;
};
/// A distance field (inside: below) whose bodies are drawn out along y: F(p) = min of d(p) and, over s > 0,
/// max(d(p - s y), iso - depth) + slope s, between voxel centres of a column; exact but for the stored type's
/// rounding. Flames stand on what is drawn upward, drops hang where it is drawn downward in few places.
/// Magnitudes are no longer those of distances. Cost: one pass, 20 ns a voxel. Throws Error: an empty volume,
/// no slope or one that is below 0 or NaN, a depth below 0 or NaN.
Volume Drawn(const Volume& field, const DrawnParams& params);
/// Signed distance to the surface `iso` of a volume (inside: value >= iso, or below it with `inside_below`),
/// world units, anisotropic spacing respected: the exact Euclidean distance to the points where the lines
/// between neighbouring voxels cross the level (linear interpolation, so sub-voxel), by the separable
/// transform of Felzenszwalb and Huttenlocher on the axis crossings: off by less than half a voxel far from,
/// and by second order near, the surface. Cost O(voxels), and 14 bytes of memory for each, of which there are
/// fewer than 2^31 (Error).
struct DistanceFieldParams {
  double iso = 0.5;                    ///< the level
  bool inside_below = false;           ///< values below the level are inside
  PixelType type = PixelType::kFloat;  ///< of the voxels
  double range = 0;                    ///< integer types, as above
};
/// Distances to a level of a volume, as DistanceFieldParams says.
Volume DistanceField(const Volume& volume, const DistanceFieldParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_VOLUME_H_
