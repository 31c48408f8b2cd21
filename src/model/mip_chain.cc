// Mip chains of tables: each level has half the edge of the one above.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "model/table_axis.h"
#include "tessera/error.h"
#include "tessera/table.h"

namespace tessera {
namespace {

double Sinc(double x) {
  if (x == 0) return 1;
  const double a = std::numbers::pi * x;
  return std::sin(a) / a;
}

// Half of a filter's support, in cells of the coarser level, and its value at a distance in the same unit.
double Support(MipFilter filter) {
  switch (filter) {
    case MipFilter::kBox:
      return 0.5;
    case MipFilter::kLinear:
      return 1;
    case MipFilter::kMitchell:
      return 2;
    case MipFilter::kLanczos3:
      break;
  }
  return 3;
}
double Value(MipFilter filter, double x) {
  x = std::fabs(x);
  if (x >= Support(filter)) return 0;
  switch (filter) {
    case MipFilter::kBox:
      return 1;
    case MipFilter::kLinear:
      return 1 - x;
    case MipFilter::kMitchell: {
      const int cell = static_cast<int>(x);
      const std::array<double, 4> w = model::CubicWeights(CubicKernel::kMitchell, x - cell);
      return cell == 0 ? w[1] : w[0];
    }
    case MipFilter::kLanczos3:
      break;
  }
  return Sinc(x) * Sinc(x / 3);
}

// Entries of the finer level that one of the coarser level is the weighted mean of.
struct Taps {
  int first = 0;
  std::vector<double> weights;
};
Taps TapsOf(MipFilter filter, int fine, int coarse, int index, TableAlign align) {
  // The first and last entries of a kEnds table stay at its ends, so that a level is no narrower function.
  const bool ends = align == TableAlign::kEnds && coarse > 1;
  const double ratio = ends ? (fine - 1.0) / (coarse - 1) : static_cast<double>(fine) / coarse;
  const double centre = ends ? index * ratio + 0.5 : (index + 0.5) * ratio;
  const double reach = Support(filter) * ratio;
  Taps taps;
  taps.first = static_cast<int>(std::floor(centre - reach));
  const int last = static_cast<int>(std::ceil(centre + reach)) - 1;
  double sum = 0;
  for (int k = taps.first; k <= last; ++k) {
    // The box weighs an entry by the part of it that is covered, the others by their value at its middle.
    const double weight =
        filter == MipFilter::kBox
            ? std::max(0.0, std::min(k + 1.0, centre + reach) - std::max<double>(k, centre - reach))
            : Value(filter, (k + 0.5 - centre) / ratio);
    taps.weights.push_back(weight);
    sum += weight;
  }
  for (double& w : taps.weights) w /= sum;
  return taps;
}

}  // namespace

std::vector<Table> MipChain(const Table& table, MipFilter filter, const std::vector<Wrap>& wrap,
                            const std::vector<double>& border) {
  if (table.dims() < 1 || table.dims() > 3) {
    throw Error("mip chain",
                "found a table of " + std::to_string(table.dims()) + " dimensions, expected 1 to 3");
  }
  std::vector<Table> levels = {table};
  const auto channels = static_cast<size_t>(table.channels());
  // Means of means are means; any other filter, and entries that overlap at the ends, must start from level
  // 0, or each level widens what the one above has smoothed (doc/maths/lookup.md).
  const bool recursive = filter == MipFilter::kBox && table.align() == TableAlign::kCentres;
  while (levels.back().entries() > 1) {
    const Table& from = recursive ? levels.back() : table;
    const std::vector<int> above = levels.back().sizes();
    std::vector<int> sizes = from.sizes();
    const std::vector<float> samples = from.Samples();
    std::vector<double> values(samples.begin(), samples.end());
    for (size_t a = 0; a < sizes.size(); ++a) {
      const int fine = sizes[a], coarse = std::max(1, above[a] / 2);
      if (fine == 1) continue;
      const model::TableAxis axis{fine, table.align(), model::WrapOf(wrap, static_cast<int>(a))};
      size_t inner = channels, outer = 1;
      for (size_t b = 0; b < a; ++b) inner *= static_cast<size_t>(sizes[b]);
      for (size_t b = a + 1; b < sizes.size(); ++b) outer *= static_cast<size_t>(sizes[b]);
      std::vector<double> next(inner * outer * static_cast<size_t>(coarse), 0.0);
      for (int i = 0; i < coarse; ++i) {
        const Taps taps = TapsOf(filter, fine, coarse, i, table.align());
        for (size_t t = 0; t < taps.weights.size(); ++t) {
          const double weight = taps.weights[t];
          const int entry = axis.Entry(taps.first + static_cast<int>(t));
          if (weight == 0) continue;
          for (size_t o = 0; o < outer; ++o) {
            double* const to = &next[(o * static_cast<size_t>(coarse) + static_cast<size_t>(i)) * inner];
            for (size_t k = 0; k < inner; ++k) {
              const size_t c = k % channels;
              const double v =
                  entry >= 0
                      ? values[(o * static_cast<size_t>(fine) + static_cast<size_t>(entry)) * inner + k]
                  : c < border.size() ? border[c]
                                      : 0;
              to[k] += weight * v;
            }
          }
        }
      }
      values = std::move(next);
      sizes[a] = coarse;
    }
    const std::vector<float> rounded(values.begin(), values.end());
    levels.emplace_back(sizes, table.channels(), rounded, table.align());
  }
  return levels;
}

}  // namespace tessera
