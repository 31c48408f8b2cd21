// Reference of compositing by choice: tests, stencils, dissolves, depth merges, decals.
#include "tessera/ops/composite.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <string>
#include <vector>

#include "reference/composite_pixels.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

bool Passes(Comparison test, double a, double b) {
  switch (test) {
    case Comparison::kNever:
      return false;
    case Comparison::kLess:
      return a < b;
    case Comparison::kEqual:
      return a == b;
    case Comparison::kLessOrEqual:
      return a <= b;
    case Comparison::kGreater:
      return a > b;
    case Comparison::kNotEqual:
      return a != b;
    case Comparison::kGreaterOrEqual:
      return a >= b;
    case Comparison::kAlways:
      break;
  }
  return true;
}

void EvaluateAlphaTest(const Call& call) {
  const auto& p = std::any_cast<const AlphaTestParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const bool keep = Passes(p.test, call.in[1].at(x, y, 0), p.reference);
    return Rounded(keep ? call.in[0].at(x, y, c) : 0);
  });
}

// Squeezed depths are compared as the floats that they become.
void EvaluateDepthTest(const Call& call) {
  const auto& p = std::any_cast<const DepthTestParams&>(call.parameters);
  const int depth = std::stoi(p.depth);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    double z = call.in[2].at(x, y, 0);
    if (p.scale != 1 || p.bias != 0) {
      const auto product = static_cast<float>(z * p.scale);
      z = static_cast<float>(double{product} + p.bias);
    }
    const double stored = call.in[3].at(x, y, 0);
    const bool pass = Passes(p.test, z, stored) || (std::isnan(stored) && !std::isnan(z));
    return Rounded(!pass ? call.in[1].at(x, y, c) : c == depth ? z : call.in[0].at(x, y, c));
  });
}

int StencilCode(double v) { return static_cast<int>(std::nearbyint(255 * Limited(v, 0, 1))); }

int Act(StencilAction action, int code, int reference) {
  switch (action) {
    case StencilAction::kKeep:
      return code;
    case StencilAction::kZero:
      return 0;
    case StencilAction::kReplace:
      return reference;
    case StencilAction::kIncrement:
      return std::min(code + 1, 255);
    case StencilAction::kDecrement:
      return std::max(code - 1, 0);
    case StencilAction::kInvert:
      return 255 - code;
    case StencilAction::kIncrementWrap:
      return (code + 1) % 256;
    case StencilAction::kDecrementWrap:
      break;
  }
  return (code + 255) % 256;
}

void EvaluateStencil(const Call& call) {
  const auto& p = std::any_cast<const StencilParams&>(call.parameters);
  const bool update = call.in.size() == 1;
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const int code = StencilCode(call.in[update ? 0 : 2].at(x, y, 0));
    const bool pass = Passes(p.test, p.reference & p.mask, code & p.mask);
    if (!update) return Rounded(call.in[pass ? 0 : 1].at(x, y, c));
    const int next = Act(pass ? p.on_pass : p.on_fail, code, p.reference);
    return Rounded(((code & ~p.write_mask) | (next & p.write_mask)) / 255.0);
  });
}

void EvaluateDissolve(const Call& call) {
  const double t = std::any_cast<const DissolveParams&>(call.parameters).t;
  ForEachSample(call, [&](int x, int y, int c) {
    return Rounded(call.in[call.in[2].at(x, y, 0) < t ? 1 : 0].at(x, y, c));
  });
}

// The Bayer matrix by its recursion: M(2n) is 4 M(n) + [0 2; 3 1], here with the smallest squares deciding
// most.
double Ordered(int x, int y) {
  constexpr int kFour[2][2] = {{0, 2}, {3, 1}};
  int rank = 0;
  for (int bit = 0; bit < 4; ++bit) rank = 4 * rank + kFour[(y >> bit) & 1][(x >> bit) & 1];
  return rank / 256.0;
}
// The hash of the noise lattices, in plain integers.
double Scattered(int x, int y, uint32_t seed) {
  uint32_t h =
      static_cast<uint32_t>(x) * 0x9e3779b1u ^ static_cast<uint32_t>(y) * 0x85ebca77u ^ seed * 0xc2b2ae3du;
  h *= 0x2c1b3c6du;
  h = (h ^ (h >> 15)) * 0x297a2d39u;
  return std::ldexp(static_cast<double>(h >> 8), -24);
}
void EvaluateThresholds(const Call& call) {
  const auto& p = std::any_cast<const ThresholdsParams&>(call.parameters);
  ForEachSample(
      call, [&](int x, int y, int) { return Rounded(p.ordered ? Ordered(x, y) : Scattered(x, y, p.seed)); });
}

void EvaluateReveal(const Call& call) {
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double a = call.in[0].at(x, y, c), b = call.in[1].at(x, y, c), m = call.in[2].at(x, y, 0);
    const double value = m == 0 ? a : m == 1 ? b : a + m * (b - a);
    return {value, std::fabs(a) + std::fabs(m) * (std::fabs(a) + std::fabs(b))};
  });
}

void EvaluateZComposite(const Call& call) {
  const auto& params = std::any_cast<const ZCompositeParams&>(call.parameters);
  const int depth_channel = std::stoi(params.depth);
  const size_t n = call.in.size() / 3;
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    std::vector<size_t> order(n);
    for (size_t k = 0; k < n; ++k) order[k] = k;
    const auto depth = [&](size_t k) { return call.in[2 * n + k].at(x, y, 0); };
    std::ranges::stable_sort(order, [&](size_t a, size_t b) {
      return depth(a) < depth(b) || (!std::isnan(depth(a)) && std::isnan(depth(b)));
    });
    if (!params.over) return Rounded(call.in[order[0]].at(x, y, c));
    if (c == depth_channel) {
      for (const size_t k : order) {
        if (!(call.in[n + k].at(x, y, 0) <= 0)) return Rounded(call.in[k].at(x, y, c));
      }
      return Rounded(call.in[order[n - 1]].at(x, y, c));
    }
    double sum = 0, size = 0;
    for (size_t i = n; i-- > 0;) {
      const double rest = 1 - Limited(call.in[n + order[i]].at(x, y, 0), 0, 1),
                   v = call.in[order[i]].at(x, y, c);
      sum = v + rest * sum;
      size = std::fabs(v) + rest * size;
    }
    return {sum, static_cast<double>(n) * size};
  });
}

void EvaluateDepthComplexity(const Call& call) {
  const auto& params = std::any_cast<const DepthComplexityParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int) {
    return Rounded(static_cast<double>(
        std::ranges::count_if(call.in, [&](const ImageD& image) { return image.at(x, y, 0) < params.far; })));
  });
}

// By painting: decals from the last to the first, each where it passes replacing what was painted on the
// base.
void EvaluateDecals(const Call& call) {
  const auto& params = std::any_cast<const DecalParams&>(call.parameters);
  const int depth = DepthOf(call.out_spec);
  const size_t n = call.in.size() / 2 - 1;
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double base = call.in[0].at(x, y, c);
    Sample result = Rounded(base);
    if (!(call.in[1].at(x, y, 0) > 0) || c == depth) return result;
    for (size_t k = n; k-- > 0;) {
      const double alpha = call.in[2 + n + k].at(x, y, 0), v = call.in[2 + k].at(x, y, c);
      if (!(alpha > params.threshold)) continue;
      const double rest = (1 - Limited(alpha, 0, 1)) * base;
      result = {v + rest, std::fabs(v) + std::fabs(rest)};
    }
    return result;
  });
}

}  // namespace

std::vector<Entry> CompositeEntries() {
  return {
      {"alphatest", EvaluateAlphaTest},
      {"depthtest", EvaluateDepthTest},
      {"stencil", EvaluateStencil},
      {"dissolve", EvaluateDissolve},
      {"thresholds", EvaluateThresholds},
      {"reveal", EvaluateReveal},
      {"zcomposite", EvaluateZComposite},
      {"decals", EvaluateDecals},
      {"depthcomplexity", EvaluateDepthComplexity},
  };
}

}  // namespace tessera::reference
