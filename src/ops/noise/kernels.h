// What the noise kernels are given: batches of lattice positions, and rows of a grid.
#ifndef TESSERA_OPS_NOISE_KERNELS_H_
#define TESSERA_OPS_NOISE_KERNELS_H_

#include <cstdint>

#include "tessera/ops/noise.h"

namespace tessera::ops {

inline constexpr int kNoiseBatch = 256;   // positions per call; arrays hold that many
inline constexpr int kNoisePadding = 16;  // floats readable past the end of tables
inline constexpr int kMaxImpulses = 24;   // per cell of kSparse and kSpot

// Constants of kGabor. Lengths of kernels are in radii: beyond 1 there is nothing.
struct GaborShape {
  int impulses = 1;                                               // in every cell
  GaborOrientation orientation = GaborOrientation::kAnisotropic;  // kHybrid in three dimensions only
  float across[3] = {1, 1, 1};                                    // a cell in radii
  float radius = 1;                                               // in waves
  float direction[3] = {1, 0, 0};  // kAnisotropic: cycles per wave along the axes
  float basis[2][3] = {};          // kHybrid: of the directions
};
// Constants of a kind that do not change along an image.
struct NoiseShape {
  int fade = 0;      // as NoiseFade
  int channel = -1;  // kOsl's colour noise: 0 to 2; else -1
  CellDistance distance = CellDistance::kF1;
  float jitter = 1;
  float scale = 1;                      // applied to the kind's raw value
  uint32_t poisson[kMaxImpulses] = {};  // a cell has as many impulses as thresholds are <= its random number
  float spot[3] = {1, 0, 1};            // symmetric 2x2 matrix xx, xy, yy applied to a spot's offset
  GaborShape gabor;
};

// Positions of one octave. Arrays of a dimension hold kNoiseBatch entries, whatever `count` is.
struct NoiseBatch {
  int count = 0;
  const uint32_t* cell[4] = {};   // modulo 2^32, or in [0, period)
  const float* fraction[4] = {};  // [0, 1), or a rounding outside
  uint32_t seed = 0;
  uint32_t period[4] = {};  // 0: none
  const NoiseShape* shape = nullptr;
  float* value = nullptr;  // kNoiseBatch entries
  float* slope[4] = {};    // derivative per cell, dims arrays; null unless asked for
};
using NoiseEvaluate = void (*)(const NoiseBatch&);

// Axes without a period repeat after so many cells where others of a simplex noise have one.
inline constexpr uint32_t kLongestSimplexPeriod = 1u << 20;
// The simplex lattice sheared onto whole coordinates: q = factor * p with an upper triangular matrix, as long
// as it fits the periods: factor * period is whole. The Cholesky factor of I + 1 1^T, whose simplices are
// Perlin's, turned; every entry is rounded to a whole number of 1 / period.
struct SimplexShear {
  SimplexShear(int dims, const uint32_t* period);
  double factor[4][4] = {};
  float steps[4][4] = {};  // factor * period
};

// The kernel of a kind in `dims` dimensions on the chosen target.
NoiseEvaluate FindNoise(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes);

// Perlin's 2002 noise in double, in the published order of operations; positions in [0, 256), y and z
// constant.
void PerlinNoise(const double* x, const double* y, const double* z, int count, float* value,
                 float* const* slope);
// The same of a batch's cells and fractions.
void PerlinBatch(const NoiseBatch& batch, int dims);

// Positions from pixels of a position image, for one dimension: high + low (low may be null) times frequency
// plus offset, as cell and fraction; `invalid` gets nonzero where the position is not finite.
struct PositionScale {
  float frequency[2] = {1, 0};  // high and low part
  float offset = 0, offset_whole = 0;
  float period = 0;  // 0: none
  bool nearest =
      false;  // fractions in [-1/2, 1/2] without a period, so that cell + fraction is the position's float
};
struct PositionBatch {
  int count = 0;
  const float* high = nullptr;
  const float* low = nullptr;
  PositionScale scale;
  float* cell = nullptr;  // whole number
  float* fraction = nullptr;
  uint32_t* invalid = nullptr;  // or-ed into
};
// The base position times an octave's scale plus its shift.
struct OctaveBatch {
  int count = 0;
  const float* cell = nullptr;
  const float* fraction = nullptr;
  float scale[2] = {1, 0};
  float shift = 0;
  uint32_t shift_cell = 0, period = 0;  // cells that reach the period start again
  bool nearest = false;                 // as PositionScale's
  uint32_t* out_cell = nullptr;
  float* out_fraction = nullptr;
};
// Moves positions by scale * delta (domain warp).
struct DisplaceBatch {
  int count = 0;
  const float* delta = nullptr;
  float scale = 1;
  uint32_t period = 0;
  uint32_t* cell = nullptr;  // in place
  float* fraction = nullptr;
};
struct AccumulateBatch {
  int count = 0;
  const float* value = nullptr;
  NoiseSum sum = NoiseSum::kFbm;
  float weight = 1;
  float* out = nullptr;  // += weight * shape(value)
};

// How the pixels of a vector find their columns.
enum class GridReach : uint8_t {
  kOne,        // all lie between the same two
  kHalf,       // within half a vector of columns from the first pixel's
  kWhole,      // within a vector of columns
  kScattered,  // anywhere
};
struct GridRun {  // neighbouring vectors of a kind
  GridReach reach = GridReach::kOne;
  int begin = 0, end = 0;  // vectors
};
// Where the pixels of a tile's rows lie between lattice columns: worked out once for all rows.
struct GridLayout {
  int32_t* base = nullptr;  // per vector: the column at its first pixel's left, from the tile's first
  int32_t* index =
      nullptr;  // per pixel: its column from the vector's base; kScattered: from the tile's first
  GridRun* runs = nullptr;
  int run_count = 0;
  bool consecutive = false;  // pixel x lies between columns x and x + 1
};
// One octave's lattice points along a tile's rows: a table of the columns in use, and where pixels lie in it.
struct GridColumns {
  int first = 0, count = 0;         // columns first .. first + count - 1 of the table
  const float* fraction = nullptr;  // per pixel
  const float* fade = nullptr;
  GridLayout layout;
};
// Blended over the third and fourth dimension at one lattice row: n contribution is gx*fx + gy*fy + rest.
struct GridLatticeRow {
  float* gx = nullptr;
  float* gy = nullptr;
  float* rest = nullptr;
};
struct GridPlace {        // one coordinate other than x
  uint32_t hash[2] = {};  // hashed lower and upper lattice coordinate
  float fraction = 0, fade = 0;
};
struct GridFill {  // blends one lattice row
  const uint32_t* column_hash = nullptr;
  int count = 0;
  uint32_t row_hash = 0;  // lattice row and seed
  GridPlace z, w;
  int dims = 2;
  bool gradient = true;  // else value noise
  GridLatticeRow out;
};
struct GridRow {  // one row of pixels of one octave
  GridColumns columns;
  int count = 0;  // pixels
  GridLatticeRow lower, upper;
  float fraction = 0, fade = 0;  // of y
  float scale = 1;
  NoiseSum sum = NoiseSum::kFbm;
  float weight = 1, bias = 0;
  bool add = false;          // add to what `out` holds
  float* out = nullptr;      // weight * shape(scale * n) + bias
  float* scratch = nullptr;  // 4 * (columns + 2 * kNoisePadding)
  bool stream = false;
};

// Rows of positions straight to noise: kGradient on kTessera in 2 or 3 dimensions, without periods and
// slopes.
struct PointOctave {
  float scale[2] = {1, 0};  // high and low part
  bool scaled = false;      // else position and octave are the same
  float shift[3] = {};
  uint32_t cell[3] = {};  // added to cells
  uint32_t seed = 0;
  float weight = 1;
};
struct PointRow {
  const float* in = nullptr;  // interleaved: 2 (two dimensions), 3 or 4 channels
  int channels = 3, count = 0;
  float frequency[3][2] = {};  // high and low part
  float offset[3] = {};
  bool plain = false;  // low parts and offsets are 0
  const PointOctave* octaves = nullptr;
  int octave_count = 0;
  int fade = 0;
  float scale = 1;
  NoiseSum sum = NoiseSum::kFbm;
  float bias = 0;
  float* out = nullptr;
  uint32_t* wrong =
      nullptr;  // nonzero where a cell is beyond 2^22 or the position no number: `out` is of no use
};
using NoisePoints = bool (*)(const PointRow&);  // whether nothing was wrong
NoisePoints FindNoisePoints(int dims);

struct GridStamp {  // one lattice column's block on a row of pixels
  int taps = 0;     // arrays hold whole vectors
  float rest = 0, gx = 0;
  const float* window = nullptr;  // 1 - u(|x|)
  const float* ramp = nullptr;    // x times it
  float* out = nullptr;           // +=
};
struct GridKernels {
  // `left`: per pixel, with kNoisePadding more, the column at its left; its neighbour is at its right. The
  // layout's arrays have room for `count` + kNoisePadding entries.
  void (*arrange)(const int32_t* left, int count, GridLayout& layout);
  // A power of two that filled lattice rows are multiplied by.
  float (*fill_unit)(int dims, bool gradient);
  void (*fill)(const GridFill&);
  void (*row)(const GridRow&);
  void (*stamp)(const GridStamp&);
};
GridKernels FindGridKernels();

struct NoiseKernels {
  // Interleaved channels to planes of kNoiseBatch entries, and back below.
  void (*separate)(const float* from, int channels, int count, float* const* planes);
  void (*position)(const PositionBatch&);
  void (*octave)(const OctaveBatch&);
  void (*displace)(const DisplaceBatch&);
  void (*accumulate)(const AccumulateBatch&);
  void (*clear)(const uint32_t* invalid, int count, float* value);  // zero where invalid
  // Planes to `channels` interleaved ones; planes[c] may be equal.
  void (*interleave)(const float* const* planes, int channels, int count, float* out);
  void (*fade)(const float* fraction, int count, int kind, float* out);
  // Slopes of `dims` axes to the gradient's direction, in place: as NoiseOutput::kNormal; three planes.
  void (*normal)(float* const* slopes, int dims, int count, bool is_signed);
};
NoiseKernels FindNoiseKernels();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_KERNELS_H_
