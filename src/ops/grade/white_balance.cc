// White balance: the white of a temperature and tint carried over to another by one matrix.
#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "model/black_body.h"
#include "ops/grade/grade_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"

namespace tessera {
namespace ops {
namespace {

constexpr double kColdest = 1000, kHottest = 25000, kMostTint = 150, kTintUnit = 1.0 / 3000;

struct Uv {
  double u = 0, v = 0;
};
using Matrix = std::array<std::array<double, 3>, 3>;
using Column = std::array<double, 3>;

Uv UvOf(double x, double y) { return {4 * x / (-2 * x + 12 * y + 3), 6 * y / (-2 * x + 12 * y + 3)}; }

Uv Planck(double t) {
  const auto [u, v] = model::BlackBodyUv(t);
  return {u, v};
}

// The CIE's daylight after Judd et al. 1964.
Uv Daylight(double t) {
  const double x = t <= 7000 ? -4.6070e9 / (t * t * t) + 2.9678e6 / (t * t) + 0.09911e3 / t + 0.244063
                             : -2.0064e9 / (t * t * t) + 1.9018e6 / (t * t) + 0.24748e3 / t + 0.237040;
  return UvOf(x, -3 * x * x + 2.87 * x - 0.275);
}

Uv Locus(double t) {
  constexpr double kLamps = 4000, kDaylight = 5000;
  if (t <= kLamps) return Planck(t);
  if (t >= kDaylight) return Daylight(t);
  const double w = (t - kLamps) / (kDaylight - kLamps);
  const Uv a = Planck(t), b = Daylight(t);
  return {a.u + w * (b.u - a.u), a.v + w * (b.v - a.v)};
}

// X, Y, Z of that white, Y being 1.
Column White(double t, double tint) {
  Uv white = Locus(t);
  if (tint != 0) {
    constexpr double kStep = 1e-3;
    const Uv a = Locus(t * (1 - kStep)), b = Locus(t * (1 + kStep));
    const double du = b.u - a.u, dv = b.v - a.v, length = std::hypot(du, dv);
    // To the left of the way to hotter whites, which is where v grows: green.
    white.u += tint * kTintUnit * (-dv / length) * (du < 0 ? -1 : 1);
    white.v += tint * kTintUnit * (du / length) * (du < 0 ? -1 : 1);
  }
  const double d = 2 * white.u - 8 * white.v + 4, x = 3 * white.u / d, y = 2 * white.v / d;
  return {x / y, 1, (1 - x - y) / y};
}

Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix m{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) m[i][j] += a[i][k] * b[k][j];
    }
  }
  return m;
}
Column Through(const Matrix& m, const Column& v) {
  Column r{};
  for (size_t i = 0; i < 3; ++i) r[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return r;
}
Matrix Inverse(const Matrix& m) {
  Matrix r{};
  double determinant = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      r[j][i] = m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3];
    }
  }
  for (size_t j = 0; j < 3; ++j) determinant += m[0][j] * r[j][0];
  for (Column& row : r) {
    for (double& v : row) v /= determinant;
  }
  return r;
}

// XYZ of R, G, B with these chromaticities of red, green, blue and white.
Matrix XyzOf(const double (&xy)[4][2]) {
  Matrix m{};
  for (size_t k = 0; k < 3; ++k) {
    m[0][k] = xy[k][0] / xy[k][1], m[1][k] = 1, m[2][k] = (1 - xy[k][0] - xy[k][1]) / xy[k][1];
  }
  const Column scale = Through(Inverse(m), {xy[3][0] / xy[3][1], 1, (1 - xy[3][0] - xy[3][1]) / xy[3][1]});
  for (Column& row : m) {
    for (size_t k = 0; k < 3; ++k) row[k] *= scale[k];
  }
  return m;
}

Matrix XyzOf(Primaries primaries) {
  switch (primaries) {
    case Primaries::kRec2020:
      return XyzOf({{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}});
    case Primaries::kAp1:
      return XyzOf({{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}});
    default:
      return XyzOf({{0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, {0.3127, 0.3290}});
  }
}

void RequireTemperature(const char* what, double kelvin) {
  if (kelvin >= kColdest && kelvin <= kHottest) return;
  throw Error("whitebalance", std::string("found ") + what + base::NumberText(kelvin) + ", expected " +
                                  base::NumberText(kColdest) + " to " + base::NumberText(kHottest) +
                                  " kelvin");
}

std::array<double, 9> MatrixOf(const WhiteBalanceParams& p) {
  RequireTemperature("", p.kelvin);
  RequireTemperature("to=", p.to);
  if (!(std::fabs(p.tint) <= kMostTint)) {
    throw Error("whitebalance", "found tint=" + base::NumberText(p.tint) + ", expected -150 to 150");
  }
  constexpr Matrix kBradford = {
      {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
  const Column from = Through(kBradford, White(p.kelvin, p.tint)), to = Through(kBradford, White(p.to, 0));
  Matrix scale{};
  for (size_t i = 0; i < 3; ++i) scale[i][i] = to[i] / from[i];
  const Matrix xyz = XyzOf(p.primaries);
  const Matrix m =
      Product(Product(Inverse(xyz), Product(Inverse(kBradford), Product(scale, kBradford))), xyz);
  std::array<double, 9> values{};
  for (size_t i = 0; i < 9; ++i) values[i] = m[i / 3][i % 3];
  return values;
}

ParamInfo Kelvin(ParamInfo p) {
  p.min = kColdest, p.max = kHottest;
  return p;
}

}  // namespace

OpInfo WhiteBalanceInfo() {
  OpInfo info = MadeRow(
      "grade", "whitebalance", "White balance by the light's temperature and tint",
      "What is white in a light of KELVIN (2,856 a bulb, 5,500 the sun, 10,000 the shade) and tint becomes the white "
      "of to=, by default that of the primaries' D65; to=6000 is ACES'. Lower KELVIN than to= make the picture "
      "bluer, higher ones warmer. tint= says how much greener than its locus the light is, in 1/3000 of (u,v) of "
      "1960: positive ones take green away. Lamps up to 4,000 K are Planck's radiator, from 5,000 K it is the CIE's "
      "daylight, mixed between; whites are adapted by Bradford's matrix. For linear light of the named primaries. "
      "KELVIN of to= returns the input bit for bit. Sources: Judd et al. 1964; Krystek 1985; Lam 1985.");
  info.arguments = {Kelvin(NumberModifier("KELVIN", "", "temperature of the light that is to become white"))};
  info.modifiers = {NumberModifier("tint", "0", -kMostTint, kMostTint, "how much greener the light is"),
                    NumberModifier("to", "6504", kColdest, kHottest, "temperature that it becomes"),
                    ChoiceModifier("primaries", {"rec709", "rec2020", "ap1"}, "of the image: ap1 is ACEScg")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& primaries = a.Text("primaries");
    return WhiteBalance(in[0], {.kelvin = a.Number("KELVIN"),
                                .tint = a.Number("tint"),
                                .to = a.Number("to"),
                                .primaries = primaries == "ap1"       ? Primaries::kAp1
                                             : primaries == "rec2020" ? Primaries::kRec2020
                                                                      : Primaries::kRec709});
  };
  info.examples = {"3200", "7500 tint=10", "5000 to=6000 primaries=ap1", "4500 tint=-20 primaries=rec2020"};
  info.identity = "6504";
  return info;
}

}  // namespace ops

std::array<double, 9> WhiteBalanceMatrix(const WhiteBalanceParams& p) { return ops::MatrixOf(p); }

Node WhiteBalance(const Node& image, const WhiteBalanceParams& p) {
  const std::array<double, 9> m = WhiteBalanceMatrix(p);
  if (p.kelvin == p.to && p.tint == 0) return image;
  return AsColors(image, [&](const Node& colors) {
    return ColorMatrix(colors, {.values = {m.begin(), m.end()}, .transpose = true});
  });
}

}  // namespace tessera
