// Exact Euclidean distance transforms of grids.
#include "model/distance_transform.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::model {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

// Lower envelope of the parabolas value[q] + step^2 (x - q)^2 along one line.
class Line {
 public:
  explicit Line(int longest)
      : value_(static_cast<size_t>(longest)),
        index_(value_.size()),
        apex_(value_.size()),
        from_(value_.size() + 1) {}

  // Line of `count` points, `stride` apart.
  void Run(float* values, int32_t* nearest, int count, int64_t stride, double step) {
    int parabolas = 0;
    const double square = step * step;
    for (int q = 0; q < count; ++q) {
      value_[q] = values[q * stride];
      if (nearest != nullptr) index_[q] = nearest[q * stride];
      if (value_[q] == kNone) continue;
      double start = -std::numeric_limits<double>::infinity();
      while (parabolas > 0) {
        const int p = apex_[parabolas - 1];
        start = ((value_[q] + square * q * q) - (value_[p] + square * p * p)) / (2 * square * (q - p));
        if (start > from_[parabolas - 1]) break;
        --parabolas;
      }
      if (parabolas == 0) start = -std::numeric_limits<double>::infinity();
      apex_[parabolas] = q;
      from_[parabolas++] = start;
    }
    if (parabolas == 0) return;
    for (int x = 0, k = 0; x < count; ++x) {
      while (k + 1 < parabolas && from_[k + 1] < x) ++k;
      const int p = apex_[k];
      values[x * stride] = static_cast<float>(value_[p] + square * (x - p) * (x - p));
      if (nearest != nullptr) nearest[x * stride] = index_[p];
    }
  }

 private:
  std::vector<float> value_;
  std::vector<int32_t> index_;
  std::vector<int> apex_;
  std::vector<double> from_;
};

}  // namespace

std::vector<float> SquaredDistances(const std::array<int, 3>& size, const std::vector<uint8_t>& set,
                                    const std::array<double, 3>& spacing, std::vector<int32_t>* nearest) {
  const int nx = size[0], ny = size[1], nz = size[2];
  const size_t count = static_cast<size_t>(nx) * ny * nz;
  std::vector<float> squared(count);
  for (size_t i = 0; i < count; ++i) squared[i] = set[i] != 0 ? 0 : kNone;
  int32_t* index = nullptr;
  if (nearest != nullptr) {
    nearest->resize(count);
    for (size_t i = 0; i < count; ++i) (*nearest)[i] = set[i] != 0 ? static_cast<int32_t>(i) : -1;
    index = nearest->data();
  }
  const auto at = [&](size_t i) { return index == nullptr ? nullptr : index + i; };
  Line line(std::max({nx, ny, nz, 1}));
  const int64_t plane = int64_t{nx} * ny;
  for (int64_t r = 0; r < int64_t{ny} * nz; ++r) {
    const auto i = static_cast<size_t>(r * nx);
    line.Run(&squared[i], at(i), nx, 1, spacing[0]);
  }
  for (int k = 0; k < nz; ++k) {
    for (int x = 0; x < nx; ++x) {
      const auto i = static_cast<size_t>(k * plane + x);
      line.Run(&squared[i], at(i), ny, nx, spacing[1]);
    }
  }
  for (int64_t i = 0; i < plane; ++i) {
    line.Run(&squared[static_cast<size_t>(i)], at(static_cast<size_t>(i)), nz, plane, spacing[2]);
  }
  return squared;
}

}  // namespace tessera::model
