/// Noise: white, value, gradient, simplex, cell, sparse convolution, spot and Gabor noise, sums of octaves,
/// on grids and at the positions of an image. @file
#ifndef TESSERA_OPS_NOISE_H_
#define TESSERA_OPS_NOISE_H_

#include <array>
#include <cstdint>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// What is at the lattice, and how it becomes a function of position.
enum class NoiseKind : uint8_t {
  kWhite,     ///< one uniform number per lattice cell
  kValue,     ///< uniform numbers at lattice points, interpolated with the fade
  kGradient,  ///< gradients at lattice points (Perlin); 0 at every lattice point
  kSimplex,   ///< gradients at the corners of simplices, radially weighted
  kCell,      ///< distance to the nearest feature points (Worley)
  kSparse,    ///< sparse convolution (Lewis): Poisson impulses of random height, radial kernel
  kSpot,      ///< spot noise (van Wijk): Poisson spots of random sign, elliptical kernel
  kHash,      ///< one uniform number per position: the hash of its coordinates as floats (OSL's hashnoise)
  kGabor,  ///< impulses convolved with a Gaussian times a wave of random phase (Lagae et al. 2009): one wave
           ///< a cell, of a bandwidth and orientation that are asked for
};
/// Where the random numbers of lattice points come from. Colour noise of kOsl is OSL's too.
enum class NoiseLattice : uint8_t {
  kTessera,  ///< integer hash of cells modulo 2^32, any seed. Where no period is asked for the noise comes
             ///< back 2^32 cells away along an axis, and 2^31 away along two axes at once
  kPerlin,   ///< Perlin's published permutation and gradients (2002), evaluated in double in the published
             ///< order
  kOsl,  ///< Open Shading Language, as MaterialX and Cycles: Jenkins' hash, OSL's gradients and scales; kinds
         ///< kGradient (OSL's perlin), kWhite (cell), kSimplex and kHash, with periods as OSL's pnoise has
         ///< them
};
/// Weights between lattice points: 6 t^5 - 15 t^4 + 10 t^3, 3 t^2 - 2 t^3, t.
enum class NoiseFade : uint8_t { kQuintic, kCubic, kLinear };
/// How octave values n in [-1,1] enter the sum.
enum class NoiseSum : uint8_t {
  kFbm,         ///< n
  kTurbulence,  ///< |n|
  kBillow,      ///< 2|n| - 1
  kRidged,      ///< (1 - |n|)^2
};
/// What the channels hold.
enum class NoiseOutput : uint8_t {
  kValue,     ///< the same value in every channel, alpha 1
  kColor,     ///< independent noise per channel, alpha 1 (lattice kOsl: OSL's colour noise)
  kGradient,  ///< channel 0 the value, channels 1 to dims its derivatives per lattice cell, further channels
              ///< 0

  /// Packings of stored noise (Miller and Jones); with kValue and sum kTurbulence they are the paper's four.
  kOctaves,  ///< channel k is octave k alone, unweighted: T = |R| + |G|/2 + |B|/4 + |A|/8 of signed values
  kNormal,   ///< channels 0 to 2 the gradient's direction, 1/2 + 1/2 g/|g| (signed: g/|g|; where it vanishes
             ///< 0), channel 3 the value; further ones 0
};
/// How rows of grids are made; the noise is the same.
enum class NoiseMethod : uint8_t {
  kAuto,        ///< lattice columns collapsed per row, then every pixel interpolated
  kAccumulate,  ///< high-resolution filtering by accumulation: the block of pixels around every lattice
                ///< point, a sampled window times the point's value or gradient, is added, in passes of
                ///< blocks that do not overlap. kValue and kGradient on kTessera in 2 to 4 dimensions,
                ///< without slopes and warp, a whole number of pixels per cell in every octave, aspect 1
};
/// Directions of the waves of kGabor, as Open Shading Language's `anisotropic` has them.
enum class GaborOrientation : uint8_t {
  kIsotropic,    ///< any, uniform over the circle (2-D) or the sphere (3-D)
  kAnisotropic,  ///< one: NoiseParams::direction
  kHybrid,  ///< any that is perpendicular to NoiseParams::direction: 3-D, a circle; 2-D, the one there is
};
/// Distance to the nearest feature point, the second nearest, or their difference.
enum class CellDistance : uint8_t { kF1, kF2, kF2MinusF1 };

/// A position p has one coordinate per dimension, in lattice cells. Octave k is noise at scale_k * p +
/// shift_k with scale_0 = 1, scale_k = scale_{k-1} * lacunarity, and weight_k = gain^k or weights[k]. shift_0
/// = 0; further shifts are pseudo-random in [0,1) on lattice kTessera (so that octaves do not vanish
/// together) and 0 on the published ones.
struct NoiseParams {
  NoiseKind kind = NoiseKind::kGradient;          ///< what the noise is made of
  NoiseLattice lattice = NoiseLattice::kTessera;  ///< whose random numbers
  NoiseFade fade = NoiseFade::kQuintic;           ///< lattice kTessera, kinds kValue and kGradient
  NoiseSum sum = NoiseSum::kFbm;                  ///< how octaves are added
  NoiseOutput output = NoiseOutput::kValue;       ///< what channels hold
  CellDistance distance = CellDistance::kF1;      ///< of kCell
  int dims = 2;                                   ///< 1 to 4 (lattice kPerlin, kGabor 1 to 3)
  uint32_t seed = 0;     ///< on published lattices a shift by whole cells; 0 is as published
  double frequency = 8;  ///< on grids: cells across the frame's width (0: one per pixel);
                         ///< at positions: cells per unit
  double aspect = 1;     ///< cells along x for one along y; 1e-3 to 1e3

  /// Cells; on grids offset[2] and [3] are the third and fourth coordinate.
  std::array<double, 4> offset = {};
  int octaves = 1;                   ///< 0 to 64; 0 gives noise 0
  double lacunarity = 2;             ///< [1, 16]
  double gain = 0.5;                 ///< [0, 4]
  std::vector<double> weights = {};  ///< spectral weights per octave instead of gain, or empty
  std::array<int, 4> period = {};  ///< cells until the noise repeats, per axis; 0: never. At most 2^24; with
                                   ///< more than one octave the lacunarity must be whole. kSimplex (2^20 in
                                   ///< the highest octave) fits its lattice to the periods: turned, and
                                   ///< lengths off by up to 0.7 cells per period; not on kOsl. kGabor: none
                                   ///< shorter than a kernel's radius, 1.8 cells for bandwidth 1
  double warp = 0;                 ///< domain warp: positions move by warp * noise, in cells

  /// false: 1/2 + value/2 (kFbm of kinds with both signs); kRidged and kBillow are divided by the sum of the
  /// octaves' |weights|, and are [0, 1] and 1/2 + value/2 of that, so that they fill the range whatever the
  /// octaves; kTurbulence is as it is.
  bool is_signed = true;
  NoiseMethod method = NoiseMethod::kAuto;  ///< grids
  bool antialias = false;  ///< grids: octaves fade to their mean from 1/2 to 1 cell per pixel
  int slices = 1;          ///< grids: the image is that many slices stacked along y, rows that are left
                           ///< over belong to the last; slice s has third coordinate offset[2] + s *
                           ///< step, as a table of three dimensions wants it
  double jitter = 1;       ///< kCell: [0,1], 0 puts feature points at cell centres
  double density = 2;      ///< kSparse, kSpot: impulses per cell, (0, 8]
  double stretch = 1;      ///< kSpot: length over width of a spot, [1, 64]
  double angle = 0;        ///< kSpot: the length's direction in degrees; kGabor: `direction` is turned by it
                           ///< in the plane of the first two coordinates, counter-clockwise as seen

  /// kGabor: octaves between the half-amplitude frequencies of a kernel, [0.05, 100]: 0.1 long even waves, 1
  /// as OSL, 3 and more single blobs. 0, an endless wave, is refused.
  double bandwidth = 1;
  GaborOrientation orientation = GaborOrientation::kIsotropic;  ///< kGabor
  std::array<double, 3> direction = {1, 0, 0};  ///< kGabor: of any length but 0; the first `dims` count
  double impulses = 16;  ///< kGabor: where a kernel's Gaussian is above 0.02 lie that many, [1, 32]
  double bias = 0.5;  ///< Perlin's bias of the finished value taken as t in [0,1] (before signs return); 0.5
                      ///< leaves it alone; in (0,1)
  double contrast = 0.5;   ///< Perlin's gain of it, likewise
  bool low_parts = false;  ///< NoiseAt(): channel dims + i is added to channel i
  Roi frame = {};          ///< filled in by Noise(): pixels are counted from its corner
};

/// Noise on the pixel grid of `spec`. Pixel (x, y) is at ((x + 1/2 - x0) * step, (y + 1/2 - y0) * step, 0, 0)
/// + offset, step = frequency / width of the display window (the data window's where that is empty). Ranges
/// (signed): kWhite, kHash, kValue, kGradient, kSimplex [-1,1]; kCell [0, sqrt(dims) * 1.5]; kSparse, kSpot
/// and kGabor standard deviation 1/3, whatever the density, bandwidth and impulses; a sum of octaves times
/// the sum of its weights. Published lattices keep their published ranges. Error: 1e-6 * sum of weights up to
/// coordinates of 2^31 (cells and fractions are kept apart), bits equal on AVX2 and AVX-512. Cost: grid forms
/// of kValue and kGradient on kTessera 0.25 to 1.3 ns per octave; other kinds 2 to 30, kGabor 20 to 100 (at
/// positions in no order a thousand). Throws Error for parameters outside the ranges above. Source: Perlin
/// 1985 and 2002; Lewis 1989; van Wijk 1991; Worley 1996; McReynolds et al. 1997, 5.13; Lagae et al. 2009;
/// doc/maths/noise.md.
Node Noise(const ImageSpec& spec, const NoiseParams& params);

/// Noise at the positions held in an image (a G-buffer's P): its first `dims` channels, times frequency plus
/// offset; with `low_parts` channel dims + i is added to channel i, so that a position may have 48 bits.
/// Further channels are not read. Positions that are NaN or infinite give noise 0.
/// The result has position's windows and `channels` channels. Error: 1e-6 * (sum of weights) plus the noise's
/// slope times 2^-24 cells per octave's scale. Throws Error as Noise does, for fewer channels than dims
/// (low_parts: than twice dims), and for what only grids have (slices, kAccumulate).
Node NoiseAt(const Node& position, const NoiseParams& params, int channels = 1);
/// The same with periods of each position's own, as Open Shading Language's pnoise has them: cells along the
/// axes in the channels of `periods`, or along all of them in its only one, rounded down; what is below 1,
/// NaN or above 2^24 (kSimplex: 2^20 in the highest octave) is no period. Positions of the same periods are
/// computed together, so that it costs what it does without, and up to the vector's lanes times that where
/// every pixel has others. Throws Error as above, for windows that differ, for `period` beside it, and for
/// what has no periods (kPerlin, kOsl's kSimplex) or only one for all (kGabor).
Node NoiseAt(const Node& position, const Node& periods, const NoiseParams& params, int channels = 1);

/// SVG 1.1's feTurbulence, to the letter, in the first four channels, further ones 0: the reference function
/// at user-space points (x, y) = whole pixel coordinates; results clamped to [0,1]. Values agree with the
/// specification's C code within 1e-5. `seed` follows SVG's rules for zero and negative seeds. stitch: base
/// frequencies are adjusted so that the frame tiles. Throws Error for numbers outside the ranges below and a
/// seed that is not finite.
struct SvgTurbulenceParams {
  bool fractal_noise = false;                           ///< sums of noise instead of its magnitude
  double seed = 0;                                      ///< by SVG's rules
  std::array<double, 2> base_frequency = {0.05, 0.05};  ///< [0, 1e6], cycles per pixel
  int octaves = 1;                                      ///< 0 to 64
  bool stitch = false;                                  ///< tiles without seams
  Roi frame = {};  ///< filled in by SvgTurbulence() and SvgTurbulenceAt(): what is stitched
};
/// SVG's turbulence on the pixel grid of `spec`, as SvgTurbulenceParams says.
Node SvgTurbulence(const ImageSpec& spec, const SvgTurbulenceParams& params);

/// SVG's turbulence at the positions held in an image, x and y of user space in its first two channels: where
/// they are whole, the bits that SvgTurbulence() has at that pixel. The result has position's windows and
/// `channels` channels, of which those beyond the fourth are 0. Positions that are NaN or infinite give noise
/// 0 (0, or 1/2 with fractal_noise). What is stitched is position's display window. Error: 1e-5, as
/// SvgTurbulence(). Throws Error as SvgTurbulence() does, and for fewer than two channels of position.
Node SvgTurbulenceAt(const Node& position, const SvgTurbulenceParams& params, int channels = 4);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_NOISE_H_
