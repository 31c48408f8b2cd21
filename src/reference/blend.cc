// Reference of over and of blending: Porter-Duff, GL equations, SVG and CSS modes from their definitions.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/composite_pixels.h"
#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/composite.h"

namespace tessera::reference {
namespace {

// One pixel of two images as an operation sees it.
struct PixelPair {
  double s = 0, d = 0, as = 1, ad = 1;
  bool alpha = false;
};

// Alpha of input k at a pixel: its own, or, where the images come with alphas beside them, that.
double AlphaAt(const Call& call, size_t k, int x, int y) {
  if (call.in.size() > 2) return call.in[2 + k].at(x, y, 0);
  const int alpha = call.in_specs[k].alpha;
  return alpha < 0 ? 1 : call.in[k].at(x, y, alpha);
}

// A sample of both images; of alpha, 1 where an image has none.
PixelPair PairAt(const Call& call, int x, int y, int c) {
  const double as = AlphaAt(call, 0, x, y), ad = AlphaAt(call, 1, x, y);
  if (c == call.out_spec.alpha) return {as, ad, as, ad, true};
  return {call.in[0].at(x, y, c), call.in[1].at(x, y, c), as, ad, false};
}

// f(PixelPair) -> Sample for each sample but depths, which are the front image's.
template <class F>
void ForEachPair(const Call& call, int depth, F f) {
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const PixelPair p = PairAt(call, x, y, c);
    if (c == depth) return Rounded(FrontDepth(p.s, p.d, p.as));
    return f(p);
  });
}

Sample WeightedPair(double fs, double s, double fd, double d) {
  const double x = fs == 0 ? 0 : fs * s, y = fd == 0 ? 0 : fd * d;
  return {x + y, std::fabs(x) + std::fabs(y)};
}

void EvaluateOver(const Call& call) {
  ForEachPair(call, DepthOf(call.out_spec), [](const PixelPair& p) -> Sample {
    const double rest = (1 - Limited(p.as, 0, 1)) * p.d;
    return {p.s + rest, std::fabs(p.s) + std::fabs(rest)};
  });
}

void EvaluateZOver(const Call& call) {
  const auto& params = std::any_cast<const ZOverParams&>(call.parameters);
  const int depth = std::stoi(params.depth);
  const auto depth_of = [&](size_t k, int x, int y) {
    const double z = call.in[4 + k].at(x, y, 0);
    return params.zero_is_infinite && z == 0 ? double{std::numeric_limits<float>::max()} : z;
  };
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const size_t front = depth_of(0, x, y) <= depth_of(1, x, y) ? 0 : 1, back = 1 - front;
    const double alpha = call.in[2 + front].at(x, y, 0);
    const double f = call.in[front].at(x, y, c), b = call.in[back].at(x, y, c);
    if (c == depth) return Rounded(FrontDepth(f, b, alpha));
    const double rest = (1 - Limited(alpha, 0, 1)) * b;
    return {f + rest, std::fabs(f) + std::fabs(rest)};
  });
}

// Factors of GL.
double Factor(BlendFactor factor, const PixelPair& p, double constant, double constant_alpha) {
  switch (factor) {
    case BlendFactor::kZero:
      return 0;
    case BlendFactor::kSourceColor:
      return p.s;
    case BlendFactor::kOneMinusSourceColor:
      return 1 - p.s;
    case BlendFactor::kDestinationColor:
      return p.d;
    case BlendFactor::kOneMinusDestinationColor:
      return 1 - p.d;
    case BlendFactor::kSourceAlpha:
      return p.as;
    case BlendFactor::kOneMinusSourceAlpha:
      return 1 - p.as;
    case BlendFactor::kDestinationAlpha:
      return p.ad;
    case BlendFactor::kOneMinusDestinationAlpha:
      return 1 - p.ad;
    case BlendFactor::kSourceAlphaSaturate:
      return p.alpha ? 1 : std::fmin(p.as, 1 - p.ad);
    case BlendFactor::kConstantColor:
      return constant;
    case BlendFactor::kOneMinusConstantColor:
      return 1 - constant;
    case BlendFactor::kConstantAlpha:
      return constant_alpha;
    case BlendFactor::kOneMinusConstantAlpha:
      return 1 - constant_alpha;
    default:
      return 1;
  }
}

// add, subtract, revsubtract with whatever factors.
Sample Equation(const BlendParams& b, const PixelPair& p, double constant) {
  const auto given = [](BlendFactor f, BlendFactor otherwise) {
    return f == BlendFactor::kDefault ? otherwise : f;
  };
  BlendFactor fs = given(b.source, BlendFactor::kOne), fd = given(b.destination, BlendFactor::kOne);
  if (p.alpha) fs = given(b.source_alpha, fs), fd = given(b.destination_alpha, fd);
  const double ca = static_cast<float>(b.constant[3]);
  const Sample x = WeightedPair(Factor(fs, p, constant, ca), p.s, 0, 0),
               y = WeightedPair(Factor(fd, p, constant, ca), p.d, 0, 0);
  const double sum = b.mode == BlendMode::kAdd        ? x.first + y.first
                     : b.mode == BlendMode::kSubtract ? x.first - y.first
                                                      : y.first - x.first;
  return {sum, x.second + y.second};
}

// B(cb, cs) of the separable modes, and the magnitude of its terms.
Sample Separable(BlendMode mode, double cb, double cs) {
  const double ab = std::fabs(cb), as = std::fabs(cs);
  switch (mode) {
    case BlendMode::kMultiply:
      return Rounded(cb * cs);
    case BlendMode::kScreen:
      return {cb + cs - cb * cs, ab + as + ab * as};
    case BlendMode::kDarken:
      return {std::fmin(cb, cs), ab + as};
    case BlendMode::kLighten:
      return {std::fmax(cb, cs), ab + as};
    case BlendMode::kColorDodge:
      if (cb <= 0) return {0, 1};
      return {cs >= 1 ? 1 : std::fmin(1, cb / (1 - cs)), 1};
    case BlendMode::kColorBurn:
      if (cb >= 1) return {1, 1};
      return {cs <= 0 ? 0 : 1 - std::fmin(1, (1 - cb) / cs), 2};
    case BlendMode::kHardLight:
      if (2 * cs <= 1) return Rounded(2 * cs * cb);
      return {1 - 2 * (1 - cb) * (1 - cs), 1 + 2 * (1 + ab) * (1 + as)};
    case BlendMode::kSoftLight: {
      if (2 * cs <= 1) return {cb - (1 - 2 * cs) * cb * (1 - cb), ab + (1 + 2 * as) * ab * (1 + ab)};
      const double curve = cb <= 0.25 ? ((16 * cb - 12) * cb + 4) * cb : std::sqrt(cb);
      const double size = cb <= 0.25 ? ((16 * ab + 12) * ab + 4) * ab : std::sqrt(cb);
      return {cb + (2 * cs - 1) * (curve - cb), ab + (2 * as + 1) * (size + ab)};
    }
    case BlendMode::kDifference:
      return {std::fabs(cb - cs), ab + as};
    default:  // exclusion
      return {cb + cs - 2 * cb * cs, ab + as + 2 * ab * as};
  }
}

Sample Mixed(const PixelPair& p, const Sample& term) {
  const double s = (1 - p.ad) * p.s, d = (1 - p.as) * p.d;
  return {term.first + s + d, 2 * (term.second + std::fabs(s) + std::fabs(d))};
}

using Rgb = std::array<double, 3>;
double Lum(const Rgb& c) { return 0.3 * c[0] + 0.59 * c[1] + 0.11 * c[2]; }
double Low(const Rgb& c) { return std::min({c[0], c[1], c[2]}); }
double High(const Rgb& c) { return std::max({c[0], c[1], c[2]}); }
double Sat(const Rgb& c) { return High(c) - Low(c); }

Rgb ClipColor(Rgb c) {
  const double l = Lum(c), n = Low(c), x = High(c);
  for (double& v : c) {
    if (n < 0) v = l + (v - l) * l / (l - n);
  }
  for (double& v : c) {
    if (x > 1) v = l + (v - l) * (1 - l) / (x - l);
  }
  return c;
}
Rgb SetLum(Rgb c, double l) {
  const double d = l - Lum(c);
  for (double& v : c) v += d;
  return ClipColor(c);
}
Rgb SetSat(Rgb c, double s) {
  const double low = Low(c), range = Sat(c);
  for (double& v : c) v = range > 0 ? (v - low) * s / range : 0;
  return c;
}
Rgb NonSeparable(BlendMode mode, const Rgb& cb, const Rgb& cs) {
  switch (mode) {
    case BlendMode::kHue:
      return SetLum(SetSat(cs, Sat(cb)), Lum(cb));
    case BlendMode::kSaturation:
      return SetLum(SetSat(cb, Sat(cs)), Lum(cb));
    case BlendMode::kColor:
      return SetLum(cs, Lum(cb));
    default:
      return SetLum(cb, Lum(cs));
  }
}

void EvaluateNonSeparable(const Call& call, BlendMode mode) {
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const double s = call.in[0].at(x, y, c);
    if (c >= 3 && c != call.out_spec.alpha) return Rounded(s);
    const PixelPair p = PairAt(call, x, y, c);
    const double as = p.as, ad = p.ad;
    const bool both = as > 0 && ad > 0;
    const double full = both ? as * ad : 0;
    if (p.alpha) return Mixed({as, ad, as, ad, true}, {full, full});
    if (!both) return Mixed(p, {0, 0});
    Rgb cs, cb;
    for (int i = 0; i < 3; ++i) {
      cs[static_cast<size_t>(i)] = Limited(call.in[0].at(x, y, i) / as, 0, 1);
      cb[static_cast<size_t>(i)] = Limited(call.in[1].at(x, y, i) / ad, 0, 1);
    }
    return Mixed(p, {full * NonSeparable(mode, cb, cs)[static_cast<size_t>(c)], 4 * full});
  });
}

Sample BlendOne(const BlendParams& b, const PixelPair& p, double constant) {
  switch (b.mode) {
    case BlendMode::kClear:
      return Rounded(0);
    case BlendMode::kOver:
      return WeightedPair(1, p.s, 1 - p.as, p.d);
    case BlendMode::kIn:
      return WeightedPair(p.ad, p.s, 0, 0);
    case BlendMode::kOut:
      return WeightedPair(1 - p.ad, p.s, 0, 0);
    case BlendMode::kAtop:
      return WeightedPair(p.ad, p.s, 1 - p.as, p.d);
    case BlendMode::kXor:
      return WeightedPair(1 - p.ad, p.s, 1 - p.as, p.d);
    case BlendMode::kPlus:
      return WeightedPair(1, p.s, 1, p.d);
    case BlendMode::kMin:
      return Rounded(std::fmin(p.s, p.d));
    case BlendMode::kMax:
      return Rounded(std::fmax(p.s, p.d));
    case BlendMode::kModulate:
      return Rounded(p.s * p.d);
    case BlendMode::kConstant:
      return WeightedPair(constant, p.s, 1 - constant, p.d);
    case BlendMode::kStraightOver:
      return WeightedPair(p.alpha ? 1 : p.as, p.s, 1 - p.as, p.d);
    case BlendMode::kPlusLighter:
      return {std::fmin(1, p.s + p.d), std::fabs(p.s) + std::fabs(p.d)};
    case BlendMode::kAdd:
    case BlendMode::kSubtract:
    case BlendMode::kReverseSubtract:
      return Equation(b, p, constant);
    default:
      break;
  }
  if (!(p.as > 0 && p.ad > 0)) return Mixed(p, {0, 0});
  const double full = p.as * p.ad;
  if (p.alpha) return Mixed(p, {full, 8 * full});
  const Sample term = Separable(b.mode, p.d / p.ad, p.s / p.as);
  return Mixed(p, {full * term.first, full * term.second});
}

void EvaluateBlend(const Call& call) {
  const auto& b = std::any_cast<const BlendParams&>(call.parameters);
  const int depth = DepthOf(call.out_spec);
  if (b.mode >= BlendMode::kHue && b.mode <= BlendMode::kLuminosity)
    return EvaluateNonSeparable(call, b.mode);
  ForEachSample(call, [&](int x, int y, int c) -> Sample {
    const PixelPair p = PairAt(call, x, y, c);
    if (c == depth) return Rounded(FrontDepth(p.s, p.d, p.as));
    return BlendOne(b, p, static_cast<float>(b.constant[static_cast<size_t>(p.alpha ? 3 : std::min(c, 2))]));
  });
}

}  // namespace

std::vector<Entry> BlendEntries() {
  return {{"over", EvaluateOver}, {"zover", EvaluateZOver}, {"blend", EvaluateBlend}};
}

}  // namespace tessera::reference
