// One table lookup in double precision: nearest, linear, simplex or cubic, any wrap, only entries that have
// weight.
#include "model/table_sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/table_axis.h"
#include "tessera/table.h"

namespace tessera {
namespace model {
namespace {

// Sums weighted entries; an entry of weight 0 is not looked at.
class Sum {
 public:
  Sum(const TableEntries& table, const LookupParams& params, const std::array<TableAxis, 4>& axes,
      double* result)
      : table_(table), params_(params), axes_(axes), result_(result) {
    std::fill_n(result, table.channels, 0.0);
  }
  void Add(const std::array<int64_t, 4>& index, double weight) {
    if (weight == 0) return;
    int64_t entry = 0, stride = 1;
    for (int a = 0; a < static_cast<int>(table_.sizes.size()) && entry >= 0; ++a) {
      const auto i = static_cast<size_t>(a);
      const int at = axes_[i].Entry(index[i]);
      entry = at < 0 ? -1 : entry + at * stride;
      stride *= table_.sizes[i];
    }
    for (int c = 0; c < table_.channels; ++c) {
      const auto k = static_cast<size_t>(c);
      const double border = k < params_.border.size() ? static_cast<float>(params_.border[k]) : 0;
      result_[c] += weight * (entry < 0 ? border : static_cast<double>(table_.read(entry, c)));
    }
  }

 private:
  const TableEntries& table_;
  const LookupParams& params_;
  const std::array<TableAxis, 4>& axes_;
  double* result_;
};

}  // namespace

void SampleEntries(const TableEntries& table, const LookupParams& params, const double* coords,
                   double* result) {
  const int dims = static_cast<int>(table.sizes.size());
  std::array<TableAxis, 4> axes;
  std::array<int64_t, 4> first = {}, nearest = {};
  std::array<double, 4> fraction = {};
  for (int a = 0; a < dims; ++a) {
    const auto i = static_cast<size_t>(a);
    axes[i] = {table.sizes[i], table.align, WrapOf(params.wrap, a)};
    const double s = axes[i].Reduce(coords[a]);
    if (std::isnan(s)) {
      for (int c = 0; c < table.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        result[c] = params.propagate_nan       ? std::numeric_limits<double>::quiet_NaN()
                    : k < params.border.size() ? static_cast<float>(params.border[k])
                                               : 0;
      }
      return;
    }
    nearest[i] = axes[i].Nearest(s);
    // Just outside, far enough for every filter to see nothing but what lies beyond.
    const double v = std::clamp(axes[i].Position(s), -3.0, table.sizes[i] + 2.0);
    first[i] = static_cast<int64_t>(std::floor(v));
    fraction[i] = v - std::floor(v);
    // OpenGL's clamp never shows the border to the nearest filter.
    if (axes[i].wrap == Wrap::kGlClamp) nearest[i] = std::clamp<int64_t>(nearest[i], 0, table.sizes[i] - 1);
  }
  Sum sum(table, params, axes, result);
  switch (params.filter) {
    case TableFilter::kNearest:
      return sum.Add(nearest, 1);
    case TableFilter::kTetrahedral: {
      // From the lower corner along the axes in falling order of their fractions.
      std::array<int, 4> order = {0, 1, 2, 3};
      std::stable_sort(order.begin(), order.begin() + dims, [&](int a, int b) {
        return fraction[static_cast<size_t>(a)] > fraction[static_cast<size_t>(b)];
      });
      double before = 1;
      std::array<int64_t, 4> index = first;
      for (int k = 0; k < dims; ++k) {
        const auto a = static_cast<size_t>(order[static_cast<size_t>(k)]);
        sum.Add(index, before - fraction[a]);
        before = fraction[a];
        ++index[a];
      }
      return sum.Add(index, before);
    }
    case TableFilter::kLinear:
    case TableFilter::kMipmap:
    case TableFilter::kTrilinear:
    case TableFilter::kEwa:
    case TableFilter::kCubic:
      break;
  }
  const bool cubic = params.filter == TableFilter::kCubic;
  const int taps = cubic ? 4 : 2, offset = cubic ? -1 : 0;
  std::array<std::array<double, 4>, 4> weights = {};
  int count = 1;
  for (int a = 0; a < dims; ++a) {
    const auto i = static_cast<size_t>(a);
    const double f = fraction[i];
    weights[i] = cubic ? CubicWeights(params.cubic, f) : std::array<double, 4>{1 - f, f, 0, 0};
    count *= taps;
  }
  for (int tap = 0; tap < count; ++tap) {
    std::array<int64_t, 4> index = {};
    double weight = 1;
    int rest = tap;
    for (int a = 0; a < dims; ++a, rest /= taps) {
      const auto i = static_cast<size_t>(a);
      index[i] = first[i] + rest % taps + offset;
      weight *= weights[i][static_cast<size_t>(rest % taps)];
    }
    sum.Add(index, weight);
  }
}

}  // namespace model

void SampleTable(const Table& table, const LookupParams& params, const double* coords, double* result) {
  const auto read = [&table](int64_t entry, int channel) { return table.At(entry, channel); };
  model::SampleEntries({table.sizes(), table.channels(), table.align(), read}, params, coords, result);
}

}  // namespace tessera
