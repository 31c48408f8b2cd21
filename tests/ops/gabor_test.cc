// Gabor noise: its spectrum, variance and directions, periods, slopes, and every option against the
// reference.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/every_target.h"
#include "support/noise_values.h"
#include "support/refusal.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using tessera::testing::At;
using tessera::testing::OnEveryTarget;
using tessera::testing::Values;
using ::testing::HasSubstr;

NoiseParams Gabor(int dims, double frequency = 1) {
  NoiseParams p;
  p.kind = NoiseKind::kGabor;
  p.dims = dims;
  p.frequency = frequency;
  return p;
}
// The envelope's Gaussian, of half amplitude bandwidth octaves apart (Lagae et al. 2009, 4).
double Width(double bandwidth) {
  const double two = std::exp2(bandwidth);
  return (two - 1) / (two + 1) * std::sqrt(std::numbers::pi / std::numbers::ln2);
}

const char* const kCases[] = {"",
                              "seed=-1 signed=1 color=1",
                              "bandwidth=0.2 orientation=anisotropic angle=30 freq=30",
                              "bandwidth=4 impulses=32 octaves=3 turbulence=1",
                              "dims=3 z=0.3 impulses=1 freq=20",
                              "dims=3 orientation=hybrid direction=1,-2,0.5 angle=-400 freq=7",
                              "orientation=hybrid direction=3,4 period=4,7 octaves=2",
                              "dims=1 bandwidth=0.5 octaves=2",
                              "dims=3 period=2,5,0 orientation=anisotropic direction=0,0,1 z=-8.5 freq=11",
                              "gradient=1 freq=3 dims=3",
                              "gradient=1 freq=3 orientation=anisotropic bandwidth=0.6 period=3",
                              "pack=normal dims=3 octaves=2 freq=3",
                              "warp=0.7 dims=2 freq=4",
                              "offset=2147483646.5,-8388609 freq=50",
                              "sum=ridged octaves=3 bias=0.4 contrast=0.7",
                              "antialias=1 octaves=4 freq=40 lacunarity=2.3",
                              "slices=2 dims=3"};
template <class F>
void ForEveryCase(F check) {
  ImageSpec spec(37, 19, 4);
  spec.data_window = {-5, 3, 32, 22};
  spec.display_window = {-2, -3, 70, 20};
  for (const char* const example : kCases) {
    SCOPED_TRACE(example);
    const ops::OpInfo& op = *ops::FindOp("gabor");
    check(op.make({}, ops::ParseExample(op, example), &spec));
  }
}

TEST(Gabor, EveryOptionIsWithinItsBound) {
  VerifyOptions options;
  options.samples = 1, options.tile_size = 24;
  OnEveryTarget([&] {
    ForEveryCase([&](const Node& node) {
      const VerifyReport report = Verify(node, PixelType::kFloat, options);
      EXPECT_TRUE(report.within_bound) << report.Summary();
    });
  });
}

TEST(Gabor, TargetsWithFusedMultiplyAddAgreeInEveryBit) {
  if (!testing::HasBothFusedTargets()) GTEST_SKIP() << "there are not both AVX2 and AVX-512";
  RenderOptions tiles;
  tiles.threads = 3, tiles.tile_width = 17, tiles.tile_height = 13;
  ForEveryCase([&](const Node& node) {
    SetSimdTarget("AVX2");
    const std::vector<float> avx2 = Values(node);
    SetSimdTarget("AVX3");
    const std::vector<float> avx3 = Values(node, tiles);
    EXPECT_EQ(std::memcmp(avx2.data(), avx3.data(), avx2.size() * sizeof(float)), 0);
  });
  SetSimdTarget("auto");
}

// Positions of one cell share a list of impulses, positions anywhere do not: the same bits in any order.
TEST(Gabor, NeighboursDoNotMatter) {
  OnEveryTarget([] {
    for (int dims = 1; dims <= 3; ++dims) {
      NoiseParams p = Gabor(dims);
      p.impulses = 32;
      p.period = {4, 0, 5, 0};
      std::vector<float> sorted;
      for (int n = 0; n < 300; ++n) {
        for (int a = 0; a < dims; ++a) sorted.push_back(static_cast<float>(a == 0 ? 0.01 * n - 1 : 0.3 * a));
      }
      std::vector<size_t> order(300);
      for (size_t i = 0; i < order.size(); ++i) order[i] = i * 143 % 300;
      std::vector<float> mixed;
      for (const size_t i : order) {
        for (int a = 0; a < dims; ++a)
          mixed.push_back(sorted[i * static_cast<size_t>(dims) + static_cast<size_t>(a)]);
      }
      const std::vector<float> one = At(sorted, p), other = At(mixed, p);
      for (size_t i = 0; i < order.size(); ++i) ASSERT_EQ(one[order[i]], other[i]) << dims << " " << i;
    }
  });
}

TEST(Gabor, MeanZeroAndDeviationOneThirdWhateverTheParameters) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> anywhere(0, 4000);
  for (int dims = 1; dims <= 3; ++dims) {
    const size_t count = 60000;
    std::vector<float> positions(count * static_cast<size_t>(dims));
    for (float& v : positions) v = anywhere(random);
    for (const GaborOrientation orientation :
         {GaborOrientation::kIsotropic, GaborOrientation::kAnisotropic, GaborOrientation::kHybrid}) {
      if (dims == 1 && orientation == GaborOrientation::kHybrid) continue;
      for (const auto& [bandwidth, impulses] : {std::pair{1.0, 16.0}, {1.0, 1.0}, {0.3, 4.0}, {6.0, 32.0}}) {
        SCOPED_TRACE(std::to_string(dims) + "-D, bandwidth " + std::to_string(bandwidth) + ", impulses " +
                     std::to_string(impulses) + ", orientation " +
                     std::to_string(static_cast<int>(orientation)));
        NoiseParams p = Gabor(dims);
        p.orientation = orientation, p.bandwidth = bandwidth, p.impulses = impulses;
        double mean = 0, square = 0;
        for (const float v : At(positions, p)) mean += v, square += static_cast<double>(v) * v;
        EXPECT_NEAR(mean / count, 0, 6e-3);
        EXPECT_NEAR(9 * square / count, 1, impulses == 1 ? 0.06 : 0.03);
      }
    }
  }
}

// Power of a periodic square picture, by frequency in waves per cell; f(fx, fy, power).
template <class F>
void ForSpectrum(const NoiseParams& params, int size, F f) {
  NoiseParams p = params;
  const int cells = static_cast<int>(p.frequency);
  p.period = {cells, cells, 0, 0};
  const std::vector<float> v = Values(Noise(ImageSpec(size, size, 1), p));
  const auto n = static_cast<size_t>(size);
  std::vector<std::complex<double>> data(v.begin(), v.end());
  // A transform by halves of every row, then of every column.
  const std::function<void(std::complex<double>*, size_t, size_t)> transform = [&](auto* at, size_t count,
                                                                                   size_t step) {
    std::vector<std::complex<double>> line(count);
    for (size_t i = 0; i < count; ++i) {
      size_t back = 0;
      for (size_t bit = 1, other = count / 2; bit < count; bit *= 2, other /= 2)
        back |= (i & bit) != 0 ? other : 0;
      line[back] = at[i * step];
    }
    for (size_t half = 1; half < count; half *= 2) {
      for (size_t k = 0; k < half; ++k) {
        const std::complex<double> w =
            std::polar(1.0, -std::numbers::pi * static_cast<double>(k) / static_cast<double>(half));
        for (size_t i = k; i < count; i += 2 * half) {
          const std::complex<double> a = line[i], b = w * line[i + half];
          line[i] = a + b, line[i + half] = a - b;
        }
      }
    }
    for (size_t i = 0; i < count; ++i) at[i * step] = line[i];
  };
  for (size_t y = 0; y < n; ++y) transform(data.data() + y * n, n, 1);
  for (size_t x = 0; x < n; ++x) transform(data.data() + x, n, n);
  for (int ky = -size / 2; ky < size / 2; ++ky) {
    for (int kx = -size / 2; kx < size / 2; ++kx) {
      const size_t at = static_cast<size_t>((ky + size) % size) * n + static_cast<size_t>((kx + size) % size);
      f(static_cast<double>(kx) / cells, static_cast<double>(ky) / cells, std::norm(data[at]));
    }
  }
}

// One direction: two Gaussians, at the frequency and its opposite, whose power has deviation a / sqrt(4 pi).
TEST(Gabor, PowerOfOneDirectionIsAGaussianAtItsFrequency) {
  for (const double bandwidth : {0.3, 0.7}) {
    NoiseParams p = Gabor(2, 128);
    p.orientation = GaborOrientation::kAnisotropic;
    p.angle = 30;
    p.bandwidth = bandwidth;
    const double wx = std::cos(std::numbers::pi / 6), wy = -std::sin(std::numbers::pi / 6);  // y is down
    double all = 0, along = 0, across = 0, along2 = 0, across2 = 0, far = 0, total = 0;
    const double a = Width(bandwidth), deviation = a / std::sqrt(4 * std::numbers::pi);
    ForSpectrum(p, 512, [&](double fx, double fy, double power) {
      const double u = fx * wx + fy * wy, v = fy * wx - fx * wy;
      total += power;
      if (std::hypot(std::fabs(u) - 1, v) > 5 * deviation) far += power;
      if (u <= 0 || std::hypot(u - 1, v) > 5 * deviation) return;
      all += power, along += u * power, across += v * power;
      along2 += (u - 1) * (u - 1) * power, across2 += v * v * power;
    });
    SCOPED_TRACE("bandwidth " + std::to_string(bandwidth));
    EXPECT_NEAR(along / all, 1, 0.01);
    EXPECT_NEAR(across / all, 0, 0.01);
    EXPECT_NEAR(std::sqrt(along2 / all) / deviation, 1, 0.04);
    EXPECT_NEAR(std::sqrt(across2 / all) / deviation, 1, 0.04);
    EXPECT_LT(far / total, 2e-3);  // of a band
  }
}

// Any direction: the same on every bearing, and on a radius what a ring of Gaussians has.
TEST(Gabor, PowerOfAnyDirectionIsARing) {
  for (const double bandwidth : {0.3, 1.0}) {
    SCOPED_TRACE("bandwidth " + std::to_string(bandwidth));
    NoiseParams p = Gabor(2, 128);
    p.bandwidth = bandwidth;
    const double a = Width(bandwidth);
    constexpr int kBins = 32, kSectors = 8;
    double power_at[kBins] = {}, expected_at[kBins] = {}, sector[kSectors] = {}, total = 0, expected = 0;
    ForSpectrum(p, 512, [&](double fx, double fy, double power) {
      const double f = std::hypot(fx, fy);
      // exp(-2 pi |f - w|^2 / a^2) over the circle of w: a Bessel function, by its integral.
      double ring = 0;
      constexpr int kSteps = 64;
      const double k = 2 * std::numbers::pi / (a * a);
      for (int i = 0; i < kSteps; ++i)
        ring += std::exp(k * (2 * f * std::cos(std::numbers::pi * (i + 0.5) / kSteps) - f * f - 1));
      const int bin = static_cast<int>(f * 16);
      total += power, expected += ring;
      if (bin < kBins) power_at[bin] += power, expected_at[bin] += ring;
      const double bearing = std::atan2(fy, fx) / (2 * std::numbers::pi) + 1;
      sector[static_cast<int>(bearing * kSectors) % kSectors] += power;
    });
    for (int bin = 0; bin < kBins; ++bin)
      EXPECT_NEAR(power_at[bin] / total, expected_at[bin] / expected, 0.006) << "at " << bin / 16.0;
    for (const double s : sector) EXPECT_NEAR(s / total * kSectors, 1, 0.08);
  }
}

// Hybrid: waves run perpendicular to the direction, along which the noise only fades.
TEST(Gabor, HybridWavesArePerpendicular) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> anywhere(0, 500);
  NoiseParams p = Gabor(3);
  p.orientation = GaborOrientation::kHybrid;
  p.direction = {0, 3, 4};
  p.bandwidth = 0.5;
  const auto correlation = [&](const std::vector<double>& step) {
    std::vector<float> from, to;
    for (int i = 0; i < 30000; ++i) {
      for (size_t a = 0; a < 3; ++a) {
        from.push_back(anywhere(random));
        to.push_back(from.back() + static_cast<float>(0.6 * step[a]));
      }
    }
    const std::vector<float> v = At(from, p), w = At(to, p);
    double sum = 0, square = 0;
    for (size_t i = 0; i < v.size(); ++i) sum += v[i] * w[i], square += (v[i] * v[i] + w[i] * w[i]) / 2;
    return sum / square;
  };
  // The envelope's own correlation at 0.6 waves, times the mean of a wave's: 1 along, J0(2 pi 0.6) across.
  const double a = Width(0.5), fade = std::exp(-std::numbers::pi * a * a * 0.36 / 2), bessel = -0.40257;
  EXPECT_NEAR(correlation({0, 0.6, 0.8}), fade, 0.02);
  EXPECT_NEAR(correlation({1, 0, 0}), fade * bessel, 0.03);
  EXPECT_NEAR(correlation({0, 0.8, -0.6}), fade * bessel, 0.03);
}

TEST(Gabor, PeriodsRepeatInEveryBitAndHaveNoSeam) {
  OnEveryTarget([] {
    for (const std::array<int, 4> period : {std::array{8, 6, 2, 0}, {2, 0, 7, 0}, {0, 257, 3, 0}}) {
      NoiseParams p = Gabor(3);
      p.period = period;
      p.octaves = 2;
      const std::vector<float> here = {0.25f, 0.5f, 0.875f, 1.0f, 1.5f, 0.0f, 1.96875f, 0.125f, 1.25f};
      std::vector<float> there = here;
      for (size_t i = 0; i < there.size(); ++i)
        there[i] += static_cast<float>(period[i % 3] * (i < 3 ? 1 : -2));
      EXPECT_EQ(At(here, p), At(there, p));
      NoiseParams endless = p;
      endless.period = {};
      EXPECT_NE(At(here, endless), At(there, endless));
    }
  });
  NoiseParams p = Gabor(2, 8);
  p.period = {8, 8, 0, 0};
  ImageSpec spec(64, 64, 1);
  spec.data_window = {0, 0, 128, 64};
  const std::vector<float> v = Values(Noise(spec, p));
  double seam = 0, inside = 0;
  for (size_t y = 0; y < 64; ++y) {
    EXPECT_EQ(v[y * 128], v[y * 128 + 64]);
    seam += std::fabs(v[y * 128 + 64] - v[y * 128 + 63]),
        inside += std::fabs(v[y * 128 + 32] - v[y * 128 + 31]);
  }
  EXPECT_LT(seam, 2 * inside);
}

TEST(Gabor, SlopesAreDerivativesAndPicturesArePositions) {
  OnEveryTarget([] {
    for (const GaborOrientation orientation : {GaborOrientation::kIsotropic, GaborOrientation::kHybrid}) {
      NoiseParams p = Gabor(3);
      p.orientation = orientation;
      const std::vector<float> at = {0.4f, 1.7f, -2.3f};
      p.output = NoiseOutput::kGradient;
      const std::vector<float> slope = At(at, p, 4);
      p.output = NoiseOutput::kValue;
      for (size_t a = 0; a < 3; ++a) {
        std::vector<float> more = at, less = at;
        more[a] += 1.0f / 256, less[a] -= 1.0f / 256;
        EXPECT_NEAR(slope[a + 1], 128 * (At(more, p)[0] - At(less, p)[0]), 6e-3) << a;
      }
    }
    NoiseParams p = Gabor(2, 0);  // a wave per pixel
    const std::vector<float> grid = Values(Noise(ImageSpec(8, 1, 1), p));
    p.frequency = 1;
    std::vector<float> positions;
    for (int x = 0; x < 8; ++x) positions.insert(positions.end(), {static_cast<float>(x) + 0.5f, 0.5f});
    EXPECT_THAT(At(positions, p), ::testing::Pointwise(::testing::FloatNear(2e-6f), grid));
  });
}

TEST(Gabor, HardPositions) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  OnEveryTarget([] {
    EXPECT_THAT(At({kNaN, 0, 0.5f, kInf, -kInf, 0.25f}, Gabor(2)), ::testing::Each(0.0f));
    for (const float v : At({3e38f, 1, -1e20f, 8388609, -0.0f, 2147483648.0f}, Gabor(2))) {
      EXPECT_TRUE(std::isfinite(v));
      EXPECT_LT(std::fabs(v), 3);
    }
    // Both sides of a cell's edge, and of 0.
    const auto radius = static_cast<float>(std::sqrt(5 / std::numbers::pi) / Width(1));
    const std::vector<float> v =
        At({radius * 0.9999999f, 0.3f, radius * 1.0000001f, 0.3f, -1e-30f, 0.3f, 0, 0.3f}, Gabor(2));
    EXPECT_NEAR(v[0], v[1], 4e-6);
    EXPECT_NEAR(v[2], v[3], 2e-6);
  });
  NoiseParams none = Gabor(2, 0);
  none.octaves = 0;
  EXPECT_THAT(Values(Noise(ImageSpec(2, 2, 1), none)), ::testing::Each(0.0f));
}

TEST(Gabor, RefusalsNameTheParameter) {
  const auto refusal = [](auto change) {
    NoiseParams p = Gabor(2);
    change(p);
    return Refusal([&] { Noise(ImageSpec(4, 4, 1), p); });
  };
  EXPECT_EQ(refusal([](NoiseParams&) {}), "accepted");
  EXPECT_THAT(refusal([](NoiseParams& p) { p.bandwidth = 0; }),
              HasSubstr("bandwidth: found 0, expected 0.05 to 100"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.bandwidth = std::nan(""); }), HasSubstr("bandwidth"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.impulses = 33; }), HasSubstr("impulses: found 33"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.dims = 4; }), HasSubstr("dims: found 4, expected 1 to 3"));
  EXPECT_THAT(refusal([](NoiseParams& p) {
                p.period = {1, 0, 0, 0};
              }),
              HasSubstr("period: found 1, expected 0, or 2 cells or more"));
  EXPECT_THAT(refusal([](NoiseParams& p) {
                p.orientation = GaborOrientation::kAnisotropic, p.direction = {0, 0, 1};
              }),
              HasSubstr("direction"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.dims = 1, p.orientation = GaborOrientation::kHybrid; }),
              HasSubstr("orientation"));
  EXPECT_THAT(refusal([](NoiseParams& p) { p.lattice = NoiseLattice::kOsl; }), HasSubstr("lattice"));
}

}  // namespace
}  // namespace tessera
