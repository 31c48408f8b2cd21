/// Hypertexture: density modulation functions in the soft region of a distance field, and the noise that they
/// read. @file
#ifndef TESSERA_OPS_HYPERTEXTURE_H_
#define TESSERA_OPS_HYPERTEXTURE_H_

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// What a block of noise holds. Blocks repeat without seams.
enum class NoiseContent : uint8_t {
  kNoise,       ///< one octave of gradient noise, in [-1, 1]
  kTurbulence,  ///< sum over octaves of |n(2^k p + s_k)| / 2^k, s_k constants: precomputed turbulence
  kFbm,         ///< sum over octaves of n / 2^k
  kMarble,      ///< 1/2 + 1/2 sin(2 pi (2 x + 0.8 T))
  kWood,  ///< grain across x: the fraction of 6 x + 0.35 fbm, from 0 to 1 and back within its last eighth
  kFourOctaves,  ///< four channels: the octaves of kTurbulence, n(2^k p + s_k)
  kVector,       ///< four channels: independent noises, for position warps
  kGradient,     ///< four channels: unit gradient of the noise, and the noise
};

/// A periodic cube of `size`^3 samples of noise, `cells` lattice cells across, stored as 16-bit integers over
/// the range that occurs and read by trilinear interpolation: value off by less than 1e-5 of its range from
/// that of exact samples; against the noise itself, the interpolation's error (table 3 of the bench).
/// Immutable, cheap to copy.
class NoiseBlock {
 public:
  NoiseBlock() = default;
  /// Throws Error: size 4 to 256, cells 1 to size, octaves 1 to 16. Cost: size^3 noise samples.
  NoiseBlock(NoiseContent content, int cells, int octaves = 4, uint32_t seed = 0, int size = 64);
  /// Of the caller's own samples: size^3 of them, `channels` (1 or 4) each, x fastest, then y, then z; the
  /// first at (1/2, 1/2, 1/2) / size. Throws Error: size 4 to 256, finite samples, their count.
  NoiseBlock(std::span<const float> samples, int size, int channels);

  /// Whether there are no samples.
  bool empty() const { return data_ == nullptr; }
  /// Samples along an edge.
  int size() const;
  int channels() const;  ///< 1 or 4

  /// Trilinear in double at a position in blocks (period 1 along every axis).
  void Sample(const Vector3& p, double* values) const;
  /// A bound of the slope of channel 0 per block, from the largest differences of neighbouring samples.
  double slope() const;
  double low() const;   ///< smallest sample of channel 0
  double high() const;  ///< largest sample of channel 0

  struct Data;
  /// The library's own.
  const Data& data() const { return *data_; }

 private:
  std::shared_ptr<const Data> data_;
};

/// How turbulence is read inside the march (table 3 of Miller and Jones): T(p) = sum of |n(2^k p + s_k)| /
/// 2^k, one periodic noise n at four octaves. All of them read the same T; they differ by what interpolation
/// in blocks of 64^3 samples leaves out, and by kEight's finer octaves.
enum class TurbulenceLookup : uint8_t {
  kBlock,         ///< one lookup in a block of precomputed turbulence
  kFourChannels,  ///< one lookup of four octaves in four channels
  kFour,          ///< four lookups of one noise at 1, 2, 4, 8 times the frequency
  kEight,         ///< eight lookups: four more octaves, at most 1/8 in all
  kExact,  ///< the noise itself at every sample: kTurbulenceOctaves of gradient noise, kTurbulenceCells a
           ///< block, seed 0; what the ready-made blocks hold samples of
};

/// Lattice cells along the edge of the block that is made for kBlock.
inline constexpr int kTurbulenceCells = 4;
inline constexpr int kTurbulenceOctaves = 4;  ///< Octaves of the turbulence in it.

/// What a C++ density modulation function is given: up to 16 samples, and changes `density` in place. Arrays
/// hold `count` values; positions are in world units; distance is the field's at the (warped) position.
struct DmfSamples {
  int count = 0;          ///< 1 to 16
  const float* x;         ///< world positions
  const float* y;         ///< world positions
  const float* z;         ///< world positions
  const float* distance;  ///< the field's
  float* density;         ///< in and out
};
/// Called by several threads at once.
using DmfFunction = std::function<void(const DmfSamples&)>;

/// Where, and how much, a step acts: a weight w between 0 and 1 by a quantity at the sample. Between points
/// linear, beyond the first and last constant; two points of one quantity are a step.
struct DmfInput {
  /// The quantity.
  enum class Kind : uint8_t {
    kGradient,  ///< magnitude of the field's gradient, per world unit
    kLight,     ///< n . l, n the unit normal (outward; 0 where there is no gradient), l towards the light
    kEye,       ///< n . v, v towards the eye
    kDensity,   ///< D, before the chain
    kHeight,    ///< y, world units of the volume's own
    kPlane,     ///< place . p
    kSphere,    ///< |p - place|
  };
  Kind kind = Kind::kHeight;                  ///< the quantity
  Vector3 place = {0, 0, 0};                  ///< of kPlane and kSphere
  std::vector<std::array<double, 2>> points;  ///< quantity and weight, quantities not decreasing; 1 to 64
};

/// One step of H(p) = DMF_n(... DMF_1(DMF_0(D(p), p))). t stands for the density so far, in [0, 1]; results
/// are clamped to [0, 1]. Steps act on the soft region: where D is 0 all but functions leave nothing. Noise
/// is read at p * frequency + drift * time (blocks per world unit; see NoiseBlock).
struct Dmf {
  /// What a step does.
  enum class Kind : uint8_t {
    kBias,        ///< t^(ln b / ln 0.5), b = amount in (0, 1)
    kGain,        ///< S curve through 1/2 by two biases, g = amount in (0, 1)
    kNoise,       ///< t + amount N(p) min(1, 8 D, 8 (1 - D))
    kTurbulence,  ///< t * (1 - amount + amount * T(p))
    kThreshold,   ///< 0 below amount, 1 above amount + softness, smooth between
    kWarp,        ///< the field is read at p + amount (N0, N1, N2)(p), amount in world units
    kLift,        ///< the field is read at p - up * amount T(p): flames; amount in world units
    kSwell,       ///< the field is read at p (1 + amount (T(p) - mean)): Perlin's fire
    kFunction,    ///< C++; may make density anywhere
    kTable,       ///< linear between `table`'s points, constant beyond; 0 where D is 0
  };
  Kind kind = Kind::kBias;    ///< what the step does
  double amount = 0.5;        ///< how much; see the kind
  double frequency = 1;       ///< blocks per world unit
  double upright = 1;         ///< factor of the frequency along y: below 1 the noise is drawn out upward
  double softness = 0.1;      ///< of kThreshold
  Vector3 drift = {0, 0, 0};  ///< blocks per second
  TurbulenceLookup lookup = TurbulenceLookup::kBlock;  ///< how turbulence is read
  NoiseBlock block = {};                               ///< empty: one that suits the kind is made
  DmfFunction function = nullptr;                      ///< of kFunction
  std::vector<std::array<double, 2>> table = {};       ///< of kTable: density and what becomes of it

  /// The step acts by their product w: t + w (t' - t), or so much of a displacement. Displacements know
  /// kHeight, kPlane and kSphere alone.
  std::vector<DmfInput> inputs = {};
};

/// A chain from words: "bias(.3), noise(.4,6), turbulence(.8,2), gain(.7), warp(.05,3), lift(.2,1),
/// swell(.3,1), threshold(.3,.1)": steps between commas, each name(amount, frequency, upward drift);
/// threshold takes amount and softness, bias and gain an amount, table(t,t',...) or table(FILE) pairs. What
/// is left out has its default. Behind a step, * INPUT says where it acts, * ~INPUT where it does not:
/// gradient(a,b), light(a,b), eye(a,b), density(a,b) and height(a,b) rise from 0 at a to 1 at b, or follow
/// more pairs quantity,weight or those of a file; half(x,y,z,offset,soft), sphere(x,y,z,radius,soft) and
/// band(low,high,soft) are 1 inside and fall to 0 over `soft`. Throws Error naming the step: other names,
/// words or numbers, amounts of bias and gain outside (0, 1), negative frequencies, pairs out of order,
/// files.
std::vector<Dmf> ParseDmf(const std::string& words);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_HYPERTEXTURE_H_
