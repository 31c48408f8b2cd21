// Cross approximation of kernels and rounding of their weights.
#include "ops/filter/window/factor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

namespace tessera::ops {
namespace {

constexpr double kUnit = 0x1p-24;

// Least squares of matrix ~ column * row for the one given the other.
void Refine(const std::vector<double>& matrix, Product& p) {
  const size_t width = p.row.size(), height = p.column.size();
  for (int round = 0; round < 3; ++round) {
    const double rr = std::inner_product(p.row.begin(), p.row.end(), p.row.begin(), 0.0);
    for (size_t y = 0; y < height; ++y) {
      if (p.column[y] == 0) continue;
      p.column[y] = std::inner_product(p.row.begin(), p.row.end(),
                                       matrix.begin() + static_cast<ptrdiff_t>(y * width), 0.0) /
                    rr;
    }
    const double cc = std::inner_product(p.column.begin(), p.column.end(), p.column.begin(), 0.0);
    for (size_t x = 0; x < width; ++x) {
      if (p.row[x] == 0) continue;
      double sum = 0;
      for (size_t y = 0; y < height; ++y) sum += p.column[y] * matrix[y * width + x];
      p.row[x] = sum / cc;
    }
  }
}

// `refine`: the first product is the nearest one, in place of a cross of the kernel.
Factors Crosses(const Kernel& kernel, int plane, int most_terms, bool refine) {
  const auto width = static_cast<size_t>(kernel.width), height = static_cast<size_t>(kernel.height);
  const auto first =
      kernel.weights.begin() + static_cast<ptrdiff_t>(static_cast<size_t>(plane) * width * height);
  const std::vector<double> weights(first, first + static_cast<ptrdiff_t>(width * height));
  std::vector<double> rest = weights;
  Factors factors;
  const auto met = [&] {
    factors.residual = 0;
    factors.elementwise = true;
    for (size_t i = 0; i < rest.size(); ++i) {
      factors.residual += std::fabs(rest[i]);
      if (std::fabs(rest[i]) > 4 * kUnit * std::fabs(weights[i])) factors.elementwise = false;
    }
    return factors.elementwise;
  };
  double total = 0;
  for (const double w : weights) total += std::fabs(w);
  while (!met() && static_cast<int>(factors.terms.size()) < most_terms &&
         factors.residual > 0.5 * kUnit * total) {
    const auto pivot =
        static_cast<size_t>(std::max_element(rest.begin(), rest.end(),
                                             [](double a, double b) { return std::fabs(a) < std::fabs(b); }) -
                            rest.begin());
    const size_t py = pivot / width, px = pivot % width;
    Product p;
    for (size_t y = 0; y < height; ++y) p.column.push_back(rest[y * width + px]);
    for (size_t x = 0; x < width; ++x) p.row.push_back(rest[py * width + x] / rest[pivot]);
    if (refine && factors.terms.empty()) Refine(rest, p);
    double sum = 0;
    for (const double c : p.column) sum += std::fabs(c);
    for (double& c : p.column) c /= sum;
    for (double& r : p.row) r *= sum;
    for (size_t y = 0; y < height; ++y) {
      for (size_t x = 0; x < width; ++x) rest[y * width + x] -= p.column[y] * p.row[x];
    }
    factors.terms.push_back(std::move(p));
  }
  return factors;
}

}  // namespace

Factors Factorize(const Kernel& kernel, int plane, int most_terms) {
  Factors nearest = Crosses(kernel, plane, most_terms, true);
  if (nearest.elementwise || most_terms < 2) return nearest;
  // What a nearest product leaves may have one more term than the kernel; crosses end at its rank.
  Factors crosses = Crosses(kernel, plane, most_terms, false);
  return crosses.residual < nearest.residual ? crosses : nearest;
}

std::vector<float> RoundWeights(const std::vector<double>& weights) {
  const size_t n = weights.size();
  std::vector<float> rounded(n);
  double error = 0;
  for (size_t i = 0; i < n; ++i) {
    rounded[i] = static_cast<float>(weights[i]);
    error += weights[i] - double{rounded[i]};
  }
  const float towards = std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(error));
  // Weights that go to the other neighbour, those first that are nearest to it; opposite ones go together, so
  // that what is symmetric stays so.
  struct Step {
    size_t index, opposite;
    double size, cost;  // of the sum; what the weight is off by afterwards, in its own units
  };
  std::vector<Step> steps;
  for (size_t i = 0; i < n; ++i) {
    const size_t opposite = rounded[n - 1 - i] == rounded[i] ? n - 1 - i : i;
    if (rounded[i] == 0 || opposite < i) continue;
    const double step = double{std::nextafter(rounded[i], towards)} - double{rounded[i]};
    steps.push_back(
        {i, opposite, opposite == i ? step : 2 * step, (step - (weights[i] - double{rounded[i]})) / step});
  }
  std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.cost < b.cost; });
  for (const Step& s : steps) {
    if (std::fabs(error - s.size) >= std::fabs(error)) continue;
    rounded[s.index] = rounded[s.opposite] = std::nextafter(rounded[s.index], towards);
    error -= s.size;
  }
  return rounded;
}

}  // namespace tessera::ops
