// Lookups over what a pixel covers of a table: what they keep, how near a floor towards the horizon comes to
// the mean of many samples, as a picture at coordinates and as a solid block, edges and seams, hard places.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/lookups.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits, testing::OnEveryTarget, testing::RandomTable, testing::Samples,
    testing::Values, testing::WorstError;
using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr Wrap kWraps[] = {Wrap::kClamp, Wrap::kGlClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror};
constexpr TableFilter kBoth[] = {TableFilter::kTrilinear, TableFilter::kEwa};

// Coordinates by a function of the pixel's centre.
Image Coordinates(int width, int height, int channels, const std::function<double(double, double, int)>& at) {
  Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c)
        image.at<float>(x, y, c) = static_cast<float>(at(x + 0.5, y + 0.5, c));
    }
  }
  return image;
}

// A floor under a picture of 128 x 124, its horizon at y = -4, turned by 30 degrees, in periods of its
// pattern's block of 128 entries.
constexpr int kWide = 128, kHigh = 124;
double OnFloor(double x, double y, int axis) {
  const double q = (y + 4) / (kHigh + 4), across = (x - kWide / 2) / q, along = 0.8 * kWide / q;
  const double c = std::sqrt(0.75), s = 0.5;
  return axis == 0 ? (c * across - s * along + 64.3) / 128 : (s * across + c * along + 17.1) / 128;
}
double Checker(double u, double v) {
  const auto cell = [](double at) { return static_cast<int64_t>(std::floor(at * 8)); };
  return (cell(u) + cell(v)) % 2 == 0 ? 0.9 : 0.05;
}
// Root of the mean square of what a picture of the floor is off by from 16 x 16 samples of the pattern per
// pixel.
double FloorError(const Node& seen) {
  const Samples got = Values(seen);
  const size_t channels = seen.spec().channels.size();
  static const std::vector<double>& truth = *new std::vector<double>([] {
    std::vector<double> means;
    for (int i = 0; i < kWide * kHigh; ++i) {
      double sum = 0;
      for (int k = 0; k < 256; ++k) {
        const double x = i % kWide + (k % 16 + 0.5) / 16, y = i / kWide + (k / 16 + 0.5) / 16;
        sum += Checker(OnFloor(x, y, 0), OnFloor(x, y, 1)) / 256;
      }
      means.push_back(sum);
    }
    return means;
  }());
  double sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) sum += std::pow(got[channels * i] - truth[i], 2);
  return std::sqrt(sum / static_cast<double>(truth.size()));
}
Table Pattern(int channels) {
  Samples samples;
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 128; ++x)
      samples.insert(samples.end(), static_cast<size_t>(channels),
                     static_cast<float>(Checker((x + 0.5) / 128, (y + 0.5) / 128)));
  }
  return Table({128, 128}, channels, samples, TableAlign::kCentres);
}

TEST(LookupFootprintTest, AFloorTowardsTheHorizonIsNearTheMeanOfManySamples) {
  const Node coords = FromImage(Coordinates(kWide, kHigh, 2, OnFloor));
  for (const int channels : {1, 3}) {
    const Table table = Pattern(channels);
    const auto error = [&](TableFilter filter, int anisotropy) {
      LookupParams p{.filter = filter, .wrap = {Wrap::kRepeat}};
      p.anisotropy = anisotropy;
      const double e = FloorError(Lookup(coords, table, p));
      std::printf("filter %d aniso %2d: %.4f\n", static_cast<int>(filter), anisotropy, e);
      return e;
    };
    const double nearest = error(TableFilter::kNearest, 1), linear = error(TableFilter::kLinear, 1),
                 mip = error(TableFilter::kMipmap, 1), one = error(TableFilter::kTrilinear, 1),
                 four = error(TableFilter::kTrilinear, 4), eight = error(TableFilter::kTrilinear, 8),
                 sixteen = error(TableFilter::kTrilinear, 16), ewa = error(TableFilter::kEwa, 16);
    EXPECT_LT(mip, linear);
    EXPECT_LT(linear, nearest);
    EXPECT_LT(one, linear);
    EXPECT_LT(four, 0.6 * mip);
    EXPECT_LE(eight, four);
    EXPECT_LE(sixteen, eight);
    EXPECT_LT(ewa, 0.5 * mip);
  }
}

TEST(LookupFootprintTest, ASolidBlockOnAFloorIsAsGood) {
  // Cubes of 2 entries in a block of 16^3, tiled; the floor cuts them at a height.
  Samples samples;
  for (int i = 0; i < 64 * 64 * 64; ++i) {
    const int x = i % 64, y = i / 64 % 64, z = i / 4096;
    samples.push_back((x / 8 + y / 8 + z / 8) % 2 == 0 ? 0.9f : 0.05f);
  }
  Image block(ImageSpec(64, 64 * 64, 1));
  std::memcpy(block.view().data, samples.data(), samples.size() * sizeof(float));
  const Node positions = FromImage(Coordinates(
      kWide, kHigh, 3, [](double x, double y, int c) { return c == 2 ? 4.5 / 64 : OnFloor(x, y, c); }));
  const Node white = FromImage(Coordinates(kWide, kHigh, 3, [](double, double, int) { return 1; }));
  const auto error = [&](TableFilter filter, bool lod, int anisotropy) {
    SolidParams p;
    p.blend = SolidBlend::kReplace, p.level_of_detail = lod;
    p.lookup.filter = filter, p.lookup.wrap = {Wrap::kRepeat}, p.lookup.anisotropy = anisotropy;
    const double e =
        FloorError(SolidTexture(white, positions, FromImage(block), {.dims = 3, .slices = {64}}, p));
    std::printf("solid filter %d aniso %2d: %.4f\n", static_cast<int>(filter) + (lod ? 100 : 0), anisotropy,
                e);
    return e;
  };
  const double linear = error(TableFilter::kLinear, false, 1), mip = error(TableFilter::kLinear, true, 1),
               four = error(TableFilter::kTrilinear, true, 4),
               eight = error(TableFilter::kTrilinear, true, 8), ewa = error(TableFilter::kEwa, false, 16);
  EXPECT_LT(mip, linear);
  EXPECT_LT(four, 0.8 * mip);
  EXPECT_LE(eight, four);
  EXPECT_LT(ewa, 0.8 * mip);
}

TEST(LookupFootprintTest, WhereAPixelCoversNoMoreThanAnEntryBitsAreThoseOfLinear) {
  const std::vector<std::vector<int>> shapes = {{1}, {2}, {37}, {1, 1}, {64, 33}, {17, 1}, {17, 17, 17}};
  OnEveryTarget([&] {
    for (const std::vector<int>& sizes : shapes) {
      for (const int channels : {1, 3, 4}) {
        for (const TableAlign align : {TableAlign::kCentres, TableAlign::kEnds}) {
          for (const Wrap wrap : kWraps) {
            const Table table = RandomTable(sizes, channels, align);
            // Steps of 0.9 entries along the diagonal, through the table and beyond both ends.
            const Image coords = Coordinates(70, 5, 3, [&](double x, double y, int c) {
              const int n = c < table.dims() ? table.size(c) : 1;
              return ((c == 1 ? y : x) - 20) * 0.6 / n;
            });
            LookupParams p{.wrap = {wrap}, .border = {0.5, -1}};
            const Image linear = Render(Lookup(FromImage(coords), table, p));
            for (const TableFilter filter : kBoth) {
              p.filter = filter;
              ExpectSameBits(Render(Lookup(FromImage(coords), table, p)), linear);
            }
          }
        }
      }
    }
  });
}

TEST(LookupFootprintTest, StaysWithinItsBound) {
  const std::vector<std::vector<int>> shapes = {{1},     {100},      {1, 1},    {64, 33},
                                                {1, 40}, {17, 5, 9}, {128, 128}};
  // A floor, a swirl, steps that differ from pixel to pixel, one axis alone.
  const std::vector<std::function<double(double, double, int)>> maps = {
      [](double x, double y, int c) { return c == 0   ? 3 * x / (y + 1)
                                             : c == 1 ? 17 / (y + 1)
                                                      : 0.3; },
      [](double x, double y, int c) {
        return c == 0 ? 0.5 + 0.4 * std::sin(0.3 * x) * y / 12 : c == 1 ? 0.07 * x - 0.11 * y : 0.05 * y;
      },
      [](double x, double y, int c) { return std::fmod(std::pow(x * 12.9898 + y * 78.233 + c, 1.7), 3) - 1; },
      [](double x, double, int c) { return c == 0 ? 0.21 * x : 0.4; }};
  double worst = 0;
  OnEveryTarget([&] {
    for (const std::vector<int>& sizes : shapes) {
      for (const int channels : {1, 3}) {
        for (const TableAlign align : {TableAlign::kCentres, TableAlign::kEnds}) {
          const Table table = RandomTable(sizes, channels, align);
          for (const Wrap wrap : kWraps) {
            for (const TableFilter filter : kBoth) {
              for (size_t m = 0; m < maps.size(); ++m) {
                const Node coords = FromImage(Coordinates(13, 7, 3, maps[m]));
                LookupParams p{.filter = filter, .wrap = {wrap, Wrap::kMirror}, .border = {0.5, -1}};
                p.anisotropy = m % 2 == 0 ? 16 : 3;
                const double error = WorstError(Lookup(coords, table, p), coords);
                EXPECT_LE(error, 4.0)
                    << sizes.size() << " " << sizes[0] << " " << static_cast<int>(wrap) << " "
                    << static_cast<int>(align) << " filter " << static_cast<int>(filter) << " map " << m;
                worst = std::max(worst, error);
              }
            }
          }
        }
      }
    }
  });
  std::printf("worst: %.3f u\n", worst);
}

TEST(LookupFootprintTest, AConstantStaysAndNothingLeavesTheRange) {
  const Table flat({16, 16}, 1, Samples(256, 0.7f), TableAlign::kCentres), noise = RandomTable({50, 31}, 1);
  const Node coords = FromImage(Coordinates(
      40, 40, 2, [](double x, double y, int c) { return c == 0 ? x / (0.1 + y) : 5 / (0.1 + y); }));
  for (const TableFilter filter : kBoth) {
    for (const Wrap wrap : {Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
      const LookupParams p{.filter = filter, .wrap = {wrap}};
      for (const float v : Values(Lookup(coords, flat, p))) ASSERT_NEAR(v, 0.7f, 1e-7f);
      for (const float v : Values(Lookup(coords, noise, p))) ASSERT_TRUE(v >= -1 && v <= 2) << v;
    }
  }
}

TEST(LookupFootprintTest, AnIntervalOfATableOfOneAxisIsItsMean) {
  // Entries of a random step function, 20 to 40 of them under a pixel: against the mean of the interval.
  const Table table = RandomTable({4096}, 1);
  double mean = 0, ewa = 0, spread = 0;
  const auto place = [](double x) { return (0.02 * x * x + 30 * x + 100) / 4096; };
  const Image coords = Coordinates(100, 1, 1, [&](double x, double, int) { return place(x); });
  for (const TableFilter filter : kBoth) {
    const Samples got = Values(Lookup(FromImage(coords), table, {.filter = filter}));
    for (int x = 1; x < 99; ++x) {
      double sum = 0;
      for (int k = 0; k < 4000; ++k)
        sum += table.At(static_cast<int64_t>(place(x + (k + 0.5) / 4000) * 4096), 0) / 4000;
      (filter == TableFilter::kEwa ? ewa : mean) += std::pow(got[static_cast<size_t>(x)] - sum, 2) / 98;
      spread += std::pow(sum - 0.5, 2) / 196;
    }
  }
  std::printf("one axis, rms of means' own %.4f: trilinear %.4f, ewa %.4f\n", std::sqrt(spread),
              std::sqrt(mean), std::sqrt(ewa));
  EXPECT_LT(mean, 0.5 * spread);
  EXPECT_LT(ewa, 0.5 * spread);
}

TEST(LookupFootprintTest, EdgesOfObjectsAndSeamsOfPeriodsHardlyCount) {
  const Table table = RandomTable({256, 256}, 1);
  const auto ramp = [](double x, double y, int c) { return c == 0 ? 0.011 * x : 0.004 * y; };
  const Image whole = Coordinates(64, 32, 2, ramp);
  // The same surface ending at another one, and with its coordinates brought back into a period.
  const Image edge = Coordinates(64, 32, 2, ramp), seam = Coordinates(64, 32, 2, ramp);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      if (x >= 40)
        edge.at<float>(x, y, 0) = 57.3f + 0.001f * static_cast<float>(x), edge.at<float>(x, y, 1) = -80;
      seam.at<float>(x, y, 0) = std::fmod(static_cast<float>(x) * 0.011f + 0.75f, 1.0f);
    }
  }
  const Image unbroken = Coordinates(64, 32, 2, ramp);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) unbroken.at<float>(x, y, 0) = static_cast<float>(x) * 0.011f + 0.75f;
  }
  for (const TableFilter filter : kBoth) {
    const LookupParams p{.filter = filter, .wrap = {Wrap::kRepeat}};
    const Samples want = Values(Lookup(FromImage(whole), table, p)),
                  got = Values(Lookup(FromImage(edge), table, p)),
                  linear = Values(Lookup(FromImage(whole), table, {.wrap = {Wrap::kRepeat}}));
    const Samples with = Values(Lookup(FromImage(seam), table, p)),
                  without = Values(Lookup(FromImage(unbroken), table, p));
    double difference = 0, filtered = 0, at_seam = 0;
    for (int y = 0; y < 32; ++y) {
      const size_t i = static_cast<size_t>(y * 64 + 39);
      difference += std::fabs(got[i] - want[i]), filtered += std::fabs(linear[i] - want[i]);
      for (int x = 0; x < 64; ++x) {
        const size_t k = static_cast<size_t>(y * 64 + x);
        at_seam = std::max(at_seam, double{std::fabs(with[k] - without[k])});
      }
    }
    std::printf("edge: %.4f of %.4f; seam: at most %.4f\n", difference / 32, filtered / 32, at_seam);
    EXPECT_LT(difference, 0.05 * filtered);
    EXPECT_LT(at_seam, 0.05);
  }
  // A masked neighbour, or one behind the projector, is none.
  const auto with_one = [&](double x, double y, int c) { return c == 2 ? 1 : ramp(x, y, c); };
  const Image masked = Coordinates(64, 32, 3, with_one), behind = Coordinates(64, 32, 3, with_one);
  for (int y = 0; y < 32; ++y) {
    for (int x = 40; x < 64; ++x) {
      masked.at<float>(x, y, 0) = masked.at<float>(x, y, 1) = 1e6f, masked.at<float>(x, y, 2) = 0;
      behind.at<float>(x, y, 2) = -1;
    }
  }
  const Image cut = Render(FromImage(Coordinates(40, 32, 2, ramp)));
  for (const TableFilter filter : kBoth) {
    const LookupParams p{.filter = filter, .wrap = {Wrap::kRepeat}};
    LookupParams hidden = p, projective = p;
    hidden.mask = 2, projective.projective = true;
    const Samples want = Values(Lookup(FromImage(cut), table, p)),
                  a = Values(Lookup(FromImage(masked), table, hidden)),
                  b = Values(Lookup(FromImage(behind), table, projective));
    const size_t channels = a.size() / (64 * 32);
    for (size_t y = 0; y < 32; ++y) {
      for (size_t x = 0; x < 40; ++x) {
        ASSERT_EQ(a[channels * (64 * y + x)], want[40 * y + x]) << x << "," << y;
        ASSERT_EQ(b[64 * y + x], want[40 * y + x]) << x << "," << y;
      }
    }
  }
}

TEST(LookupFootprintTest, HardPlaces) {
  // Coordinates that are no numbers, endless, huge; pictures of one row, column, pixel.
  const float values[] = {kNaN, kInf, -kInf, 1e30f, -1e30f, 1e8f, 0, 1, -1e-30f, 0.5f, 3e38f, -3e38f};
  for (const std::vector<int>& sizes :
       std::vector<std::vector<int>>{{7}, {5, 4}, {4, 5, 3}, {1, 1}, {1, 9}}) {
    const Table table = RandomTable(sizes, 2);
    for (const auto& [w, h] : std::vector<std::pair<int, int>>{{12, 12}, {12, 1}, {1, 12}, {1, 1}}) {
      const Image coords = Coordinates(w, h, 3, [&](double x, double y, int c) {
        return values[static_cast<size_t>(7 * x + 5 * y + c * 3) % 12];
      });
      for (const Wrap wrap : kWraps) {
        for (const TableFilter filter : kBoth) {
          for (const bool nan : {false, true}) {
            LookupParams p{.filter = filter, .wrap = {wrap}, .border = {0.25, 0.5}, .propagate_nan = nan};
            EXPECT_LE(WorstError(Lookup(FromImage(coords), table, p), FromImage(coords)), 4.0)
                << sizes.size() << " " << w << "x" << h << " " << static_cast<int>(wrap) << " "
                << static_cast<int>(filter);
            // What is lost is what linear lookups lose.
            const Samples got = Values(Lookup(FromImage(coords), table, p));
            p.filter = TableFilter::kLinear;
            const Samples linear = Values(Lookup(FromImage(coords), table, p));
            for (size_t i = 0; i < got.size(); ++i) EXPECT_EQ(std::isnan(got[i]), std::isnan(linear[i]));
          }
        }
      }
    }
  }
  // An entry that is no number reaches the pixels that cover it, and no others.
  Table holed = RandomTable({64, 64}, 1);
  Samples samples = holed.Samples();
  samples[64 * 40 + 40] = kNaN;
  holed = Table({64, 64}, 1, samples, TableAlign::kCentres);
  const Image coords =
      Coordinates(32, 32, 2, [](double x, double y, int c) { return (c == 0 ? x : y) * 2 / 64; });
  for (const TableFilter filter : kBoth) {
    const Samples got = Values(Lookup(FromImage(coords), holed, {.filter = filter}));
    EXPECT_TRUE(std::isnan(got[32 * 20 + 20]));
    EXPECT_FALSE(std::isnan(got[32 * 10 + 20]));
    EXPECT_TRUE(Verify(Lookup(FromImage(coords), holed, {.filter = filter})).within_bound);
  }
}

TEST(LookupFootprintTest, TablesAsImagesAndAsValuesAreTheSame) {
  const Image picture = testing::Picture({0, 0, 40, 36}, 3, PixelType::kFloat, 5);
  const Image coords = Coordinates(50, 40, 2, OnFloor);
  for (const TableFilter filter : kBoth) {
    const LookupParams p{.filter = filter, .wrap = {Wrap::kRepeat, Wrap::kMirror}};
    EXPECT_EQ(Values(Lookup(FromImage(coords), FromImage(picture), {}, p)),
              Values(Lookup(FromImage(coords), TableFromImage(picture.view()), p)));
    const VerifyReport report = Verify(Lookup(FromImage(coords), FromImage(picture), {}, p));
    EXPECT_TRUE(report.within_bound) << report.max_error;
  }
}

TEST(LookupFootprintTest, RefusesWhatItCannot) {
  const Node coords = FromImage(Coordinates(4, 4, 4, OnFloor));
  for (const int n : {0, -1, 65}) {
    LookupParams p{.filter = TableFilter::kTrilinear};
    p.anisotropy = n;
    EXPECT_THAT(Refusal([&] {
                  Lookup(coords, RandomTable({4, 4}, 1), p);
                }),
                HasSubstr("anisotropy " + std::to_string(n) + ", expected 1 to 64"));
  }
  EXPECT_THAT(Refusal([&] {
                Lookup(coords, RandomTable({2, 2, 2, 2}, 1), {.filter = TableFilter::kEwa});
              }),
              HasSubstr("found the filter ewa for 4 dimensions"));
}

}  // namespace
}  // namespace tessera
