// Reference of the procedural textures.
#include "tessera/ops/texture.h"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "reference/noise_lattice.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using Color = std::array<double, 4>;
constexpr double kPi = std::numbers::pi;

double Random(uint32_t seed, int index) {
  const auto scramble = [](uint32_t h) {
    h = (h ^ (h >> 16)) * 0x21f0aaadu;
    h = (h ^ (h >> 15)) * 0xd35a2d97u;
    return h ^ (h >> 15);
  };
  return scramble(scramble(seed) + 0x85ebca6bu * static_cast<uint32_t>(index)) / 4294967296.0;
}

struct Stop {
  double at;
  Color color;
};
Color Ramp(const std::vector<Stop>& stops, double t) {
  size_t i = 0;
  while (i + 2 < stops.size() && t > stops[i + 1].at) ++i;
  const double w = (t - stops[i].at) / (stops[i + 1].at - stops[i].at);
  Color c = {0, 0, 0, 1};
  for (size_t k = 0; k < 3; ++k) c[k] = (1 - w) * stops[i].color[k] + w * stops[i + 1].color[k];
  return c;
}
double Clamped(double v) { return std::clamp(v, 0.0, 1.0); }
double Smooth(double v) { return Clamped(v) * Clamped(v) * (3 - 2 * Clamped(v)); }

// Sum of terms c_i sin(f_i u + p_i) plus n t0, written out with its angles. `off`: what floats are off by, in
// u: a few roundings of each term and one of every partial sum, times the other factors.
double Gardner(const TextureParams& p, double x, double y, double z, bool volume, double* off) {
  constexpr double kRatio[3] = {1, 1.19, 0.87};
  const auto angle = [&](int axis, int term, double units) {
    return 2 * kPi * 0.35 * p.frequency * kRatio[axis] *
           std::ldexp(units + 7 * Random(p.seed, 3000 + axis), term);
  };
  const double drift = p.drift;
  double fx = p.terms * p.threshold, fy = fx, fz = fx, amplitude = p.amplitude, terms = std::fabs(fx);
  for (int i = 0; i < p.terms; ++i, amplitude *= 0.707) {
    const double along_x = i == 0 ? 0 : kPi / 2 * std::sin(angle(1, i - 1, y));
    const double along_y =
        i == 0 ? 0 : kPi / 2 * std::sin(angle(0, i - 1, x) - drift * std::ldexp(1.0, i - 1));
    fx += amplitude * std::sin(angle(0, i, x) - drift * std::ldexp(1.0, i) + along_x);
    fy += amplitude * std::sin(angle(1, i, y) + along_y);
    fz += amplitude * std::sin(angle(2, i, z) + along_y);
    terms += std::fabs(amplitude);
  }
  if (!volume) fz = 1;
  const double each = (p.terms + 6) * terms;
  *off = std::fabs(p.scale) *
         (each * (std::fabs(fy * fz) + std::fabs(fx * fz) + (volume ? std::fabs(fx * fy) : 0)) +
          12 * std::fabs(fx * fy * fz));
  return p.scale * fx * fy * fz;
}

Color Ripples(const TextureParams& p, double s, double t) {
  double dx = 0, dy = 0, height = 0;
  for (int i = 0; i < 3; ++i) {
    const auto random = [&](int k) { return std::floor(Random(p.seed, 4000 + 2 * i + k) * 0x1p24) / 0x1p24; };
    const double x = s - (0.15 + 0.7 * random(0)), y = t - (0.1 + 0.45 * random(1)), r = std::hypot(x, y);
    const double size = 0.16 / (1 + 14 * r * r), turns = p.frequency * r - p.time;
    const double slope = size * std::cos(2 * kPi * turns) / (r + 0.01);
    dx += slope * x;
    dy += slope * y;
    height += size * std::sin(2 * kPi * turns);
  }
  return {0.5 + dx, 0.5 + dy, 0.5 + height, 1};
}

Color Shade(const TextureParams& p, double s, double t, double h, const std::vector<double>& n,
            double gardner) {
  switch (p.kind) {
    case TextureKind::kClouds: {
      const Color zenith = {0.075, 0.20, 0.50}, horizon = {0.42, 0.60, 0.80}, lit = {1, 0.985, 0.96},
                  shade = {0.27, 0.32, 0.42};
      const double body = 1.15 * gardner + 0.95 * n[0] - 0.12;
      const double cover = Smooth(1.9 * body), depth = body > 0 ? body / (body + 0.9) : 0;
      const double shadow = Smooth(0.10 + 0.85 * depth + 0.8 * (n[1] - n[0]));
      Color c = {0, 0, 0, 1};
      for (size_t k = 0; k < 3; ++k) {
        const double sky = horizon[k] * (1 - h) + zenith[k] * h,
                     cloud = lit[k] * (1 - shadow) + shade[k] * shadow;
        c[k] = sky * (1 - cover) + cloud * cover;
      }
      return c;
    }
    case TextureKind::kMarble: {
      const double turns[2] = {p.frequency * (0.8 * s + 0.45 * t) + 0.4 * n[0],
                               0.7 * p.frequency * (0.5 * s - 0.9 * t) + 0.2 * n[0] + 0.1 * n[1] + 0.21};
      Color c = Ramp({{0, {0.035, 0.038, 0.048}},
                      {0.02, {0.115, 0.125, 0.15}},
                      {0.10, {0.27, 0.28, 0.295}},
                      {0.35, {0.62, 0.615, 0.60}},
                      {1, {0.90, 0.88, 0.84}}},
                     0.5 + 0.5 * std::sin(2 * kPi * turns[0]));
      const double sharp = std::max(0.0, 1 - (0.5 + 0.5 * std::sin(2 * kPi * turns[1])) / 0.04);
      const double vein = 0.8 * sharp * sharp * Clamped(0.25 + 1.3 * n[1]);
      const double darker[3] = {0.78, 0.80, 0.72};
      for (size_t k = 0; k < 3; ++k) c[k] *= (1.06 - 0.22 * n[0] + 0.12 * n[1]) * (1 - darker[k] * vein);
      return c;
    }
    case TextureKind::kWood: {
      const double r = 14 * p.frequency * std::hypot(t - 0.33, 0.17 + 0.06 * s) + 0.55 * n[0],
                   w = r - std::floor(r);
      const double late = w < 0.82 ? w / 0.82 : (1 - w) / 0.18;
      Color c = Ramp({{0, {0.52, 0.27, 0.105}}, {0.55, {0.40, 0.18, 0.060}}, {1, {0.17, 0.062, 0.018}}},
                     late * late);
      for (size_t k = 0; k < 3; ++k) c[k] *= 1 + 0.35 * n[1];
      return c;
    }
    case TextureKind::kFire: {
      const double up = h / p.height, below = (0.66 + 0.50 * n[0] + 0.28 * n[1] - up) / 0.66;
      const double heat = 0.72 * std::min(below, 0.85) +
                          (0.30 + 0.45 * Clamped(1.3 * up)) * (0.8 * n[1] + 0.5 * n[2]) +
                          0.38 * (std::pow(1 + 30 * n[1] * n[1], -2) - 0.35) * Clamped(1.5 * below) -
                          0.12 * Clamped(1 - 5 * up);
      const double light = Smooth(0.95 * heat), near = std::max(0.0, 1 - n[3] / 0.1);
      const double glow = 3 * p.embers * near * near * Clamped(3 * up) * Clamped(1.3 - up);
      return {1.9 * light + 1.6 * glow, 1.15 * light * light + 0.62 * glow,
              0.72 * std::pow(light, 4) + 0.12 * glow, Clamped(1.2 * light)};
    }
    case TextureKind::kSmoke: {
      const double up = std::max(h, 0.0);
      const double x = (s - 0.5 - (0.02 + 0.16 * up) * n[0]) / (0.045 + 0.25 * up);
      const double out = std::max(0.0, std::fabs(x) - 0.35 * n[1]), inside = std::max(0.0, 1 - out * out);
      const double density = Clamped(inside * inside * (0.72 + 0.8 * n[1] + 0.9 * up * n[2]) *
                                     (1.5 - 1.05 * up) * Smooth(5 * (h + 0.04)));
      const double alpha = density * (1.9 - 0.95 * density),
                   grey = 0.08 + 0.70 * Clamped(0.46 - 0.32 * x + 0.7 * n[1] + 0.3 * n[2]);
      return {grey * alpha, grey * alpha * 1.01, grey * alpha * 1.04, alpha};
    }
    case TextureKind::kRipples:
      return Ripples(p, s, t);
    default:
      return {gardner, gardner, gardner, 1};
  }
}

void Evaluate(const Call& call) {
  const auto& p = std::any_cast<const TextureParams&>(call.parameters);
  TextureParams sines = p;
  if (p.kind == TextureKind::kClouds)
    sines.terms = 5, sines.amplitude = 1, sines.threshold = 0.6, sines.scale = 0.04, sines.slices = 1;
  const double width = std::max(p.frame.width(), 1), height = std::max(p.frame.height(), 1);
  const int slice_height = std::max(p.frame.height() / sines.slices, 1);
  const bool covers = p.kind == TextureKind::kFire || p.kind == TextureKind::kSmoke;
  const bool grey = p.kind == TextureKind::kRipples || p.kind == TextureKind::kGardner;
  double off = 0;  // of Gardner's sums, in u
  // `aside`: what each curl, as floats have it, may be off by, to the right and down.
  const auto color_at = [&](int x, int y, const std::array<double, 2>& aside = {0, 0}) {
    double s = (x - p.frame.x0 + 0.5) / width, t = (y - p.frame.y0 + 0.5) / width;
    double h = 1 - (y - p.frame.y0 + 0.5) / height;
    // Where curls lead to from here, one after the other.
    double right = 0, down = 0;
    const double strength = p.kind == TextureKind::kFire    ? 0.3 + 0.7 * Smooth(1.6 * h)
                            : p.kind == TextureKind::kSmoke ? 0.15 + 0.85 * Smooth(1.5 * h)
                                                            : 1;
    for (size_t k = 0; k < p.curls.size(); ++k) {
      const NoiseValue potential = GridNoise(p.fields[k], x, y, right, down);
      right += strength * p.curls[k][0] * potential.slope[1] + aside[0];
      down += aside[1] - strength * p.curls[k][1] * potential.slope[0];
    }
    std::vector<double> n;
    for (size_t k = p.curls.size(); k < p.fields.size(); ++k)
      n.push_back(GridNoise(p.fields[k], x, y, right, down).value);
    double gardner = 0;
    if (p.kind == TextureKind::kClouds || p.kind == TextureKind::kGardner) {
      int row = y - p.frame.y0, slice = 0;
      if (sines.slices > 1) {
        slice = std::clamp(static_cast<int>(std::floor(static_cast<double>(row) / slice_height)), 0,
                           sines.slices - 1);
        row -= slice * slice_height;
      }
      const double z = (slice + 0.5) / sines.slices;
      gardner = Gardner(sines, s, (row + 0.5) / width, z, sines.slices > 1, &off);
      if (sines.slices > 1) {
        const double u = 2 * s - 1, v = (2.0 * row + 1) / slice_height - 1, w = 2 * z - 1;
        // The sum of squares is of floats.
        const double inside = std::max(0.0, 1 - (u * u + v * v + w * w));
        off = off * inside + 12 * std::fabs(gardner);
        gardner *= inside;
      }
    }
    s += right, t += down, h -= down * width / height;
    return Shade(p, s, t, h, n, gardner);
  };
  Color color = {}, off_by = {};
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    if (c == 0) {
      color = color_at(x, y);
      off_by = {};
      // Curls stretch what their own roundings, and those of the noise that they lead to, move a place by.
      const double by = 2.5e-7 * std::max(1.0, p.curl);
      for (size_t axis = 0; axis < 2 && !p.curls.empty() && call.scale != nullptr; ++axis) {
        const Color moved = color_at(x, y, {axis == 0 ? by : 0, axis == 1 ? by : 0});
        for (size_t k = 0; k < 4; ++k) off_by[k] += std::fabs(moved[k] - color[k]) / (672 * 0x1p-24);
      }
    }
    // Places are floats, in widths: far down a narrow picture they are that much coarser.
    double scale = std::max(1.0, std::fabs(y - p.frame.y0 + 0.5) / width);
    // Angles are doubles; the row's bound is 336 u.
    if (p.kind == TextureKind::kGardner) scale = off / 336;
    // Rings are counted in floats.
    if (p.kind == TextureKind::kRipples) scale *= std::max(1.0, std::fabs(p.frequency) / 150);
    scale += off_by[c == call.out_spec.alpha ? 3 : static_cast<size_t>(std::min(c, 2))];
    if (c == call.out_spec.alpha) return {covers ? color[3] : 1.0, scale};
    if (c >= 3) return {grey ? color[2] : 0.0, scale};
    return {color[static_cast<size_t>(c)], scale};
  });
}

}  // namespace

std::vector<Entry> TextureEntries() {
  std::vector<Entry> entries;
  for (const char* name : {"clouds", "marble", "wood", "fire", "smoke", "ripples", "gardner"})
    entries.push_back({name, Evaluate});
  return entries;
}

}  // namespace tessera::reference
