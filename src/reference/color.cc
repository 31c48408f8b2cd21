// The oracle of the colour operations, from the stepwise formulas of doc/maths/color.md, in double.
#include "tessera/ops/color.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <typeinfo>

#include "reference/reference.h"

namespace tessera::reference {

// color_remap.cc
void EvaluateContrastRemap(const Call& call);

namespace {

constexpr double kPi = 3.14159265358979323846;

template <typename P>
const P& Params(const Call& call) {
  return *std::any_cast<P>(&call.parameters);
}

// Copies all channels of input 0, then lets f(in, out, scale) change one pixel: pointers to its channels;
// alpha is in[alpha] with alpha = the input's index or -1. The scale of a copied channel is 0: it must be
// exact.
template <typename F>
void EachPixel(const Call& call, const F& f) {
  const ImageD& in = call.in[0];
  const int n = std::min(in.channels, call.out.channels);
  std::vector<double> from(static_cast<size_t>(in.channels)), to(static_cast<size_t>(call.out.channels)),
      scale;
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      for (int c = 0; c < in.channels; ++c) from[static_cast<size_t>(c)] = in.at(x, y, c);
      std::copy_n(from.begin(), n, to.begin());
      scale.assign(to.size(), 0.0);
      f(from.data(), to.data(), scale.data());
      for (int c = 0; c < call.out.channels; ++c) {
        call.out.at(x, y, c) = to[static_cast<size_t>(c)];
        if (call.scale != nullptr) call.scale->at(x, y, c) = scale[static_cast<size_t>(c)];
      }
    }
  }
}

double LargestColor(const double* p) { return std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])}); }

// Weights divided by their sum, and the sum of their magnitudes, which is 1 unless some are negative.
double Weights(const LuminanceWeights& given, double w[3]) {
  const double sum = given.r + given.g + given.b;
  w[0] = given.r / sum, w[1] = given.g / sum, w[2] = given.b / sum;
  return std::fabs(w[0]) + std::fabs(w[1]) + std::fabs(w[2]);
}

// w v, where a weight of 0 takes no part, be v what it may.
double Weighted(double w, double v) { return w == 0 ? 0 : w * v; }

// Multiplies a column by a 3x3 matrix in place.
void Transform(const double m[3][3], double v[3]) {
  double r[3];
  for (int i = 0; i < 3; ++i) r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  std::copy_n(r, 3, v);
}

void SaturateReference(const Call& call) {
  const auto& p = Params<SaturateParams>(call);
  double w[3];
  const double terms = Weights(p.weights, w);
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    const double grey = Weighted(w[0], in[0]) + Weighted(w[1], in[1]) + Weighted(w[2], in[2]);
    for (int i = 0; i < 3; ++i) {
      out[i] = Weighted(1 - p.saturation, grey) + Weighted(p.saturation, in[i]);
      scale[i] = LargestColor(in) * std::max(1.0, std::fabs(p.saturation)) * terms;
    }
  });
}

// As Filter Effects 1 prints the three matrices of hueRotate.
void CssHueReference(const Call& call, double degrees) {
  const double t = std::fmod(degrees, 360.0) * kPi / 180, c = std::cos(t), s = std::sin(t);
  const double m[3][3] = {
      {0.213 + c * 0.787 - s * 0.213, 0.715 - c * 0.715 - s * 0.715, 0.072 - c * 0.072 + s * 0.928},
      {0.213 - c * 0.213 + s * 0.143, 0.715 + c * 0.285 + s * 0.140, 0.072 - c * 0.072 - s * 0.283},
      {0.213 - c * 0.213 - s * 0.787, 0.715 - c * 0.715 + s * 0.715, 0.072 + c * 0.928 + s * 0.072}};
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3; ++i) {
      const double terms[] = {m[i][0] * in[0], m[i][1] * in[1], m[i][2] * in[2]};
      out[i] = terms[0] + terms[1] + terms[2];
      scale[i] = std::fabs(terms[0]) + std::fabs(terms[1]) + std::fabs(terms[2]);
    }
  });
}

// The seed's construction, corrected: turn grey to +z, shear planes of equal luminance level, rotate about z,
// undo.
void HueReference(const Call& call) {
  const auto& p = Params<HueParams>(call);
  if (p.preserve == HuePreserve::kCss) return CssHueReference(call, p.degrees);
  double w[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  const double terms = p.preserve == HuePreserve::kLuminance ? Weights(p.weights, w) : 1;
  const double a = std::sqrt(0.5), b = -std::sqrt(1.0 / 3), c = std::sqrt(2.0 / 3);
  const double rx[3][3] = {{1, 0, 0}, {0, a, -a}, {0, a, a}}, ry[3][3] = {{c, 0, b}, {0, 1, 0}, {-b, 0, c}};
  const double rx_back[3][3] = {{1, 0, 0}, {0, a, a}, {0, -a, a}},
               ry_back[3][3] = {{c, 0, -b}, {0, 1, 0}, {b, 0, c}};
  double l[3] = {w[0], w[1], w[2]};
  Transform(rx, l), Transform(ry, l);
  const double zx = l[0] / l[2], zy = l[1] / l[2];
  const double t = std::fmod(p.degrees, 360.0) * kPi / 180;
  const double sin = std::sin(t), cos = std::cos(t);
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    double v[3] = {in[0], in[1], in[2]};
    Transform(rx, v), Transform(ry, v);
    v[2] += zx * v[0] + zy * v[1];
    const double x = cos * v[0] - sin * v[1], y = sin * v[0] + cos * v[1];
    v[0] = x, v[1] = y;
    v[2] -= zx * v[0] + zy * v[1];
    Transform(ry_back, v), Transform(rx_back, v);
    for (int i = 0; i < 3; ++i) out[i] = v[i], scale[i] = LargestColor(in) * terms;
  });
}

void LuminanceReference(const Call& call) {
  double w[3];
  Weights(Params<LuminanceParams>(call).weights, w);
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3; ++i) {
      const double terms[] = {Weighted(w[0], in[0]), Weighted(w[1], in[1]), Weighted(w[2], in[2])};
      out[i] = terms[0] + terms[1] + terms[2];
      scale[i] = std::fabs(terms[0]) + std::fabs(terms[1]) + std::fabs(terms[2]);
    }
  });
}

void CmyReference(const Call& call) {
  EachPixel(call, [](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3; ++i) out[i] = 1 - in[i], scale[i] = 1 + std::fabs(in[i]);
  });
}

void CmykReference(const Call& call) {
  EachPixel(call, [](const double* in, double* out, double* scale) {
    const double c = 1 - in[0], m = 1 - in[1], y = 1 - in[2];
    const double k = std::fmin(std::fmin(c, m), y);
    out[0] = c - k, out[1] = m - k, out[2] = y - k, out[3] = k;
    std::fill_n(scale, 4, std::max(1.0, LargestColor(in)));
  });
}

void YiqReference(const Call& call) {
  const double m[3][3] = {{0.299, 0.587, 0.114}, {0.596, -0.275, -0.321}, {0.212, -0.523, 0.311}};
  const bool inverse = Params<YiqParams>(call).inverse;
  // Gauss-Jordan with pivoting; identity on the right.
  double g[3][6] = {};
  for (int i = 0; i < 3; ++i) {
    std::copy_n(m[i], 3, g[i]);
    g[i][3 + i] = 1;
  }
  for (int k = 0; k < 3; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 3; ++i) pivot = std::fabs(g[i][k]) > std::fabs(g[pivot][k]) ? i : pivot;
    std::swap_ranges(g[k], g[k] + 6, g[pivot]);
    const double d = g[k][k];
    for (double& v : g[k]) v /= d;
    for (int i = 0; i < 3; ++i) {
      const double f = g[i][k];
      for (int j = 0; i != k && j < 6; ++j) g[i][j] -= f * g[k][j];
    }
  }
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3; ++i) {
      const double* const row = inverse ? g[i] + 3 : m[i];
      out[i] = row[0] * in[0] + row[1] * in[1] + row[2] * in[2];
      scale[i] = std::fabs(row[0] * in[0]) + std::fabs(row[1] * in[1]) + std::fabs(row[2] * in[2]);
    }
  });
}

void BrightnessReference(const Call& call) {
  const double x = Params<BrightnessParams>(call).x;
  EachPixel(call, [x](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3; ++i) out[i] = x * in[i], scale[i] = std::fabs(x * in[i]);
  });
}

void ContrastReference(const Call& call) {
  if (call.parameters.type() == typeid(ContrastRemapParams)) return EvaluateContrastRemap(call);
  const auto& p = Params<ContrastParams>(call);
  const double pivot = p.pivot ? *p.pivot : call.in[1].samples[0];
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3 && std::isfinite(pivot); ++i) {
      out[i] = (1 - p.x) * pivot + p.x * in[i];
      scale[i] = std::fabs((1 - p.x) * pivot) + std::fabs(p.x * in[i]);
    }
  });
}

// Of the pivot's image its one pixel.
Roi PivotRoi(const std::any&, int input, const Roi& out) { return input == 1 ? Roi{0, 0, 1, 1} : out; }

void InterpolateReference(const Call& call) {
  const double x = Params<InterpolateParams>(call).x;
  const ImageD &a = call.in[0], &b = call.in[1];
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    const double first = x == 1 ? 0 : (1 - x) * a.samples[i], second = x == 0 ? 0 : x * b.samples[i];
    call.out.samples[i] = x == 0 ? a.samples[i] : x == 1 ? b.samples[i] : first + second;
    if (call.scale != nullptr) call.scale->samples[i] = std::fabs(first) + std::fabs(second);
  }
}

// Whether alpha is 0 is a decision: where it may be off by its own size, colours may be `jump(c)` apart.
template <typename F>
void MarkZeroAlpha(const Call& call, int alpha, const F& jump) {
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1 && alpha >= 0 && call.undecided != nullptr; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const double off = call.Tolerance(0, x, y, alpha);
      if (!(off > 0) || std::fabs(call.in[0].at(x, y, alpha)) > off) continue;
      for (int c = 0; c < std::min(3, call.out.channels); ++c) call.Undecided(x, y, c, jump(x, y, c));
    }
  }
}
double AnyJump(int, int, int) { return kUnknownJump; }

void PremultiplyReference(const Call& call) {
  const int alpha = call.in_specs[0].alpha;
  EachPixel(call, [alpha](const double* in, double* out, double* scale) {
    for (int i = 0; i < 3 && alpha >= 0; ++i) out[i] = in[i] * in[alpha], scale[i] = std::fabs(out[i]);
  });
}

// Where alpha is 0 the colours stay: u(p) = p / a there is p itself, and this is its inverse.
void RepremultiplyReference(const Call& call) {
  const int alpha = call.in_specs[0].alpha;
  EachPixel(call, [alpha](const double* in, double* out, double* scale) {
    const double factor = alpha < 0 || in[alpha] == 0 ? 1 : in[alpha];
    for (int i = 0; i < 3; ++i) out[i] = in[i] * factor, scale[i] = std::fabs(out[i]);
  });
  MarkZeroAlpha(call, alpha, [&](int x, int y, int c) { return std::fabs(call.in[0].at(x, y, c)); });
}

void UnpremultiplyReference(const Call& call) {
  const int alpha = call.in_specs[0].alpha;
  EachPixel(call, [alpha](const double* in, double* out, double* scale) {
    if (alpha < 0 || in[alpha] == 0) return;
    for (int i = 0; i < 3; ++i) out[i] = in[i] / in[alpha], scale[i] = std::fabs(out[i]);
  });
  MarkZeroAlpha(call, alpha, AnyJump);
}

// Row vectors: result[j] = sum over i of pixel[i] M[i][j] + bias[j].
void ColorMatrixReference(const Call& call) {
  const auto& p = Params<ColorMatrixParams>(call);
  const int alpha = call.in_specs[0].alpha >= 3 ? call.in_specs[0].alpha : -1;
  const int n = p.values.size() >= 16 ? 4 : 3;
  const auto entry = [&](int i, int j) {
    return p.values[static_cast<size_t>(p.transpose ? j * n + i : i * n + j)];
  };
  EachPixel(call, [&](const double* in, double* out, double* scale) {
    const double a = alpha >= 0 ? in[alpha] : 0;
    const double divisor = p.unpremult && alpha >= 0 && a != 0 ? a : 1;
    const double pixel[4] = {in[0] / divisor, in[1] / divisor, in[2] / divisor, a};
    for (int j = 0; j < n; ++j) {
      const int to = j < 3 ? j : alpha;
      if (to < 0) continue;
      const bool biased = p.values.size() > static_cast<size_t>(n * n);
      double sum = biased ? p.values[static_cast<size_t>(n * n + j)] : 0, magnitude = std::fabs(sum);
      for (int i = 0; i < n; ++i) {
        if (i == 3 && alpha < 0) continue;
        const double term = Weighted(entry(i, j), pixel[i]);
        sum += term;
        magnitude += std::fabs(term);
      }
      const double factor = j < 3 ? divisor : 1;
      out[to] = sum * factor;
      scale[to] = magnitude * std::fabs(factor);
    }
  });
  if (p.unpremult) MarkZeroAlpha(call, alpha, AnyJump);
}

}  // namespace

std::vector<Entry> ColorEntries();
std::vector<Entry> ColorEntries() {
  return {{"saturate", SaturateReference},
          {"hue", HueReference},
          {"luminance", LuminanceReference},
          {"cmy", CmyReference},
          {"cmyk", CmykReference},
          {"yiq", YiqReference},
          {"brightness", BrightnessReference},
          {"contrast", ContrastReference, PivotRoi},
          {"interp", InterpolateReference},
          {"premult", PremultiplyReference},
          {"repremult", RepremultiplyReference},
          {"unpremult", UnpremultiplyReference},
          {"ccmatrix", ColorMatrixReference}};
}

}  // namespace tessera::reference
