// Simplex noise of one octave in double precision: endless, around periods, and as OSL has it.
#include <algorithm>
#include <cmath>

#include "reference/noise_lattice.h"

namespace tessera::reference {
namespace {

// OSL's gradients as simplexnoise.cpp lists them.
NoiseVector OslSimplexGradient(uint32_t hash, int dims) {
  constexpr double kPlane[8][2] = {{-1, -1}, {1, 0}, {-1, 0}, {1, 1}, {-1, 1}, {0, -1}, {0, 1}, {1, -1}};
  constexpr double kSpace[16][3] = {{1, 0, 1},   {0, 1, 1},   {-1, 0, 1}, {0, -1, 1}, {1, 0, -1}, {0, 1, -1},
                                    {-1, 0, -1}, {0, -1, -1}, {1, -1, 0}, {1, 1, 0},  {-1, 1, 0}, {-1, -1, 0},
                                    {1, 0, 1},   {-1, 0, 1},  {0, 1, -1}, {0, -1, -1}};
  if (dims == 1) return OslGradient(hash, 1);
  if (dims == 2) return {kPlane[hash & 7][0], kPlane[hash & 7][1]};
  if (dims == 3) return {kSpace[hash & 15][0], kSpace[hash & 15][1], kSpace[hash & 15][2]};
  NoiseVector g = {};
  uint32_t bit = 4;
  for (size_t a = 0; a < 4; ++a) {
    if (a == (hash & 31) / 8) continue;
    g[a] = (hash & bit) != 0 ? -1 : 1;
    bit /= 2;
  }
  return g;
}
uint32_t OslSimplexHash(const NoiseCells& cell, int dims, uint32_t seed) {
  constexpr uint32_t kStart = 0xdeadbeefu;
  const auto scramble = [](uint32_t a, uint32_t b, uint32_t c) { return JenkinsFinal(a, b, c ^ kStart); };
  if (dims == 1) return scramble(cell[0], seed, 0);
  if (dims == 2) return scramble(cell[0], cell[1], seed);
  return scramble(cell[0], cell[1],
                  dims == 3 ? scramble(cell[2], seed, 0) : scramble(cell[2], cell[3], seed));
}

// Where a position lies: the first corner of its cell on the lattice of whole coordinates, and the skewed
// fractions.
struct Skewed {
  std::array<int64_t, 4> corner = {};
  std::array<long double, 4> fraction = {};
};

}  // namespace

NoiseValue SimplexNoise(const NoiseParams& p, uint32_t seed, const NoiseCells& period, int channel,
                        const NoisePlace& place) {
  const auto dims = static_cast<size_t>(p.dims);
  const bool osl = p.lattice == NoiseLattice::kOsl;
  const bool periodic = std::any_of(period.begin(), period.end(), [](uint32_t n) { return n != 0; });
  const long double root = std::sqrt(static_cast<long double>(p.dims + 1));
  const long double unskew = p.dims == 1 ? 0 : (1 - 1 / root) / p.dims;
  // Rows of the matrix onto whole coordinates; the columns' products with the periods are whole.
  long double matrix[4][4] = {};
  std::array<int64_t, 4> length = {};
  for (size_t a = 0; a < dims; ++a) {
    length[a] = period[a] != 0 ? period[a] : int64_t{1} << 20;
    for (size_t row = 0; row < dims; ++row) {
      const long double skew = p.dims == 1 ? 0 : (root - 1) / p.dims;
      matrix[row][a] = skew + (row == a ? 1 : 0);
      if (!periodic) continue;
      // Cholesky, by its definition: T T^T = I + 1 1^T with T upper triangular, from the last column.
      const auto j = static_cast<long double>(dims - 1 - a);
      const long double entry = p.dims == 1 ? (row == a ? 1 : 0)
                                : row > a   ? 0
                                : row == a  ? std::sqrt((j + 2) / (j + 1))
                                            : 1 / std::sqrt((j + 1) * (j + 2));
      matrix[row][a] =
          std::round(entry * static_cast<long double>(length[a])) / static_cast<long double>(length[a]);
    }
  }
  Skewed at;
  for (size_t row = 0; row < dims; ++row) {
    long double whole = 0, rest = 0;
    for (size_t a = 0; a < dims; ++a) {
      const int64_t cell = !periodic        ? static_cast<int32_t>(place.cell[a])
                           : period[a] == 0 ? place.cell[a] % (uint32_t{1} << 20)
                                            : place.cell[a];
      const long double product = matrix[row][a] * (static_cast<long double>(cell) + place.fraction[a]);
      whole += std::floor(product);
      rest += product - std::floor(product);
    }
    at.corner[row] = static_cast<int64_t>(whole + std::floor(rest));
    at.fraction[row] = rest - std::floor(rest);
  }
  if (!periodic && p.dims > 1) {
    // The published skew wraps with the sum of coordinates, a signed number of 32 bits.
    uint32_t cells = 0;
    long double fractions = 0;
    for (size_t a = 0; a < dims; ++a) cells += place.cell[a], fractions += place.fraction[a];
    const long double factor = (root - 1) / p.dims;
    const long double of_cells = static_cast<int32_t>(cells) * factor;
    const long double skew = (of_cells - std::floor(of_cells)) + fractions * factor;
    for (size_t a = 0; a < dims; ++a) {
      const long double q = place.fraction[a] + skew;
      at.fraction[a] = q - std::floor(q);
      at.corner[a] = static_cast<int64_t>(place.cell[a]) + static_cast<int64_t>(std::floor(of_cells)) +
                     static_cast<int64_t>(std::floor(q));
    }
  }
  NoiseVector x = {};
  long double sum = 0;
  for (size_t a = 0; a < dims; ++a) sum += at.fraction[a];
  for (size_t a = 0; a < dims; ++a) x[a] = static_cast<double>(at.fraction[a] - unskew * sum);
  std::array<size_t, 4> order = {0, 1, 2, 3};
  std::stable_sort(order.begin(), order.begin() + p.dims, [&](size_t a, size_t b) { return x[a] > x[b]; });

  constexpr double kScale[5] = {0, 3.1604938, 99.204, 76.88, 62.777}, kOslScale[5] = {0, 0.36, 64, 68, 54};
  const double scale = osl ? kOslScale[p.dims] : kScale[p.dims], reach = p.dims == 1 ? 1 : 0.5;
  NoiseValue n;
  NoiseVector slope = {};
  std::array<int64_t, 4> corner = at.corner;
  NoiseVector r = x;
  for (size_t k = 0; k <= dims; ++k) {
    if (k > 0) {
      ++corner[order[k - 1]], r[order[k - 1]] -= 1;
      for (size_t a = 0; a < dims; ++a) r[a] += static_cast<double>(unskew);
    }
    std::array<int64_t, 4> wrapped = corner;
    for (size_t a = dims; a-- > 0 && periodic;) {  // whole periods off, from the last axis
      std::array<int64_t, 4> step = {};
      for (size_t row = 0; row <= a; ++row)
        step[row] = std::llround(matrix[row][a] * static_cast<long double>(length[a]));
      const int64_t turns = (wrapped[a] >= 0 ? wrapped[a] : wrapped[a] - step[a] + 1) / step[a];
      for (size_t row = 0; row <= a; ++row) wrapped[row] -= turns * step[row];
    }
    NoiseCells cell = {};
    for (size_t a = 0; a < dims; ++a) cell[a] = static_cast<uint32_t>(wrapped[a]);
    const NoiseVector g =
        osl ? OslSimplexGradient(OslSimplexHash(cell, p.dims, static_cast<uint32_t>(std::max(channel, 0))),
                                 p.dims)
            : LatticeGradient(LatticeHash(cell, p.dims, seed), p.dims);
    double square = 0, dot = 0;
    for (size_t a = 0; a < dims; ++a) square += r[a] * r[a], dot += g[a] * r[a];
    const double t = std::max(0.0, reach - square);
    n.value += scale * std::pow(t, 4) * dot;
    for (size_t a = 0; a < dims; ++a)
      slope[a] += scale * (std::pow(t, 4) * g[a] - 8 * std::pow(t, 3) * dot * r[a]);
  }
  // Slopes by position: through the unskewing and the matrix, which cancel but for the periods' fit.
  if (!periodic) {
    n.slope = slope;
  } else {
    double total = 0;
    for (size_t a = 0; a < dims; ++a) total += slope[a];
    for (size_t a = 0; a < dims; ++a) {
      for (size_t row = 0; row < dims; ++row) {
        n.slope[a] +=
            static_cast<double>(matrix[row][a]) * (slope[row] - static_cast<double>(unskew) * total);
      }
    }
  }
  n.scale = 2;
  return n;
}

}  // namespace tessera::reference
