// Bump mapping: doc/maths/bump.md's table of errors, its checks and hard cases, on every target.
#include "tessera/ops/bump.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
constexpr double kPi = std::numbers::pi;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const Vector3 kLight = {0.5, 0.3, 0.812};

class BumpTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(Targets, BumpTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

Image Heights(int width, int height, const std::function<double(int, int)>& f) {
  const Image image(ImageSpec(width, height, 1));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<float>(x, y) = static_cast<float>(f(x, y));
  }
  return image;
}
Image Pixel(const Vector3& v) {
  const Image image(ImageSpec(1, 1, 3));
  for (int c = 0; c < 3; ++c) image.at<float>(0, 0, c) = static_cast<float>(v[static_cast<size_t>(c)]);
  return image;
}
Vector3 At(const Image& image, int x = 0, int y = 0) {
  return {image.at<float>(x, y, 0), image.at<float>(x, y, 1), image.at<float>(x, y, 2)};
}
double Angle(const Vector3& a, const Vector3& b) {
  return std::acos(std::clamp(Dot(Normalized(a), Normalized(b)), -1.0, 1.0)) * 180 / kPi;
}
// A product of sinusoids of k periods over 256 pixels, with its slopes; y up.
struct Waves {
  double k, amplitude;
  double Phase(double v) const { return 2 * kPi * k * v / 256; }
  double At(int x, int y) const { return amplitude * std::sin(Phase(x)) * std::sin(Phase(-y)); }
  double SlopeX(int x, int y) const {
    return amplitude * 2 * kPi * k / 256 * std::cos(Phase(x)) * std::sin(Phase(-y));
  }
  double SlopeY(int x, int y) const {
    return amplitude * 2 * kPi * k / 256 * std::sin(Phase(x)) * std::cos(Phase(-y));
  }
};
double WorstOf(const Waves& waves, const BumpParams& params) {
  const Image got =
      Render(Bump(FromImage(Heights(256, 256, [&](int x, int y) { return waves.At(x, y); })), params));
  const Vector3 l = Normalized(params.light);
  double worst = 0;
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      const double fx = waves.SlopeX(x, y), fy = waves.SlopeY(x, y);
      const double want = (l[2] - l[0] * fx - l[1] * fy) / std::sqrt(1 + fx * fx + fy * fy);
      worst = std::max(worst, std::fabs(got.at<float>(x, y) - std::max(want, 0.0)));
    }
  }
  return worst;
}

// The specification's table: forward and central shifts, with the normal's length and without it.
TEST_P(BumpTest, ShiftAndSubtractErrsAsTheTableSays) {
  struct Row {
    double k, slope, forward, central, forward_length, central_length;
  };
  // Steeper rows are clamped at 0 in parts, which only lowers the errors.
  const Row rows[] = {{4, 0.049, 0.0013, 0.0010, 0.0008, 0.0001},
                      {4, 0.20, 0.017, 0.017, 0.0033, 0.0001},
                      {4, 0.78, 0.257, 0.256, 0.013, 0.0005},
                      {16, 0.76, 0.253, 0.241, 0.051, 0.0025}};
  for (const Row& row : rows) {
    const Waves waves = {row.k, row.slope * 256 / (2 * kPi * row.k)};
    const auto error = [&](BumpMethod method, bool length) {
      BumpParams p;
      p.light = kLight, p.method = method, p.length = length, p.wrap = Wrap::kRepeat;
      return WorstOf(waves, p);
    };
    const double forward = error(BumpMethod::kForward, false), central = error(BumpMethod::kShift, false);
    // The table shifts exactly. Linear shifts by fractions of a pixel add half the curvature times f (1 - f),
    // of both axes; about the pixel these cancel but for a third derivative.
    const double omega = 2 * kPi * row.k / 256, forward_more = 0.5 * row.slope * omega * (0.25 + 0.21);
    const double central_more = 0.16 * row.slope * omega * omega;
    EXPECT_GE(forward, 0.8 * row.forward) << row.slope;
    EXPECT_LE(forward, 1.2 * (row.forward + forward_more)) << row.slope;
    EXPECT_GE(central, 0.8 * row.central) << row.slope;
    EXPECT_LE(central, 1.2 * row.central + central_more) << row.slope;
    EXPECT_NEAR(error(BumpMethod::kForward, true), row.forward_length + forward_more,
                0.2 * (row.forward_length + forward_more))
        << row.slope;
    const double best = error(BumpMethod::kShift, true);
    EXPECT_LE(best, 1.2 * (row.central_length + central_more)) << row.slope;
    EXPECT_LT(best, error(BumpMethod::kForward, true));
    EXPECT_LE(error(BumpMethod::kNormals, true), row.k == 4 ? 2e-3 : 2.5e-2) << row.slope;
  }
}

TEST_P(BumpTest, PlanesAreExact) {
  // f = a x + b y (y up): a constant normal, E = -s (a L_x + b L_y).
  const double a = 0.5, b = -0.25;
  const Image plane = Heights(32, 32, [&](int x, int y) { return a * x - b * y; });
  for (const Slope slope : {Slope::kCentral, Slope::kForward, Slope::kSobel, Slope::kGaussian}) {
    const Image n = Render(HeightToNormals(FromImage(plane), {.scale = 1, .slope = slope}));
    const Vector3 want = Normalized({-a, -b, 1});
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(n.at<float>(16, 16, static_cast<int>(c)), want[c], 1e-6);
  }
  for (const BumpMethod method : {BumpMethod::kNormals, BumpMethod::kShift, BumpMethod::kForward}) {
    BumpParams p;
    p.light = kLight, p.method = method, p.output = BumpOutput::kEmboss, p.shift = 2.5;
    const Vector3 l = Normalized(kLight);
    const Image e = Render(Bump(FromImage(plane), p));
    EXPECT_NEAR(e.at<float>(16, 16), 0.5 - 2.5 * (a * l[0] + b * l[1]), 1e-6);
  }
}

TEST_P(BumpTest, FlatHeightsAreLitByTheLightAlone) {
  for (const double height : {0.0, 1e8, -3.0}) {
    const Node flat = FromImage(Heights(9, 7, [&](int, int) { return height; }));
    for (const BumpMethod method : {BumpMethod::kNormals, BumpMethod::kShift, BumpMethod::kForward}) {
      BumpParams p;
      p.light = kLight, p.method = method;
      const Image got = Render(Bump(flat, p));
      const auto want = static_cast<float>(Normalized(kLight)[2]);
      for (int x = 0; x < 9; ++x) EXPECT_EQ(got.at<float>(x, 3), want);
      p.light = {0.3, 0.1, -1};  // from below
      EXPECT_EQ(Render(Bump(flat, p)).at<float>(4, 4), 0);
    }
    const Image n = Render(HeightToNormals(flat));
    EXPECT_EQ(At(n, 4, 4), (Vector3{0, 0, 1}));
    EXPECT_EQ(At(Render(HeightToNormals(flat, {.pack = true})), 4, 4), (Vector3{0.5, 0.5, 1}));
  }
}

TEST_P(BumpTest, AConstantChangesNothingAndTurningTheHeightTurnsTheLight) {
  // Heights on a grid of 1/4, so that the sum with the constant is exact.
  const auto f = [](int x, int y) { return 0.25 * ((x * 7 + y * 13) % 11); };
  const Node plain = FromImage(Heights(40, 30, f));
  const Node lifted = FromImage(Heights(40, 30, [&](int x, int y) { return f(x, y) + 65536; }));
  const Node sunk = FromImage(Heights(40, 30, [&](int x, int y) { return -f(x, y); }));
  for (const BumpMethod method : {BumpMethod::kNormals, BumpMethod::kShift, BumpMethod::kForward}) {
    BumpParams p;
    p.light = kLight, p.method = method, p.shift = 1.7;
    const Image a = Render(Bump(plain, p)), b = Render(Bump(lifted, p));
    const Image c = Render(Bump(sunk, [&] {
      BumpParams q = p;
      q.light = {-kLight[0], -kLight[1], kLight[2]};
      return q;
    }()));
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        ASSERT_EQ(a.at<float>(x, y), b.at<float>(x, y));
        if (method != BumpMethod::kForward) {
          ASSERT_EQ(a.at<float>(x, y), c.at<float>(x, y));
        }
      }
    }
  }
}

TEST_P(BumpTest, CliffsAndNaNStayWithinBounds) {
  const Image cliff = Heights(16, 4, [](int x, int) { return x < 8 ? 0 : 1e4; });
  for (const BumpMethod method : {BumpMethod::kNormals, BumpMethod::kShift}) {
    BumpParams p;
    p.light = {-1, 0, 0.5}, p.method = method;
    const Image got = Render(Bump(FromImage(cliff), p));
    for (int x = 0; x < 16; ++x) {
      EXPECT_GE(got.at<float>(x, 1), 0);
      EXPECT_LE(got.at<float>(x, 1), 1.0f + 1e-6f);
    }
    EXPECT_NEAR(got.at<float>(8, 1), 1 / std::sqrt(1.25), 1e-3);  // faces the light from the left
  }
  Image hole = Heights(16, 4, [](int x, int) { return 0.1 * x; });
  hole.at<float>(6, 2) = kNaN;
  const Image n = Render(HeightToNormals(FromImage(hole)));
  int lost = 0;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 16; ++x) lost += std::isnan(n.at<float>(x, y, 2)) ? 1 : 0;
  }
  EXPECT_EQ(lost, 5);  // itself and its four neighbours
}

TEST_P(BumpTest, RepeatingTexturesHaveNoSeam) {
  const Waves waves = {8, 4};
  const Image tile = Heights(256, 64, [&](int x, int y) { return waves.At(x, y); });
  const Image n = Render(HeightToNormals(FromImage(tile), {.wrap = Wrap::kRepeat}));
  for (int y = 0; y < 32; ++y) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(n.at<float>(0, y, c), n.at<float>(32, y, c), 1e-5);
  }
}

// The accumulation recipe, LOAD k f, ACCUM -k f shifted, as a composition of existing blocks.
TEST_P(BumpTest, TheAccumulationRecipeIsTheSame) {
  const Waves waves = {4, 2};
  const Node height = FromImage(Heights(256, 64, [&](int x, int y) { return waves.At(x, y); }));
  BumpParams p;
  p.light = kLight, p.method = BumpMethod::kForward, p.length = false, p.shift = 1.5;
  const Image direct = Render(Bump(height, p));
  const Vector3 l = Normalized(kLight);
  // Moving the content left by s L_x and down by s L_y shows f(p + s L).
  const Node shifted = Shift(height, {-1.5 * l[0], 1.5 * l[1], "triangle", Wrap::kClamp});
  const Node sum = WeightedSum({height, shifted}, {.weights = {1 / 1.5, -1 / 1.5}});
  const Image composed = Render(MaxConstant(AddConstant(sum, {l[2]}), {0}));
  for (int y = 2; y < 62; ++y) {
    for (int x = 2; x < 254; ++x) ASSERT_NEAR(direct.at<float>(x, y), composed.at<float>(x, y), 2e-6);
  }
  // And with a framebuffer of 8 bits, which holds heights in [0, 1]: within the papers' 2/255 of each other.
  const Node low = FromImage(Heights(64, 64, [&](int x, int y) { return 0.5 + waves.At(x, y) / 8; }));
  p.bits = 8, p.shift = 1;
  const Image coarse = Render(Bump(low, p));
  p.bits = 0;
  const Image fine = Render(Bump(low, p));
  double worst = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x)
      worst = std::max<double>(worst, std::fabs(coarse.at<float>(x, y) - fine.at<float>(x, y)));
  }
  EXPECT_GT(worst, 0.5 / 255);
  EXPECT_LE(worst, 2.6 / 255);
}

TEST_P(BumpTest, SpecularFollowsTheHalfwayVector) {
  const Node flat = FromImage(Heights(4, 4, [](int, int) { return 0; }));
  BumpParams p;
  p.light = {1, 0, 1}, p.output = BumpOutput::kSpecular, p.exponent = 30;
  EXPECT_NEAR(Render(Bump(flat, p)).at<float>(1, 1), std::pow(std::cos(kPi / 8), 30), 1e-6);
  p.exponent = 0;
  EXPECT_EQ(Render(Bump(flat, p)).at<float>(1, 1), 1);
  p.light = {0, 0, -1};  // L + V = 0
  EXPECT_EQ(Render(Bump(flat, p)).at<float>(1, 1), 0);
}

TEST_P(BumpTest, TangentFrames) {
  const auto put = [](const Vector3& map, const Vector3& n, const Vector3& t, TangentNormalsParams p) {
    return At(Render(TangentNormals(FromImage(Pixel(map)), FromImage(Pixel(n)), FromImage(Pixel(t)), p)));
  };
  const TangentNormalsParams plain{.packed = false};
  // The frame x, y, z keeps the map; B = N x T; T need not be perpendicular or of unit length.
  const Vector3 a = Normalized({0.3, -0.4, 0.8});
  const Vector3 same = put(a, {0, 0, 2}, {5, 0, 3}, plain);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(same[c], a[c], 1e-6);
  EXPECT_NEAR(put({0, 1, 0}, {1, 0, 0}, {0, 1, 0}, plain)[2], 1, 1e-6);  // x cross y
  EXPECT_NEAR(put({0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {.packed = false, .left_handed = true})[2], -1, 1e-6);
  EXPECT_NEAR(put({0.5, 0.5, 1}, {0, 3, 4}, {1, 0, 0}, {})[2], 0.8, 1e-6);  // packed: the normal itself
  // Hard cases: no tangent, tangent along the normal, no normal, NaN.
  EXPECT_EQ(put(a, {0, 0, 7}, {0, 0, 0}, plain), (Vector3{0, 0, 1}));
  EXPECT_EQ(put(a, {0, 0, 7}, {0, 0, -2}, plain), (Vector3{0, 0, 1}));
  EXPECT_EQ(put(a, {0, 0, 7}, {kNaN, 0, 0}, plain), (Vector3{0, 0, 1}));
  EXPECT_EQ(put(a, {0, 0, 0}, {1, 0, 0}, plain), (Vector3{0, 0, 0}));
  EXPECT_EQ(put(a, {0, kNaN, 0}, {1, 0, 0}, plain), (Vector3{0, 0, 0}));
  EXPECT_EQ(put({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, plain), (Vector3{0, 1, 0}));
  // There and back.
  const Vector3 n = {0.2, 0.9, -0.5}, t = {1, 0.1, 0.4}, there = put(a, n, t, plain);
  const Vector3 back = put(there, n, t, {.packed = false, .inverse = true});
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(back[c], a[c], 1e-6);
}

// Tangents along the normal but for the rounding of their parts still have a direction across it, that of
// exact products.
TEST_P(BumpTest, TangentsNearlyAlongTheNormal) {
  using Long = std::array<long double, 3>;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.1f, 1);
  for (int k = 0; k < 2000; ++k) {
    float n[3], t[3];
    const float times = uniform(random);
    for (int c = 0; c < 3; ++c) n[c] = uniform(random), t[c] = n[c] * times;
    Long across, along;
    for (size_t c = 0; c < 3; ++c) {
      const size_t i = (c + 1) % 3, j = (c + 2) % 3;
      across[c] = static_cast<long double>(n[i]) * t[j] - static_cast<long double>(n[j]) * t[i];
    }
    for (size_t c = 0; c < 3; ++c) {
      const size_t i = (c + 1) % 3, j = (c + 2) % 3;
      along[c] = across[i] * n[j] - across[j] * n[i];
    }
    const long double length = std::sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
    if (length == 0) continue;
    const Vector3 normal = {n[0], n[1], n[2]}, tangent = {t[0], t[1], t[2]};
    const Vector3 got = At(Render(TangentNormals(FromImage(Pixel({1, 0, 0})), FromImage(Pixel(normal)),
                                                 FromImage(Pixel(tangent)), {.packed = false})));
    for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(got[c], static_cast<double>(along[c] / length), 2e-7) << k;
    // What tilts away from such a normal is as exact: V - K of the same direction.
    const double steep = 1e6;
    const Vector3 tilted = At(Render(CombineNormals(FromImage(Pixel(normal)), FromImage(Pixel(tangent)),
                                                    {.k = steep, .method = CombineMethod::kTilt})));
    long double square = 0;
    Long want;
    const long double of_n = static_cast<long double>(Dot(normal, normal));
    for (size_t c = 0; c < 3; ++c) want[c] = n[c] / std::sqrt(of_n) - steep * along[c] / of_n;
    for (const long double v : want) square += v * v;
    for (size_t c = 0; c < 3; ++c)
      ASSERT_NEAR(tilted[c], static_cast<double>(want[c] / std::sqrt(square)), 2e-7) << k;
  }
}

TEST_P(BumpTest, SurfaceDerivativesFollowBlinn) {
  const auto put = [](const Vector3& map, const Vector3& n, const Vector3& u, const Vector3& v,
                      SurfaceBumpParams p) {
    return At(Render(SurfaceBump(FromImage(Pixel(map)), FromImage(Pixel(n)), FromImage(Pixel(u)),
                                 FromImage(Pixel(v)), p)));
  };
  const SurfaceBumpParams plain{.packed = false};
  const auto near = [](const Vector3& a, const Vector3& b) {
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-6);
  };
  const auto scaled = [](const Vector3& v, double k) { return Vector3{k * v[0], k * v[1], k * v[2]}; };
  const auto plus = [](const Vector3& a, const Vector3& b) {
    return Vector3{a[0] + b[0], a[1] + b[1], a[2] + b[2]};
  };
  // The true normal of a displaced flat patch: (Pu + f_u N) x (Pv + f_v N).
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3{normal(random), normal(random), normal(random)}; };
  for (int k = 0; k < 200; ++k) {
    const Vector3 u = vector(), v = vector(), n = Normalized(Cross(u, v));
    const double fu = normal(random), fv = normal(random), scale = k % 2 ? 0.3 : 1;
    const Vector3 want = Normalized(Cross(plus(u, scaled(n, scale * fu)), plus(v, scaled(n, scale * fv))));
    near(put({-fu, -fv, 1}, n, u, v, {.packed = false, .scale = scale}), want);
    // Any length of the map's vector and the normal's; seen from the other side the relief is the same one,
    // pressed in.
    near(put({-2 * fu, -2 * fv, 2}, scaled(n, 3), u, v, {.packed = false, .scale = scale}), want);
    near(put({fu, fv, 1}, scaled(n, -1), u, v, {.packed = false, .scale = scale}), scaled(want, -1));
  }
  // A unit patch keeps the map, one of edge k divides its slope by k.
  near(put({-0.3, 0.4, 1}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, plain), Normalized({-0.3, 0.4, 1}));
  near(put({-0.3, 0.4, 1}, {0, 0, 1}, {4, 0, 0}, {0, 4, 0}, plain), Normalized({-0.3 / 4, 0.4 / 4, 1}));
  near(put({0.5, 0.5, 1}, {0, 3, 4}, {1, 0, 0}, {0, 4, -3}, {}), {0, 0.6, 0.8});
  // Hard cases: no area, no derivative, NaN, no normal.
  const Vector3 tilted = {-0.3, 0.4, 1}, up = {0, 0, 1};
  EXPECT_EQ(put(tilted, up, {1, 2, 0}, {2, 4, 0}, plain), up);
  EXPECT_EQ(put(tilted, up, {1, 2, 0}, {0, 0, 0}, plain), up);
  EXPECT_EQ(put(tilted, up, {kNaN, 2, 0}, {0, 1, 0}, plain), up);
  EXPECT_EQ(put({0, 0, 0}, up, {1, 0, 0}, {0, 1, 0}, plain), up);
  EXPECT_EQ(put(tilted, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, plain), (Vector3{0, 0, 0}));
}

TEST_P(BumpTest, CombinedNormalsFollowEquationSeven) {
  const auto combine = [](const Vector3& v, const Vector3& b, CombineNormalsParams p) {
    return At(Render(CombineNormals(FromImage(Pixel(v)), FromImage(Pixel(b)), p)));
  };
  const Vector3 v = {0, 0, 3};
  struct Row {
    double k, right_angle, at_150;
  };
  for (const Row& row : {Row{0.5, 63.4, 126.2}, Row{1, 45, 75}, Row{2, 26.6, 23.8}, Row{8, 7.1, 4.0}}) {
    EXPECT_NEAR(Angle(combine(v, {0.5, 0, 0}, {.k = row.k}), v), row.right_angle, 0.1);
    const Vector3 b = {2 * std::sin(150 * kPi / 180), 0, 2 * std::cos(150 * kPi / 180)};
    EXPECT_NEAR(Angle(combine(v, b, {.k = row.k}), v), row.at_150, 0.3) << row.k;
  }
  // B = V is V, k large is V; opposite at k = 1 is V, not 0; zero bump is V; zero surface is 0.
  EXPECT_NEAR(Angle(combine({1, 2, 3}, {1, 2, 3}, {.k = 0.1}), {1, 2, 3}), 0, 0.05);
  EXPECT_NEAR(Angle(combine({1, 2, 3}, {3, -1, 0}, {.k = 1e6}), {1, 2, 3}), 0, 0.05);
  EXPECT_EQ(combine(v, {0, 0, -1}, {.k = 1}), (Vector3{0, 0, 1}));
  EXPECT_EQ(combine(v, {0, 0, 0}, {.k = 1}), (Vector3{0, 0, 1}));
  EXPECT_EQ(combine(v, {kNaN, 0, 0}, {.k = 1}), (Vector3{0, 0, 1}));
  EXPECT_EQ(combine({0, 0, 0}, {1, 0, 0}, {.k = 1}), (Vector3{0, 0, 0}));
  // Tilts stay below 90 degrees: atan(k |g_t|).
  const CombineNormalsParams tilt{.k = 0.5, .method = CombineMethod::kTilt};
  EXPECT_NEAR(Angle(combine(v, {2, 0, 100}, tilt), v), 45, 1e-3);
  EXPECT_LT(Angle(combine(v, {1e6, 0, -1e6}, tilt), v), 90);
}

TEST(BumpRefusalTest, NamesWhatIsWrong) {
  const Node height = FromImage(Image(ImageSpec(4, 4, 1)));
  const auto with = [&](const std::function<void(BumpParams&)>& change) {
    BumpParams p;
    change(p);
    return Refusal([&] { Bump(height, p); });
  };
  EXPECT_EQ(with([](BumpParams& p) { p.shift = 1e-4; }),
            "bump: found shift=1e-04, expected 0.001 to 64 pixels");
  EXPECT_THAT(with([](BumpParams& p) { p.light = {0, 0, 0}; }), HasSubstr("not all 0"));
  EXPECT_THAT(with([](BumpParams& p) { p.exponent = -1; }), HasSubstr("expected 0 to 10000"));
  EXPECT_THAT(with([](BumpParams& p) { p.scale = kNaN; }), HasSubstr("scale"));
  EXPECT_THAT(Refusal([&] { CombineNormals(height, height); }), HasSubstr("combinenormals"));
  const Node normal = FromImage(Image(ImageSpec(4, 4, 3)));
  EXPECT_THAT(Refusal([&] { CombineNormals(normal, normal, {.k = 0}); }), HasSubstr("found k=0"));
}

}  // namespace
}  // namespace tessera
