// Reference of depth of field: by layers, every pixel asks its neighbours what they give it; and by
// gathering.
#include "reference/depth_of_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "model/defocus.h"
#include "reference/point_loop.h"

namespace tessera::reference {
namespace {

using ops::Defocus;

void Gather(const Call& call) {
  const auto& p = std::any_cast<const DepthOfFieldParams&>(call.parameters);
  const Roi& w = call.in_specs[0].data_window;
  const auto depth = [&](int x, int y) { return call.in[1].at(x, y, p.depth_channel); };
  const auto radius = [&](double z) {
    return std::max(0.5, std::min(p.max_radius, p.aperture * std::fabs(1 / p.focus - 1 / z)));
  };
  const int reach = static_cast<int>(std::ceil(p.max_radius));
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      const double own_depth = depth(x, y);
      for (int c = 0; c < call.out.channels; ++c) {
        double sum = 0, total = 0, largest = 0;
        for (int j = std::max(w.y0, y - reach); j <= std::min(w.y1 - 1, y + reach); ++j) {
          for (int i = std::max(w.x0, x - reach); i <= std::min(w.x1 - 1, x + reach); ++i) {
            const double other = depth(i, j);
            if (!(other > 0)) continue;
            double r = radius(other);
            if (other > own_depth) r = std::min(r, radius(own_depth));
            const double coverage = std::clamp(r + 0.5 - std::hypot(i - x, j - y), 0.0, 1.0);
            if (coverage == 0) continue;
            const double weight = coverage / (r * r), value = call.in[0].at(i, j, c);
            sum += weight * value;
            total += weight;
            largest = std::max(largest, std::fabs(value));
          }
        }
        const double own = call.in[0].at(x, y, c);
        call.out.at(x, y, c) = own_depth > 0 ? sum / total : own;
        if (call.scale != nullptr)
          call.scale->at(x, y, c) = std::max({largest, std::fabs(own), kSmallestScale});
      }
    }
  }
}

// The length and the middle of what a row of a shape is drawn as: one pixel high, of the shape's area there.
struct Strip {
  double length = 0, middle = 0;
};

// What a circle has below a line at height `y`.
double SegmentBelow(double r, double y) {
  y = std::clamp(y, -r, r);
  return r * r * std::acos(-y / r) + y * std::sqrt(std::max(0.0, r * r - y * y));
}

// A polygon's sides between its corners' heights are straight: two points of Gauss each are exact.
Strip StripOfPolygon(double r, int blades, double rotation, double y0, double y1) {
  std::vector<std::array<double, 2>> corner;
  for (int k = 0; k < blades; ++k) {
    const double angle = (rotation + 360.0 * k / blades) * std::numbers::pi / 180;
    corner.push_back({r * std::cos(angle), -r * std::sin(angle)});
  }
  std::vector<double> heights = {y0, y1};
  for (const auto& c : corner)
    if (c[1] > y0 && c[1] < y1) heights.push_back(c[1]);
  std::sort(heights.begin(), heights.end());
  double area = 0, moment = 0;
  for (size_t i = 1; i < heights.size(); ++i) {
    const double half = (heights[i] - heights[i - 1]) / 2, centre = (heights[i] + heights[i - 1]) / 2;
    for (const double sign : {-1.0, 1.0}) {
      const double y = centre + sign * half / std::sqrt(3.0);
      double left = HUGE_VAL, right = -HUGE_VAL;
      for (size_t k = 0; k < corner.size(); ++k) {
        const auto &a = corner[k], &b = corner[(k + 1) % corner.size()];
        if ((a[1] <= y) == (b[1] <= y)) continue;
        const double x = a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]);
        left = std::min(left, x), right = std::max(right, x);
      }
      if (!(left < right)) continue;
      area += half * (right - left), moment += half * (right * right - left * left) / 2;
    }
  }
  return area > 0 ? Strip{area, moment / area} : Strip{};
}

// The light of a picture, stretched over the disc, on the pixel at (dx, dy).
double LightOfPicture(const ImageD& picture, const Roi& w, double r, int dx, int dy) {
  const double size = 2 * r / std::max(w.width(), w.height());  // of one of its pixels
  const auto overlap = [&](int i, int count, int d) {
    const double begin = (i - count / 2.0) * size;
    return std::max(0.0, std::min(begin + size, d + 0.5) - std::max(begin, d - 0.5)) / size;
  };
  double light = 0;
  for (int j = 0; j < w.height(); ++j) {
    const double across = overlap(j, w.height(), dy);
    if (across == 0) continue;
    for (int i = 0; i < w.width(); ++i) {
      const double v = picture.at(w.x0 + i, w.y0 + j, 0);
      if (v > 0 && std::isfinite(v)) light += v * across * overlap(i, w.width(), dx);
    }
  }
  return light;
}

// The weights of one level, by place.
class Shape {
 public:
  Shape(const Call& call, const DepthOfFieldParams& p, double r)
      : reach_(ops::LensReach(r)), side_(2 * reach_ + 1), weights_(static_cast<size_t>(side_ * side_)) {
    double total = 0;
    bool pictured = false;
    if (p.shape == ApertureShape::kPicture) {
      const Roi& w = call.in_specs[2].data_window;
      for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
          const double v = call.in[2].at(x, y, 0);
          pictured |= v > 0 && std::isfinite(v);
        }
      }
    }
    for (int dy = -reach_; dy <= reach_; ++dy) {
      Strip strip;
      if (p.shape != ApertureShape::kPolygon)
        strip.length = SegmentBelow(r, dy + 0.5) - SegmentBelow(r, dy - 0.5);
      if (p.shape == ApertureShape::kPolygon)
        strip = StripOfPolygon(r, p.blades, p.rotation, dy - 0.5, dy + 0.5);
      const double begin = strip.middle - strip.length / 2, end = strip.middle + strip.length / 2;
      for (int dx = -reach_; dx <= reach_; ++dx) {
        double w = std::max(0.0, std::min(end, dx + 0.5) - std::max(begin, dx - 0.5));
        if (pictured) w = LightOfPicture(call.in[2], call.in_specs[2].data_window, r, dx, dy);
        weights_[static_cast<size_t>((dy + reach_) * side_ + dx + reach_)] = w;
        total += w;
      }
    }
    for (double& w : weights_) w /= total;
  }
  double At(int dx, int dy) const {
    if (std::abs(dx) > reach_ || std::abs(dy) > reach_) return 0;
    return weights_[static_cast<size_t>((dy + reach_) * side_ + dx + reach_)];
  }

 private:
  int reach_, side_;
  std::vector<double> weights_;
};

// What is hidden beneath a pixel: nothing where there is no depth.
struct Hidden {
  Defocus defocus;
  std::vector<double> values;
};

class Layers {
 public:
  explicit Layers(const Call& call)
      : call_(call),
        p_(std::any_cast<const DepthOfFieldParams&>(call.parameters)),
        window_(call.in_specs[0].data_window),
        reach_(ops::LensReach(p_.max_radius)),
        region_(Intersection(Inflate(call.out.roi, reach_, reach_), window_)),
        known_(Intersection(Inflate(region_, reach_, reach_), window_)) {
    for (int y = known_.y0; y < known_.y1; ++y) {
      for (int x = known_.x0; x < known_.x1; ++x) {
        const auto depth = static_cast<float>(call.in[1].at(x, y, p_.depth_channel));
        defocus_.push_back(ops::DefocusOf(p_, depth));
      }
    }
    for (int y = region_.y0; y < region_.y1; ++y) {
      call_.Check();
      for (int x = region_.x0; x < region_.x1; ++x) hidden_.push_back(Beneath(x, y));
    }
    if (call.scale != nullptr) around_ = Around();
  }

  void Evaluate(int x, int y) {
    std::map<int, std::vector<double>> layers;  // per channel and coverage
    double largest = 0;
    for (int j = y - reach_; j <= y + reach_; ++j) {
      for (int i = x - reach_; i <= x + reach_; ++i) {
        if (!window_.Contains({i, j, i + 1, j + 1})) continue;
        const Hidden& beneath =
            hidden_[static_cast<size_t>((j - region_.y0) * region_.width() + i - region_.x0)];
        const Defocus seen = At(i, j);
        // A pixel gives its own place to what is beneath it only where that is sharp and it is not.
        const bool both_sharp = IsSharp(seen) && IsSharp(beneath.defocus);
        Give(
            layers, seen, x - i, y - j, [&](int c) { return call_.in[0].at(i, j, c); }, largest);
        if (both_sharp) continue;
        Give(
            layers, beneath.defocus, x - i, y - j,
            [&](int c) { return beneath.values[static_cast<size_t>(c)]; }, largest);
      }
    }
    double left = 1, taken = 0;
    const auto n = static_cast<size_t>(call_.out.channels);
    std::vector<double> sums(n, 0.0);
    for (const auto& [layer, light] : layers) {
      const double coverage = light[n];
      if (!(coverage > 1e-9)) continue;
      const double share = std::min(1.0, left / coverage);
      for (size_t c = 0; share > 0 && c < n; ++c) sums[c] += share * light[c];
      left = std::max(0.0, left - coverage), taken += share * coverage;
    }
    const bool own = At(x, y).level < 0 || !(taken > 1e-9);
    // What is left of large values in the block of a pixel, which have been added and taken away again.
    const Roi& out = call_.out.roi;
    const auto place =
        static_cast<size_t>(y - out.y0) * static_cast<size_t>(out.width()) + static_cast<size_t>(x - out.x0);
    const double around = call_.scale != nullptr ? std::ldexp(around_[place], -18) : 0;
    for (size_t c = 0; c < n; ++c) {
      const double value = call_.in[0].at(x, y, static_cast<int>(c));
      call_.out.at(x, y, static_cast<int>(c)) = own ? value : sums[c] / taken;
      if (call_.scale == nullptr) continue;
      call_.scale->at(x, y, static_cast<int>(c)) =
          std::max({largest, std::fabs(value), around, kSmallestScale});
    }
  }

 private:
  static bool IsSharp(const Defocus& d) { return d.level >= 0 && d.level <= ops::kSharpLevel; }
  const Defocus& At(int x, int y) const {
    return defocus_[static_cast<size_t>((y - known_.y0) * known_.width() + x - known_.x0)];
  }

  template <class Values>
  void Give(std::map<int, std::vector<double>>& layers, const Defocus& d, int dx, int dy, Values values,
            double& largest) {
    if (d.level < 0) return;
    double weight = dx == 0 && dy == 0 ? 1 : 0;
    if (!IsSharp(d)) weight = d.layer < 0 ? ShapeOf(d.level).At(-dx, -dy) : ShapeOf(d.level).At(dx, dy);
    if (weight == 0) return;
    std::vector<double>& layer = layers[d.layer];
    layer.resize(static_cast<size_t>(call_.out.channels) + 1);
    for (int c = 0; c < call_.out.channels; ++c) {
      const double value = values(c);
      layer[static_cast<size_t>(c)] += weight * value;
      if (std::isfinite(value)) largest = std::max(largest, std::fabs(value));
    }
    layer.back() += weight;
  }

  const Shape& ShapeOf(int level) {
    const auto found = shapes_.find(level);
    if (found != shapes_.end()) return found->second;
    return shapes_.emplace(level, Shape(call_, p_, ops::LevelRadius(level, p_.max_radius))).first->second;
  }

  Hidden Beneath(int x, int y) const {
    Hidden hidden;
    const Defocus own = At(x, y);
    if (own.level < 0) return hidden;
    hidden.values.assign(static_cast<size_t>(call_.out.channels), 0.0);
    double total = 0, nearest = HUGE_VAL;
    for (const auto& [dx, dy] :
         {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}) {
      float before = own.shift;
      for (int k = 1; k * std::hypot(dx, dy) <= reach_ + 1e-9; ++k) {
        const int u = x + k * dx, v = y + k * dy;
        if (!window_.Contains({u, v, u + 1, v + 1})) break;
        const Defocus there = At(u, v);
        if (there.level < 0) break;
        const bool farther =
            there.shift > before + ops::kSurfaceStep && there.shift > own.shift + ops::kSurfaceStep;
        before = there.shift;
        if (!farther) continue;
        const double square = (dx * dx + dy * dy) * static_cast<double>(k) * k;
        if (square < nearest) nearest = square, hidden.defocus = there;
        for (int c = 0; c < call_.out.channels; ++c)
          hidden.values[static_cast<size_t>(c)] += Beyond(u, v, dx, dy, k, c) / square;
        total += 1 / square;
        break;
      }
    }
    for (double& v : hidden.values) v /= total;
    return hidden;
  }

  // The lower median of up to five finite pixels from (u, v) on, the k-th in this direction, while the
  // surface goes on; the first where none is finite.
  double Beyond(int u, int v, int dx, int dy, int k, int c) const {
    std::vector<double> values;
    float last = At(u, v).shift;
    for (int m = 0; m < 5 && (k + m) * std::hypot(dx, dy) <= reach_ + 1e-9; ++m) {
      const int i = u + m * dx, j = v + m * dy;
      if (!window_.Contains({i, j, i + 1, j + 1})) break;
      const Defocus& there = At(i, j);
      if (there.level < 0 || !(std::fabs(there.shift - last) <= ops::kSurfaceStep)) break;
      last = there.shift;
      if (std::isfinite(call_.in[0].at(i, j, c))) values.push_back(call_.in[0].at(i, j, c));
    }
    const double first = call_.in[0].at(u, v, c);
    if (values.empty()) return first;
    std::sort(values.begin(), values.end());
    const double median = values[(values.size() - 1) / 2];
    if (!std::isfinite(first)) return median;
    return first <= 0 ? first : std::min(first, std::max(0.0, 4 * median));
  }

  // The largest magnitudes that may have been in the same sums as each result's, which begin up to 64 columns
  // to the left; what is beneath a pixel is found as far from it as it is spread. Along rows, then along
  // columns.
  std::vector<double> Around() const {
    const Roi& out = call_.out.roi;
    const ImageD& in = call_.in[0];
    const int far = 2 * reach_, rows = out.height() + 2 * far;
    const auto width = static_cast<size_t>(out.width());
    std::vector<double> along(width * static_cast<size_t>(rows)),
        around(width * static_cast<size_t>(out.height()));
    const auto at = [&](std::vector<double>& all, int x, int row) -> double& {
      return all[static_cast<size_t>(row) * width + static_cast<size_t>(x - out.x0)];
    };
    for (int row = 0; row < rows; ++row) {
      const int y = out.y0 - far + row;
      if (y < in.roi.y0 || y >= in.roi.y1) continue;
      for (int x = out.x0; x < out.x1; ++x) {
        double& largest = at(along, x, row);
        for (int i = std::max(x - far - 64, in.roi.x0); i <= std::min(x + far, in.roi.x1 - 1); ++i) {
          for (int c = 0; c < in.channels; ++c) {
            const double v = std::fabs(in.at(i, y, c));
            if (std::isfinite(v)) largest = std::max(largest, v);
          }
        }
      }
    }
    for (int row = 0; row < out.height(); ++row) {
      for (int x = out.x0; x < out.x1; ++x) {
        for (int k = 0; k <= 2 * far; ++k)
          at(around, x, row) = std::max(at(around, x, row), at(along, x, row + k));
      }
    }
    return around;
  }

  const Call& call_;
  const DepthOfFieldParams& p_;
  const Roi window_;
  const int reach_;
  const Roi region_, known_;  // what may give light; what may be found from there
  std::vector<Defocus> defocus_;
  std::vector<Hidden> hidden_;
  std::vector<double> around_;
  std::map<int, Shape> shapes_;
};

}  // namespace

void EvaluateDepthOfField(const Call& call) {
  const auto& p = std::any_cast<const DepthOfFieldParams&>(call.parameters);
  if (p.method == DepthOfFieldMethod::kGather) return Gather(call);
  Layers layers(call);
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      call.Check();
      layers.Evaluate(x, y);
    }
  }
}

Roi DepthOfFieldRegion(const std::any& parameters, int input, const Roi& out) {
  const auto& p = std::any_cast<const DepthOfFieldParams&>(parameters);
  if (input == 2) return {INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
  if (p.method == DepthOfFieldMethod::kGather) {
    const int reach = static_cast<int>(std::ceil(p.max_radius));
    return Inflate(out, reach, reach);
  }
  // Sums run along blocks of columns; what is spread may have been found as far away again.
  const int reach = 2 * ops::LensReach(p.max_radius);
  return {out.x0 - reach - 64, out.y0 - reach, out.x1 + reach, out.y1 + reach};
}

}  // namespace tessera::reference
