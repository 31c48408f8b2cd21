/// Line integral convolution: a vector field shown, or an image smeared, along its streamlines. @file
#ifndef TESSERA_OPS_FLOW_H_
#define TESSERA_OPS_FLOW_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera {

/// How a streamline is followed from tap to tap. P' = v(P), v the field between pixels, bilinear.
enum class LicIntegrator : uint8_t {
  kEuler,     ///< P + h v(P), first order
  kMidpoint,  ///< second order
  kRk4,       ///< classical Runge-Kutta, fourth order
  kAdaptive,  ///< RK4 over up to ten pixels at once, twenty where the field is smooth, taps in between by
              ///< cubic Hermite; down to one tap where the line bends, by third order where it does within
              ///< every pixel. Lines longer than 64 pixels take steps of their own near saddles and centres,
              ///< down to 1/16 pixel, and end in sinks
  kCell,  ///< from pixel to pixel, direction constant within each (Cabral and Leedom 1993; rlic): a tap per
          ///< pixel
};
/// Weights of taps along a line.
enum class LicKernel : uint8_t {
  kBox,
  kTent,    ///< falls to 0 at the length
  kHann,    ///< falls to 0 at the length
  kRamp,    ///< rises along the field: shows its sign on sparse noise (oriented LIC)
  kRipple,  ///< a Hann window over a wave of `phase`: a loop of phases moves along the field
  kUser,    ///< LicParams::weights
};
/// Whose lines are followed.
enum class LicMethod : uint8_t {
  kAuto,    ///< kDirect; from a length of 64 kShared where it can be had
  kDirect,  ///< a line from every pixel, both ways
  kShared,  ///< lines shared by the pixels that they cross
};
/// What is done about the contrast that averaging takes away.
enum class LicContrast : uint8_t {
  kAuto,      ///< kRescale of the library's own noise, kNone of an image and with `speed`
  kNone,      ///< the weighted mean as it is
  kRescale,   ///< the contrast that averaging noise takes away is put back: mean + f (I - mean), see Lic
  kEqualize,  ///< histogram equalisation (Equalize)
};
/// How |f| shows in the picture.
enum class LicMagnitude : uint8_t {
  kNone,
  kColor,   ///< three channels: a colour of |f| times the convolution
  kNoise,   ///< spots of the noise grow with |f|
  kLength,  ///< lines as long as |f| over its largest value
};
/// What the library's own noise looks like.
enum class LicNoise : uint8_t {
  kWhite,     ///< uniform, one value a pixel, 256 levels
  kFiltered,  ///< white noise under a small binomial kernel, contrast restored
  kSparse,    ///< few bright spots on black
};
/// What the field's numbers mean.
enum class LicUnits : uint8_t {
  kPixels,      ///< components in pixels
  kNormalized,  ///< x in widths, y in heights of the image
  kLatLong,  ///< east and north over a full map of longitude and latitude, the upper edge +90 degrees; lines
             ///< cross the date line from the last column to the first, whatever the border
};

/// Parameters of Lic. Lengths are in pixels of the result.
struct LicParams {
  double length = 20;                                   ///< each way, [0, 100000]; in taps for kCell
  double step = 1;                                      ///< between taps, [1/16, 16]
  LicIntegrator integrator = LicIntegrator::kAdaptive;  ///< how a line is followed
  LicKernel kernel = LicKernel::kBox;                   ///< weights along it
  double phase = 0;                                     ///< kRipple: turns of its wave, [0,1) makes a loop
  double waves = 2;                                     ///< kRipple: waves within the kernel

  /// kUser: an odd number, from the farthest tap backward to the farthest forward; >= 0.
  std::vector<double> weights = {};
  LicMethod method = LicMethod::kAuto;           ///< whose lines
  Wrap wrap = Wrap::kRenormalize;                ///< where a line leaves the image
  LicContrast contrast = LicContrast::kAuto;     ///< of the result
  double gain = 0.75;                            ///< kRescale: share of the noise's contrast that is put back
  LicMagnitude magnitude = LicMagnitude::kNone;  ///< how |f| shows
  LicNoise noise = LicNoise::kWhite;             ///< of Lic(field)
  int spot = 1;                                  ///< pixels across a cell of the noise, 1 to 64
  uint32_t seed = 0;                             ///< of the noise
  bool linear = false;                 ///< the texture between its pixels: bilinear instead of nearest
  bool speed = false;                  ///< lines as long as |f| times the length: step is in time
  LicUnits units = LicUnits::kPixels;  ///< of the field
  double scale_x = 1;                  ///< user units: factors on the components
  double scale_y = 1;                  ///< user units: factors on the components
  bool y_up = false;                   ///< the second component points up

  /// A field of another size is brought to the picture's by Catmull-Rom, not bilinearly.
  bool bicubic = false;
  double smallest = 1e-6;  ///< vectors shorter than this times the longest are 0
  bool alpha = false;      ///< an alpha channel that is 0 where masked
  int width = 0;           ///< of the result without an image; 0: the field's
  int height = 0;          ///< of the result without an image; 0: the field's
  int passes = 1;  ///< 2: sharpened by ten times themselves less nine times the mean of the 3 x 3 pixels
                   ///< around, masked ones left out, and convolved again; kAuto then is kEqualize, else kNone
  bool with_image = false;  ///< set by Lic: input 0 is the image, input 1 the field
};

/// The field's first two channels are the vector's components at the pixels' centres, x right and y down; a
/// field of another size than the picture is first brought to the picture's pixels, its vectors with it. NaN,
/// infinity and, where the field has an alpha channel beyond them, alpha 0 are masked: lines end there, and
/// the pixel itself is 0 (alpha 0).
///   result(x) = sum_i w_i T(P_i) / sum_i w_i   over the taps of the streamline through x, P_0 = x
/// Lic(field) convolves the library's own noise in [0,1] and gives one channel; Lic(image, field) every
/// channel of the image. A zero vector gives T(x). Without `speed` the vectors' lengths do not matter.
///
/// The mean of n taps of white noise has 1/sqrt(n) of its deviation: 6 % of the range at the default length,
/// a grey picture. With kRescale deviations from the noise's mean are multiplied by
///   f = max(1, gain sum_i w_i / sqrt(sum_ij w_i w_j rho(|i - j| step)))
/// for the weights of the pixel's kernel (cut short by magnitude kLength, not by borders and sinks, whose
/// pixels have more contrast for it), rho the noise's correlation over a distance: of an image 1 at 0 and 0
/// beyond, of own noise what `spot` (at the pixel, for magnitude kNoise) and `noise` say. f = 1 where the
/// vector is 0. About 2 of 100 pixels then leave [0,1]; kNone gives the plain mean.
///
/// Error: end points of kAdaptive at a length of 100 on fields with details of 80 pixels and more: 3e-4
/// pixels in the mean, 1.1e-3 at most, sinks and foci included; with details of 16 pixels 2e-3 and 2e-2.
/// kRk4: 1e-4 and 4e-4 where no line comes near a critical point; in a sink, as at shorter lengths, up to
/// 0.2. Circles keep their radius within 1e-3 pixels over 10,000. The other integrators are computed as
/// defined, positions within 1e-4 pixels. kShared: RMS from kDirect with a linear texture on white noise
/// 16/1024 of its range at length 10, 12/1024 at 20, 7/1024 at 60, half of it on smooth noise; with the
/// nearest pixels of white noise 42, 31 and 20/1024, as lines up to half a pixel beside read other numbers
/// (taps at half the step would differ by 16/1024 too; the picture's own deviation at 20 is 46/1024).
///
/// Cost per pixel in field samples at a length of 20: kAdaptive about 17, 120 where the field changes from
/// pixel to pixel; kRk4 160. A texture sample per tap. Memory: a copy of the field, the noise.
///
/// Errors: fewer than two channels, weights that are not finite or sum to 0, parameters out of range. Source:
/// Cabral and Leedom 1993; Stalling and Hege 1995; doc/maths/flow.md.
Node Lic(const Node& field, const LicParams& params = {});
/// The image smeared along the field.
Node Lic(const Node& image, const Node& field, const LicParams& params = {});

/// The parameters of frame `frame` (from 1) of `frames` that make a loop: kernel kRipple, phase (frame - 1) /
/// frames.
LicParams LicFrame(LicParams params, int frame, int frames);

/// How SurfaceField brings vectors to the picture.
struct SurfaceFieldParams {
  std::optional<Camera> camera;  ///< the picture's, with normals; none: by the positions' own differences
  double edge = 3;  ///< neighbours are on two surfaces where their step is longer than this times the larger
                    ///< of the steps just before and behind it, 1 to 1e6 (the outline of a curved surface has
                    ///< 2.4); 0: nowhere
};
/// A field of the picture for Lic: at each pixel the part of a vector along the surface, pixels per world
/// unit, X right and Y down (channels X, Y, A). `positions` has a surface's points, by the names that
/// renderers give them or the first three channels; `vectors` three channels, world units; windows equal,
/// else Error. Without a camera V = x P_x + y P_y + z (P_x x P_y), P_x and P_y the mean of the differences to
/// the neighbours that the surface joins, or the one there is. Where something is missing or not finite,
/// where P_x and P_y are parallel within 1e-10, and, of two neighbours that no surface joins (`edge`; sides
/// and corners), at the left or upper one X, Y and A are 0, else A is 1: Lic's lines end there. Computed in
/// double, rounded once but for cancellation. Cost: the positions of 5 x 5 pixels. Source: Laramee et al.
/// 2003.
Node SurfaceField(const Node& positions, const Node& vectors, const SurfaceFieldParams& params = {});
/// The same through a camera: V - N (V.N) / (N.N), as far as it moves the picture of the point. Error without
/// a camera.
Node SurfaceField(const Node& positions, const Node& normals, const Node& vectors,
                  const SurfaceFieldParams& params);

/// Histogram equalisation of every channel but alpha: the share of samples that are smaller, plus half of
/// those that are equal. NaN and pixels of alpha 0 stay and do not count; images of one value become 1/2.
/// 65,536 classes between the smallest and the largest number: |error| <= the share of samples in the value's
/// class. Whole image in memory.
Node Equalize(const Node& image);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_FLOW_H_
