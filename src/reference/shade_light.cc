// The oracle of shadows and lights, from doc/maths/shadow.md. Double.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "model/shade_settings.h"
#include "reference/reference.h"
#include "reference/shade_loop.h"
#include "tessera/ops/shade.h"

namespace tessera::reference {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

// --- Shadows. ---

// A few roundings of doubles: what sums in another order are off by, in parts of their terms.
constexpr double kOrder = 0x1p-50;

class Map {
 public:
  Map(const ImageD& depths, const ops::ShadowSettings& settings)
      : depths_(depths),
        s_(settings),
        own_(static_cast<size_t>(depths.roi.pixels()), std::numeric_limits<double>::quiet_NaN()) {}
  int width() const { return depths_.roi.width(); }
  int height() const { return depths_.roi.height(); }
  // The texel with its bias as float, texels counted from the map's corner; `sign` times what doubles in
  // another order may have.
  double Biased(int x, int y, int sign) const {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return s_.shadow.dark_outside ? -kInf : kInf;
    const double m = At(x, y);
    if (!(m < 1)) return kInf;
    const auto rounded = [&](double bias) {
      return static_cast<float>(m + bias + sign * kOrder * (std::fabs(m) + std::fabs(bias)));
    };
    if (s_.shadow.bias >= 0) return rounded(s_.shadow.bias);
    const bool coarse = s_.position_step > 1e-6;
    const double reach =
        (s_.shadow.filter == ShadowFilter::kBilinear ? 1 : s_.shadow.size / 2.0) + (coarse ? 1 : 0);
    return rounded(OwnDepth(x, y, reach) + s_.map_step * (1 + 2 * reach));
  }

 private:
  double At(int x, int y) const {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return 1;
    return depths_.at(depths_.roi.x0 + x, depths_.roi.y0 + y, 0);
  }
  // How much deeper a texel's own surface is within reach: as its neighbours foretell, or as the map has it.
  double OwnDepth(int x, int y, double reach) const {
    double& known = own_[static_cast<size_t>(y) * static_cast<size_t>(width()) + static_cast<size_t>(x)];
    if (!std::isnan(known)) return known;
    const double m = At(x, y);
    double deeper = Deeper(x, y, reach, reach);
    const int around = std::min(static_cast<int>(std::ceil(reach)), 8);
    for (int v = y - around; v <= y + around; ++v) {
      for (int u = x - around; u <= x + around; ++u) {
        const double other = At(u, v) - m;
        const double dx = std::abs(u - x), dy = std::abs(v - y);
        const bool own =
            At(u, v) < 1 && other <= 6 * Deeper(x, y, dx, dy) && other <= 6 * Deeper(u, v, dx, dy);
        if (own) deeper = std::max(deeper, other);
      }
    }
    return known = deeper;
  }
  // How much deeper the surface around a texel may be dx, dy away, by its slopes and how it bends and twists.
  double Deeper(int x, int y, double dx, double dy) const {
    const auto row = [&](int k) { return At(x + k, y); };
    const auto column = [&](int k) { return At(x, y + k); };
    std::vector<double> twists;
    for (const int v : {-1, 1}) {
      for (const int u : {-1, 1}) {
        if (At(x + u, y + v) < 1 && At(x + u, y) < 1 && At(x, y + v) < 1)
          twists.push_back(u * v * (At(x + u, y + v) - At(x + u, y) - At(x, y + v) + At(x, y)));
      }
    }
    return Slope(row) * dx + Slope(column) * dy + 0.5 * (Bend(row) * dx * dx + Bend(column) * dy * dy) +
           Consensus(twists) * dx * dy;
  }
  template <class F>
  static double Slope(const F& at) {
    const bool left = at(-1) < 1, right = at(1) < 1;
    if (!left || !right) return left ? std::fabs(at(0) - at(-1)) : right ? std::fabs(at(1) - at(0)) : 0;
    const double one = at(0) - at(-1), other = at(1) - at(0);
    const double least = std::min(std::fabs(one), std::fabs(other));
    if (one * other < 0) return std::min(0.5 * std::fabs(at(1) - at(-1)), 2 * least);
    return std::min(std::max(std::fabs(one), std::fabs(other)), 2 * least);
  }
  template <class F>
  static double Bend(const F& at) {
    std::vector<double> bends;
    for (const int k : {-1, 0, 1}) {
      if (at(k - 1) < 1 && at(k) < 1 && at(k + 1) < 1) bends.push_back(at(k - 1) - 2 * at(k) + at(k + 1));
    }
    return Consensus(bends);
  }
  // Estimates of one sign: the largest, at most twice the smallest; else 0.
  static double Consensus(std::vector<double> v) {
    if (v.empty()) return 0;
    std::sort(v.begin(), v.end());
    if (v.front() < 0 && v.back() > 0) return 0;
    if (v.front() < 0) {
      for (double& x : v) x = -x;
      std::reverse(v.begin(), v.end());
    }
    return std::min(v.back(), 2 * v.front());
  }

  const ImageD& depths_;
  const ops::ShadowSettings& s_;
  mutable std::vector<double> own_;  // OwnDepth of every texel; NaN before it is known
};

// Which way doubles in another order may have gone: in columns, in rows, and in depth.
struct Aside {
  int u = 0, v = 0, r = 0;
};

double Visibility(const ops::ShadowSettings& s, const Map& map, const double* p, const Aside& aside) {
  const Matrix4& m = s.shadow.light;
  // A row's sum and what it may be off by.
  const auto row = [&](size_t i) {
    return m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
  };
  const auto off = [&](size_t i) {
    double sum = std::fabs(m[4 * i + 3]);
    for (size_t k = 0; k < 3; ++k) sum += std::fabs(m[4 * i + k] * p[k]);
    return kOrder * sum;
  };
  const double w = row(3);
  if (w + aside.r * off(3) < 1e-20) return 0;
  const auto part = [&](size_t i, int sign) {
    const double quotient = row(i) / w;
    return quotient + sign * ((off(i) + off(3) * std::fabs(quotient)) / std::fabs(w) + kOrder);
  };
  const double u = (part(0, aside.u) + 1) / 2 * map.width(), v = (1 - part(1, aside.v)) / 2 * map.height();
  double r = (part(2, aside.r) + 1) / 2;
  if (std::isnan(u) || std::isnan(v) || !(r <= 1)) return 1;
  if (s.shadow.bias < 0) {
    for (size_t k = 0; k < 3; ++k) {
      r -= s.position_step * (std::fabs((m[8 + k] + m[12 + k]) / 2) + std::fabs(m[12 + k])) *
           std::fabs(p[k]) / w;
    }
  }
  const double depth = static_cast<float>(r);
  const auto inside = [](double at, int size) {
    return static_cast<int>(std::clamp(std::floor(at), -1000.0, size + 1000.0));
  };
  const auto lit = [&](int x, int y) { return depth <= map.Biased(x, y, -aside.r) ? 1.0 : 0.0; };
  if (s.shadow.filter == ShadowFilter::kBilinear) {
    const int x = inside(u - 0.5, map.width()), y = inside(v - 0.5, map.height());
    const double fx = std::clamp(u - 0.5 - std::floor(u - 0.5), 0.0, 1.0);
    const double fy = std::clamp(v - 0.5 - std::floor(v - 0.5), 0.0, 1.0);
    return (1 - fy) * ((1 - fx) * lit(x, y) + fx * lit(x + 1, y)) +
           fy * ((1 - fx) * lit(x, y + 1) + fx * lit(x + 1, y + 1));
  }
  const int n = s.shadow.size;
  const int x0 = inside(u - 0.5 * (n - 1), map.width()), y0 = inside(v - 0.5 * (n - 1), map.height());
  double count = 0;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) count += lit(x0 + x, y0 + y);
  }
  return count / (n * n);
}

void Shadow(const Call& call) {
  const auto& s = *std::any_cast<ops::ShadowSettings>(&call.parameters);
  const Map map(call.in[1], s);
  constexpr Aside kAsides[] = {{0, 0, -1}, {0, 0, 1}, {-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const double p[3] = {call.in[0].at(x, y, 0), call.in[0].at(x, y, 1), call.in[0].at(x, y, 2)};
    const double visible = Visibility(s, map, p, {});
    pixel.Set(0, visible, 1);
    if (call.undecided == nullptr) return;
    for (const Aside& aside : kAsides) {
      const double jump = std::fabs(Visibility(s, map, p, aside) - visible);
      // Between two texels bilinear weights go on as they were.
      if (jump > 0x1p-30) call.Undecided(x, y, jump);
    }
  });
}

// The map is needed whole, wherever the positions are.
constexpr int kEverything = 1 << 20;
Roi ShadowInput(const std::any&, int input, const Roi& out) {
  return input == 1 ? Roi{-kEverything, -kEverything, kEverything, kEverything} : out;
}

// --- Lights. ---

void DiffuseLight(const Call& call) {
  const auto& light = *std::any_cast<LightSample>(&call.parameters);
  const Vector3 facing = Normalized(light.direction);
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    Vector3 to, n;
    for (size_t k = 0; k < 3; ++k) {
      to[k] = light.position[k] - call.in[0].at(x, y, static_cast<int>(k));
      n[k] = call.in[1].at(x, y, static_cast<int>(k));
    }
    const double r2 = Dot(to, to), r = std::sqrt(r2);
    double value = 0, size = 0;
    if (r > 0) {
      const double receiver = Dot(to, n) / r;
      const double sender = Dot(facing, facing) == 0 ? 1 : std::max(-Dot(to, facing) / r, 0.0);
      value = light.area / kPi * std::max(receiver, 0.0) * sender / std::max(r2, light.area);
      size = light.area / kPi * std::sqrt(Dot(n, n)) / std::max(r2, light.area);
    }
    if (std::isnan(value)) value = 0;
    pixel.Set(0, value, size);
  });
}

void Spotlight(const Call& call) {
  const auto& s = *std::any_cast<ops::SpotlightSettings>(&call.parameters);
  const SpotlightParams& p = s.light;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const Vector3 at = {call.in[0].at(x, y, 0), call.in[0].at(x, y, 1), call.in[0].at(x, y, 2)};
    const auto clip = Transform(p.light.world_to_clip(), at);
    const double depth = p.light.PlanarDepth(at), d = p.light.Distance(at);
    double value = 0;
    const bool inside = std::fabs(clip[0]) <= clip[3] && std::fabs(clip[1]) <= clip[3];
    if (depth > 0 && clip[3] >= 1e-20 && inside) {
      value = 1 / std::max(p.attenuation[0] + p.attenuation[1] * d + p.attenuation[2] * d * d, 1e-20);
      const double cosine = p.light.perspective() ? std::min(depth / d, 1.0) : 1;
      value *= std::pow(cosine, p.exponent);
      if (p.cone > 0) {
        const double outer = std::cos(p.cone * kPi / 180);
        const double width = std::max(std::cos((p.cone - p.rim) * kPi / 180) - outer, 1e-9);
        const double t = std::clamp((cosine - outer) / width, 0.0, 1.0);
        value *= t * t * (3 - 2 * t);
      }
    }
    for (size_t k = 0; k < 3; ++k) {
      const double slide = s.slide ? call.in[1].at(x, y, static_cast<int>(k)) : 1;
      const double v = value * p.color[k] * slide;
      pixel.Set(k, v, std::fabs(v));
    }
  });
}

}  // namespace

std::vector<Entry> ShadeLightEntries() {
  return {{"shadow", Shadow, ShadowInput}, {"diffuselight", DiffuseLight}, {"spotlight", Spotlight}};
}

}  // namespace tessera::reference
