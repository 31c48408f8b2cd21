// The oracle of solid textures, from doc/maths/solid.md. Double.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/shade_settings.h"
#include "reference/filtered.h"
#include "reference/reference.h"
#include "reference/shade_loop.h"
#include "tessera/ops/shade.h"

namespace tessera::reference {
namespace {

constexpr double kPi = std::numbers::pi;

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

// The sum of |2 frac - 1| of three places has this distribution (Irwin, Hall).
double ScreenShare(double sum) {
  double share = 0;
  const double binomial[] = {1, -3, 3, -1};
  for (int k = 0; k <= 3; ++k) share += sum > k ? binomial[k] * std::pow(sum - k, 3) / 6 : 0;
  return share;
}
// Where that is `share`, by halving.
double ScreenLevel(double share) {
  if (!(share > 0)) return -1e30;
  if (share > 1) return 1e30;
  double low = 0, high = 3;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (ScreenShare(middle) < share ? low : high) = middle;
  }
  return (low + high) / 2;
}

double Marble(double phase, size_t c) {
  double color[3];
  Ramp(kMarble, 0.5 + 0.5 * std::sin(2 * kPi * phase), color);
  return color[c];
}
double Wood(double rings, size_t c) {
  const double w = rings - std::floor(rings), late = w < 0.82 ? w / 0.82 : (1 - w) / 0.18;
  double color[3];
  Ramp(kWood, late * late, color);
  return color[c];
}
double Triangle(double v) { return std::fabs(2 * (v - std::floor(v)) - 1); }

class Procedure {
 public:
  Procedure(const Call& call, const ops::SolidSettings& s, int x, int y) : call_(call), s_(s), x_(x), y_(y) {
    if (!s.footprint) return;
    const size_t first = call.in.size() - 2;
    for (int k = 0; k < 6; ++k) footprint_.m[k] = call.in[first + (k < 3 ? 0 : 1)].at(x, y, k % 3);
  }

  Texel At(const double* p) const {
    const SolidParams& q = s_.solid;
    Texel t{{}, 1};
    switch (q.kind) {
      case SolidKind::kTable:
        for (int k = 0; k < 3; ++k) t.color[k] = call_.in[1].at(x_, y_, s_.table_channels == 1 ? 0 : k);
        if (const int alpha = call_.in_specs[1].alpha; alpha >= 0 && s_.table_channels == 4)
          t.alpha = call_.in[1].at(x_, y_, alpha);
        return t;
      case SolidKind::kMarble:
        return MarbleAt(p);
      case SolidKind::kWood:
        return WoodAt(p);
      case SolidKind::kNoise: {
        const double v =
            std::clamp(0.5 + 0.5 * (s_.footprint ? Octaves(q.frequency, 0.29, 0).value : Input(2)), 0.0, 1.0);
        return {{v, v, v}, 1};
      }
      case SolidKind::kContours: {
        const double f = q.frequency * (q.plane[0] * p[0] + q.plane[1] * p[1] + q.plane[2] * p[2]);
        if (!s_.footprint) return Inked(q, std::fabs(f - std::nearbyint(f)) < q.width / 2 ? 1 : 0);
        const double width = FootprintWidth(
            footprint_.Along(q.frequency * q.plane[0], q.frequency * q.plane[1], q.frequency * q.plane[2]),
            0x1p-12);
        const double half = q.width / 2;
        const auto line = [&](double at) {
          const double place = at - std::floor(at);
          return place < half || place > 1 - half ? 1.0 : 0.0;
        };
        return Inked(q, PeriodicMean(line, {0, half, 1 - half}, f, width));
      }
      default:
        return ScreenAt(p);
    }
  }

  // How much steeper than a texture the result is.
  double steepness() const { return steepness_; }

 private:
  double Input(size_t k) const { return call_.in[k].at(x_, y_, 0); }

  struct Sum {
    double value = 0, variance = 0;
  };
  // Octaves one by one, each as the mean over the footprint that its middle lets expect.
  Sum Octaves(double cells, double fade, double variance) const {
    Sum sum;
    const double trace = footprint_.m[0] + footprint_.m[1] + footprint_.m[2];
    for (int k = 0; k < s_.octaves; ++k) {
      const double gain = std::exp2(-k), size = cells * std::exp2(k);
      const double left = 1 / (1 + fade * trace * size * size);
      sum.value += left * Input(2 + static_cast<size_t>(k)) + (1 - left) * s_.mean * gain;
      sum.variance += gain * gain * variance * (1 - left * left);
    }
    return sum;
  }

  Texel MarbleAt(const double* p) const {
    const SolidParams& q = s_.solid;
    const double f = q.frequency, turbulence = 0.9 * q.strength;
    const double bands = f * (0.8 * p[0] + 0.45 * p[1] + 0.3 * p[2]);
    Texel t{{}, 1};
    if (!s_.footprint) {
      for (size_t c = 0; c < 3; ++c) t.color[c] = Marble(bands + turbulence * Input(2), c);
      return t;
    }
    const Sum noise = Octaves(f, 0.75, 0.023);
    const double width = FootprintWidth(
        footprint_.Along(0.8 * f, 0.45 * f, 0.3 * f) + 12 * turbulence * turbulence * noise.variance,
        0x1p-12);
    // Where the ramp's stops are reached, up and down.
    std::vector<double> bends = {0};
    for (const Stop& stop : kMarble) {
      const double up = std::asin(2 * stop.at - 1) / (2 * kPi);
      for (const double bend : {up, 0.5 - up}) bends.push_back(bend - std::floor(bend));
    }
    std::sort(bends.begin(), bends.end());
    for (size_t c = 0; c < 3; ++c) {
      t.color[c] = PeriodicMean([c](double at) { return Marble(at, c); }, bends,
                                bands + turbulence * noise.value, width);
    }
    return t;
  }

  Texel WoodAt(const double* p) const {
    const SolidParams& q = s_.solid;
    const double x = p[0] - 0.5, y = p[1] - 0.5, radius = std::hypot(x, y), bend = 0.55 * q.strength;
    Texel t{{}, 1};
    double grain = 0.35 * Input(call_.in.size() - 1);
    if (!s_.footprint) {
      for (size_t c = 0; c < 3; ++c)
        t.color[c] = Wood(q.frequency * radius + bend * Input(2), c) * (1 + grain);
      return t;
    }
    grain = 0.35 * Input(2 + static_cast<size_t>(s_.octaves));
    const Sum noise = Octaves(2.5, 0.29, 0.068);
    const double scale = q.frequency / std::max(radius, 1e-30);
    const double width = FootprintWidth(
        footprint_.Along(scale * x, scale * y, 0) + 12 * bend * bend * noise.variance, 0x1p-12);
    // Late wood's steepest place, the ramp's stop on both sides of it.
    const double stop = std::sqrt(0.55);
    const std::vector<double> bends = {0, 0.82 * stop, 0.82, 1 - 0.18 * stop};
    const double* const m = footprint_.m;
    grain /= 1 + 0.29 * (90 * 90 * (m[0] + m[1]) + 9 * m[2]);
    for (size_t c = 0; c < 3; ++c) {
      t.color[c] = PeriodicMean([c](double at) { return Wood(at, c); }, bends,
                                q.frequency * radius + bend * noise.value, width) *
                   (1 + grain);
    }
    return t;
  }

  Texel ScreenAt(const double* p) const {
    const SolidParams& q = s_.solid;
    const double luminance = 0.2126 * call_.in[0].at(x_, y_, 0) + 0.7152 * call_.in[0].at(x_, y_, 1) +
                             0.0722 * call_.in[0].at(x_, y_, 2);
    double mean = 0, variance = 0, slope[3];
    for (int k = 0; k < 3; ++k) {
      const double at = q.frequency * p[k];
      if (!s_.footprint) {
        mean += Triangle(at);
        continue;
      }
      const double width = FootprintWidth(q.frequency * q.frequency * footprint_.m[k], 0x1p-8);
      const double first = PeriodicMean(Triangle, {0, 0.5}, at, width);
      variance += PeriodicMean([&](double v) { return (Triangle(v) - first) * (Triangle(v) - first); },
                               {0, 0.5}, at, width);
      slope[k] = (Triangle(at + width / 2) - Triangle(at - width / 2)) / width;
      mean += first;
    }
    if (!s_.footprint) return Inked(q, luminance > ScreenShare(mean) ? 0 : 1);
    // Along the footprint the triangles rise and fall together.
    const double* const m = footprint_.m;
    variance += 2 * q.frequency * q.frequency *
                (m[3] * slope[0] * slope[1] + m[4] * slope[0] * slope[2] + m[5] * slope[1] * slope[2]) / 12;
    const double half = FootprintWidth(3 * variance, 0x1p-8);
    steepness_ = std::max(1.0, 0.5 / half);
    return Inked(q, std::clamp(0.5 + (mean - ScreenLevel(luminance)) / (2 * half), 0.0, 1.0));
  }

  const Call& call_;
  const ops::SolidSettings& s_;
  int x_, y_;
  FootprintMatrix footprint_ = {};
  mutable double steepness_ = 1;
};

void Solid(const Call& call) {
  const auto& s = *std::any_cast<ops::SolidSettings>(&call.parameters);
  const int alpha = call.in_specs[0].alpha;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    double p[3];
    for (int k = 0; k < 3; ++k) p[k] = call.in[1].at(x, y, k);
    if (std::isnan(p[0]) || std::isnan(p[1]) || std::isnan(p[2])) return;
    const Procedure procedure(call, s, x, y);
    const Texel t = procedure.At(p);
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
      pixel.Set(k, v, (std::fabs(c) + std::fabs(a)) * std::max(procedure.steepness(), std::fabs(texture)));
    }
  });
}

void Footprint(const Call& call) {
  const ImageD& in = call.in[0];
  const Roi& window = call.in_specs[0].data_window;
  const bool mixed = *std::any_cast<bool>(&call.parameters);
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    double sum[3] = {}, size[3] = {};
    for (int axis = 0; axis < 2; ++axis) {
      Vector3 side[2];
      bool there[2];
      for (int k = 0; k < 2; ++k) {
        const int step = 2 * k - 1;
        int nx = axis == 0 ? x + step : x, ny = axis == 1 ? y + step : y;
        // Beyond the edge the picture is reflected at the edge pixel.
        if (nx < window.x0 || nx >= window.x1) nx = window.width() > 1 ? x - step : x;
        if (ny < window.y0 || ny >= window.y1) ny = window.height() > 1 ? y - step : y;
        for (int c = 0; c < 3; ++c) side[k][static_cast<size_t>(c)] = in.at(nx, ny, c) - in.at(x, y, c);
        there[k] = Dot(side[k], side[k]) <= 1e100;
      }
      for (size_t k = 0; k < 2; ++k) {
        if (!there[k]) continue;
        const double own = Dot(side[k], side[k]), other = Dot(side[1 - k], side[1 - k]);
        const double weight = !there[1 - k] ? 1 : own + other > 0 ? other / (own + other) : 0;
        const Vector3& j = side[k];
        for (size_t c = 0; c < 3; ++c) {
          const double product = weight * (!mixed   ? j[c] * j[c]
                                           : c == 0 ? j[0] * j[1]
                                           : c == 1 ? j[0] * j[2]
                                                    : j[1] * j[2]);
          sum[c] += product;
          size[c] += std::fabs(product);
        }
      }
    }
    for (size_t c = 0; c < 3; ++c) pixel.Set(c, std::clamp(sum[c], -1e30, 1e30), size[c]);
  });
}
Roi FootprintInput(const std::any&, int, const Roi& out) {
  return {out.x0 - 1, out.y0 - 1, out.x1 + 1, out.y1 + 1};
}

}  // namespace

std::vector<Entry> SolidEntries() { return {{"solid", Solid}, {"footprint", Footprint, FootprintInput}}; }

}  // namespace tessera::reference
