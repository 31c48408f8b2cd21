// Procedures of solid textures averaged over footprints, by quadrature between the places where they bend.
#ifndef TESSERA_REFERENCE_FILTERED_H_
#define TESSERA_REFERENCE_FILTERED_H_

#include <algorithm>
#include <cmath>
#include <vector>

namespace tessera::reference {

// The footprint of a pixel as the operation gives it: xx, yy, zz, xy, xz, yz.
struct FootprintMatrix {
  double m[6];
  double Along(double x, double y, double z) const {
    return x * x * m[0] + y * y * m[1] + z * z * m[2] + 2 * (x * y * m[3] + x * z * m[4] + y * z * m[5]);
  }
};

// A footprint's width along an argument, within the limits that the definition has.
inline double FootprintWidth(double square, double narrowest) {
  return std::clamp(std::sqrt(std::max(square, 0.0)), narrowest, 0x1p20);
}

// The mean of f, a function of period 1, over [at - width / 2, at + width / 2]. Between `bends`, places in
// [0, 1) that begin with 0, it is smooth.
template <class F>
double PeriodicMean(const F& f, const std::vector<double>& bends, double at, double width) {
  // Gauss's eight places.
  constexpr double kPlaces[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                 0.9602898564975363},
                   kWeights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                  0.1012285362903763};
  const auto smooth = [&](double from, double to) {
    const double middle = (from + to) / 2, half = (to - from) / 2;
    double sum = 0;
    for (int k = 0; k < 4; ++k)
      sum += kWeights[k] * (f(middle - half * kPlaces[k]) + f(middle + half * kPlaces[k]));
    return sum * half;
  };
  // Within one period, from <= to.
  const auto part = [&](double from, double to) {
    double sum = 0;
    for (size_t k = 0; k < bends.size(); ++k) {
      const double low = std::max(from, bends[k]),
                   high = std::min(to, k + 1 < bends.size() ? bends[k + 1] : 1);
      if (low < high) sum += smooth(low, high);
    }
    return sum;
  };
  if (!std::isfinite(at)) at = 0;
  const double place = at - std::floor(at), from = place - width / 2, to = place + width / 2;
  const double first = std::floor(from), last = std::floor(to);
  if (first == last) return part(from - first, to - last) / width;
  return (part(from - first, 1) + (last - first - 1) * part(0, 1) + part(0, to - last)) / width;
}

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_FILTERED_H_
