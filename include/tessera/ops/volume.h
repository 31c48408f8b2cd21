/// Pictures of volumes: lit surfaces, textured surfaces and hypertexture of distance fields, and density
/// volumes. @file
#ifndef TESSERA_OPS_VOLUME_H_
#define TESSERA_OPS_VOLUME_H_

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/ops/hypertexture.h"
#include "tessera/volume.h"

TESSERA_API_BEGIN
namespace tessera {

/// What is drawn.
enum class VolumeMode : uint8_t {
  /// Surfaces: the first crossing of a level along the ray, lit.
  kIso,    ///< material colour
  kSolid,  ///< colour from a block of texture at the surface point
  kBump,   ///< normal combined with the gradient of noise: normalize(k V + B)
  kMelt,   ///< the level of the field read at p + up * s(p), s noise growing downward

  /// Hypertexture: the soft region between two levels, modulated (Dmf), composited.
  kFur,
  kFire,
  kHyper,  ///< the caller's chain, transfer function and shading

  /// Density volumes through a transfer function.
  kOver,       ///< back to front
  kUnder,      ///< front to back: the same picture, ends early
  kAttenuate,  ///< mean of a c along the ray, a the opacity of the transfer function's reference length
  kXray,       ///< exp(-sum kappa h) in R, G, B; 1 where the ray misses
  kMip,        ///< largest value, 0 to 1 over the transfer function's domain
};
/// Where the samples of a ray lie.
enum class VolumeMethod : uint8_t {
  kRays,       ///< from where the ray enters the volume
  kSlices,     ///< planes parallel to the image
  kShells,     ///< spheres around the eye
  kStacks,     ///< the volume's own slices along the axis that the view is nearest to (x before y before z)
  kShearWarp,  ///< slices sheared and composited in the volume's frame, then one 2-D warp; perspective
               ///< cameras stand before all slices, and the nearest slice has one pixel a voxel
};
/// When values become colour and opacity.
enum class Classification : uint8_t {
  kPost,           ///< interpolate, then look up
  kPre,            ///< look up at voxels, then interpolate colour times extinction
  kPreIntegrated,  ///< a table over the values at both ends of a segment
};

/// Colour (not premultiplied) and opacity of a reference length of material of each value. Between points
/// linear; beyond the first and last constant. Sampled to 1,024 entries of colour and extinction -log1p(-a) /
/// length over [first, last value] (an opacity of 1 counts as 1 - 1e-40), read linearly. Opacities are
/// clamped to [0, 1], NaN to 0.
struct TransferPoint {
  double value = 0;                         ///< of the volume
  std::array<double, 3> color = {1, 1, 1};  ///< R, G, B, not premultiplied
  double opacity = 0;                       ///< of the reference length
};
/// Colour and opacity of every value; see TransferPoint.
struct VolumeTransferFunction {
  std::vector<TransferPoint> points;  ///< values increasing
  double length = 0.01;               ///< world units that have these opacities
};
/// A text file: lines of "value r g b opacity", # starts a comment. Throws Error naming the file and line.
VolumeTransferFunction ReadVolumeTransferFunction(const std::string& file);

/// Phong's material of surfaces under one light, distant or at a point (without falling off).
struct VolumeMaterial {
  std::array<double, 3> color = {0.80, 0.60, 0.42};  ///< R, G, B
  double ambient = 0.25;                             ///< share without light
  double diffuse = 0.75;                             ///< factor of n.l
  double specular = 0.35;                            ///< factor of the highlight, which is white
  double exponent = 40;                              ///< of the highlight
  Vector3 light = {-0.45, 0.65, 0.62};               ///< towards the light, world; any length
  bool point = false;                                ///< `light` is where it stands, world, not a direction
  bool flat = false;                                 ///< unlit: colours as they are
};

/// What hair is like, from root to tip (kFur).
struct VolumeFur {
  /// Factors of the material's colour where strands leave the skin, each R, G, B, at least 0; linear between.
  std::array<double, 3> root = {0.42, 0.34, 0.28};
  std::array<double, 3> tip = {1.25, 1.18, 1.08};  ///< the same at their ends

  /// From even fur, 0, to an undercoat of half the height that few hairs pass, 1.
  double guard = 0.7;
  double patches = 0.25;  ///< share by which colour changes from place to place, 0 to 1
};

/// A further light of media.
struct VolumeLight {
  Vector3 light = {0, 1, 0};                ///< towards it, world, any length; or where it stands
  bool point = false;                       ///< `light` is where it stands (without falling off)
  std::array<double, 3> color = {1, 1, 1};  ///< R, G, B; the first light, VolumeMaterial's, is white
};

/// Light in a medium: modes fire, hyper, over, under and attenuate. Where any of it is asked for (`lit`, or a
/// shadow), a sample's colour is multiplied by ambient + diffuse * P * S of VolumeMaterial, and with
/// VolumeParams::shade the diffuse part and the highlight by P * S.
///
/// S = 1 - shadow * (1 - T) (Kajiya and Von Herzen 1984, 4), T the transmittance from the sample to the light
/// through this medium alone (what cutting planes leave of it), held in an opacity volume: T at the nodes of
/// a grid from corner to corner of the box, each by a march to the light with the midpoints of `step`, read
/// trilinearly. It is made once a stage (size^3 floats, and that many marches) and costs one look-up a
/// sample. Against a march from every sample, in pictures of 1: what a grid of half the voxels leaves out is
/// below 0.02 where the density is resolved by it; an edge between nodes is blurred by one.
/// doc/maths/volume.md has figures.
///
/// P = (1 - g^2) / (1 + g^2 - 2 g cos)^1.5 (Henyey and Greenstein 1941, its mean over all directions 1), cos
/// between the ways of the light before and behind: g above 0 brightens what stands before the light.
///
/// Further lights add their diffuse part and highlight, times their colour, each with a P and an S of its
/// own.
struct VolumeScattering {
  bool lit = false;   ///< lit as a medium although nothing is shadowed
  double shadow = 0;  ///< strength of the medium's shadow on itself, 0 to 1
  double phase = 0;   ///< g, -0.95 to 0.95
  double step = 0;    ///< between samples towards the light, world units; 0: VolumeParams::step
  int size = 0;  ///< nodes of the opacity volume along the longest side, 2 to 256; 0: half as many as voxels,
                 ///< at most 64
  std::vector<VolumeLight> lights = {};  ///< further lights, at most 7
};

/// Light that a medium gives of itself, of a black body (Planck's law) whose temperature rises from `low`
/// where the transfer function begins to `high` where it ends. Chromaticities by Krystek 1985 (within 3e-4 in
/// x and y of the CIE's from 1,000 to 15,000 K), in linear Rec.709, what is negative there 0; luminances
/// relative to that of `high`, by Planck's law and the CIE's luminous efficiency after Wyman et al. 2013. It
/// is added to a sample's colour and neither lit nor shadowed; where the medium is not lit it is all of the
/// colour.
struct VolumeEmission {
  double low = 0;       ///< kelvin, 1,000 to 15,000
  double high = 0;      ///< kelvin, 1,000 to 15,000; 0: no light of its own
  double strength = 1;  ///< luminance of `high`, 0 to 1e6
};

/// Half space that is kept: normal . p >= offset.
struct CuttingPlane {
  Vector3 normal = {0, 0, 1};  ///< any length but 0
  double offset = 0;           ///< along the normal as given
};

/// What RenderVolume draws, and how.
struct VolumeParams {
  VolumeMode mode = VolumeMode::kIso;  ///< what is drawn
  Camera camera;                       ///< looks through the display window
  double iso = 0;                      ///< surfaces: the level; hypertexture: d_in, where density is 1

  /// Width of the soft region: d_out = iso + soft. 0: a hard step; -1: what suits the mode.
  double soft = -1;
  bool inside_above = false;  ///< surfaces: values above the level are inside (density volumes)
  VolumeMaterial material;    ///< of surfaces
  VolumeFur fur;              ///< kFur
  double step = 0;  ///< sample spacing along the axis, world units; 0: one voxel (the smallest spacing);
                    ///< fur 1.25, fire 2.5

  /// Front to back ends at alpha 1 - termination; error <= termination * largest colour.
  double termination = 1.0 / 512;
  VolumeMethod method = VolumeMethod::kRays;  ///< where samples lie
  bool leap = true;                           ///< space leaping; pictures are the same bits without
  std::vector<CuttingPlane> planes;           ///< what lies beyond any of them is cut away
  double time = 0;                            ///< seconds: melt, fur, fire, drifts

  /// Not 0: seconds after which what drifts (fire, steps of `dmf`) is as it was: speeds are rounded to whole
  /// blocks of noise in that time, at least one where there is a speed along y. [0, 1e6]
  double loop = 0;

  /// kSolid, kBump, kMelt, kFur, kFire
  double frequency = 0;  ///< noise blocks per world unit; 0: what suits the mode

  /// Melt: sag, fur: droop, fire: height of flames (world units); bump: k of eq. 7; < 0: default.
  double amount = -1;

  /// kMelt, of distance fields: how long drops are, world units; 0: none; < 0: default.
  double drip = -1;
  TurbulenceLookup lookup = TurbulenceLookup::kBlock;  ///< how turbulence is read
  NoiseBlock block = {};                               ///< empty: made

  /// kSolid: colours of the block's values, linear between points, constant beyond; opacities are not read.
  /// Empty: polished marble over [0, 1].
  std::vector<TransferPoint> colors;

  /// kHyper and density modes, there with Classification::kPost and all methods but kShearWarp: t is the
  /// value from 0 to 1 over the transfer function's domain, and what the chain leaves of it is looked up.
  std::vector<Dmf> dmf;
  VolumeTransferFunction
      transfer;  ///< empty: white, opacity rising from 0 to 0.1 a voxel (hypertexture: 0.5)
  Classification classification = Classification::kPost;  ///< order of lookup and interpolation
  bool shade = false;                                     ///< gradient shading by `material`
  VolumeScattering scatter;                               ///< shadows of media on themselves, and phase
  VolumeEmission emission;                                ///< light of media
  bool depth = false;  ///< a further channel Z: planar depth of the surface (hypertexture and density: where
                       ///< alpha passes 1/2), infinity where there is none

  /// Z and, in the world, the unit normal N.X, N.Y, N.Z that is lit (hypertexture and density: of the field
  /// where it is not displaced), the position P.X, P.Y, P.Z, and the distance from the eye (for a parallel
  /// camera Z). Where there is nothing N and P are 0, the distance infinite.
  bool aovs = false;
};

/// A picture of `spec`'s windows; the camera looks through the display window. Channels R, G, B, A
/// (premultiplied) and, with `depth`, Z; with `aovs` what a renderer adds. The picture carries its camera as
/// metadata (Camera::FromMetadata). Leaping, tiles and threads change no bit. `scene_depth`, where
/// given, holds planar depths (channel 0): rays end there (fractions of a step count); NaN and values at or
/// below the near side draw nothing, infinity everything.
///
/// Leaping is conservative: trilinear interpolation never leaves the range of a cell's corners, so blocks of
/// cells whose range misses the levels (the transfer function's support), widened by the largest
/// displacement, are stepped over by the exact distance to the nearest block that matters; within, a surface
/// is approached by the value over the largest slope nearby, on a grid of 1/4 voxel. Features that a ray
/// crosses in less than that may be missed.
///
/// Opacities are corrected for the length of each sample's segment, 1 - exp(-extinction length), in all modes
/// that composite, so that pictures converge as `step` shrinks; kAttenuate averages the opacity of a
/// reference length, which no step changes, and kMip takes the largest of the samples.
///
/// Error against the double-precision march (kAttenuate: the integral, plus what midpoints of this step miss
/// of it; kShearWarp: the sheared picture itself): 1e-5 at 256 samples, 1e-4 at 4,096 (premultiplied), plus
/// what moving the ray by 1e-4 voxel changes (silhouettes), plus `termination`. Throws Error: empty volume or
/// spec, parameters outside their ranges. Sources: Miller and Jones 2005; Lacroute and Levoy
/// 1994; McReynolds et al. 1997, 13; doc/maths/volume.md.
Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params);
/// The same behind and between what has these depths.
Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                  const Node& scene_depth);

/// A volume of a scene, and where it stands: `to_world`, a rigid motion, leads from its own coordinates to
/// the world's, in which the camera, cutting planes and the light are given.
struct PlacedVolume {
  Volume volume;                  ///< in its own coordinates
  VolumeParams params;            ///< of its own picture
  Matrix4 to_world = kIdentity4;  ///< a rigid motion
};
/// One picture of up to 8 volumes. The camera of the first serves all. All media are marched together, on
/// samples as close as the closest of their steps: where they overlap, their extinctions add up and their
/// colours mix by them, so that the order of the list changes nothing but rounding (1e-6), and media apart
/// from each other hide one another by their depth. Normals of several media are refused. The nearest of the
/// surfaces ends the rays and shows through what lies before it. Alpha, Z, leaping and the error bound are
/// those of RenderVolume. Modes: surfaces, hypertexture, over and under (both front to back), by the method
/// kRays. `samples` above 1: the mean of so many jittered pictures, as RenderVolumeSupersampled's. Throws
/// Error: other modes and methods, more volumes, a matrix that is no rigid motion.
Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, int samples = 1);
/// The same behind and between what has these depths.
Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, const Node& scene_depth);
/// The same with the mean of `samples` pictures.
Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, const Node& scene_depth,
                   int samples);
/// The picture that RenderVolume or RenderVolumes made (scene depth included) with one more volume in it,
/// seen by its camera. Throws Error when `picture` is anything else.
Node AddVolume(const Node& picture, const PlacedVolume& volume, int samples = 1);
/// The mean of `samples` pictures whose rays pass at jittered places in the pixel (JitterSet): antialiasing
/// by the accumulation operations. Depth, where asked for, is averaged too.
Node RenderVolumeSupersampled(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                              int samples);
/// A camera that sees all of a volume from a direction: degrees around y from +z, and above the horizon. A
/// field of view of 0 gives a parallel camera. `zoom` 1: the volume's bounding sphere touches the shorter
/// side.
Camera OrbitCamera(const Volume& volume, double azimuth, double elevation, double field_of_view,
                   double aspect, double zoom = 1);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_VOLUME_H_
