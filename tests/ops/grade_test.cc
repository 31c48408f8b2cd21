// The grade family on every target against its formulas in double, written once more; whites, curves and what
// is refused.
#include "tessera/ops/grade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "tessera/error.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::OnEveryTarget;
using Pixel = std::array<double, 4>;

constexpr int kPixels = 97;

// Values below 0, above 1, greys and colours.
Pixel Sample(int i) {
  const double t = static_cast<double>(i) / kPixels;
  return {static_cast<float>(0.5 + 0.9 * std::sin(9 * t)),
          static_cast<float>(i % 7 == 0 ? 0.4 : 1.2 * t - 0.1),
          static_cast<float>(i % 7 == 0 ? 0.4 : 0.5 + 0.6 * std::cos(23 * t)), static_cast<float>(t)};
}
Node Colors() {
  Image image(ImageSpec(kPixels, 1, 4));
  for (int i = 0; i < kPixels; ++i) {
    const Pixel p = Sample(i);
    for (int c = 0; c < 4; ++c) image.at<float>(i, 0, c) = static_cast<float>(p[static_cast<size_t>(c)]);
  }
  return FromImage(image);
}
// The node's samples against the formula; alpha as it was.
void ExpectFormula(const Node& node, const std::function<Pixel(const Pixel&)>& formula,
                   double tolerance = 4e-6) {
  OnEveryTarget([&] {
    const Image got = Render(node);
    for (int i = 0; i < kPixels; ++i) {
      const Pixel want = formula(Sample(i));
      for (int c = 0; c < 4; ++c) {
        const double w = want[static_cast<size_t>(c)];
        ASSERT_NEAR(got.at<float>(i, 0, c), w, tolerance * std::max(1.0, std::fabs(w)))
            << i << " channel " << c;
      }
    }
    EXPECT_TRUE(Verify(node).within_bound);
  });
}
double Kept(double v, double e) { return v < 0 ? v : std::pow(v, e); }
double Limited(double v) { return std::clamp(v, 0.0, 1.0); }
double Grey(const Pixel& p) { return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]; }

TEST(GradeTest, Exposure) {
  ExpectFormula(Exposure(Colors(), 1.5), [](Pixel p) {
    for (size_t c = 0; c < 3; ++c) p[c] *= std::exp2(1.5);
    return p;
  });
  EXPECT_THROW(Exposure(Colors(), 61), Error);
}

TEST(GradeTest, LiftGammaGain) {
  const GradeParams g{.black = {0.1, 0, 0.05},
                      .white = {0.9, 1, 1.2},
                      .lift = {0.02, 0, 0.1},
                      .gain = {1.1, 1, 0.9},
                      .multiply = {0.9, 1.2, 1},
                      .offset = {0.01, -0.02, 0},
                      .gamma = {1.2, 1, 0.7}};
  const auto v = [&](const Pixel& p, size_t c) {
    return g.multiply[c] * (g.gain[c] - g.lift[c]) / (g.white[c] - g.black[c]) * (p[c] - g.black[c]) +
           g.multiply[c] * g.lift[c] + g.offset[c];
  };
  ExpectFormula(Grade(Colors(), g), [&](Pixel p) {
    const Pixel in = p;
    for (size_t c = 0; c < 3; ++c) p[c] = Kept(v(in, c), 1 / g.gamma[c]);
    return p;
  });
  GradeParams limited = g;
  limited.clamp_black = limited.clamp_white = true;
  ExpectFormula(
      Grade(Colors(), limited),
      [&](Pixel p) {
        const Pixel in = p;
        for (size_t c = 0; c < 3; ++c)
          p[c] = std::min(1.0, std::pow(std::max(0.0, v(in, c)), 1 / g.gamma[c]));
        return p;
      },
      3e-4);  // the powers are steep near 0
  EXPECT_THROW(Grade(Colors(), {.black = {1, 0, 0}}), Error);
  EXPECT_THROW(Grade(Colors(), {.gamma = {1, 0, 1}}), Error);
}

TEST(GradeTest, ColorDecisionList) {
  CdlParams cdl{
      .slope = {1.1, 1, 0.9}, .offset = {0.01, 0, -0.02}, .power = {1, 1.2, 1.1}, .saturation = 1.3};
  const auto formula = [&](Pixel p) {
    const auto limit = [&](double v) { return cdl.clamp ? Limited(v) : v; };
    for (size_t c = 0; c < 3; ++c) p[c] = Kept(limit(cdl.slope[c] * p[c] + cdl.offset[c]), cdl.power[c]);
    const double grey = Grey(p);
    for (size_t c = 0; c < 3; ++c) p[c] = limit(grey + cdl.saturation * (p[c] - grey));
    return p;
  };
  ExpectFormula(Cdl(Colors(), cdl), formula);
  cdl.clamp = false;
  ExpectFormula(Cdl(Colors(), cdl), formula);
  EXPECT_THROW(Cdl(Colors(), {.slope = {-1, 1, 1}}), Error);
  EXPECT_THROW(Cdl(Colors(), {.power = {1, 0, 1}}), Error);
  EXPECT_THROW(Cdl(Colors(), {.saturation = -1}), Error);
}

TEST(GradeTest, Levels) {
  LevelsParams levels{
      .black = {0.1, 0, 0.2}, .white = {0.9, 0.5, 1}, .gamma = 0.8, .out_black = 0.1, .out_white = 0.8};
  const auto formula = [&](Pixel p) {
    for (size_t c = 0; c < 3; ++c) {
      const double v = (p[c] - levels.black[c]) / (levels.white[c] - levels.black[c]);
      p[c] = 0.1 + 0.7 * Kept(levels.clamp ? Limited(v) : v, 1 / levels.gamma);
    }
    return p;
  };
  ExpectFormula(Levels(Colors(), levels), formula);
  levels.clamp = false;
  ExpectFormula(Levels(Colors(), levels), formula);
  EXPECT_THROW(Levels(Colors(), {.black = {0.5, 0, 0}, .white = {0.5, 1, 1}}), Error);
}

TEST(GradeTest, Vibrance) {
  for (const double amount : {0.7, -0.5}) {
    ExpectFormula(Vibrance(Colors(), amount), [&](Pixel p) {
      const double grey = Grey(p), span = std::max({p[0], p[1], p[2]}) - std::min({p[0], p[1], p[2]});
      for (size_t c = 0; c < 3; ++c) p[c] = grey + (1 + amount * (1 - Limited(span))) * (p[c] - grey);
      return p;
    });
  }
}

TEST(GradeTest, DespillAndKey) {
  ExpectFormula(Despill(Colors(), {.screen = Screen::kBlue, .limit = SpillLimit::kLarger, .amount = 0.5}),
                [](Pixel p) {
                  p[2] += 0.5 * (std::min(p[2], std::max(p[0], p[1])) - p[2]);
                  return p;
                });
  ExpectFormula(Despill(Colors(), {}), [](Pixel p) {
    p[1] = std::min(p[1], (p[0] + p[2]) / 2);
    return p;
  });
  ExpectFormula(Key(Colors(), {.keep = 0.1, .drop = 0.6}), [](Pixel p) {
    const double most = std::max(p[0], p[2]), matte = Limited((0.6 - (p[1] - most)) / 0.5) * p[3];
    return Pixel{p[0] * matte, std::min(p[1], most) * matte, p[2] * matte, matte};
  });
  EXPECT_THROW(Key(Colors(), {.keep = 0.6, .drop = 0.6}), Error);
  EXPECT_THROW(Despill(FromImage(Image(ImageSpec(3, 3, 2))), {}), Error);
}

TEST(GradeTest, CurvesGoThroughTheirPoints) {
  const CurvePoints points = {{0, 0.1}, {0.2, 0.1}, {0.25, 0.5}, {0.7, 0.6}, {1, 0.9}};
  for (const auto& [x, y] : points) EXPECT_DOUBLE_EQ(CurveThrough(points, x), y);
  double before = CurveThrough(points, 0);
  for (int i = 1; i <= 1000; ++i) {  // nowhere falling, as the points do not
    const double v = CurveThrough(points, i / 1000.0);
    EXPECT_GE(v, before - 1e-15);
    before = v;
  }
  EXPECT_DOUBLE_EQ(CurveThrough({{0, 0}, {1, 1}}, 0.3), 0.3);
  EXPECT_EQ(CurveThrough({{0.2, 0.3}, {0.8, 0.7}}, 0.1), 0.3);
  const CurvePoints blue = {{0, 1}, {1, 0}};
  ExpectFormula(
      Curves(Colors(), {.all = points, .blue = blue}),
      [&](Pixel p) {
        for (size_t c = 0; c < 2; ++c) p[c] = CurveThrough(points, Limited(p[c]));
        p[2] = CurveThrough(blue, Limited(p[2]));
        return p;
      },
      2e-5);  // lines between 4,097 places
  EXPECT_THROW(Curves(Colors(), {.all = {{0, 0}}}), Error);
  EXPECT_THROW(Curves(Colors(), {.all = {{0, 0}, {0, 1}}}), Error);
  EXPECT_THROW(Curves(Colors(), {.all = {{0, 0}, {1.5, 1}}}), Error);
}

// A light's white becomes the white of the primaries.
TEST(GradeTest, WhitesAreCarriedOver) {
  const auto through = [](const std::array<double, 9>& m, const std::array<double, 3>& v) {
    std::array<double, 3> r{};
    for (size_t i = 0; i < 3; ++i) r[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
    return r;
  };
  // Illuminant A, 2,856 K, in linear Rec.709: XYZ 1.09850, 1, 0.35585 (CIE 15).
  const std::array<double, 3> bulb = {3.2406 * 1.0985 - 1.5372 - 0.4986 * 0.35585,
                                      -0.9689 * 1.0985 + 1.8758 + 0.0415 * 0.35585,
                                      0.0557 * 1.0985 - 0.2040 + 1.0570 * 0.35585};
  for (const double v : through(WhiteBalanceMatrix({.kelvin = 2856}), bulb)) EXPECT_NEAR(v, 1, 6e-3);
  // Daylight of 5,003 K is D50, XYZ 0.96422, 1, 0.82521: the published Bradford matrix from D50 to D65.
  const std::array<double, 3> d50 = {3.2406 * 0.96422 - 1.5372 - 0.4986 * 0.82521,
                                     -0.9689 * 0.96422 + 1.8758 + 0.0415 * 0.82521,
                                     0.0557 * 0.96422 - 0.2040 + 1.0570 * 0.82521};
  for (const double v : through(WhiteBalanceMatrix({.kelvin = 5003}), d50)) EXPECT_NEAR(v, 1, 2e-3);
  for (const Primaries primaries : {Primaries::kRec709, Primaries::kRec2020, Primaries::kAp1}) {
    const auto m = WhiteBalanceMatrix({.kelvin = 6504, .primaries = primaries});
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(m[i], i % 4 == 0 ? 1 : 0, 1e-12);
    // There and back.
    const auto there = WhiteBalanceMatrix({.kelvin = 3200, .to = 6000, .primaries = primaries}),
               back = WhiteBalanceMatrix({.kelvin = 6000, .to = 3200, .primaries = primaries});
    const auto same = through(back, through(there, {0.2, 0.5, 0.7}));
    EXPECT_NEAR(same[0], 0.2, 1e-12);
    EXPECT_NEAR(same[1], 0.5, 1e-12);
    EXPECT_NEAR(same[2], 0.7, 1e-12);
  }
}

TEST(GradeTest, TemperaturesAndTintsGoTheRightWay) {
  const auto grey = [](const WhiteBalanceParams& p) {
    const auto m = WhiteBalanceMatrix(p);
    return std::array<double, 3>{m[0] + m[1] + m[2], m[3] + m[4] + m[5], m[6] + m[7] + m[8]};
  };
  double ratio = 1e9;
  for (double kelvin = 3000; kelvin <= 20000;
       kelvin *= 1.05) {  // bluer the lower; hotter ones than 3,000 K are within Rec.709
    const auto g = grey({.kelvin = kelvin});
    EXPECT_LT(g[2] / g[0], ratio) << kelvin;
    ratio = g[2] / g[0];
  }
  for (const double kelvin : {2800.0, 4500.0, 6504.0, 9000.0}) {
    const auto none = grey({.kelvin = kelvin}), less = grey({.kelvin = kelvin, .tint = 20});
    EXPECT_LT(less[1] / (less[0] + less[2]), none[1] / (none[0] + none[2])) << kelvin;
  }
  EXPECT_THROW(WhiteBalanceMatrix({.kelvin = 900}), Error);
  EXPECT_THROW(WhiteBalanceMatrix({.kelvin = 5000, .tint = 151}), Error);
}

}  // namespace
}  // namespace tessera
