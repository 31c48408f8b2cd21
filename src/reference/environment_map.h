// Environment maps for the reference: lookups by the definition of each map, texel by texel, in double.
#ifndef TESSERA_REFERENCE_ENVIRONMENT_MAP_H_
#define TESSERA_REFERENCE_ENVIRONMENT_MAP_H_

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/lens_picture.h"
#include "reference/reference.h"
#include "tessera/ops/environment.h"

namespace tessera::reference {

inline constexpr double kPi = std::numbers::pi;
using Vec = Vector3;

inline double Norm(const Vec& v) { return std::sqrt(Dot(v, v)); }

// A weighted sum of texels, and the largest that had weight.
struct Sample {
  std::vector<double> value;
  double largest = 0;
  explicit Sample(int channels) : value(static_cast<size_t>(channels)) {}
  void Add(const Sample& s, double w) {
    if (w == 0) return;
    for (size_t c = 0; c < value.size(); ++c) value[c] += w * s.value[c];
    largest = std::max(largest, s.largest);
  }
};

// A map as faces of n x m texels in a picture.
class Map {
 public:
  Map(const ImageD& picture, EnvironmentMap kind, double field_of_view = 0)
      : Map(picture, kind, picture.roi.width(), picture.roi.height(), field_of_view) {}
  Map(const ImageD& picture, EnvironmentMap kind, int width, int height, double field_of_view = 0)
      : picture_(picture), kind_(kind), w_(width), h_(height) {
    corners_ = {{0, 0}};
    if (LensPicture::Is(kind)) lens_ = LensPicture(kind, field_of_view);
    if (kind == EnvironmentMap::kDualParabolic) {
      w_ = std::max(1, width / 2);
      corners_.push_back({width - w_, 0});
    }
    if (kind != EnvironmentMap::kCube) return;
    // The faces' places counted in faces: +x -x +y -y +z -z.
    static constexpr int kAcross[6][2] = {{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {3, 1}};
    static constexpr int kDown[6][2] = {{2, 1}, {0, 1}, {1, 0}, {1, 2}, {1, 1}, {1, 3}};
    const bool strip = width == 6 * height || height == 6 * width;
    const int n = strip ? std::min(width, height) : width > height ? width / 4 : width / 3;
    corners_.clear();
    for (int f = 0; f < 6; ++f) {
      if (strip) {
        corners_.push_back(width > height ? Corner{f * n, 0} : Corner{0, f * n});
      } else {
        const auto& at = width > height ? kAcross[f] : kDown[f];
        corners_.push_back({at[0] * n, at[1] * n});
      }
    }
    half_turn_ = !strip && height > width;
    w_ = h_ = n;
  }
  bool empty() const { return w_ <= 0 || h_ <= 0; }
  int faces() const { return static_cast<int>(corners_.size()); }
  int channels() const { return picture_.channels; }
  int w() const { return w_; }
  int h() const { return h_; }
  EnvironmentMap kind() const { return kind_; }
  double focal() const { return w_ / 2.0 / lens_.edge(); }  // of a lens, in texels

  // The texel of a face that a pixel of the picture would be; outside of its sides if the pixel is not the
  // face's.
  std::pair<int, int> TexelAt(int face, int x, int y) const {
    const Corner& corner = corners_[static_cast<size_t>(face)];
    const bool turned = half_turn_ && face == 5;
    const int i = x - corner.x, j = y - corner.y;
    return {turned ? w_ - 1 - i : i, turned ? h_ - 1 - j : j};
  }
  Sample Texel(int face, int i, int j) const {
    if (half_turn_ && face == 5) i = w_ - 1 - i, j = h_ - 1 - j;
    const Corner& corner = corners_[static_cast<size_t>(face)];
    Sample s(channels());
    for (int c = 0; c < picture_.channels; ++c) {
      s.value[static_cast<size_t>(c)] =
          picture_.at(picture_.roi.x0 + corner.x + i, picture_.roi.y0 + corner.y + j, c);
      s.largest = std::max(s.largest, std::fabs(s.value[static_cast<size_t>(c)]));
    }
    return s;
  }
  // Which face, and where on it in [-1, 1] to the right and upwards; false behind a single parabolic map.
  bool Project(const Vec& d, int* face, double* s, double* t) const {
    const double r = Norm(d), x = d[0] / r, y = d[1] / r, z = d[2] / r;
    *face = 0;
    switch (kind_) {
      case EnvironmentMap::kLatLong:
        *s = -std::atan2(x, z) / kPi, *t = std::atan2(y, std::hypot(x, z)) / (kPi / 2);
        return true;
      case EnvironmentMap::kSphere: {
        const double up = z < 0 ? (x * x + y * y) / (1 - z) : 1 + z, m = std::hypot(x, y, up);
        *s = m == 0 ? 1 : x / m, *t = m == 0 ? 0 : y / m;
        return true;
      }
      case EnvironmentMap::kParabolic:
      case EnvironmentMap::kDualParabolic:
        *face = z < 0 ? 1 : 0;
        *s = x / (1 + std::fabs(z)), *t = y / (1 + std::fabs(z));
        return z >= 0 || kind_ == EnvironmentMap::kDualParabolic;
      case EnvironmentMap::kOctahedral: {
        const double sum = std::fabs(x) + std::fabs(y) + std::fabs(z);
        *s = x / sum, *t = y / sum;
        if (z < 0)
          *s = std::copysign(1 - std::fabs(y) / sum, x), *t = std::copysign(1 - std::fabs(x) / sum, y);
        return true;
      }
      case EnvironmentMap::kCube:
        break;
      default: {
        double right, up;
        if (!lens_.Project({x, y, z}, &right, &up)) return false;
        *s = right / lens_.edge(), *t = up * 2 * focal() / h_;
        return std::isfinite(*s) && std::isfinite(*t);
      }
    }
    const double ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
    if (ax >= ay && ax >= az) {
      *face = x < 0 ? 1 : 0, *s = (x < 0 ? z : -z) / ax, *t = y / ax;
    } else if (ay >= az) {
      *face = y < 0 ? 3 : 2, *s = x / ay, *t = (y < 0 ? z : -z) / ay;
    } else {
      *face = z < 0 ? 5 : 4, *s = (z < 0 ? -x : x) / az, *t = y / az;
    }
    return true;
  }
  Vec Direction(int face, double s, double t) const {
    const double q = s * s + t * t;
    switch (kind_) {
      case EnvironmentMap::kLatLong:
        return {-std::sin(kPi * s) * std::cos(kPi / 2 * t), std::sin(kPi / 2 * t),
                std::cos(kPi * s) * std::cos(kPi / 2 * t)};
      case EnvironmentMap::kSphere:
        if (q >= 1) return {0, 0, -1};
        return {2 * s * std::sqrt(1 - q), 2 * t * std::sqrt(1 - q), 1 - 2 * q};
      case EnvironmentMap::kParabolic:
      case EnvironmentMap::kDualParabolic:
        return {2 * s, 2 * t, face == 0 ? 1 - q : q - 1};
      case EnvironmentMap::kOctahedral: {
        // The outer triangles are folded back along the square |s| + |t| = 1.
        const double z = 1 - std::fabs(s) - std::fabs(t);
        if (z >= 0) return {s, t, z};
        return {std::copysign(1 - std::fabs(t), s), std::copysign(1 - std::fabs(s), t), z};
      }
      case EnvironmentMap::kCube:
        break;
      default:
        return lens_.Direction(s * lens_.edge(), t * h_ / 2 / focal());
    }
    const Vec directions[6] = {{1, t, -s}, {-1, t, s}, {s, 1, -t}, {s, -1, t}, {s, t, 1}, {-s, t, -1}};
    return directions[face];
  }
  // Of a lens: steradian per area of the square that its picture is.
  double LensDensity(double s, double t) const {
    const double across = lens_.edge(), down = h_ / 2.0 / focal();
    return lens_.Density(s * across, t * down) * across * down;
  }
  double Disc(int i, int j) const {
    const double s = (2 * i + 1.0) / w_ - 1, t = (2 * j + 1.0) / h_ - 1;
    return s * s + t * t;
  }

  bool Has(const Vec& d) const {
    int face;
    double s, t;
    return Project(d, &face, &s, &t);
  }
  // Whether a lens's picture ends there, within roundings.
  bool MayBeMissed(const Vec& d) const {
    int face;
    double s, t;
    if (!LensPicture::Is(kind_) || !(Norm(d) > 0)) return false;
    if (kind_ == EnvironmentMap::kOrthographic && std::fabs(d[2]) < 1e-9 * Norm(d)) return true;
    if (!Project(d, &face, &s, &t)) return false;
    const auto at_edge = [](double v) { return std::fabs(std::fabs(v) - (1 + 2 * kHair)) < kHair; };
    return at_edge(s) || at_edge(t);
  }
  // Texels from one place to another that is near; below 0 where they are not on one sheet of the map.
  double TexelsBetween(const Vec& a, const Vec& b) const {
    int f, g;
    double s0, t0, s1, t1;
    if (!Project(a, &f, &s0, &t0) || !Project(b, &g, &s1, &t1) || f != g) return -1;
    if (kind_ == EnvironmentMap::kOctahedral && std::min(a[2], b[2]) < 0) {
      for (size_t k = 0; k < 2; ++k) {
        if ((a[k] < 0) != (b[k] < 0)) return -1;
      }
    }
    double u = std::fabs(s1 - s0) / 2 * w_;
    if (kind_ == EnvironmentMap::kLatLong || WholeTurn()) u = std::min(u, w_ - u);
    return std::max(u, std::fabs(t1 - t0) / 2 * h_);
  }

  Sample LookUp(const Vec& d) const {
    int face;
    double s, t;
    if (!Project(d, &face, &s, &t)) return Sample(channels());
    if (LensPicture::Is(kind_) && (std::fabs(s) > 1 + 2 * kHair || std::fabs(t) > 1 + 2 * kHair)) {
      return Sample(channels());
    }
    const double radius = 0.5 * std::min(w_, h_);
    Sample sum(channels());
    if (kind_ == EnvironmentMap::kSphere) {
      const double fade = std::clamp(1 - (1 - std::hypot(s, t)) * radius, 0.0, 1.0);
      sum.Add(Bilinear(face, s, t), 1 - fade);
      sum.Add(Rim(), fade);
      return sum;
    }
    if (kind_ == EnvironmentMap::kDualParabolic) {
      const double height = std::fabs(d[2]) / Norm(d), mix = std::max(0.0, 0.5 - height * radius);
      sum.Add(Bilinear(face, s, t), 1 - mix);
      if (mix > 0) {
        const double inverse = 1 / (s * s + t * t);  // the other face's place is the inverse in the circle
        sum.Add(Bilinear(1 - face, s * inverse, t * inverse), mix);
      }
      return sum;
    }
    return Bilinear(face, s, t);
  }

 private:
  static constexpr double kHair = 1e-9;  // of the picture: as far from its edge is still on it
  bool WholeTurn() const { return LensPicture::Is(kind_) && lens_.whole_turn(); }

  struct Corner {
    int x, y;
  };

  // Of a sphere map: the mean of the texels that touch the rim. Found once.
  const Sample& Rim() const {
    if (!rim_.value.empty()) return rim_;
    const double band = std::max(0.0, 1 - std::sqrt(2.0) / (0.5 * std::min(w_, h_)));
    Sample sum(channels());
    double count = 0;
    for (int j = 0; j < h_; ++j) {
      for (int i = 0; i < w_; ++i) {
        if (Disc(i, j) <= 1 && Disc(i, j) >= band * band) sum.Add(Texel(0, i, j), 1), ++count;
      }
    }
    for (double& v : sum.value) v /= std::max(count, 1.0);
    return rim_ = sum;
  }
  // The first or the last row of a lat-long map. Found once.
  const Sample& Pole(int j) const {
    Sample& sum = pole_[j > 0 ? 1 : 0];
    if (!sum.value.empty()) return sum;
    sum = Sample(channels());
    for (int i = 0; i < w_; ++i) sum.Add(Texel(0, i, j), 1.0 / w_);
    return sum;
  }
  // What is seen at texel (i, j), which may lie one beyond the face.
  Sample Bordered(int face, int i, int j) const {
    const bool inside = i >= 0 && j >= 0 && i < w_ && j < h_;
    const int ci = std::clamp(i, 0, w_ - 1), cj = std::clamp(j, 0, h_ - 1);
    switch (kind_) {
      case EnvironmentMap::kLatLong:
        return j < 0 ? Pole(0) : j >= h_ ? Pole(h_ - 1) : Texel(0, (i + w_) % w_, j);
      case EnvironmentMap::kSphere:
        return inside && Disc(i, j) <= 1 ? Texel(0, i, j) : Rim();
      case EnvironmentMap::kParabolic:
        return Texel(0, ci, cj);
      case EnvironmentMap::kDualParabolic:
        return inside && Disc(i, j) <= 1 ? Texel(face, i, j) : OtherSide(face, i, j, ci, cj);
      case EnvironmentMap::kOctahedral:
        // Beyond an edge lies its other half.
        if (i < 0 || i >= w_) return Bordered(face, ci, h_ - 1 - j);
        if (j < 0 || j >= h_) return Texel(face, w_ - 1 - i, cj);
        return Texel(face, i, j);
      case EnvironmentMap::kCube:
        break;
      default:
        return Texel(0, WholeTurn() ? (i + w_) % w_ : ci, cj);
    }
    if (inside) return Texel(face, i, j);
    if (ci != i && cj != j) {
      Sample mean = Texel(face, ci, cj);
      const Sample a = Bordered(face, i, cj), b = Bordered(face, ci, j);
      mean.Add(a, 1), mean.Add(b, 1);
      for (double& v : mean.value) v /= 3;
      return mean;
    }
    const double out = 1 + 1e-9;
    const double s = i < 0 ? -out : i >= w_ ? out : (2 * i + 1.0) / w_ - 1;
    const double t = j < 0 ? out : j >= h_ ? -out : 1 - (2 * j + 1.0) / h_;
    int other;
    double u, v;
    Project(Direction(face, s, t), &other, &u, &v);
    return Texel(other, std::clamp(static_cast<int>((u + 1) / 2 * w_), 0, w_ - 1),
                 std::clamp(static_cast<int>((1 - v) / 2 * h_), 0, h_ - 1));
  }
  // A texel beyond a parabolic map's circle, from the texels of the other face that lie inside of theirs.
  Sample OtherSide(int face, int i, int j, int ci, int cj) const {
    const double q = Disc(i, j), u = (((2 * i + 1.0) / w_ - 1) / q + 1) / 2 * w_ - 0.5,
                 v = (((2 * j + 1.0) / h_ - 1) / q + 1) / 2 * h_ - 0.5;
    Sample sum(channels());
    double weight = 0;
    for (int y = static_cast<int>(std::floor(v)); y <= std::floor(v) + 1; ++y) {
      for (int x = static_cast<int>(std::floor(u)); x <= std::floor(u) + 1; ++x) {
        const double w = (1 - std::fabs(x - u)) * (1 - std::fabs(y - v));
        if (w <= 0 || x < 0 || y < 0 || x >= w_ || y >= h_ || Disc(x, y) > 1) continue;
        sum.Add(Texel(1 - face, x, y), w), weight += w;
      }
    }
    if (weight == 0) return Texel(face, ci, cj);
    for (double& value : sum.value) value /= weight;
    return sum;
  }
  Sample Bilinear(int face, double s, double t) const {
    double u = w_ * (s + 1) / 2 - 0.5, v = h_ * (1 - t) / 2 - 0.5;
    // Next to a lat-long map's poles half a texel counts as a whole one.
    if (kind_ == EnvironmentMap::kLatLong) {
      if (v < 0) {
        v = 2 * v;
      } else if (v > h_ - 1) {
        v = h_ - 1 + 2 * (v - (h_ - 1));
      }
    }
    u = std::clamp(u, -1.0, static_cast<double>(w_)), v = std::clamp(v, -1.0, static_cast<double>(h_));
    const int i = std::min(static_cast<int>(std::floor(u)), w_ - 1),
              j = std::min(static_cast<int>(std::floor(v)), h_ - 1);
    const double fu = u - i, fv = v - j;
    Sample sum(channels());
    sum.Add(Bordered(face, i, j), (1 - fu) * (1 - fv)), sum.Add(Bordered(face, i + 1, j), fu * (1 - fv));
    sum.Add(Bordered(face, i, j + 1), (1 - fu) * fv), sum.Add(Bordered(face, i + 1, j + 1), fu * fv);
    return sum;
  }

  const ImageD& picture_;
  EnvironmentMap kind_;
  int w_ = 0, h_ = 0;
  LensPicture lens_;
  bool half_turn_ = false;
  mutable Sample rim_{0}, pole_[2] = {Sample(0), Sample(0)};
  std::vector<Corner> corners_;
};

// Solid angle of texel (i, j).
inline double SolidAngle(const Map& m, int i, int j) {
  const double s0 = 2.0 * i / m.w() - 1, s1 = 2.0 * (i + 1) / m.w() - 1, t0 = 2.0 * j / m.h() - 1,
               t1 = 2.0 * (j + 1) / m.h() - 1;
  const double area = (s1 - s0) * (t1 - t0), q = m.Disc(i, j);
  switch (m.kind()) {
    case EnvironmentMap::kLatLong:
      return kPi * (s1 - s0) * (std::sin(kPi / 2 * t1) - std::sin(kPi / 2 * t0));
    case EnvironmentMap::kSphere:
      return q <= 1 ? 4 * area : 0;
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic:
      return q <= 1 ? 4 * area / ((1 + q) * (1 + q)) : 0;
    case EnvironmentMap::kCube:
      break;
    case EnvironmentMap::kOctahedral:
      return area / std::pow(Norm(m.Direction(0, (s0 + s1) / 2, -(t0 + t1) / 2)), 3);
    default:
      return m.LensDensity((s0 + s1) / 2, (t0 + t1) / 2) * area;
  }
  const auto corner = [](double x, double y) { return std::atan(x * y / std::sqrt(x * x + y * y + 1)); };
  return corner(s1, t1) - corner(s0, t1) - corner(s1, t0) + corner(s0, t0);
}

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_ENVIRONMENT_MAP_H_
