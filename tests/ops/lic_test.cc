// Line integral convolution: the checks of its specification, lines against formulas.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/fields.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/flow.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace testing;  // NOLINT: the fields are this test's language
using ::testing::HasSubstr;

TEST(LicTest, ConstantFieldIsTheBoxFilterAlongIt) {
  const Image texture = Texture(37, 29);
  OnEveryTarget([&] {
    for (const auto& [u, v] : {std::pair(1, 0), std::pair(0, 1), std::pair(-1, 0)}) {
      for (const LicIntegrator integrator :
           {LicIntegrator::kAdaptive, LicIntegrator::kRk4, LicIntegrator::kMidpoint, LicIntegrator::kEuler,
            LicIntegrator::kCell}) {
        const LicParams p{.length = 6, .integrator = integrator, .wrap = Wrap::kRepeat};
        const Image got = Lines(texture, Constant(37, 29, u, v), p);
        for (int y = 0; y < 29; ++y) {
          for (int x = 0; x < 37; ++x) {
            double mean = 0;
            for (int i = -6; i <= 6; ++i)
              mean += texture.at<float>((x + i * u + 37) % 37, (y + i * v + 29) % 29) / 13.0;
            ASSERT_NEAR(got.at<float>(x, y), mean, 1e-6)
                << x << "," << y << " integrator " << static_cast<int>(integrator);
          }
        }
      }
    }
  });
}

TEST(LicTest, ObliqueConstantFieldTakesDiagonalTaps) {
  const Image texture = Texture(40, 40);
  const LicParams p{.length = 5, .wrap = Wrap::kRepeat, .linear = true};
  const Image got = Lines(texture, Constant(40, 40, 3, 3), p);
  const auto bilinear = [&](double x, double y) {
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const double tx = x - x0, ty = y - y0;
    const auto at = [&](int i, int j) { return double{texture.at<float>((i + 80) % 40, (j + 80) % 40)}; };
    return (1 - ty) * ((1 - tx) * at(x0, y0) + tx * at(x0 + 1, y0)) +
           ty * ((1 - tx) * at(x0, y0 + 1) + tx * at(x0 + 1, y0 + 1));
  };
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      double mean = 0;
      for (int i = -5; i <= 5; ++i)
        mean += bilinear(x + i * std::numbers::sqrt2 / 2, y + i * std::numbers::sqrt2 / 2) / 11;
      ASSERT_NEAR(got.at<float>(x, y), mean, 3e-6);
    }
  }
}

TEST(LicTest, LinesThatLeaveStopAndRenormaliseOrReadTheEdge) {
  const Image texture = Texture(9, 1);
  const Image field = Constant(9, 1, 1, 0);
  OnEveryTarget([&] {
    const Image stop = Lines(texture, field, {.length = 4});
    const Image clamp = Lines(texture, field, {.length = 4, .wrap = Wrap::kClamp});
    for (int x = 0; x < 9; ++x) {
      double used = 0, sum = 0, edge = 0;
      for (int i = -4; i <= 4; ++i) {
        if (x + i >= 0 && x + i < 9) used += 1, sum += texture.at<float>(x + i, 0);
        edge += texture.at<float>(std::clamp(x + i, 0, 8), 0) / 9;
      }
      EXPECT_NEAR(stop.at<float>(x, 0), sum / used, 1e-6);
      EXPECT_NEAR(clamp.at<float>(x, 0), edge, 1e-6);
    }
  });
}

TEST(LicTest, ZeroFieldAndZeroLengthAreTheIdentity) {
  const Image texture = Texture(33, 18, 3);
  OnEveryTarget([&] {
    for (const LicIntegrator integrator :
         {LicIntegrator::kAdaptive, LicIntegrator::kEuler, LicIntegrator::kCell}) {
      const Image still = Lines(texture, Constant(33, 18, 0, 0), {.length = 8, .integrator = integrator});
      const Image none = Lines(texture, FieldOf(33, 18, Swirls), {.length = 0, .integrator = integrator});
      for (int i = 0; i < 33 * 18 * 3; ++i) {
        const float t = reinterpret_cast<const float*>(texture.view().data)[i];
        ASSERT_NEAR(reinterpret_cast<const float*>(still.view().data)[i], t, 1e-6);
        ASSERT_EQ(reinterpret_cast<const float*>(none.view().data)[i], t);
      }
    }
  });
}

TEST(LicTest, TurnedAndScaledFieldsGiveTheSameBits) {
  const Image texture = Texture(64, 48);
  const auto scaled = [](double s) {
    return FieldOf(64, 48, [s](double x, double y) {
      const auto [u, v] = Swirls(x, y);
      return std::pair(static_cast<float>(u) * s, static_cast<float>(v) * s);
    });
  };
  OnEveryTarget([&] {
    for (const LicIntegrator integrator :
         {LicIntegrator::kAdaptive, LicIntegrator::kRk4, LicIntegrator::kCell}) {
      const LicParams p{.length = 15, .integrator = integrator};
      const Image plain = Lines(texture, scaled(1), p);
      ExpectSameBits(plain, Lines(texture, scaled(-1), p));
      for (const int exponent : {-100, -3, 7, 100})
        ExpectSameBits(plain, Lines(texture, scaled(std::ldexp(1.0, exponent)), p));
    }
  });
}

TEST(LicTest, QuarterTurnsTurnTheResult) {
  const int n = 61;
  const Image texture = Texture(n, n), field = FieldOf(n, n, Swirls);
  const Image turned_texture(ImageSpec(n, n, 1)), turned_field(ImageSpec(n, n, 2));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {  // (x, y) goes to (n - 1 - y, x)
      turned_texture.at<float>(n - 1 - y, x) = texture.at<float>(x, y);
      turned_field.at<float>(n - 1 - y, x, 0) = -field.at<float>(x, y, 1);
      turned_field.at<float>(n - 1 - y, x, 1) = field.at<float>(x, y, 0);
    }
  }
  const LicParams p{.length = 12, .integrator = LicIntegrator::kRk4, .linear = true};
  const Image a = Lines(texture, field, p), b = Lines(turned_texture, turned_field, p);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) ASSERT_NEAR(b.at<float>(n - 1 - y, x), a.at<float>(x, y), 2e-5);
  }
}

TEST(LicTest, VarianceFallsWithTheNumberOfTapsAndRescalePutsItBack) {
  const Image field = Constant(512, 512, 1, 0);
  const double noise = Variance(Render(Lic(FromImage(field), {.length = 0})), 0);
  EXPECT_NEAR(noise, 1.0 / 12, 0.001);
  for (const int length : {5, 10, 20}) {
    const double lic =
        Variance(Render(Lic(FromImage(field), {.length = double(length), .contrast = LicContrast::kNone})),
                 length + 1);
    EXPECT_NEAR(lic * (2 * length + 1) / noise, 1, 0.05) << length;
    const double rescaled =
        Variance(Render(Lic(FromImage(field),
                            {.length = double(length), .contrast = LicContrast::kRescale, .gain = 1})),
                 length + 1);
    EXPECT_NEAR(rescaled / noise, 1, 0.05) << length;
  }
  const Image lic = Render(Lic(FromImage(field), {.length = 20, .contrast = LicContrast::kNone}));
  double along = 0, across = 0, squares = 0;
  for (int y = 30; y < 480; ++y) {
    for (int x = 30; x < 480; ++x) {
      const double v = lic.at<float>(x, y) - 0.5;
      along += v * (lic.at<float>(x + 1, y) - 0.5), across += v * (lic.at<float>(x, y + 1) - 0.5),
          squares += v * v;
    }
  }
  EXPECT_GT(along / squares, 0.9);
  EXPECT_LT(std::fabs(across / squares), 0.05);
}

TEST(LicTest, OwnNoiseHasTheSameContrastWhateverTheLineIs) {
  const Node field = FromImage(Constant(512, 512, 1, 0));
  for (const LicNoise noise : {LicNoise::kWhite, LicNoise::kFiltered, LicNoise::kSparse}) {
    for (const int spot : {1, 3}) {
      const LicParams look{.length = 0, .noise = noise, .spot = spot};
      const double all = std::sqrt(Variance(Render(Lic(field, look)), 0));
      for (const LicKernel kernel : {LicKernel::kBox, LicKernel::kTent, LicKernel::kHann}) {
        for (const double step : {0.5, 1.0, 2.0}) {
          LicParams p = look;
          p.length = 20, p.kernel = kernel, p.step = step;
          const double deviation = std::sqrt(Variance(Render(Lic(field, p)), 22));
          EXPECT_NEAR(deviation / all, 0.75, 0.08)
              << static_cast<int>(noise) << " spot " << spot << " kernel " << static_cast<int>(kernel)
              << " step " << step;
        }
      }
    }
  }
  // An image is not noise: its mean stays one.
  const Image texture = Texture(37, 29), along = Constant(37, 29, 1, 0);
  ExpectSameBits(Lines(texture, along, {.length = 6}),
                 Lines(texture, along, {.length = 6, .contrast = LicContrast::kNone}));
}

TEST(LicTest, ContrastIsThatOfThePixelsOwnLine) {
  const int n = 400;
  // Still on the left, then lines of a quarter of the length, then of all of it.
  const Node field = FromImage(FieldOf(n, n, [](double x, double) {
    return std::pair(x < 100 ? 0.0 : x < 250 ? 0.25 : 1.0, 0.0);
  }));
  const auto deviation = [](const Image& image, int from, int to) {
    double sum = 0, squares = 0, count = 0;
    for (int y = 0; y < n; ++y) {
      for (int x = from; x < to; ++x, ++count) {
        const double v = image.at<float>(x, y);
        sum += v, squares += v * v;
      }
    }
    return std::sqrt(squares / count - std::pow(sum / count, 2));
  };
  const double white = std::sqrt(1.0 / 12);
  for (const LicMagnitude magnitude : {LicMagnitude::kNone, LicMagnitude::kLength, LicMagnitude::kNoise}) {
    const LicParams p{.length = 20, .magnitude = magnitude};
    const Image image = Render(Lic(field, p));
    EXPECT_NEAR(deviation(image, 0, 80), white, 0.02) << static_cast<int>(magnitude);
    EXPECT_NEAR(deviation(image, 125, 225), 0.75 * white, 0.03) << static_cast<int>(magnitude);
    EXPECT_NEAR(deviation(image, 275, 375), 0.75 * white, 0.03) << static_cast<int>(magnitude);
    EXPECT_TRUE(Verify(Lic(field, p), PixelType::kFloat, {.samples = 2}).within_bound);
  }
}

TEST(LicTest, WindowsFallToNothingAtTheLength) {
  const Image texture = Texture(64, 8);
  for (const double length : {0.0, 1.0, 7.0}) {
    for (const LicKernel kernel : {LicKernel::kTent, LicKernel::kHann}) {
      const Image got = Lines(texture, Constant(64, 8, 1, 0), {.length = length, .kernel = kernel});
      for (int x = 8; x < 56; ++x) {
        double sum = 0, all = 0;
        for (int i = -static_cast<int>(length); i <= length; ++i) {
          const double share = length > 0 ? i / length : 0;
          const double w = kernel == LicKernel::kTent ? 1 - std::fabs(share)
                                                      : 0.5 + 0.5 * std::cos(std::numbers::pi * share);
          sum += w * texture.at<float>(x + i, 4), all += w;
        }
        ASSERT_NEAR(got.at<float>(x, 4), sum / all, 1e-6) << x << " length " << length;
      }
    }
  }
}

TEST(LicTest, CircleKeepsItsRadiusToTheIntegratorsOrder) {
  const Image field = FieldOf(128, 128, Circle);
  const auto drift = [&](LicIntegrator integrator, double length, double step) {
    const Image end = EndPoints(field, {.length = length, .step = step, .integrator = integrator});
    double worst = 0;
    for (int i = 0; i < 8; ++i) {
      const int x = std::array{96, 95, 64, 31, 32, 40, 63, 88}[static_cast<size_t>(i)];
      const int y = std::array{64, 70, 96, 64, 60, 40, 31, 42}[static_cast<size_t>(i)];
      const double before = std::hypot(x - 63.5, y - 63.5);
      worst = std::max(
          worst,
          std::fabs(std::hypot(end.at<float>(x, y, 0) - 63.5, end.at<float>(x, y, 1) - 63.5) - before));
    }
    return worst;
  };
  // n steps of h on a circle of radius r: Euler goes n h^2 / (2 r) outward.
  EXPECT_NEAR(drift(LicIntegrator::kEuler, 10, 1), 10 / (2 * 32.5), 0.03);
  EXPECT_NEAR(drift(LicIntegrator::kEuler, 10, 0.5), 5 / (2 * 32.5), 0.015);
  EXPECT_LT(drift(LicIntegrator::kMidpoint, 10, 1), 1e-3);
  EXPECT_LT(drift(LicIntegrator::kRk4, 20, 1), 5e-5);  // float positions: 4e-6 each
  EXPECT_LT(drift(LicIntegrator::kAdaptive, 20, 1), 1e-3);
  EXPECT_LT(drift(LicIntegrator::kAdaptive, 100, 1), 1e-3);
}

TEST(LicTest, CircleKeepsItsRadiusForTenThousandPixels) {
  LicParams p{.length = 10000, .kernel = LicKernel::kUser, .linear = true};
  p.weights.assign(20001, 0.0);
  p.weights.back() = 1;
  const Node ends = Lic(FromImage(Coordinates(128, 128)), FromImage(FieldOf(128, 128, Circle)), p);
  for (const auto& [x, y] : {std::pair(96, 64), std::pair(64, 96), std::pair(90, 70)}) {
    const Image end = Render(Crop(ends, {x, y, x + 1, y + 1}));
    const double before = std::hypot(x - 63.5, y - 63.5);
    EXPECT_NEAR(std::hypot(end.at<float>(x, y, 0) - 63.5, end.at<float>(x, y, 1) - 63.5), before, 1e-3);
  }
}

TEST(LicTest, AdaptiveEndPointsAreThoseOfSmallSteps) {
  const int n = 256;
  const Image field = FieldOf(n, n, [](double x, double y) {  // smooth, no critical point
    return std::pair(2 + std::sin(y / 17) + 0.3 * std::sin(x / 13),
                     0.6 * std::cos(x / 21) + 0.1 * std::sin(y / 29));
  });
  const LicParams p{.length = 100, .wrap = Wrap::kClamp};
  LicParams fine = p;
  fine.integrator = LicIntegrator::kRk4, fine.step = 0.25;
  const Image a = EndPoints(field, p), b = EndPoints(field, fine);
  double worst = 0, sum = 0;
  int count = 0;
  for (int y = 30; y < n - 60; ++y) {
    for (int x = 4; x < n - 110; ++x, ++count) {
      const double off = std::hypot(a.at<float>(x, y, 0) - b.at<float>(x, y, 0),
                                    a.at<float>(x, y, 1) - b.at<float>(x, y, 1));
      worst = std::max(worst, off), sum += off;
    }
  }
  EXPECT_LT(sum / count, 5e-4);
  EXPECT_LT(worst, 2e-3);
  EXPECT_GT(worst, 0);
}

}  // namespace
}  // namespace tessera
