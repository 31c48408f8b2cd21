// Reference of texenv, from the specification's tables, in double.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <vector>

#include "model/texture_environment_settings.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using Sample = std::pair<double, double>;  // value, scale

Sample Sum(double a, double b) { return {a + b, std::fabs(a) + std::fabs(b)}; }
double Share(double v) { return 1 - v; }

// R, G, B and A of an image and of the constant.
using Colors = std::array<double, 4>;

double ArgumentOf(TextureArgument argument, const Colors& t, const Colors& f, const Colors& constant, int c) {
  const auto of = [&](const Colors& colors, bool alpha) {
    return colors[alpha ? 3 : static_cast<size_t>(c)];
  };
  switch (argument) {
    case TextureArgument::kTexture:
      return of(t, false);
    case TextureArgument::kOneMinusTexture:
      return Share(of(t, false));
    case TextureArgument::kTextureAlpha:
      return of(t, true);
    case TextureArgument::kOneMinusTextureAlpha:
      return Share(of(t, true));
    case TextureArgument::kFragment:
      return of(f, false);
    case TextureArgument::kOneMinusFragment:
      return Share(of(f, false));
    case TextureArgument::kFragmentAlpha:
      return of(f, true);
    case TextureArgument::kOneMinusFragmentAlpha:
      return Share(of(f, true));
    case TextureArgument::kConstant:
      return of(constant, false);
    case TextureArgument::kOneMinusConstant:
      return Share(of(constant, false));
    case TextureArgument::kConstantAlpha:
      return of(constant, true);
    case TextureArgument::kOneMinusConstantAlpha:
      return Share(of(constant, true));
  }
  return 0;
}

// An argument may be 1 minus a sample: the roundings are of 1 + |sample|.
Sample Combined(const TextureEnvironmentParams& p, const Colors& t, const Colors& f, const Colors& constant,
                int c) {
  const auto argument = [&](size_t k, int channel) {
    return ArgumentOf(p.arguments[k], t, f, constant, channel);
  };
  const auto size = [](double v) { return std::fabs(v) + 2; };
  const double a = argument(0, c), b = argument(1, c), w = argument(2, c);
  switch (p.function) {
    case TextureFunction::kReplace:
      return {a, size(a)};
    case TextureFunction::kModulate:
      return {a * b, size(a) * size(b)};
    case TextureFunction::kAdd:
      return {a + b, size(a) + size(b)};
    case TextureFunction::kAddSigned:
      return {a + b - 0.5, size(a) + size(b)};
    case TextureFunction::kInterpolate:
      return {a * w + b * (1 - w), (size(a) + size(b)) * size(w)};
    case TextureFunction::kSubtract:
      return {a - b, size(a) + size(b)};
    case TextureFunction::kDot:
      break;
  }
  if (c == 3) return Rounded(f[3]);
  Sample dot{0, 0};
  for (int k = 0; k < 3; ++k) {
    dot.first += 4 * (argument(0, k) - 0.5) * (argument(1, k) - 0.5);
    dot.second += 4 * size(argument(0, k)) * size(argument(1, k));
  }
  return dot;
}

void Evaluate(const Call& call) {
  const auto& settings = std::any_cast<const ops::TextureEnvironmentSettings&>(call.parameters);
  const TextureEnvironmentParams& p = settings.params;
  Colors constant;
  for (size_t k = 0; k < 4; ++k) constant[k] = static_cast<float>(p.constant[k]);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    Colors t, f;
    for (int k = 0; k < 4; ++k) {
      t[static_cast<size_t>(k)] = call.in[0].at(x, y, k), f[static_cast<size_t>(k)] = call.in[1].at(x, y, k);
    }
    const auto channel = static_cast<size_t>(c);
    if (p.mode == TextureMode::kCombine) {
      const Sample v = Combined(p, t, f, constant, c);
      const double scale = c == 3 && p.function == TextureFunction::kDot ? 1 : p.scale;
      return {scale * v.first, scale * v.second};
    }
    if (c == 3) {
      if (p.mode == TextureMode::kDecal || !settings.texture_alpha) return Rounded(f[3]);
      return Rounded(p.mode == TextureMode::kReplace ? t[3] : t[3] * f[3]);
    }
    if (!settings.texture_colors) return Rounded(f[channel]);
    switch (p.mode) {
      case TextureMode::kModulate:
        return Rounded(t[channel] * f[channel]);
      case TextureMode::kDecal: {
        const Sample v = Sum(t[3] * t[channel], Share(t[3]) * f[channel]);
        return {v.first, v.second + std::fabs(f[channel])};
      }
      case TextureMode::kBlend: {
        const Sample v = Sum(Share(t[channel]) * f[channel], t[channel] * constant[channel]);
        return {v.first, v.second + std::fabs(f[channel])};
      }
      case TextureMode::kAdd:
        return Sum(t[channel], f[channel]);
      default:
        return Rounded(t[channel]);
    }
  });
}

}  // namespace

std::vector<Entry> TextureEnvironmentEntries() { return {{"texenv", Evaluate}}; }

}  // namespace tessera::reference
