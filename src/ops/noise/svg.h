// SVG 1.1's feTurbulence: the specification's tables, and places on its lattice.
#ifndef TESSERA_OPS_NOISE_SVG_H_
#define TESSERA_OPS_NOISE_SVG_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/ops/noise.h"

namespace tessera::ops {

inline constexpr int kSvgSize = 256;
inline constexpr double kSvgOrigin = 4096;  // added to coordinates, so that those above -4096 are positive

// The specification's tables: a permutation and unit gradients of four channels.
struct SvgLattice {
  std::array<int32_t, 2 * kSvgSize + 2> selector;
  std::array<std::array<std::array<float, 2>, 2 * kSvgSize + 2>, 4> gradient;

  explicit SvgLattice(double seed_number) {
    constexpr int64_t kModulus = 2147483647, kFactor = 16807;  // Park and Miller
    const double truncated = std::clamp(std::trunc(seed_number), -2147483647.0, 2147483647.0);
    int64_t seed = static_cast<int64_t>(truncated);
    if (seed <= 0) seed = -(seed % (kModulus - 1)) + 1;
    seed = std::min(seed, kModulus - 1);
    const auto random = [&] { return seed = seed * kFactor % kModulus; };
    for (auto& channel : gradient) {
      for (int i = 0; i < kSvgSize; ++i) {
        double g[2];
        for (double& v : g) v = static_cast<double>(random() % (2 * kSvgSize) - kSvgSize) / kSvgSize;
        const double length = std::sqrt(g[0] * g[0] + g[1] * g[1]);
        channel[static_cast<size_t>(i)] = {static_cast<float>(g[0] / length),
                                           static_cast<float>(g[1] / length)};
      }
    }
    for (int i = 0; i < kSvgSize; ++i) selector[static_cast<size_t>(i)] = i;
    for (int i = kSvgSize - 1; i > 0; --i) {
      std::swap(selector[static_cast<size_t>(i)], selector[static_cast<size_t>(random() % kSvgSize)]);
    }
    for (size_t i = 0; i < kSvgSize + 2; ++i) {
      selector[kSvgSize + i] = selector[i];
      for (auto& channel : gradient) channel[kSvgSize + i] = channel[i];
    }
  }
};

// Base frequencies, adjusted where the frame must tile, and where lattice coordinates wrap.
struct SvgAxis {
  double frequency = 0;
  double width = 0, wrap = 0;  // of the first octave; 0: no stitching

  SvgAxis(double base, bool stitch, int origin, int size) : frequency(base) {
    if (!stitch || size == 0) return;
    if (base != 0) {
      const double low = std::floor(size * base) / size, high = std::ceil(size * base) / size;
      frequency = base / low < high / base ? low : high;
    }
    width = std::floor(size * frequency + 0.5);
    wrap = std::trunc(origin * frequency + kSvgOrigin + width);
  }
  struct Place {
    int low, high;  // lattice coordinates, modulo 256
    float fraction;
  };
  Place At(double coordinate, int octave) const {
    const double scale = std::ldexp(1.0, octave);
    const double t = coordinate * frequency * scale + kSvgOrigin;
    const double whole = std::trunc(t);
    // Octave by octave: width doubles, wrap becomes 2 wrap - 4096.
    const double octave_width = width * scale, octave_wrap = (wrap - kSvgOrigin) * scale + kSvgOrigin;
    const auto cell = [&](double c) {
      if (width > 0 && c >= octave_wrap) c -= octave_width;
      return static_cast<int>(std::fmod(std::fmod(c, kSvgSize) + kSvgSize, kSvgSize));
    };
    return {cell(whole), cell(whole + 1), static_cast<float>(t - whole)};
  }
};

// Throws Error naming the parameter.
void CheckSvg(const std::string& op, const SvgTurbulenceParams& params);
// The modifiers that both ways to a turbulence have, and the parameters that they make.
std::vector<ParamInfo> SvgModifiers();
SvgTurbulenceParams SvgArguments(const Arguments& arguments, bool fractal_noise);

// Rows of positions straight to a turbulence.
struct SvgPoints {
  int count = 0;                           // arrays hold whole vectors
  const float *x = nullptr, *y = nullptr;  // user space
  const SvgAxis* axis = nullptr;           // two
  const SvgLattice* lattice = nullptr;
  int octaves = 1;
  bool fractal_noise = false;
  int channels = 1;  // up to four, which may be null
  float* out[4] = {};
};
using SvgEvaluate = void (*)(const SvgPoints&);
SvgEvaluate FindSvgPoints();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_SVG_H_
