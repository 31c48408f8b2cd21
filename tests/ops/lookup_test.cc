// Tables and lookups on every target: doc/maths/lookup.md's checks and hard cases, bounds against the
// oracle.
#include "tessera/ops/lookup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "support/lookups.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Pixels, testing::Random, testing::RandomTable, testing::Samples, testing::Values;
using testing::WorstError;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr TableFilter kFilters[] = {TableFilter::kNearest, TableFilter::kLinear, TableFilter::kTetrahedral,
                                    TableFilter::kCubic};
constexpr Wrap kWraps[] = {Wrap::kClamp, Wrap::kGlClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror};

class LookupTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, LookupTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST_P(LookupTest, StaysWithinItsBoundInEveryDimension) {
  const std::vector<std::vector<int>> shapes = {
      {1}, {2}, {37}, {1, 1}, {2, 3}, {64, 33}, {17, 17, 17}, {5, 2, 9}, {9, 9, 9, 9}, {8, 4, 2, 3}};
  const Samples coords = Random(4 * 600, -1.5f, 2.5f, 7);
  const Node in = Pixels(coords, 4);
  for (const std::vector<int>& sizes : shapes) {
    for (const int channels : {1, 3, 4}) {
      for (const TableAlign align : {TableAlign::kCentres, TableAlign::kEnds}) {
        const Table table = RandomTable(sizes, channels, align);
        for (const TableFilter filter : kFilters) {
          for (const Wrap wrap : kWraps) {
            LookupParams p{.filter = filter, .wrap = {wrap}, .border = {0.5, -1}};
            if (filter == TableFilter::kCubic) p.cubic = static_cast<CubicKernel>(channels % 3);
            const double worst = WorstError(Lookup(in, table, p), in);
            EXPECT_LE(worst, filter == TableFilter::kNearest ? 0.0 : 4.0)
                << sizes.size() << "-D of " << sizes[0] << ", " << channels << " channels, align "
                << int(align) << ", filter " << int(filter) << ", wrap " << int(wrap);
          }
        }
      }
    }
  }
}

TEST_P(LookupTest, EntriesAreExact) {
  for (const int n : {1, 2, 3, 33, 100, 4096}) {
    for (const TableAlign align : {TableAlign::kCentres, TableAlign::kEnds}) {
      const Table table = RandomTable({n}, 1, align);
      Samples at, want;
      for (int i = 0; i < n; ++i) {
        at.push_back(static_cast<float>(align == TableAlign::kCentres ? (i + 0.5) / n
                                        : n > 1                       ? i / (n - 1.0)
                                                                      : 0));
        want.push_back(table.At(i, 0));
      }
      for (const TableFilter filter : kFilters) {
        for (const Wrap wrap : kWraps) {
          // The last end of a period is the first one of the next.
          if (align == TableAlign::kEnds && wrap == Wrap::kRepeat && n > 1)
            at.back() = 0, want.back() = want[0];
          EXPECT_EQ(Values(Lookup(Pixels(at, 1), table, {.filter = filter, .wrap = {wrap}})), want)
              << n << " filter " << int(filter) << " wrap " << int(wrap) << " align " << int(align);
        }
      }
    }
  }
}

TEST_P(LookupTest, EdgesFollowTheWrap) {
  const Table table({4}, 1, Samples{1, 2, 4, 8}, TableAlign::kCentres);
  const auto at = [&](float s, Wrap wrap, TableFilter filter = TableFilter::kLinear) {
    return Values(Lookup(Pixels({s}, 1), table, {.filter = filter, .wrap = {wrap}, .border = {100}}))[0];
  };
  EXPECT_EQ(at(0, Wrap::kGlClamp), 50.5f);
  EXPECT_EQ(at(1, Wrap::kGlClamp), 54.0f);
  EXPECT_EQ(at(0, Wrap::kClamp), 1.0f);
  EXPECT_EQ(at(1, Wrap::kClamp), 8.0f);
  EXPECT_EQ(at(0, Wrap::kRepeat), 4.5f);
  EXPECT_EQ(at(1, Wrap::kRepeat), 4.5f);
  EXPECT_EQ(at(0, Wrap::kMirror), 1.0f);
  EXPECT_EQ(at(1, Wrap::kMirror), 8.0f);
  EXPECT_EQ(at(1, Wrap::kGlClamp, TableFilter::kNearest), 8.0f);
  EXPECT_EQ(at(5, Wrap::kGlClamp, TableFilter::kNearest), 8.0f);
  EXPECT_EQ(at(1, Wrap::kClamp, TableFilter::kNearest), 8.0f);
  EXPECT_EQ(at(1, Wrap::kMirror, TableFilter::kNearest), 8.0f);
  EXPECT_EQ(at(1, Wrap::kRepeat, TableFilter::kNearest), 1.0f);
  // -1e-9 - floor(-1e-9) is 1 in float: the seam, not an entry beyond it.
  EXPECT_EQ(at(-1e-9f, Wrap::kRepeat), 4.5f);
  EXPECT_EQ(at(-1e-30f, Wrap::kRepeat), 4.5f);
  EXPECT_EQ(at(1e8f, Wrap::kRepeat), 4.5f);
  EXPECT_EQ(at(1e8f, Wrap::kMirror), 1.0f);
  EXPECT_EQ(at(1e8f, Wrap::kClamp), 8.0f);
  EXPECT_EQ(at(-1e38f, Wrap::kClamp), 1.0f);
  EXPECT_EQ(at(1e38f, Wrap::kBlack), 100.0f);
  for (const TableFilter filter : kFilters) {
    EXPECT_EQ(at(kInf, Wrap::kClamp, filter), 8.0f);
    EXPECT_EQ(at(-kInf, Wrap::kClamp, filter), 1.0f);
    EXPECT_EQ(at(kInf, Wrap::kBlack, filter), 100.0f);
    EXPECT_EQ(at(kInf, Wrap::kRepeat, filter), 100.0f);
    EXPECT_EQ(at(-kInf, Wrap::kMirror, filter), 100.0f);
    for (const Wrap wrap : kWraps) EXPECT_EQ(at(kNaN, wrap, filter), 100.0f);
  }
  EXPECT_TRUE(std::isnan(Values(Lookup(Pixels({kNaN}, 1), table, {.propagate_nan = true}))[0]));
}

TEST_P(LookupTest, PeriodsAndMirrorsRepeat) {
  const Table table = RandomTable({13, 7}, 4);
  Samples base = Random(2 * 64, 0, 1, 3);
  for (float& v : base) v = std::round(v * 4096) / 4096;  // adding whole numbers stays exact
  for (const TableFilter filter : kFilters) {
    const Samples repeat =
        Values(Lookup(Pixels(base, 2), table, {.filter = filter, .wrap = {Wrap::kRepeat}}));
    for (const float shift : {1.0f, -1.0f, 7.0f, -1000.0f}) {
      Samples moved = base;
      for (float& v : moved) v += shift;
      EXPECT_EQ(Values(Lookup(Pixels(moved, 2), table, {.filter = filter, .wrap = {Wrap::kRepeat}})), repeat);
    }
    const Samples mirror =
        Values(Lookup(Pixels(base, 2), table, {.filter = filter, .wrap = {Wrap::kMirror}}));
    for (const float about : {0.0f, 2.0f}) {
      Samples moved = base;
      for (float& v : moved) v = about - v;
      EXPECT_EQ(Values(Lookup(Pixels(moved, 2), table, {.filter = filter, .wrap = {Wrap::kMirror}})), mirror);
    }
  }
}

TEST_P(LookupTest, EntriesWithoutWeightDoNotLeak) {
  const Table table({5}, 1, Samples{1, kNaN, 3, kInf, 5}, TableAlign::kCentres);
  const Samples at = {0.1f, 0.5f, 0.9f, 0.0f, 1.0f, 0.3f, 0.2f};
  for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kTetrahedral, TableFilter::kCubic}) {
    const Samples v = Values(Lookup(Pixels(at, 1), table, {.filter = filter}));
    EXPECT_EQ(v[0], 1);
    EXPECT_EQ(v[1], 3);
    EXPECT_EQ(v[2], 5);
    if (filter != TableFilter::kCubic) {
      EXPECT_EQ(v[3], 1);
      EXPECT_EQ(v[4], 5);
    }
    EXPECT_TRUE(std::isnan(v[5]));
    EXPECT_TRUE(std::isnan(v[6]));
  }
  // The same through a colour table, and in three dimensions.
  EXPECT_THAT(
      Values(ApplyTables1D(Pixels({0, 0.5f, 1}, 1), {.tables = {table.WithAlign(TableAlign::kEnds)}})),
      ElementsAre(1, 3, 5));
  Samples cube(27 * 3, 0.25f);
  cube[3 * 13] = kNaN;  // the middle
  const Table three({3, 3, 3}, 3, cube, TableAlign::kEnds);
  for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kTetrahedral}) {
    const Samples v = Values(
        ApplyTable3D(Pixels({0, 0, 0, 7, 0.5f, 0, 1, 8, 0.5f, 0.5f, 0.5f, 9}, 4), three, {.filter = filter}));
    EXPECT_THAT(Samples(v.begin(), v.begin() + 8),
                ElementsAre(0.25f, 0.25f, 0.25f, 7, 0.25f, 0.25f, 0.25f, 8));
    EXPECT_TRUE(std::isnan(v[8]));
    EXPECT_EQ(v[9], 0.25f);
    EXPECT_EQ(v[11], 9);
  }
  // Opposite ends of the range meet in the middle.
  const Table wide({2}, 1, Samples{-FLT_MAX, FLT_MAX}, TableAlign::kEnds);
  EXPECT_EQ(Values(Lookup(Pixels({0.5f}, 1), wide))[0], 0);
}

TEST_P(LookupTest, ConstantsStayAndAffineFunctionsAreExact) {
  const Node coords = Pixels(Random(4 * 500, -2, 3, 5), 4);
  for (const TableFilter filter : kFilters) {
    for (const Wrap wrap : kWraps) {
      const Table flat({3, 2, 4}, 1, Samples(24, 0.7f), TableAlign::kCentres);
      for (const float v :
           Values(Lookup(coords, flat, {.filter = filter, .wrap = {wrap}, .border = {0.7f}}))) {
        ASSERT_NEAR(v, 0.7f, 4e-7f);
      }
    }
  }
  const auto affine = [](const double* s, double* v) { v[0] = 0.25 + 0.5 * s[0] - 0.125 * s[1] + 2 * s[2]; };
  for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kTetrahedral, TableFilter::kCubic}) {
    const FunctionTable table = TableFromFunction(
        affine, {.sizes = {9, 5, 17}, .lookup = {.filter = filter, .wrap = {Wrap::kClamp}}});
    if (filter != TableFilter::kCubic) {
      EXPECT_LT(table.max_error, 1e-6);
    }
    const Node inside = Pixels(Random(3 * 500, 0.3f, 0.7f, 6), 3);
    const Samples s = Values(inside), v = Values(Lookup(inside, table.table, {.filter = filter}));
    for (size_t i = 0; i < v.size(); ++i) {
      const double at[3] = {s[3 * i], s[3 * i + 1], s[3 * i + 2]};
      double want;
      affine(at, &want);
      ASSERT_NEAR(v[i], want, 1e-6);
    }
  }
}

TEST_P(LookupTest, DegenerateAxesEqualFewerDimensionsBitForBit) {
  const Samples samples = Random(4 * 6 * 5, 0, 1, 4);
  const Table two({6, 5}, 4, samples, TableAlign::kCentres),
      four({6, 1, 5, 1}, 4, samples, TableAlign::kCentres);
  const Node coords = Pixels(Random(4 * 300, -0.5f, 1.5f, 8), 4);
  for (const TableFilter filter : {TableFilter::kNearest, TableFilter::kLinear}) {
    LookupParams flat{.filter = filter}, deep{.filter = filter};
    flat.axes = {0, 2};
    EXPECT_EQ(Values(Lookup(coords, two, flat)), Values(Lookup(coords, four, deep)));
  }
}

TEST_P(LookupTest, SwizzlesProjectionAndMasks) {
  const Table table = RandomTable({16, 16}, 3);
  const Samples s = Random(3 * 200, 0, 1, 9);
  const Node coords = Pixels(s, 3);
  Samples swapped = s;
  for (size_t i = 0; i < s.size(); i += 3) std::swap(swapped[i], swapped[i + 1]);
  EXPECT_EQ(Values(Lookup(coords, table, {.axes = {1, 0}})), Values(Lookup(Pixels(swapped, 3), table)));
  // q a power of two changes nothing.
  for (const float q : {0.25f, 1.0f, 1024.0f}) {
    Samples scaled = s;
    for (size_t i = 0; i < s.size(); i += 3) scaled[i] *= q, scaled[i + 1] *= q, scaled[i + 2] = q;
    EXPECT_EQ(Values(Lookup(Pixels(scaled, 3), table, {.projective = true})), Values(Lookup(coords, table)));
  }
  const Samples behind = {0, 0, 0, 1, 1, -1, 0.5f, 0.5f, kNaN, 0, 0, 1e-40f, 1, 1, 1e-30f};
  const Samples v = Values(Lookup(Pixels(behind, 3), table, {.border = {7, 8}, .projective = true}));
  for (size_t i = 0; i < 12; i += 3) EXPECT_THAT(Samples(&v[i], &v[i] + 3), ElementsAre(7, 8, 0));
  EXPECT_EQ(v[12], table.At(255, 0));
  // Background pixels keep their bits.
  const Samples masked = {0.5f, 0.5f, 0, 0.5f, 0.5f, 1, -0.0f, 3, kNaN, 0.25f, 0.5f, -2};
  const Samples m = Values(Lookup(Pixels(masked, 3), table, {.mask = 2}));
  EXPECT_THAT(Samples(&m[0], &m[0] + 3), ElementsAre(0.5f, 0.5f, 0));
  EXPECT_TRUE(std::signbit(m[6]));
  EXPECT_EQ(m[7], 3);
  EXPECT_TRUE(std::isnan(m[8]));
  EXPECT_EQ(m[9], Values(Lookup(Pixels({0.25f, 0.5f}, 2), table))[0]);
}

TEST_P(LookupTest, ImagesReadInPlaceEqualTables) {
  // Large enough to be read where they are; seams and NaN entries take the careful path.
  for (const int channels : {1, 4}) {
    Image image(ImageSpec(700, 600, channels));
    const Samples values = Random(size_t{420000} * static_cast<size_t>(channels), 0, 1, 10);
    std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
    image.at<float>(5, 5) = kNaN;
    const Node coords = Pixels(Random(2 * 2000, -1.2f, 2.2f, 11), 2);
    for (const TableFilter filter : kFilters) {
      for (const Wrap wrap : kWraps) {
        const LookupParams p{.filter = filter, .wrap = {wrap}, .border = {0.5}};
        const Samples a = Values(Lookup(coords, FromImage(image), {}, p)),
                      b = Values(Lookup(coords, TableFromImage(image.view()), p));
        for (size_t i = 0; i < a.size(); ++i) {
          ASSERT_TRUE(std::fabs(a[i] - b[i]) <= 3e-7f || (std::isnan(a[i]) && std::isnan(b[i])))
              << a[i] << " and " << b[i] << " filter " << int(filter) << " wrap " << int(wrap);
        }
      }
    }
  }
}

TEST_P(LookupTest, SlicesMakeThirdAndFourthAxes) {
  const Samples values = Random(2 * 3 * 4 * 5 * 3, 0, 1, 12);
  Image image(ImageSpec(3, 2 * 4 * 5, 3));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  const Table table({3, 2, 4, 5}, 3, values, TableAlign::kCentres);
  const Node coords = Pixels(Random(4 * 100, 0, 1, 13), 4);
  EXPECT_EQ(Values(Lookup(coords, FromImage(image), {.slices = {4, 5}})), Values(Lookup(coords, table)));
  EXPECT_EQ(TableFromImage(image.view(), {.slices = {4, 5}}).Samples(), table.Samples());
}

TEST_P(LookupTest, ColorTablesMapEveryCodeAndLeaveOthersAlone) {
  Samples entries = Random(256, -0.2f, 1.2f, 14);
  const Table table({256}, 1, entries, TableAlign::kEnds), invert({2}, 1, Samples{1, 0}, TableAlign::kEnds);
  Image codes(ImageSpec(256, 1, 4, PixelType::kUint8));
  for (int x = 0; x < 256; ++x) {
    for (int c = 0; c < 4; ++c) codes.at<uint8_t>(x, 0, c) = static_cast<uint8_t>(x);
  }
  Tables1DParams p{.tables = {table, {}, invert}};
  const Image out = Render(ApplyTables1D(FromImage(codes), p), PixelType::kUint8);
  for (int x = 0; x < 256; ++x) {
    const double v = std::clamp<double>(entries[static_cast<size_t>(x)], 0, 1) * 255;
    EXPECT_EQ(out.at<uint8_t>(x, 0, 0), std::nearbyint(v));
    EXPECT_EQ(out.at<uint8_t>(x, 0, 1), x);
    EXPECT_EQ(out.at<uint8_t>(x, 0, 2), 255 - x);
    EXPECT_EQ(out.at<uint8_t>(x, 0, 3), x);
  }
  const Samples v = Values(ApplyTables1D(Pixels({kNaN, -0.0f, kInf, -kInf, -1, 2, 1 - 0x1p-24f, 1e-45f}, 1),
                                         {.tables = {invert}}));
  EXPECT_THAT(v, ElementsAre(1, 1, 0, 1, 1, 0, 0x1p-24f, 1));
  // Untouched channels keep the bits of any value.
  EXPECT_TRUE(std::isnan(Values(ApplyTables1D(Pixels({0.5f, kNaN}, 2), {.tables = {invert}}))[1]));
}

TEST_P(LookupTest, ColorCubesKeepAlphaAndTheNeutralAxis) {
  const auto grey = [](const double* c, double* v) {
    for (int i = 0; i < 3; ++i) v[i] = std::sqrt(c[i]) * (0.5 + 0.5 * std::max({c[0], c[1], c[2]}));
  };
  const Table table = TableFromFunction(grey, {.sizes = {17, 17, 17}, .channels = 3}).table;
  Samples pixels;
  for (int i = 0; i <= 1000; ++i) {
    const float v = static_cast<float>(i) * 0.0012f - 0.1f;
    pixels.insert(pixels.end(), {v, v, v, static_cast<float>(i)});
  }
  const Samples v = Values(ApplyTable3D(Pixels(pixels, 4), table));
  for (size_t i = 0; i < v.size(); i += 4) {
    ASSERT_EQ(v[i], v[i + 1]);
    ASSERT_EQ(v[i], v[i + 2]);
    ASSERT_EQ(v[i + 3], pixels[i + 3]);
  }
  for (const TableFilter filter : kFilters) {
    for (const TableAlign align : {TableAlign::kEnds, TableAlign::kCentres}) {
      const Node in = Pixels(Random(4 * 3000, -0.2f, 1.2f, 15), 4);
      EXPECT_LE(WorstError(ApplyTable3D(in, RandomTable({33, 33, 33}, 3, align), {.filter = filter}), in),
                4.0);
      EXPECT_LE(
          WorstError(ApplyTables1D(in, {.tables = {RandomTable({4096}, 1, align), RandomTable({7}, 1, align)},
                                        .filter = filter}),
                     in),
          2.0);
    }
  }
}

TEST_P(LookupTest, RandomBitPatternsNeitherTrapNorLeaveTheTable) {
  // Ten million over all methods and wraps, on this target: every kind of float there is.
  std::mt19937 random(std::hash<std::string>()(GetParam()) & 0xffffffffu);
  const size_t per_case = 10'000'000 / (4 * 5 * 3) / SimdTargets().size() + 1;
  const Table tables[] = {RandomTable({300, 3}, 4), RandomTable({7, 5, 9}, 1), RandomTable({3, 2, 4, 5}, 3)};
  Samples coords(per_case / 4 * 4);
  for (float& v : coords) v = std::bit_cast<float>(static_cast<uint32_t>(random()));
  Image image(ImageSpec(static_cast<int>(coords.size()) / 4, 1, 4));
  std::memcpy(image.view().data, coords.data(), coords.size() * sizeof(float));
  for (const Table& table : tables) {
    for (const TableFilter filter : kFilters) {
      for (const Wrap wrap : kWraps) {
        for (const float v : Values(Lookup(FromImage(image), table, {.filter = filter, .wrap = {wrap}}))) {
          // Negative cubic weights reach a little beyond the entries.
          ASSERT_LE(std::fabs(v - 0.5f), filter == TableFilter::kCubic ? 8.0f : 1.5f + 1e-6f);
        }
      }
    }
    Values(Lookup(FromImage(image), table,
                  {.wrap = {Wrap::kRepeat},
                   .axes = std::vector<int>(static_cast<size_t>(table.dims()) + 1, 2),
                   .projective = true}));
  }
}

TEST_P(LookupTest, MipLevelsFollowTheDerivatives) {
  // A checkerboard of single entries: its first level is flat grey.
  Samples board(64 * 64);
  for (size_t i = 0; i < board.size(); ++i) board[i] = static_cast<float>((i + i / 64) & 1);
  const Table table({64, 64}, 1, board, TableAlign::kCentres);
  const auto ramp = [](float step) {
    Image image(ImageSpec(32, 32, 2));
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        image.at<float>(x, y, 0) = (static_cast<float>(x) + 0.5f) * step / 64;
        image.at<float>(x, y, 1) = (static_cast<float>(y) + 0.5f) * step / 64;
      }
    }
    return image;
  };
  const LookupParams p{.filter = TableFilter::kMipmap, .wrap = {Wrap::kRepeat}};
  EXPECT_EQ(Values(Lookup(FromImage(ramp(1)), table, p)),
            Values(Lookup(FromImage(ramp(1)), table, {.wrap = {Wrap::kRepeat}})));
  for (const float v : Values(Lookup(FromImage(ramp(2)), table, p))) ASSERT_NEAR(v, 0.5f, 1e-6f);
  // An object's edge: both sides stay sharp.
  Image edge = ramp(1);
  for (int y = 0; y < 32; ++y) {
    for (int x = 16; x < 32; ++x) edge.at<float>(x, y, 0) += 0.25f;
  }
  EXPECT_EQ(Values(Lookup(FromImage(edge), table, p)),
            Values(Lookup(FromImage(edge), table, {.wrap = {Wrap::kRepeat}})));
  const Node coords = FromImage(ramp(3.3f));
  EXPECT_LE(WorstError(Lookup(coords, RandomTable({64, 64}, 3), p), coords), 4.0);
  EXPECT_EQ(Values(Lookup(coords, FromImage(ramp(1)), {}, p)),
            Values(Lookup(coords, TableFromImage(ramp(1).view()), p)));
}

TEST(LostCoordinatesTest, AreCountedByTheRuleOfTheLookup) {
  const Samples at = {0.5f, kNaN, 1, kInf, 0, 1, 9, -kInf, 0, kNaN, kNaN, kNaN, 0.5f, 0.5f, -1, 1, 1, 1e-40f};
  const Node coords = Pixels(at, 3);
  const auto count = [&](const LookupParams& p, int threads = 1) {
    const LostCoordinates lost = CountLostCoordinates(coords, 2, p, {.threads = threads});
    // As many results are NaN as are counted.
    LookupParams nan = p;
    nan.propagate_nan = true;
    const Samples v = Values(Lookup(coords, RandomTable({4, 4}, 1), nan));
    if (!p.projective && p.mask < 0) {
      EXPECT_EQ(std::count_if(v.begin(), v.end(), [](float x) { return std::isnan(x); }), lost.not_a_number);
    }
    return std::vector<int64_t>{lost.pixels, lost.not_a_number, lost.behind, lost.first_x, lost.first_y};
  };
  EXPECT_THAT(count({}), ElementsAre(6, 2, 0, 0, 0));
  EXPECT_THAT(count({.wrap = {Wrap::kRepeat}}), ElementsAre(6, 4, 0, 0, 0));
  EXPECT_THAT(count({.wrap = {Wrap::kClamp, Wrap::kMirror}}, 3), ElementsAre(6, 3, 0, 0, 0));
  EXPECT_THAT(count({.projective = true}), ElementsAre(6, 1, 4, 0, 0));
  EXPECT_THAT(count({.axes = {0, 0}, .mask = 2}), ElementsAre(4, 0, 0, 0, 0));
  EXPECT_THAT(count({.axes = {1, 1}}), ElementsAre(6, 2, 0, 0, 0));
  EXPECT_EQ(CountLostCoordinates(coords, 1, {.axes = {2}, .projective = false}).Summary(),
            "1 of 6 pixels have coordinates that are no numbers; the first at 3,0");
  EXPECT_THAT(Refusal([&] { CountLostCoordinates(coords, 4); }), HasSubstr("expected channel 3"));
  EXPECT_THAT(Refusal([&] { CountLostCoordinates(coords, 5); }), HasSubstr("found 5 dimensions"));
  // The commands tell it.
  const auto notes = [&](const char* op, const std::string& words, std::vector<Node> inputs) {
    std::vector<std::string> told;
    const ops::OpInfo& info = *ops::FindOp(op);
    ops::Arguments arguments = ops::ParseExample(info, words);
    arguments.notes = &told;
    info.make(inputs, arguments, nullptr);
    return told;
  };
  const Node table = FromImage(Image(ImageSpec(4, 4, 1)));
  EXPECT_THAT(
      notes("lookup", "count=1 projective=1", {coords, table}),
      ElementsAre("1 of 6 pixels have coordinates that are no numbers, 4 lie behind the projector; the "
                  "first at 0,0"));
  EXPECT_THAT(notes("table", "0,1 count=1 channels=all", {coords}),
              ElementsAre("R,G,B: 2 of 6 pixels have coordinates that are no numbers; the first at 0,0"));
  EXPECT_THAT(notes("lookup", "", {coords, table}), ::testing::IsEmpty());
}

TEST(LookupRefusalTest, NamesWhatIsWrong) {
  const Node two = Pixels({0, 0, 1, 1}, 2), row = Pixels({0, 1, 2}, 3);
  const Table cube = RandomTable({2, 2, 2}, 3);
  EXPECT_EQ(Refusal([&] { Lookup(two, cube); }),
            "lookup: found 2 channels (Y,A), expected channel 2 as a coordinate");
  EXPECT_THAT(Refusal([&] { Lookup(two, Table()); }), HasSubstr("found an empty table"));
  EXPECT_THAT(Refusal([&] { Lookup(two, row, {.dims = 3}); }),
              HasSubstr("found 0 numbers of slices, expected 1"));
  EXPECT_THAT(Refusal([&] { Lookup(two, FromImage(Image(ImageSpec(4, 5, 3))), {.slices = {2}}); }),
              HasSubstr("found an image of 4x5, expected a height that is a multiple of 2 slices"));
  EXPECT_THAT(Refusal([&] {
                Lookup(row, RandomTable({2, 2, 2, 2}, 1), {.filter = TableFilter::kMipmap});
              }),
              HasSubstr("mipmap for 4 dimensions"));
  EXPECT_THAT(Refusal([&] { Lookup(row, cube, {.axes = {0}}); }), HasSubstr("found 1 axes, expected 3"));
  EXPECT_THAT(Refusal([&] { ApplyTable3D(two, cube); }), HasSubstr("table3d"));
  for (const auto filter : {TableFilter::kMipmap, TableFilter::kTrilinear, TableFilter::kEwa}) {
    EXPECT_THAT(Refusal([&] { ApplyTable3D(row, cube, {.filter = filter}); }), HasSubstr("of mip levels"));
    EXPECT_THAT(Refusal([&] { ApplyTables1D(row, {.tables = {RandomTable({4}, 1)}, .filter = filter}); }),
                HasSubstr("of mip levels"));
  }
  EXPECT_THAT(Refusal([&] { ApplyTable3D(row, RandomTable({4}, 3)); }),
              HasSubstr("1 dimensions, expected 3"));
  EXPECT_THAT(Refusal([&] { ApplyTables1D(row, {.tables = {cube}}); }), HasSubstr("expected one of each"));
  EXPECT_THAT(Refusal([&] { Lookup(Pixels({0}, 1), RandomTable({(1 << 22) + 1}, 1)); }),
              HasSubstr("along an axis"));
}

}  // namespace
}  // namespace tessera
