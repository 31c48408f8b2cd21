// Where the impulses of Gabor noise lie: the definition that the kernel and its reference share, in waves
// (cells of the noise).
#ifndef TESSERA_MODEL_GABOR_LATTICE_H_
#define TESSERA_MODEL_GABOR_LATTICE_H_

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::model {

inline constexpr double kLeastBandwidth = 0.05, kMostBandwidth = 100;  // octaves
inline constexpr double kGaborEnd = 5;  // a kernel ends where its Gaussian is exp(-5)

// The Gaussian exp(-pi a^2 r^2) of a kernel whose spectrum has half its amplitude `bandwidth` octaves apart.
inline double GaborWidth(double bandwidth) {
  const double two = std::exp2(bandwidth);
  return (two - 1) / (two + 1) * std::sqrt(std::numbers::pi / std::numbers::ln2);
}
inline double GaborRadius(double bandwidth) {
  return std::sqrt(kGaborEnd / std::numbers::pi) / GaborWidth(bandwidth);
}

// Cells of impulses along an axis: no shorter than a kernel's radius, and a whole number of them in a period.
struct GaborCells {
  double per_wave = 1, length = 1;
  double period = 0;  // cells until they repeat; 0: never
};
inline GaborCells CellsOfGabor(double bandwidth, int period) {
  const double radius = GaborRadius(bandwidth);
  if (period == 0) return {1 / radius, radius, 0};
  const double count = std::max(std::floor(period / radius), 1.0);
  return {count / period, period / count, count};
}

// Impulses in every cell of that volume: `impulses` where a Gaussian is above 0.02, as Open Shading Language
// counts them, to a whole number. Every cell has as many (where Lagae et al. 2009 draw a number from
// Poisson's distribution): as their phases are independent the spectrum is the same, and no place is bare.
inline int GaborImpulsesPerCell(double impulses, double bandwidth, int dims, double volume) {
  const double reach = std::sqrt(-std::log(0.02) / std::numbers::pi) / GaborWidth(bandwidth);
  const double ball[] = {1, 2, std::numbers::pi, 4 * std::numbers::pi / 3};
  return std::max(1, static_cast<int>(std::round(impulses * volume / (ball[dims] * std::pow(reach, dims)))));
}

}  // namespace tessera::model

#endif  // TESSERA_MODEL_GABOR_LATTICE_H_
