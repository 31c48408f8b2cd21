// Lobes over an environment map as sums over every texel.
#ifndef TESSERA_REFERENCE_ENVIRONMENT_LOBE_H_
#define TESSERA_REFERENCE_ENVIRONMENT_LOBE_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/environment_map.h"

namespace tessera::reference {

// Means over all texels with the weights of a lobe around a direction.
class Lobe {
 public:
  Lobe(const Map& m, double exponent, int table) : channels_(m.channels()), exponent_(exponent) {
    for (int face = 0; face < m.faces(); ++face) {
      for (int j = 0; j < m.h(); ++j) {
        for (int i = 0; i < m.w(); ++i) Add(m, face, i, j);
      }
    }
    if (table < 0) return;
    // As documented: so many texels an edge by themselves, and as many cells of which all texels are one.
    const double chosen = std::clamp(std::ceil(16 * std::sqrt(exponent)), 16.0, 512.0);
    edge_ = table > 0 ? table : chosen;
    const double cells = std::ceil(24 * std::sqrt(exponent));
    gathered_ = static_cast<double>(items_.size()) > 6 * cells * cells;
  }

  // `largest`: the scale of the bound.
  Sample Mean(const Vec& d) const {
    Sample sum(channels_);
    sum.value = Value(d);
    sum.largest = largest_;
    if (edge_ == 0 || !(high_ > low_)) return sum;
    // Between its texels a table is bilinear: four times the curvature across
    // two of them to either side. Items below 1e-6 of the nearest one's power are left out.
    const double contrast = high_ - low_, step = 2 / edge_;
    double off = edge_ < 4 ? contrast : contrast * 2e-6 * (exponent_ + 1) + (gathered_ ? 0.01 * contrast : 0);
    if (edge_ >= 4) {
      const Vec n = Normalized(d), up = std::fabs(n[1]) < 0.7 ? Vec{0, 1, 0} : Vec{1, 0, 0};
      const Vec across = Normalized(Cross(up, n)), along = Cross(n, across);
      const auto mixed = [&](double by) {
        Vec sum;
        for (size_t k = 0; k < 3; ++k) sum[k] = (across[k] + by * along[k]) * std::sqrt(0.5);
        return sum;
      };
      double bends[2] = {}, slope = 0;
      int axes = 0;
      for (const Vec& axis : {across, along, mixed(1), mixed(-1)}) {
        std::vector<double> row[5];
        for (int k = -2; k <= 2; ++k) row[k + 2] = k == 0 ? sum.value : Value(Moved(n, axis, k * step));
        double most = 0;
        for (int k = 1; k <= 4; ++k) {
          for (size_t c = 0; c < sum.value.size(); ++c)
            slope = std::max(slope, std::fabs(row[k][c] - row[k - 1][c]));
        }
        for (int k = 1; k <= 3; ++k) {
          for (size_t c = 0; c < sum.value.size(); ++c)
            most = std::max(most, std::fabs(row[k - 1][c] + row[k + 1][c] - 2 * row[k][c]));
        }
        bends[axes++ / 2] += most;
      }
      const double bend = std::max(bends[0], bends[1]);
      // What bends by that much from texel to texel, the table does not have.
      off += bend > contrast / 4 ? contrast : bend / 2;
      // Across the seams of a cube rows of texels meet that point up to a quarter of a texel past each other.
      double size[3] = {std::fabs(n[0]), std::fabs(n[1]), std::fabs(n[2])};
      std::sort(size, size + 3);
      if (size[2] - size[1] < step * size[2]) off += slope / 2;
    }
    sum.largest += off / (8 * 0x1p-24);
    return sum;
  }

 private:
  struct Item {
    Vec direction;
    double weight;
    std::vector<double> value;
  };
  static Vec Moved(const Vec& d, const Vec& axis, double by) {
    return {d[0] + by * axis[0], d[1] + by * axis[1], d[2] + by * axis[2]};
  }
  void Add(const Map& m, int face, int i, int j) {
    const double weight = SolidAngle(m, i, j);
    if (!(weight > 0)) return;
    const Vec at = m.Direction(face, (2 * i + 1.0) / m.w() - 1, 1 - (2 * j + 1.0) / m.h());
    const Sample texel = m.Texel(face, i, j);
    if (!std::isfinite(texel.largest)) return;
    for (const double v : texel.value) low_ = std::min(low_, v), high_ = std::max(high_, v);
    largest_ = std::max(largest_, texel.largest);
    items_.push_back({Normalized(at), weight, texel.value});
  }
  std::vector<double> Value(const Vec& d) const {
    std::vector<double> cosines, sum(static_cast<size_t>(channels_));
    double nearest = 0, total = 0;
    for (const Item& item : items_) {
      cosines.push_back(Dot(item.direction, d) / Norm(d));
      nearest = std::max(nearest, cosines.back());
    }
    for (size_t k = 0; k < items_.size(); ++k) {
      if (!(cosines[k] > 0)) continue;
      const double p = items_[k].weight * std::pow(cosines[k] / nearest, exponent_);
      for (size_t c = 0; c < sum.size(); ++c) sum[c] += p * items_[k].value[c];
      total += p;
    }
    for (double& v : sum) v = total > 0 ? v / total : 0;
    return sum;
  }

  int channels_;
  double exponent_, edge_ = 0;
  bool gathered_ = false;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_, largest_ = 0;
  std::vector<Item> items_;
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_ENVIRONMENT_LOBE_H_
