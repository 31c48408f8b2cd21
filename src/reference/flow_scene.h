// What the reference of line integral convolution sees: the field and the texture at the picture's pixels, in
// double.
#ifndef TESSERA_REFERENCE_FLOW_SCENE_H_
#define TESSERA_REFERENCE_FLOW_SCENE_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "reference/reference.h"
#include "tessera/ops/flow.h"

namespace tessera::reference::flow {

struct Point {
  double x = 0, y = 0;
};
inline Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y}; }
inline Point operator*(double s, Point a) { return {s * a.x, s * a.y}; }

inline int Wrapped(int i, int n) { return ((i % n) + n) % n; }

// Own copy of the noise's definition: Wellons' lowbias32 of seed, row and column; the upper 8 bits.
inline uint32_t Scramble(uint32_t v) {
  v ^= v >> 16;
  v *= 2146121005u;
  v ^= v >> 15;
  v *= 2221713035u;
  return v ^ (v >> 16);
}
inline uint32_t Cell(int x, int y, uint32_t seed) {
  const uint32_t row = Scramble(static_cast<uint32_t>(y) * 2246822519u ^ Scramble(seed + 1663821227u));
  return Scramble(static_cast<uint32_t>(x) * 2654435761u ^ row);
}

// A field and a texture over the pixels of the picture, counted from its first one.
class Scene {
 public:
  Scene(const LicParams& p, const Call& call)
      : p_(p),
        field_(call.in[p.with_image ? 1 : 0]),
        alpha_(AlphaOf(call.in_specs[p.with_image ? 1 : 0])),
        image_(p.with_image ? &call.in[0] : nullptr),
        width_(call.out_spec.width()),
        height_(call.out_spec.height()),
        vectors_(static_cast<size_t>(width_) * static_cast<size_t>(height_)),
        masked_(vectors_.size(), 0) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) Place(x, y);
    }
    for (const Point& v : vectors_) longest_ = std::max(longest_, std::hypot(v.x, v.y));
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) shown_ = std::max(shown_, Given(x, y));
    }
    channels_ = image_ != nullptr ? image_->channels : 1;
    if (image_ == nullptr) {
      texels_.resize(vectors_.size());
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) texels_[Index(x, y)] = Noise(x, y) / 255.0;
      }
    }
    for (int c = 0; c < channels_; ++c) {
      double low = 0, high = 0;
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          const double t = Texel(x, y, c);
          if (std::isfinite(t)) low = std::min(low, t), high = std::max(high, t);
        }
      }
      range_.push_back(high - low);
    }
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  double longest() const { return longest_; }
  double range(int c) const { return range_[static_cast<size_t>(c)]; }
  double Share(int x, int y) const { return shown_ > 0 ? std::min(1.0, Given(x, y) / shown_) : 0; }
  bool Repeats() const { return p_.wrap == Wrap::kRepeat; }
  // A map of the whole earth is one across the date line too.
  bool Around() const { return Repeats() || p_.units == LicUnits::kLatLong; }
  // A pixel beyond the picture, as the border has it.
  int X(int x) const { return Around() ? Wrapped(x, width_) : std::clamp(x, 0, width_ - 1); }
  int Y(int y) const { return Repeats() ? Wrapped(y, height_) : std::clamp(y, 0, height_ - 1); }
  // Whether a line may be at this pixel.
  bool Open(int x, int y) const {
    const bool out = y < 0 || y >= height_ || (!Around() && (x < 0 || x >= width_));
    if (p_.wrap == Wrap::kRenormalize && out) return false;
    return masked_[Index(X(x), Y(y))] == 0;
  }
  Point Stored(int x, int y) const { return vectors_[Index(X(x), Y(y))]; }

  // v at a position in pixel centres' coordinates.
  Point Velocity(Point at) const {
    const double fx = std::floor(at.x), fy = std::floor(at.y);
    const int x = static_cast<int>(fx), y = static_cast<int>(fy);
    const double tx = at.x - fx, ty = at.y - fy;
    const Point top = (1 - tx) * Stored(x, y) + tx * Stored(x + 1, y);
    const Point low = (1 - tx) * Stored(x, y + 1) + tx * Stored(x + 1, y + 1);
    const Point v = (1 - ty) * top + ty * low;
    if (p_.speed) return v;
    const double size = std::hypot(v.x, v.y);
    return size > 0 && size >= p_.smallest * longest_ ? (1 / size) * v : Point{};
  }
  // 1 where the vector counts as 0, 1/2 where that hangs on its last digits, else 0.
  double StillOrNot(int x, int y) const {
    const Point v = Stored(x, y);
    const double size = std::hypot(v.x, v.y), least = p_.smallest * longest_;
    if (size == 0) return 1;
    if (std::fabs(size - least) <= 1e-5 * least) return 0.5;
    return size < least ? 1 : 0;
  }
  // Direction of a pixel: the larger component 2^20, the smaller one a whole number below.
  Point Code(int x, int y) const {
    const Point v = Stored(x, y);
    const double size = std::hypot(v.x, v.y), one = 1 << 20;
    if (!(size > 0) || size < p_.smallest * longest_) return {};
    const double across = std::fabs(v.x), down = std::fabs(v.y);
    const double share =
        std::min(std::nearbyint(std::min(across, down) / std::max(across, down) * one), one - 1);
    return {std::copysign(across >= down ? one : share, v.x),
            std::copysign(across >= down ? share : one, v.y)};
  }
  double Texel(int x, int y, int c) const {
    x = X(x), y = Y(y);
    if (image_ != nullptr) return image_->at(image_->roi.x0 + x, image_->roi.y0 + y, c);
    return texels_[Index(x, y)];
  }

 private:
  // Size of a vector before a map stretched it.
  double Given(int x, int y) const {
    const Point v = vectors_[Index(x, y)];
    const double shrink =
        p_.units == LicUnits::kLatLong ? std::sin(std::numbers::pi * (y + 0.5) / height_) : 1;
    return std::hypot(v.x * shrink, v.y);
  }
  // The first two channels are the vector's even where one of them is called alpha.
  static int AlphaOf(const ImageSpec& spec) { return spec.alpha > 1 ? spec.alpha : -1; }
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  bool Known(int x, int y) const {
    const auto at = [&](int c) { return field_.at(field_.roi.x0 + x, field_.roi.y0 + y, c); };
    return std::isfinite(at(0)) && std::isfinite(at(1)) && (alpha_ < 0 || at(alpha_) > 0);
  }
  void Place(int x, int y) {
    const int fw = field_.roi.width(), fh = field_.roi.height();
    const bool same = fw == width_ && fh == height_;
    double u = 0, v = 0;
    const auto at = [&](int i, int j, int c) { return field_.at(field_.roi.x0 + i, field_.roi.y0 + j, c); };
    const auto column = [&](int i) { return Around() ? Wrapped(i, fw) : std::clamp(i, 0, fw - 1); };
    const auto row = [&](int j) { return Repeats() ? Wrapped(j, fh) : std::clamp(j, 0, fh - 1); };
    if (same) {
      if (!Known(x, y)) return Mask(x, y);
      u = at(x, y, 0), v = at(x, y, 1);
    } else {
      const double px = (x + 0.5) * fw / width_ - 0.5, py = (y + 0.5) * fh / height_ - 0.5;
      const int nx = column(static_cast<int>(std::floor(px + 0.5))),
                ny = row(static_cast<int>(std::floor(py + 0.5)));
      if (!Known(nx, ny)) return Mask(x, y);
      const auto kernel = [&](double d) {
        d = std::fabs(d);
        if (!p_.bicubic) return std::max(0.0, 1 - d);
        if (d >= 2) return 0.0;
        return d < 1 ? 1 + d * d * (1.5 * d - 2.5) : 2 + d * (-4 + d * (2.5 - 0.5 * d));
      };
      double sum = 0;
      for (int j = static_cast<int>(std::floor(py)) - 1; j <= static_cast<int>(std::floor(py)) + 2; ++j) {
        for (int i = static_cast<int>(std::floor(px)) - 1; i <= static_cast<int>(std::floor(px)) + 2; ++i) {
          if (!Known(column(i), row(j))) continue;
          const double w = kernel(px - i) * kernel(py - j);
          sum += w, u += w * at(column(i), row(j), 0), v += w * at(column(i), row(j), 1);
        }
      }
      if (sum > 1e-3) {
        u /= sum, v /= sum;
      } else {
        u = at(nx, ny, 0), v = at(nx, ny, 1);
      }
    }
    u *= p_.scale_x, v *= p_.y_up ? -p_.scale_y : p_.scale_y;
    if (p_.units == LicUnits::kPixels) {
      u *= static_cast<double>(width_) / fw, v *= static_cast<double>(height_) / fh;
    } else if (p_.units == LicUnits::kNormalized) {
      u *= width_, v *= height_;
    } else {
      const double latitude = std::numbers::pi * (0.5 - (y + 0.5) / height_);
      u *= width_ / 360.0 / std::max(std::cos(latitude), 1e-6), v *= -height_ / 180.0;
    }
    const double most = std::numeric_limits<float>::max();
    if (!(std::fabs(u) <= most && std::fabs(v) <= most)) return Mask(x, y);
    vectors_[Index(x, y)] = {u, v};
  }
  void Mask(int x, int y) { masked_[Index(x, y)] = 1; }
  double Noise(int x, int y) const {
    uint32_t seed = p_.seed;
    int spot = p_.spot;
    if (p_.magnitude == LicMagnitude::kNoise) {
      const int level = std::min(3, static_cast<int>(4 * Share(x, y)));
      spot <<= level, seed += static_cast<uint32_t>(level);
    }
    x /= spot, y /= spot;
    if (p_.noise == LicNoise::kSparse) return Cell(x, y, seed) < UINT32_MAX / 24 ? 255 : 0;
    if (p_.noise == LicNoise::kWhite) return Cell(x, y, seed) >> 24;
    double sum = 0;
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i)
        sum += (2 - std::abs(i)) * (2 - std::abs(j)) * double(Cell(x + i, y + j, seed) >> 24);
    }
    return static_cast<double>(std::lround(std::clamp(127.5 + 2 * (sum / 16 - 127.5), 0.0, 255.0)));
  }

  const LicParams& p_;
  const ImageD& field_;
  int alpha_;
  const ImageD* image_;
  int width_, height_, channels_ = 1;
  std::vector<Point> vectors_;
  std::vector<char> masked_;
  double longest_ = 0, shown_ = 0;
  std::vector<double> range_;
  std::vector<double> texels_;  // of the noise
};

}  // namespace tessera::reference::flow

#endif  // TESSERA_REFERENCE_FLOW_SCENE_H_
