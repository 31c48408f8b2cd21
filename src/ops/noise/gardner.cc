// Gardner's sines, and rings of water.
#include "ops/noise/gardner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ops/noise/plan.h"

namespace tessera::ops {
namespace {

constexpr double kAxisRatio[3] = {1, 1.19,
                                  0.87};  // the axes' frequencies differ a little, or squares would show
constexpr double kDrift = 0.4;            // radians per second

}  // namespace

TextureParams GardnerOf(const TextureParams& params) {
  TextureParams p = params;
  if (p.kind == TextureKind::kGardner) return p;
  p.terms = 5;
  p.amplitude = 1;
  p.threshold = 0.6;
  p.scale = 1 / 25.0;
  p.slices = 1;
  return p;
}

double GardnerDrift(const TextureParams& params) {
  if (params.loop == 0) return kDrift * params.time;
  const double turn = 2 * std::numbers::pi, turns = params.time / params.loop;
  return turn * std::max(1.0, std::round(kDrift * params.loop / turn)) * (turns - std::floor(turns));
}

// f_i * units (widths); the seed moves the origin.
double GardnerRows::Angle(int axis, int term, double units) const {
  const double origin = OctaveSeed(params_.seed, 3000 + axis, 0) / 4294967296.0;
  return 2 * std::numbers::pi * 0.35 * params_.frequency * kAxisRatio[axis] *
         std::ldexp(units + 7 * origin, term);
}

GardnerRows::GardnerRows(const TextureParams& params, const Roi& columns) : params_(params), x0_(columns.x0) {
  const int terms = params.terms;
  const double width = std::max(params.frame.width(), 1);
  const double drift = params.drift;
  columns_.reserve(static_cast<size_t>(columns.width()) * static_cast<size_t>(terms));
  for (int x = columns.x0; x < columns.x1; ++x) {
    const double units = (x - params.frame.x0 + 0.5) / width;
    for (int i = 0; i < terms; ++i) {
      const double angle = Angle(0, i, units) - drift * std::ldexp(1.0, i);
      const double phase =
          i == 0 ? 0
                 : std::numbers::pi / 2 * std::sin(Angle(0, i - 1, units) - drift * std::ldexp(1.0, i - 1));
      columns_.push_back({static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)),
                          static_cast<float>(std::sin(phase)), static_cast<float>(std::cos(phase))});
    }
  }
}

void GardnerRows::Row(int y, int x0, int x1, float* out) const {
  const auto terms = static_cast<size_t>(params_.terms);
  const Roi& frame = params_.frame;
  const double width = std::max(frame.width(), 1);
  const int slices = params_.slices, height = std::max(frame.height() / slices, 1);
  int row = y - frame.y0, slice = 0;
  if (slices > 1) {
    slice = std::clamp(row / height - (row % height < 0 ? 1 : 0), 0, slices - 1);
    row -= slice * height;
  }
  const double units_y = (row + 0.5) / width, units_z = (slice + 0.5) / slices;
  struct Term {
    float amplitude, sin_y, cos_y, sin_phase, cos_phase, sin_z, cos_z;
  };
  std::array<Term, kMaxGardnerTerms> term;
  double amplitude = params_.amplitude;
  for (size_t i = 0; i < terms; ++i, amplitude *= 0.707) {
    const int k = static_cast<int>(i);
    const double angle = Angle(1, k, units_y), z = Angle(2, k, units_z);
    const double phase = k == 0 ? 0 : std::numbers::pi / 2 * std::sin(Angle(1, k - 1, units_y));
    term[i] = {static_cast<float>(amplitude),       static_cast<float>(std::sin(angle)),
               static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(phase)),
               static_cast<float>(std::cos(phase)), static_cast<float>(std::sin(z)),
               static_cast<float>(std::cos(z))};
  }
  const float base = static_cast<float>(params_.terms * params_.threshold),
              scale = static_cast<float>(params_.scale);
  for (int x = x0; x < x1; ++x) {
    const std::array<float, 4>* const column = &columns_[static_cast<size_t>(x - x0_) * terms];
    float fx = base, fy = base, fz = base;
    for (size_t i = 0; i < terms; ++i) {
      const std::array<float, 4>& c = column[i];
      fx += term[i].amplitude * (c[0] * term[i].cos_phase + c[1] * term[i].sin_phase);
      fy += term[i].amplitude * (term[i].sin_y * c[3] + term[i].cos_y * c[2]);
      fz += term[i].amplitude * (term[i].sin_z * c[3] + term[i].cos_z * c[2]);
    }
    float t = scale * fx * fy;
    if (slices > 1) {  // inside the ellipsoid, opacity falls to 0 at its rim
      const float u = static_cast<float>((2 * (x - frame.x0) + 1) / width - 1);
      const float v = static_cast<float>((2.0 * row + 1) / height - 1),
                  w = static_cast<float>(2 * units_z - 1);
      t *= fz * std::max(0.0f, 1 - (u * u + v * v + w * w));
    }
    out[x - x0] = t;
  }
}

Rgba Ripples(const TexturePlace& p, float rings, float time, uint32_t seed) {
  float dx = 0, dy = 0, height = 0;
  for (int i = 0; i < 3; ++i) {
    const auto random = [&](int k) {
      return static_cast<float>(OctaveSeed(seed, 4000 + 2 * i + k, 0) >> 8) * 0x1p-24f;
    };
    const float x = p.s - (0.15f + 0.7f * random(0)), y = p.t - (0.1f + 0.45f * random(1));
    const float r = std::sqrt(x * x + y * y);
    const float fall = 1 / (1 + 14 * r * r);
    // A wave's slope points along its radius; the middle of the drop is flat.
    const float wave = 0.16f * fall * SinTurns(rings * r - time);
    const float slope = 0.16f * fall * SinTurns(rings * r - time + 0.25f) * r / (r + 0.01f);
    const float along = slope / std::max(r, 1e-6f);
    dx += along * x;
    dy += along * y;
    height += wave;
  }
  return {0.5f + dx, 0.5f + dy, 0.5f + height, 1};
}

}  // namespace tessera::ops
