// The oracle of shadows, lights and solid textures, from doc/maths/shadow.md and doc/maths/solid.md. Double.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <numbers>

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
  Map(const ImageD& depths, const ops::ShadowSettings& settings) : depths_(depths), s_(settings) {}
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
    const double slope = Slope(At(x - 1, y), m, At(x + 1, y)) + Slope(At(x, y - 1), m, At(x, y + 1));
    return rounded(reach * slope + s_.map_step * (1 + 2 * reach));
  }

 private:
  double At(int x, int y) const {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return 1;
    return depths_.at(depths_.roi.x0 + x, depths_.roi.y0 + y, 0);
  }
  static double Slope(double a, double m, double b) {
    const bool left = a < 1, right = b < 1;
    if (left && right) {
      const double one = std::fabs(m - a), other = std::fabs(b - m);
      return std::min(std::max(one, other), 2 * std::min(one, other));
    }
    return left ? std::fabs(m - a) : right ? std::fabs(b - m) : 0;
  }

  const ImageD& depths_;
  const ops::ShadowSettings& s_;
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

// --- Solids. ---

struct Stop {
  double at, color[3];
};
constexpr Stop kMarble[] = {{0.0, {0.075, 0.085, 0.105}},
                            {0.10, {0.24, 0.25, 0.27}},
                            {0.35, {0.62, 0.61, 0.59}},
                            {1.0, {0.90, 0.88, 0.84}}};
constexpr Stop kWood[] = {
    {0.0, {0.52, 0.27, 0.105}}, {0.55, {0.40, 0.18, 0.060}}, {1.0, {0.17, 0.062, 0.018}}};

template <size_t n>
void Ramp(const Stop (&stops)[n], double t, double* color) {
  size_t k = 0;
  while (k + 2 < n && t > stops[k + 1].at) ++k;
  const double w = (t - stops[k].at) / (stops[k + 1].at - stops[k].at);
  for (size_t c = 0; c < 3; ++c) color[c] = (1 - w) * stops[k].color[c] + w * stops[k + 1].color[c];
}

struct Texel {
  double color[3], alpha;
};

Texel Inked(const SolidParams& p, double covered) {
  Texel t{{}, covered};
  for (size_t k = 0; k < 3; ++k) t.color[k] = covered * p.ink[k];
  if (p.blend != SolidBlend::kReplace) return t;
  for (double& c : t.color) c += 1 - covered;
  t.alpha = 1;
  return t;
}

class Procedure {
 public:
  Procedure(const Call& call, const ops::SolidSettings& s, int x, int y) : call_(call), s_(s), x_(x), y_(y) {}

  Texel At(const double* p) const {
    const SolidParams& q = s_.solid;
    Texel t{{}, 1};
    switch (q.kind) {
      case SolidKind::kTable:
        for (int k = 0; k < 3; ++k) t.color[k] = call_.in[1].at(x_, y_, s_.table_channels == 1 ? 0 : k);
        if (s_.table_channels == 4) t.alpha = call_.in[1].at(x_, y_, 3);
        return t;
      case SolidKind::kMarble:
        Ramp(kMarble,
             0.5 + 0.5 * std::sin(2 * kPi *
                                  (q.frequency * (0.8 * p[0] + 0.45 * p[1] + 0.3 * p[2]) +
                                   0.9 * q.strength * Noise())),
             t.color);
        return t;
      case SolidKind::kWood: {
        const double rings = q.frequency * std::hypot(p[0] - 0.5, p[1] - 0.5) + 0.55 * q.strength * Input(2);
        const double w = rings - std::floor(rings), late = w < 0.82 ? w / 0.82 : (1 - w) / 0.18;
        Ramp(kWood, late * late, t.color);
        for (double& c : t.color) c *= 1 + 0.35 * Input(3);
        return t;
      }
      case SolidKind::kNoise: {
        const double v = std::clamp(0.5 + 0.5 * Noise(), 0.0, 1.0);
        return {{v, v, v}, 1};
      }
      case SolidKind::kContours: {
        const double f = q.frequency * (q.plane[0] * p[0] + q.plane[1] * p[1] + q.plane[2] * p[2]);
        const double outside = std::fabs(f - std::nearbyint(f)) - q.width / 2;
        if (!s_.spread) return Inked(q, outside < 0 ? 1 : 0);
        const double slope = std::fabs(q.plane[0]) + std::fabs(q.plane[1]) + std::fabs(q.plane[2]);
        const double pixel = std::max(Input(2) * q.frequency * slope, 1e-30);
        return Inked(q, std::clamp(0.5 - outside / pixel, 0.0, 1.0));
      }
      default: {
        double sum = 0;
        for (int k = 0; k < 3; ++k)
          sum += std::fabs(2 * (q.frequency * p[k] - std::floor(q.frequency * p[k])) - 1);
        // Distribution of the sum of three even numbers (Irwin, Hall).
        double threshold = 0;
        const double binomial[] = {1, -3, 3, -1};
        for (int k = 0; k <= 3; ++k) threshold += sum > k ? binomial[k] * std::pow(sum - k, 3) / 6 : 0;
        const double luminance = 0.2126 * call_.in[0].at(x_, y_, 0) + 0.7152 * call_.in[0].at(x_, y_, 1) +
                                 0.0722 * call_.in[0].at(x_, y_, 2);
        return Inked(q, luminance > threshold ? 0 : 1);
      }
    }
  }

 private:
  double Input(size_t k) const { return call_.in[k].at(x_, y_, 0); }
  double Noise() const {
    if (!s_.spread) return Input(2);
    const double spread = Input(2 + static_cast<size_t>(s_.octaves)) * s_.solid.frequency;
    double sum = 0;
    for (int k = 0; k < s_.octaves; ++k) {
      const double fade = std::clamp(2 - 4 * spread * std::exp2(k), 0.0, 1.0);
      sum += fade * Input(2 + static_cast<size_t>(k)) + (1 - fade) * s_.mean * std::exp2(-k);
    }
    return sum;
  }

  const Call& call_;
  const ops::SolidSettings& s_;
  int x_, y_;
};

void Solid(const Call& call) {
  const auto& s = *std::any_cast<ops::SolidSettings>(&call.parameters);
  const int alpha = call.in_specs[0].alpha;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    double p[3];
    for (int k = 0; k < 3; ++k) p[k] = call.in[1].at(x, y, k);
    if (std::isnan(p[0]) || std::isnan(p[1]) || std::isnan(p[2])) return;
    const Texel t = Procedure(call, s, x, y).At(p);
    const double a = alpha >= 0 ? call.in[0].at(x, y, alpha) : 1;
    for (size_t k = 0; k < 3; ++k) {
      const double c = call.in[0].at(x, y, static_cast<int>(k)), texture = t.color[k];
      double v = 0;
      switch (s.solid.blend) {
        case SolidBlend::kModulate:
          v = c * (texture + 1 - t.alpha);
          break;
        case SolidBlend::kReplace:
          v = texture * a;
          break;
        case SolidBlend::kOver:
          v = texture * a + c * (1 - t.alpha);
          break;
        case SolidBlend::kAdd:
          v = c + texture * a;
          break;
      }
      pixel.Set(k, v, (std::fabs(c) + std::fabs(a)) * std::max(1.0, std::fabs(texture)));
    }
  });
}

void Spread(const Call& call) {
  const ImageD& in = call.in[0];
  const Roi& window = call.in_specs[0].data_window;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const auto reach = [&](int dx, int dy) {
      int nx = x + dx, ny = y + dy;
      // Beyond the edge the picture is reflected at the edge pixel.
      if (nx < window.x0 || nx >= window.x1) nx = window.width() > 1 ? x - dx : x;
      if (ny < window.y0 || ny >= window.y1) ny = window.height() > 1 ? y - dy : y;
      double largest = 0;
      for (int c = 0; c < 3; ++c) {
        const double difference = std::fabs(in.at(nx, ny, c) - in.at(x, y, c));
        if (std::isnan(difference)) return difference;
        largest = std::max(largest, difference);
      }
      return largest;
    };
    // fmin and fmax prefer numbers.
    const double both = std::fmax(std::fmin(reach(-1, 0), reach(1, 0)), std::fmin(reach(0, -1), reach(0, 1)));
    pixel.Set(0, std::isnan(both) ? 0 : both, std::fabs(both));
  });
}
Roi SpreadInput(const std::any&, int, const Roi& out) {
  return {out.x0 - 1, out.y0 - 1, out.x1 + 1, out.y1 + 1};
}

}  // namespace

std::vector<Entry> ShadeLightEntries() {
  return {{"shadow", Shadow, ShadowInput},
          {"diffuselight", DiffuseLight},
          {"spotlight", Spotlight},
          {"solid", Solid},
          {"spread", Spread, SpreadInput}};
}

}  // namespace tessera::reference
