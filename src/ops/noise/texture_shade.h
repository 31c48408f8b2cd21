// Colours of the textures from their noise: plain float arithmetic, the same bits on every target.
#ifndef TESSERA_OPS_NOISE_TEXTURE_SHADE_H_
#define TESSERA_OPS_NOISE_TEXTURE_SHADE_H_

#include <algorithm>
#include <array>
#include <cmath>

#include "tessera/ops/texture.h"

namespace tessera::ops {

using Rgba = std::array<float, 4>;

// sin(2 pi x), to 2e-7.
inline float SinTurns(float x) {
  float r = x - std::floor(x + 0.5f);  // [-1/2, 1/2]
  if (r > 0.25f) r = 0.5f - r;
  if (r < -0.25f) r = -0.5f - r;
  const float s = r * r;
  return r * (6.2831853f + s * (-41.341702f +
                                s * (81.605249f + s * (-76.705860f + s * (42.058694f + s * (-15.094643f))))));
}
inline float Saturated(float v) { return std::clamp(v, 0.0f, 1.0f); }
inline float SmoothStep(float v) {
  v = Saturated(v);
  return v * v * (3 - 2 * v);
}

struct RampStop {
  float at;
  float color[3];
};
// Linear between stops; t within the first and the last.
template <size_t n>
Rgba Ramp(const RampStop (&stops)[n], float t) {
  size_t i = 0;
  while (i + 2 < n && t > stops[i + 1].at) ++i;
  const float w = (t - stops[i].at) / (stops[i + 1].at - stops[i].at);
  Rgba c = {0, 0, 0, 1};
  for (size_t k = 0; k < 3; ++k) c[k] = stops[i].color[k] + w * (stops[i + 1].color[k] - stops[i].color[k]);
  return c;
}

// Where a pixel is: s across and t down in widths, h the height above the lower edge in heights. Exactly for
// what repeats, as many bands or rings leave little of a float's fraction.
struct TexturePlace {
  float s, t, h;
  double exact_s, exact_t;
};

// How strong curls are at a height: what burns or smoulders stands still at its foot.
inline float CurlGrowth(TextureKind kind, float height) {
  if (kind == TextureKind::kFire) return 0.3f + 0.7f * SmoothStep(1.6f * height);
  if (kind == TextureKind::kSmoke) return 0.15f + 0.85f * SmoothStep(1.5f * height);
  return 1;
}

inline Rgba Marble(const TexturePlace& p, double bands, float turbulence, float cloud) {
  static constexpr RampStop kRamp[] = {{0.0f, {0.035f, 0.038f, 0.048f}},
                                       {0.02f, {0.115f, 0.125f, 0.15f}},
                                       {0.10f, {0.27f, 0.28f, 0.295f}},
                                       {0.35f, {0.62f, 0.615f, 0.60f}},
                                       {1.0f, {0.90f, 0.88f, 0.84f}}};
  static constexpr float kVein[3] = {0.78f, 0.80f, 0.72f};
  const auto wave = [](double turns) {
    return 0.5f + 0.5f * SinTurns(static_cast<float>(turns - std::floor(turns)));
  };
  // Little turbulence: more would turn the bands around, and close them.
  Rgba c = Ramp(kRamp, wave(bands * (0.8 * p.exact_s + 0.45 * p.exact_t) + 0.4 * double{turbulence}));
  const float across = wave(0.7 * bands * (0.5 * p.exact_s - 0.9 * p.exact_t) + 0.2 * double{turbulence} +
                            0.1 * double{cloud} + 0.21);
  const float sharp = std::max(0.0f, 1 - 25 * across);
  const float vein = 0.8f * sharp * sharp * Saturated(0.25f + 1.3f * cloud);
  const float tone = 1.06f - 0.22f * turbulence + 0.12f * cloud;
  for (size_t k = 0; k < 3; ++k) c[k] *= tone * (1 - kVein[k] * vein);
  return c;
}

inline Rgba Wood(const TexturePlace& p, double rings, float bend, float grain) {
  static constexpr RampStop kRamp[] = {
      {0.0f, {0.52f, 0.27f, 0.105f}}, {0.55f, {0.40f, 0.18f, 0.060f}}, {1.0f, {0.17f, 0.062f, 0.018f}}};
  // Rings around an axis that passes a little below the middle, nearly along the board.
  const double y = p.exact_t - 0.33, z = 0.17 + 0.06 * p.exact_s;
  const double r = rings * std::sqrt(y * y + z * z) + 0.55 * double{bend};
  const float w = static_cast<float>(r - std::floor(r));
  // Slow growth in summer, a quick dark edge: continuous, so that no edge is aliased.
  const float late = w < 0.82f ? w * (1 / 0.82f) : (1 - w) * (1 / 0.18f);
  Rgba c = Ramp(kRamp, late * late);
  for (size_t k = 0; k < 3; ++k) c[k] *= 1 + 0.35f * grain;
  return c;
}

// `ahead`: the broad part of `detail` a little nearer to the sun.
inline Rgba Clouds(const TexturePlace& p, float gardner, float detail, float ahead) {
  const float zenith[3] = {0.075f, 0.20f, 0.50f}, horizon[3] = {0.42f, 0.60f, 0.80f};
  const float lit[3] = {1.0f, 0.985f, 0.96f}, shade[3] = {0.27f, 0.32f, 0.42f};
  const float body = 1.15f * gardner + 0.95f * detail - 0.12f;
  const float cover = SmoothStep(1.9f * body);
  // Depth grows with the body but never stops; less cloud towards the sun lets more light in.
  const float thick = std::max(body, 0.0f), depth = thick / (thick + 0.9f);
  const float shadow = SmoothStep(0.10f + 0.85f * depth + 0.8f * (ahead - detail));
  Rgba c = {0, 0, 0, 1};
  for (size_t k = 0; k < 3; ++k) {
    const float sky = horizon[k] + (zenith[k] - horizon[k]) * p.h;
    const float cloud = lit[k] + shadow * (shade[k] - lit[k]);
    c[k] = sky + cover * (cloud - sky);
  }
  return c;
}

// `spark`: the distance to the nearest point of a cellular noise.
inline Rgba Fire(const TexturePlace& p, float height, float embers, float broad, float tongue, float fine,
                 float spark) {
  const float up = p.h / height;
  const float narrow = 1 / (1 + 30 * tongue * tongue), sheet = narrow * narrow;
  // How far below the tip, 1 at the foot of what reaches highest on the mean.
  const float below = (0.66f + 0.50f * broad + 0.28f * tongue - up) * (1 / 0.66f);
  const float torn = (0.30f + 0.45f * Saturated(1.3f * up)) * (0.8f * tongue + 0.5f * fine);
  const float sheets = 0.38f * (sheet - 0.35f) * Saturated(1.5f * below);
  const float heat = 0.72f * std::min(below, 0.85f) + torn + sheets - 0.12f * Saturated(1 - 5 * up);
  // Green and blue fade before red does: what is nearly out is orange, not dark.
  const float light = SmoothStep(0.95f * heat), square = light * light;
  const float near = std::max(0.0f, 1 - 10 * spark);
  const float glow = 3 * embers * near * near * Saturated(3 * up) * Saturated(1.3f - up);
  return {1.9f * light + 1.6f * glow, 1.15f * square + 0.62f * glow, 0.72f * square * square + 0.12f * glow,
          Saturated(1.2f * light)};
}

inline Rgba Smoke(const TexturePlace& p, float sway, float body, float broad) {
  const float up = std::max(p.h, 0.0f);
  const float centre = 0.5f + (0.02f + 0.16f * up) * sway, width = 0.045f + 0.25f * up;
  const float x = (p.s - centre) / width, out = std::max(std::fabs(x) - 0.35f * body, 0.0f);
  const float inside = std::max(0.0f, 1 - out * out), profile = inside * inside;
  // Soft where it begins, thinner the higher.
  const float lumps = 0.72f + 0.8f * body + 0.9f * up * broad;
  const float density = Saturated(profile * lumps * (1.5f - 1.05f * up) * SmoothStep(5 * p.h + 0.2f));
  const float alpha = density * (1.9f - 0.95f * density);
  const float grey = 0.08f + 0.70f * Saturated(0.46f - 0.32f * x + 0.7f * body + 0.3f * broad);
  return {grey * alpha, grey * alpha * 1.01f, grey * alpha * 1.04f, alpha};
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_TEXTURE_SHADE_H_
