// Colours of the textures from their noise: plain float arithmetic, the same bits on every target.
#ifndef TESSERA_OPS_NOISE_TEXTURE_SHADE_H_
#define TESSERA_OPS_NOISE_TEXTURE_SHADE_H_

#include <algorithm>
#include <array>
#include <cmath>

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

inline Rgba Marble(const TexturePlace& p, double bands, float turbulence) {
  static constexpr RampStop kRamp[] = {{0.0f, {0.030f, 0.035f, 0.048f}},
                                       {0.02f, {0.115f, 0.125f, 0.15f}},
                                       {0.10f, {0.24f, 0.25f, 0.27f}},
                                       {0.35f, {0.62f, 0.61f, 0.59f}},
                                       {1.0f, {0.90f, 0.88f, 0.84f}}};
  const double turns = bands * (0.8 * p.exact_s + 0.45 * p.exact_t) + 0.9 * double{turbulence};
  return Ramp(kRamp, 0.5f + 0.5f * SinTurns(static_cast<float>(turns - std::floor(turns))));
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

inline Rgba Fire(const TexturePlace& p, float broad, float middle, float fine) {
  static constexpr RampStop kRamp[] = {{0.0f, {0.0f, 0.0f, 0.0f}},       {0.15f, {0.10f, 0.008f, 0.0f}},
                                       {0.38f, {0.72f, 0.085f, 0.004f}}, {0.66f, {1.0f, 0.30f, 0.02f}},
                                       {1.15f, {1.0f, 0.82f, 0.25f}},    {1.6f, {1.0f, 0.97f, 0.76f}}};
  // Noise eats into the flame more with height: the base stays closed, and is broken up by the finer layers.
  const float tongues = 1.0f * broad + 0.62f * middle + 0.38f * fine;
  const float low = 1 - p.h;
  const float heat =
      std::clamp(1.12f - 1.54f * p.h + (0.38f + 0.97f * p.h) * tongues + 0.30f * low * low * (middle + fine),
                 0.0f, 1.6f);
  Rgba c = Ramp(kRamp, heat);
  c[3] = SmoothStep(2.2f * heat);
  for (size_t k = 0; k < 3; ++k) c[k] *= c[3];
  return c;
}

inline Rgba Smoke(const TexturePlace& p, float sway, float body, float fine) {
  const float centre = 0.5f + (0.04f + 0.22f * p.h) * sway, width = 0.075f + 0.32f * p.h;
  // Puffs push the plume's edge in and out; it thins out towards it.
  const float x = (p.s - centre) / width, out = std::max(std::fabs(x) - 0.33f * body, 0.0f);
  const float inside = std::max(0.0f, 1 - out * out), profile = inside * inside;
  const float lumps = 0.85f + (0.35f + 0.7f * p.h) * (body + 0.45f * fine);
  const float density = Saturated(profile * lumps * (1.18f - 0.95f * p.h));
  const float alpha = density * (1.75f - 0.85f * density);
  const float grey = 0.30f + 0.42f * Saturated(0.5f + 0.6f * body + 0.25f * fine - 0.35f * x);
  return {grey * alpha, grey * alpha * 1.01f, grey * alpha * 1.04f, alpha};
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_TEXTURE_SHADE_H_
