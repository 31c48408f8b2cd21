// Weights of discs, polygons and pictures on pixels.
#include "ops/accumulate/aperture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "model/defocus.h"

namespace tessera::ops {
namespace {

using Point = std::array<double, 2>;

// What a strip of a convex shape is drawn as: its area along its middle row.
struct Span {
  double begin = 0, end = 0;
};

// A disc between the rows y0 and y1.
Span DiscStrip(double r, double y0, double y1) {
  const auto integral = [r](double y) {
    y = std::clamp(y, -r, r);
    return (y * std::sqrt(std::max(0.0, r * r - y * y)) + r * r * std::asin(y / r)) / 2;
  };
  const double half = integral(y1) - integral(y0);
  return {-half, half};
}

std::vector<Point> Below(const std::vector<Point>& shape, double y, double sign) {
  std::vector<Point> kept;
  for (size_t i = 0; i < shape.size(); ++i) {
    const Point &a = shape[i], &b = shape[(i + 1) % shape.size()];
    const double da = sign * (a[1] - y), db = sign * (b[1] - y);
    if (da <= 0) kept.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) kept.push_back({a[0] + (b[0] - a[0]) * da / (da - db), y});
  }
  return kept;
}

Span PolygonStrip(const std::vector<Point>& shape, double y0, double y1) {
  const std::vector<Point> strip = Below(Below(shape, y1, 1), y0, -1);
  double area = 0, moment = 0;
  for (size_t i = 0; i < strip.size(); ++i) {
    const Point &a = strip[i], &b = strip[(i + 1) % strip.size()];
    const double cross = a[0] * b[1] - b[0] * a[1];
    area += cross / 2, moment += cross * (a[0] + b[0]) / 6;
  }
  if (area == 0) return {};
  const double middle = moment / area, half = std::fabs(area) / 2;
  return {middle - half, middle + half};
}

std::vector<Point> Polygon(double r, int blades, double rotation) {
  std::vector<Point> corners;
  for (int k = 0; k < blades; ++k) {
    const double angle = (rotation / 180 + 2.0 * k / blades) * std::numbers::pi;
    corners.push_back({r * std::cos(angle), -r * std::sin(angle)});
  }
  return corners;
}

// Sums over rectangles of a picture that is constant in each of its pixels.
class PictureSums {
 public:
  explicit PictureSums(const ConstImageView& picture)
      : width_(picture.roi.width()),
        height_(picture.roi.height()),
        sums_(static_cast<size_t>(width_ + 1) * static_cast<size_t>(height_ + 1)) {
    for (int y = 0; y < height_; ++y) {
      double row = 0;
      for (int x = 0; x < width_; ++x) {
        const float v =
            *reinterpret_cast<const float*>(picture.At(picture.roi.x0 + x, picture.roi.y0 + y, 0));
        if (v > 0 && std::isfinite(v)) row += v;
        sums_[Index(x + 1, y + 1)] = sums_[Index(x + 1, y)] + row;
      }
    }
  }
  double Total() const { return sums_.back(); }
  // The rectangle from (x0, y0) to (x1, y1) about the middle, where the longer side is 2 long.
  double Within(double x0, double y0, double x1, double y1) const {
    return UpTo(x1, y1) - UpTo(x0, y1) - UpTo(x1, y0) + UpTo(x0, y0);
  }

 private:
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_ + 1) + static_cast<size_t>(x);
  }
  double UpTo(double x, double y) const {
    const double scale = std::max(width_, height_) / 2.0;
    x = std::clamp(x * scale + width_ / 2.0, 0.0, static_cast<double>(width_));
    y = std::clamp(y * scale + height_ / 2.0, 0.0, static_cast<double>(height_));
    const int i = std::min(static_cast<int>(x), width_ - 1), j = std::min(static_cast<int>(y), height_ - 1);
    const double fx = x - i, fy = y - j;
    return (1 - fy) * ((1 - fx) * sums_[Index(i, j)] + fx * sums_[Index(i + 1, j)]) +
           fy * ((1 - fx) * sums_[Index(i, j + 1)] + fx * sums_[Index(i + 1, j + 1)]);
  }

  int width_, height_;
  std::vector<double> sums_;
};

// `side` x `side` weights that sum to 1.
std::vector<double> Dense(const DepthOfFieldParams& p, const PictureSums* picture, double r, int reach) {
  const int side = 2 * reach + 1;
  std::vector<double> dense(static_cast<size_t>(side) * static_cast<size_t>(side));
  std::vector<Point> polygon;
  if (p.shape == ApertureShape::kPolygon) polygon = Polygon(r, p.blades, p.rotation);
  double total = 0;
  for (int y = -reach; y <= reach; ++y) {
    double* const row = dense.data() + static_cast<ptrdiff_t>(y + reach) * side + reach;
    Span span;
    if (p.shape != ApertureShape::kPolygon) span = DiscStrip(r, y - 0.5, y + 0.5);
    if (p.shape == ApertureShape::kPolygon) span = PolygonStrip(polygon, y - 0.5, y + 0.5);
    for (int x = -reach; x <= reach; ++x) {
      row[x] = picture != nullptr
                   ? picture->Within((x - 0.5) / r, (y - 0.5) / r, (x + 0.5) / r, (y + 0.5) / r)
                   : std::clamp(std::min(x + 0.5, span.end) - std::max(x - 0.5, span.begin), 0.0, 1.0);
      // What is left of sums that cancel is no weight.
      if (picture != nullptr && !(row[x] > picture->Total() * 0x1p-40)) row[x] = 0;
      total += row[x];
    }
  }
  for (double& w : dense) w /= total;
  return dense;
}

}  // namespace

double ApertureRow::At(int x) const {
  const int16_t* const after = std::upper_bound(column, column + count, x);
  return after == column ? 0 : weight[after - column - 1];
}

Aperture::Level Aperture::Compressed(const std::vector<double>& dense, int reach, bool turned) {
  Level level;
  level.reach = reach;
  const int side = 2 * reach + 1;
  for (int y = -reach; y <= reach; ++y) {
    level.first.push_back(level.steps.size());
    double before = 0;
    for (int x = -reach; x <= reach + 1; ++x) {
      const int i = turned ? -x : x, j = turned ? -y : y;
      const double w = x > reach ? 0 : dense[static_cast<size_t>((j + reach) * side + i + reach)];
      if (w == before) continue;
      level.columns.push_back(static_cast<int16_t>(x));
      level.steps.push_back(w - before);
      level.weights.push_back(w);
      before = w;
    }
  }
  level.first.push_back(level.steps.size());
  return level;
}

Aperture::Aperture(const DepthOfFieldParams& p, const ConstImageView* picture) {
  turns_ = p.shape == ApertureShape::kPicture || (p.shape == ApertureShape::kPolygon && p.blades % 2 != 0);
  std::vector<PictureSums> sums;
  if (picture != nullptr) sums.emplace_back(*picture);
  if (!sums.empty() && !(sums[0].Total() > 0)) sums.clear();
  for (int k = kSharpLevel + 1; k <= LevelOf(p.max_radius); ++k) {
    const double r = LevelRadius(k, p.max_radius);
    const int reach = LensReach(r);
    const std::vector<double> dense = Dense(p, sums.empty() ? nullptr : sums.data(), r, reach);
    levels_[0].push_back(Compressed(dense, reach, false));
    if (turns_) levels_[1].push_back(Compressed(dense, reach, true));
  }
}

ApertureRow Aperture::Row(int level, bool before_focus, int dy) const {
  const Level& l = levels_[turns_ && before_focus ? 1 : 0][static_cast<size_t>(level - kSharpLevel - 1)];
  if (dy < -l.reach || dy > l.reach) return {};
  const size_t row = static_cast<size_t>(dy + l.reach), i = l.first[row];
  return {l.columns.data() + i, l.steps.data() + i, l.weights.data() + i,
          static_cast<int>(l.first[row + 1] - i)};
}

}  // namespace tessera::ops
