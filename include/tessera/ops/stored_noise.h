/// Stored noise: blocks of noise that repeat, as tables for lookups and as images for files, and turbulence
/// read from them. @file
#ifndef TESSERA_OPS_STORED_NOISE_H_
#define TESSERA_OPS_STORED_NOISE_H_

#include <cstdint>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// The four packings of Miller and Jones; n is gradient noise in [-1,1] at positions in lattice cells.
enum class NoisePacking : uint8_t {
  kSingle,       ///< one channel: n(p)
  kOctaves,      ///< four channels: n(p), n(2 p), n(4 p), n(8 p)
  kNormal,       ///< four channels: the direction of n's gradient, and n
  kPrecomputed,  ///< one channel: turbulence, the sum over octaves of |n(2^k p)| / 2^k
};
/// Parameters of StoredNoise.
struct StoredNoiseParams {
  NoisePacking packing = NoisePacking::kSingle;  ///< what the channels hold
  int size = 64;                                 ///< samples along each edge, 2 to 512
  int cells = 4;                                 ///< lattice cells along each edge, 1 to `size`
  int octaves = 8;                               ///< kPrecomputed, 1 to 16
  uint32_t seed = 0;                             ///< of the noise

  /// Integers hold 1/2 + value / 2 of what lies in [-1,1], and half of a turbulence.
  PixelType storage = PixelType::kFloat;
};

/// A cube of size^3 samples that repeats without a seam along every axis; sample i lies at (i + 1/2) / size
/// of the edge. As a table of three dimensions, its lookups wrap with Wrap::kRepeat (kMirror hides a
/// seam of values, but not of slopes). Error of samples: 1e-6 times the sum of weights, and the storage's
/// rounding. Cost: size^3 samples of noise, once. Throws Error for parameters outside the ranges. Source:
/// Miller and Jones 2005, 4; doc/maths/noise.md.
Table StoredNoise(const StoredNoiseParams& params = {});
/// The same samples as an image for a file, slices of size x size stacked along y: `size` x size^2 pixels,
/// which TableFromImage with slices = {size} makes a table of again.
Node StoredNoiseImage(const StoredNoiseParams& params = {});

/// Turbulence, the sum over octaves of |n(2^k p)| / 2^k, read from stored noise by linear lookups at
/// positions in edges of the block (three channels; period 1). One lookup per octave (kSingle, kNormal), per
/// four octaves (kOctaves), or one in all (kPrecomputed, which has its own octaves). `table` is StoredNoise's
/// of that packing, or read from a file of it. The result has one channel and position's windows. Largest
/// error against turbulence by formula, 8 octaves from 64 samples for 4 cells: 9e-3 (kSingle, kNormal), 6e-2
/// (kOctaves), 0.1 (kPrecomputed): octaves stored beside each other have fewer samples per cell. Cost: 5 to 8
/// ns per lookup. Throws Error for octaves outside 1 to 16, for another wrap than kRepeat and kMirror, and
/// for a table that is none of this packing.
struct StoredTurbulenceParams {
  NoisePacking packing = NoisePacking::kSingle;  ///< of the table
  int octaves = 8;                               ///< 1 to 16; not of kPrecomputed
  Wrap wrap = Wrap::kRepeat;                     ///< kRepeat or kMirror
};
/// Turbulence by lookups, as StoredTurbulenceParams says.
Node StoredTurbulence(const Node& position, const Table& table, const StoredTurbulenceParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_STORED_NOISE_H_
