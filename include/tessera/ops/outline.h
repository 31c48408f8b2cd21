/// Lines and masks for compositing: outlines from depth, normals and ids, halos, brushes, sprites. @file
#ifndef TESSERA_OPS_OUTLINE_H_
#define TESSERA_OPS_OUTLINE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Sources: McReynolds et al. 1997, 6.3, 11.1, 11.6, 15.2, 15.3; doc/maths/composite.md; u = 2^-24. @file

/// Lines of a picture from what lies behind its pixels. A pixel is 1 when it differs from a 4-neighbour
/// inside the image, else 0; each test serves where its image is given:
///   depth:  the second difference of 1/z along a row or column exceeds `depth_tolerance` times the largest
///   |1/z| of the
///           three: nothing on planes however tilted, since 1/z is affine across them in screen space;
///           infinite z counts as 1/z = 0, NaN and 0 as well. The line is on both sides of a step.
///   normal: |n . m| < cos(normal_degrees) |n| |m| with one of the four neighbours; zero and NaN normals
///   differ from all
///           others. Both pixels are marked.
///   id:     ids differ in any channel. Both pixels are marked.
/// Background, whose normal is zero or NaN or whose 1/z is 0, has no lines of its own: the object beside it
/// has. `smooth`: lines of one pixel instead, antialiased, along the middle between pixels that differ
/// (background has its half of them): 1 - t where the boundary is t < 1 pixels from the pixel's centre, by
/// the share of the pixels around, binomial weights of 5 x 5, that lie on its own side; creases of the depth,
/// which lie on pixels, as without.
/// Depth is channel 0 of its image, normals channels 0 to 2. Windows are equal, else Error; so is nothing to
/// test. The comparisons are made in double on the float samples. One channel.
struct EdgeInputs {
  Node depth;   ///< may be empty
  Node normal;  ///< may be empty
  Node id;      ///< may be empty
};
/// Thresholds of Edges.
struct EdgeParams {
  double depth_tolerance = 0.01;  ///< relative second difference of 1/z
  double normal_degrees = 30;     ///< 0 to 90
  bool smooth = false;            ///< lines of one pixel, antialiased
};
/// Lines of a picture, as EdgeInputs says.
Node Edges(const EdgeInputs& inputs, const EdgeParams& params = {});

/// Outline of a mask (first channel > 0.5) by counting 4-neighbours inside it, k: kInner marks mask pixels
/// with k < 4, kOuter pixels beside the mask (k > 0), kCount gives k / 4. Outside the image nothing is mask,
/// unless `clamp` repeats the edge. One channel, exact.
enum class OutlineKind : uint8_t { kInner, kOuter, kBoth, kCount };
/// Parameters of Outline; the kinds are described at OutlineKind.
struct OutlineParams {
  OutlineKind kind = OutlineKind::kInner;  ///< what is marked
  bool clamp = false;                      ///< the edge repeated outside, instead of no mask
};
/// The outline of a mask, as OutlineKind says.
Node Outline(const Node& mask, const OutlineParams& params = {});

/// Lines with halos: a line pixel (lines > 0) stays when no line within `radius` pixels is nearer by more
/// than `epsilon`: z <= Zmin + epsilon, Zmin the smallest line depth on the disc. epsilon >= radius times the
/// depth's slope along a line, or it erases itself. Elsewhere 0. Line samples keep their bits. Depth is its
/// image's first channel; a NaN depth is never nearer and is erased. Cost O(radius^2) per line pixel.
struct HaloParams {
  int radius = 3;         ///< 0 to 64
  double epsilon = 0.01;  ///< how much nearer another line has to be
};
/// Lines that keep clear of nearer ones, as HaloParams says.
Node Halo(const Node& lines, const Node& depth, const HaloParams& params = {});

/// A round dab of paint at (x, y) in pixels (pixel centres at half-integers). Its opacity falls from the
/// middle to 0 at the radius: full within `hardness` * radius, then as 1 - (3 t^2 - 2 t^3).
struct Dab {
  double x = 0;           ///< of the middle, pixels
  double y = 0;           ///< of the middle, pixels
  double radius = 8;      ///< pixels, above 0
  double opacity = 0.25;  ///< in the middle, 0 to 1
  double hardness = 0;    ///< 0 to 1
};
/// The coverage of dabs laid over each other, 1 - product of (1 - opacity): n equal dabs give 1 - (1 - a)^n.
/// `output` gives the window; one channel "A". Computed in double, |error| <= 2 u. Error unless radius > 0,
/// opacity in [0, 1].
Node AirbrushMask(const ImageSpec& output, const std::vector<Dab>& dabs);
/// Dabs along a line through the points, `spacing` pixels apart, shaped like `brush`.
std::vector<Dab> Stroke(const std::vector<std::array<double, 2>>& points, double spacing, const Dab& brush);

/// A round soft sprite: colour times alpha times the dab's fall-off, painted over those behind it (depth
/// falling: far first, equal depths in order). `density` below `threshold` drops it whole. RGBA,
/// premultiplied; double, |error| <= 4 u.
struct Sprite {
  double x = 0;        ///< of the middle, pixels
  double y = 0;        ///< of the middle, pixels
  double radius = 8;   ///< pixels
  double alpha = 0.5;  ///< in the middle
  double red = 1;      ///< not premultiplied
  double green = 1;    ///< not premultiplied
  double blue = 1;     ///< not premultiplied
  double depth = 0;    ///< larger is farther
};
/// Sprites painted far to near on transparent black, as Sprite says.
Node Sprites(const ImageSpec& output, const std::vector<Sprite>& sprites, double threshold = 1.0 / 512);

/// One print of a brush: its middle in pixels, the length of its longer side, and how it is turned.
struct Stamp {
  double x = 0;        ///< of the middle, pixels
  double y = 0;        ///< of the middle, pixels
  double size = 32;    ///< of the brush's longer side, pixels; below 1 it stays 1 and fades as its square
  double angle = 0;    ///< degrees, counter-clockwise as seen
  double opacity = 1;  ///< 0 to 1
};
/// Where a brush is set down along a path. Stamp k is born k * spacing * (the larger size) pixels along the
/// path, which is the share u of its length; its youth is s = 1 - (time - u) / life, and it is there while
/// 0 <= s <= 1. Pairs of numbers are its values at s = 0 and s = 1, linear between. With time and life as
/// they are, s is the place on the path and the pairs are a brush's pressure; with others, the stamps are
/// puffs that a moving source leaves behind (McReynolds et al. 1997, 11.2): they grow, fade and are carried
/// off.
struct StampPathParams {
  std::vector<std::array<double, 2>> path = {{0, 0}};  ///< points x,y, pixels
  bool smooth = false;                     ///< a Catmull-Rom curve through the points, 32 pieces each
  double spacing = 0.25;                   ///< in parts of the larger size, above 0
  std::array<double, 2> size = {32, 32};   ///< oldest and newest, pixels, 0 or above
  std::array<double, 2> opacity = {1, 1};  ///< oldest and newest, 0 to 1
  double rotation = 0;                     ///< degrees, counter-clockwise as seen
  bool follow = false;                     ///< turned as the path is, besides
  double time = 1;                         ///< share of the path that was travelled; goes on beyond 1
  double life = 1;                         ///< of a stamp, in shares of the path, above 0
  std::array<double, 2> drift = {0, 0};    ///< how far a stamp is carried in its life, pixels
  double jitter_place = 0;                 ///< largest shift along x and y, in parts of the size
  double jitter_rotation = 0;              ///< largest turn either way, degrees
  double jitter_size = 0;                  ///< largest loss, a share, 0 to 1
  double jitter_opacity = 0;               ///< largest loss, a share, 0 to 1
  uint32_t seed = 0;                       ///< of jitter, which a stamp has of k and this alone
};
/// The stamps there are, first born first, as StampPathParams says. Error out of the ranges there, and for
/// more than 100,000 stamps on the path.
std::vector<Stamp> StampsAlong(const StampPathParams& params);
/// `stamps` of a brush laid over the base one after the other: p + (1 - a) base, premultiplied, p and a the
/// brush's colours and alpha times the opacity. A brush without alpha covers its whole rectangle, but one of
/// a single channel is itself the coverage, and `color` (one value for all channels or one for each but
/// alpha) what it leaves. Each stamp reads the brush bilinearly between means of 2^l x 2^l of its pixels, and
/// linearly between the two l around log2(pixels of the brush per pixel of the result), transparent outside.
/// Error unless the brush has as many channels beside alpha as the base. Computed in double, |error| <= 2 u
/// of the sum of magnitudes. Cost: pixels under each stamp, times channels. Source: McReynolds et al.
/// 1997, 6.3; Haeberli and Segal 1993, 4.2.
Node Paint(const Node& base, const Node& brush, const std::vector<Stamp>& stamps,
           const std::vector<double>& color = {1});

/// Puffs of smoke or vapour that rise from (x, y): born every `interval`, each lives `life`, moves with its
/// own velocity, grows from `radius` by `growth` times its age and fades as (1 - age / life)^2. Everything
/// depends on `seed` and `time` only; any time may be asked for. Error unless interval and life are above 0,
/// and for more than 100,000 puffs alive at once.
struct PuffParams {
  double x = 0;                                   ///< where they rise, pixels
  double y = 0;                                   ///< where they rise, pixels
  double time = 1;                                ///< of the picture
  double interval = 0.02;                         ///< between births
  double life = 1;                                ///< how long one lives
  double velocity_x = 0;                          ///< pixels per time unit
  double velocity_y = -100;                       ///< pixels per time unit; up is negative
  double spread = 25;                             ///< largest deviation of a puff's own velocity
  double radius = 6;                              ///< at birth, pixels
  double growth = 20;                             ///< of the radius, pixels per time unit
  double alpha = 0.35;                            ///< at birth
  std::array<double, 3> color = {0.8, 0.8, 0.8};  ///< R, G, B, not premultiplied
  uint32_t seed = 0;                              ///< of velocities
};
/// The puffs alive at a time, as PuffParams says.
std::vector<Sprite> Puffs(const PuffParams& params);

/// A light seen from a distance: the size shrinks with the square root of the attenuation 1 / (kc + kl d + kq
/// d^2); below `threshold` the size stays and alpha falls as the area would.
struct LightPoint {
  double size = 1;   ///< pixels
  double alpha = 1;  ///< 1 while the size is above the threshold
};
/// Size and alpha of a light point at a distance, as LightPoint says.
LightPoint AttenuatedLight(double size, double distance, double kc, double kl, double kq, double threshold);

/// A small light.
struct LightSource {
  Vector3 place = {0, 0, 1};  ///< x, y in pixels and the distance; with a camera a point of the world
  std::array<double, 3> color = {1, 1, 1};  ///< R, G, B, not premultiplied
  double size = 1;                          ///< its diameter before attenuation, pixels, 0 to 10000
};
/// What a light looks like.
enum class LightShape : uint8_t {
  kDisc,      ///< the share of each pixel that a disc covers
  kGaussian,  ///< the mean over each pixel of exp(-d^2 / 2 s^2), s = size / sqrt(8): of a disc's area
};
/// Lights and how they are seen.
struct LightPointsParams {
  std::vector<LightSource> lights;                ///< any order
  std::array<double, 3> attenuation = {1, 0, 0};  ///< k0, k1, k2 of AttenuatedLight, 0 to 1e9, one above 0
  double fade = 1;                       ///< the size below which lights fade instead, pixels, 1e-3 to 10000
  LightShape shape = LightShape::kDisc;  ///< of all lights
  bool adds = false;                     ///< colours are summed, not painted near over far
  std::optional<Camera> camera;          ///< places are the world's; lights behind it are left out
};
/// A light in its picture.
struct ShownLight {
  double x = 0;                             ///< of the middle, pixels
  double y = 0;                             ///< of the middle, pixels
  double size = 1;                          ///< diameter, pixels
  double alpha = 1;                         ///< opacity
  double distance = 0;                      ///< to the eye
  std::array<double, 3> color = {1, 1, 1};  ///< R, G, B, not premultiplied
};
/// The lights as they are seen, far first, equal distances in order; those that are not are left out. Error
/// for numbers out of the ranges above (coordinates and colours within 1e9).
std::vector<ShownLight> ShownLights(const ImageSpec& output, const LightPointsParams& params);
/// Lights on transparent black, R, G, B premultiplied, and A = 1 - product of (1 - a). Each covers pixels by
/// exact integrals, so a light sums to its area however it lies on the pixels, Gaussians within 1e-5 (they
/// end at 5 s). Double, |error| <= 4 u of the sum of the colours. Cost: rows times lights, pixels under each.
/// Source: McReynolds et al. 1997, 11.6.
Node LightPoints(const ImageSpec& output, const LightPointsParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_OUTLINE_H_
