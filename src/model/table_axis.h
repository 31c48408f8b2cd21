// The rules of one table axis: how a coordinate becomes a position among its entries, and which entry an
// index beyond them stands for. Plain C++, shared by the table builders and the lookups' careful path.
#ifndef TESSERA_MODEL_TABLE_AXIS_H_
#define TESSERA_MODEL_TABLE_AXIS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tessera/error.h"
#include "tessera/table.h"

namespace tessera::model {

// The wrap of an axis in a list whose last item serves the rest. Throws Error for what no table has.
inline Wrap WrapOf(const std::vector<Wrap>& wrap, int axis) {
  if (wrap.empty()) return Wrap::kClamp;
  const Wrap own = wrap[std::min(static_cast<size_t>(axis), wrap.size() - 1)];
  if (own == Wrap::kMirror101 || own == Wrap::kRenormalize || own == Wrap::kValid)
    throw Error("table wrap", "found an image's, expected kClamp, kGlClamp, kBlack, kRepeat or kMirror");
  return own;
}

struct TableAxis {
  int size = 1;
  TableAlign align = TableAlign::kCentres;
  Wrap wrap = Wrap::kClamp;

  // The entry that index i stands for; -1 for the border colour.
  int Entry(int64_t i) const {
    if (i >= 0 && i < size) return static_cast<int>(i);
    const int64_t n = size;
    const bool ends = align == TableAlign::kEnds;
    switch (wrap) {
      case Wrap::kClamp:
        return i < 0 ? 0 : size - 1;
      case Wrap::kGlClamp:
      case Wrap::kBlack:
        return -1;
      case Wrap::kRepeat: {
        // With kEnds the last entry stands where the first one of the next period does.
        const int64_t period = ends ? std::max<int64_t>(n - 1, 1) : n;
        return static_cast<int>(((i % period) + period) % period);
      }
      case Wrap::kMirror: {
        const int64_t period = ends ? std::max<int64_t>(2 * (n - 1), 1) : 2 * n;
        const int64_t j = ((i % period) + period) % period;
        return static_cast<int>(j < n ? j : period - (ends ? 0 : 1) - j);
      }
      default:
        return -1;
    }
  }

  // The coordinate after the wrap's reduction; NaN stays, and infinity becomes NaN where there is a period.
  // In float, as the contract has it: coordinates are floats, s - floor(s) is exact above 1 and rounds to 1
  // just below 0.
  double Reduce(double coordinate) const {
    const auto s = static_cast<float>(coordinate);
    switch (wrap) {
      case Wrap::kRepeat:
        return s - std::floor(s);
      case Wrap::kMirror: {
        const float t = s - 2 * std::floor(0.5f * s);
        return t > 1 ? 2 - t : t;
      }
      case Wrap::kGlClamp:
        return std::isnan(s) ? s : std::clamp(s, 0.0f, 1.0f);
      default:
        break;
    }
    // Beyond four table lengths nothing changes any more.
    return std::isnan(s) ? s : std::clamp(s, -4.0f, 4.0f);
  }

  // Position of a reduced coordinate in entries: entry i is at i. A coordinate that is an entry's but for its
  // own rounding is at that entry.
  double Position(double reduced) const {
    const bool ends = align == TableAlign::kEnds;
    const double product = reduced * (ends ? size - 1 : size), v = product - (ends ? 0 : 0.5);
    const double nearest = std::nearbyint(v);
    const double rounding = std::fabs(0x1p-24 * static_cast<float>(product));
    return std::fabs(static_cast<float>(v - nearest)) <= rounding ? nearest : v;
  }
  int64_t Nearest(double reduced) const {
    return static_cast<int64_t>(align == TableAlign::kEnds ? std::floor(reduced * (size - 1) + 0.5)
                                                           : std::floor(reduced * size));
  }
};

// Sizes of the table that an image with this data window is; throws Error as TableFromImage does.
std::vector<int> TableSizes(const Roi& window, int channels, const TableLayout& layout);

// Weights of the four entries around a fraction f in [0,1].
inline std::array<double, 4> CubicWeights(CubicKernel kernel, double f) {
  const double b = kernel == CubicKernel::kBSpline ? 1 : kernel == CubicKernel::kMitchell ? 1.0 / 3 : 0;
  const double c = kernel == CubicKernel::kBSpline ? 0 : kernel == CubicKernel::kMitchell ? 1.0 / 3 : 0.5;
  const auto near = [=](double x) {
    return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
  };
  const auto far = [=](double x) {
    return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) /
           6;
  };
  // The far polynomials are 0 at distance 2 up to rounding; there the entry must have no weight at all.
  return {f == 1 ? 0 : far(1 + f), near(f), near(1 - f), f == 0 ? 0 : far(2 - f)};
}

}  // namespace tessera::model

#endif  // TESSERA_MODEL_TABLE_AXIS_H_
