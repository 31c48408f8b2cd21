// The bound of lookups for the entries and coordinates that come nearest to it, on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "support/lookups.h"
#include "tessera/ops/lookup.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Pixels, testing::Samples, testing::WorstError;

class LookupBoundTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, LookupBoundTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

// Entries and coordinates that hurt most: large entries of equal size, fractions whose products are lost in
// their last bits. Of these rows the common forms (1 - f) a + f b and sum w c are 4, 6, 8, 3.5, 4.5 and 5.5 u
// off; found by a search.
struct Adverse {
  TableFilter filter;
  Samples entries, coordinates;
};
const Adverse kAdverse[] = {
    {TableFilter::kLinear,
     {-0x1.000002p+0f, 0x1.000002p+0f, 0x1.000002p+0f, 0x1p+0f},
     {0x1.fffffcp-25f, 0x1.fffffcp-25f}},
    {TableFilter::kLinear,
     {-0x1.000006p+0f, -0x1.000004p+0f, -0x1p+0f, -0x1.ffffd6p-1f, -0x1.000002p+0f, -0x1.fe51bcp-1f,
      -0x1.ff5cb8p-1f, 0x1p+0f},
     {0x1.fffffep-25f, 0x1.fffffep-25f, 0x1.fffffap-25f}},
    {TableFilter::kLinear,
     {0x1.00006cp+0f, -0x1.00006ap+0f, -0x1.00006cp+0f, -0x1.ffe5bep-1f, 0x1.00006cp+0f, -0x1.fc5c84p-1f,
      -0x1.fb0f06p-1f, -0x1.27f9d6p-1f, -0x1.00006cp+0f, -0x1.00003ep+0f, -0x1.02e392p-3f, -0x1.00049ap-1f,
      -0x1.2e6cf2p-1f, 0x1.021afp-2f, -0x1.ee43d8p-1f, -0x1.3608f6p-1f},
     {0x1.7fff66p-23f, 0x1.ffff34p-25f, 0x1.ffff36p-25f, 0x1.3fff78p-22f}},
    {TableFilter::kTetrahedral,
     {0x1.000004p+0f, 0x1.55555p-1f, 0, 0x1.000002p+0f},
     {0x1.400002p-23f, 0x1.fffffcp-25f}},
    {TableFilter::kTetrahedral,
     {-0x1.000006p+0f, -0x1.99998ep-2f, 0, -0x1.000004p+0f, 0, 0, 0, -0x1.000006p+0f},
     {0x1.200002p-22f, 0x1.fffff6p-24f, 0x1.fffff4p-25f}},
    {TableFilter::kTetrahedral,
     {0x1.000008p+0f, 0x1.000008p+0f, 0, 0x1.000008p+0f, 0, 0, 0, 0x1.1215cap-1f, 0, 0, 0, 0, 0, 0, 0,
      0x1.850ff2p-2f},
     {0x1.a00002p-22f, 0x1.600006p-22f, 0x1.200008p-22f, 0x1.50e45ep-23f}}};

TEST_P(LookupBoundTest, HoldsItsBoundForAdverseEntries) {
  // kEnds of size two: coordinates are fractions, so that nothing is added for positions, and a scale of 4 is
  // 3 u of the largest entry, in four dimensions 4 u.
  const auto worst = [](const Table& table, TableFilter filter, const Samples& coords) {
    const Node in = Pixels(coords, table.dims());
    double error = WorstError(Lookup(in, table, {.filter = filter}), in);
    if (table.dims() == 3 && table.channels() == 3)
      error = std::max(error, WorstError(ApplyTable3D(in, table, {.filter = filter}), in));
    return error;
  };
  for (const Adverse& a : kAdverse) {
    const std::vector<int> sizes(a.coordinates.size(), 2);
    Samples three;
    for (const float v : a.entries) three.insert(three.end(), {v, -v, 0.5f * v});
    EXPECT_LE(worst(Table(sizes, 3, three, TableAlign::kEnds), a.filter, a.coordinates), 4.0);
    EXPECT_LE(worst(Table(sizes, 1, a.entries, TableAlign::kEnds), a.filter, a.coordinates), 4.0);
  }
  std::mt19937 random(19);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto entry = [&] {
    const float size = random() % 3 > 0 ? 1 + 0x1p-23f * static_cast<float>(random() % 64) : unit(random);
    return random() % 2 > 0 ? size : -size;
  };
  const auto coordinate = [&] {
    const float small = std::ldexp(unit(random), -static_cast<int>(random() % 26));
    return random() % 2 > 0 ? small : 1 - small;
  };
  for (int dims = 1; dims <= 4; ++dims) {
    for (int trial = 0; trial < 60; ++trial) {
      Samples entries(size_t{3} << dims), coords(static_cast<size_t>(dims) * 100);
      std::generate(entries.begin(), entries.end(), entry);
      std::generate(coords.begin(), coords.end(), coordinate);
      const Table table(std::vector<int>(static_cast<size_t>(dims), 2), 3, entries, TableAlign::kEnds);
      for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kTetrahedral, TableFilter::kCubic})
        EXPECT_LE(worst(table, filter, coords), 4.0) << dims << "-D, filter " << int(filter);
      if (dims > 1) continue;
      const Node in = Pixels(coords, 1);
      for (const int size : {2, 3, 4}) {
        const Samples some(entries.begin(), entries.begin() + size);
        const Table curve({size}, 1, some, TableAlign::kEnds);
        EXPECT_LE(WorstError(ApplyTables1D(in, {.tables = {curve}}), in), 2.0);
      }
    }
  }
}

// Cubic: entries of the weights' signs, so that partial sums are as large as they can be, and fractions where
// roundings come together. Searches of 10^8 of them found less than seven tenths of the bound.
TEST_P(LookupBoundTest, HoldsTheBoundOfCubicForEntriesOfTheWeightsSigns) {
  std::mt19937 random(23);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int trial = 0; trial < 192; ++trial) {
    const int dims = 1 + trial % 4, size = 4 + trial / 4 % 2;  // positions are rounded, or exact
    size_t count = 1;
    for (int a = 0; a < dims; ++a) count *= static_cast<size_t>(size);
    Samples entries(count), coords(static_cast<size_t>(dims) * 500);
    for (size_t i = 0; i < count; ++i) {
      bool negative = random() % 16 == 0;
      size_t rest = i;
      for (int a = 0; a < dims; ++a, rest /= static_cast<size_t>(size)) {
        const size_t k = rest % static_cast<size_t>(size);
        negative ^= k == 0 || k == 3;
      }
      const float magnitude = 1 - 0x1p-12f * unit(random);
      entries[i] = negative ? -magnitude : magnitude;
    }
    for (float& v : coords) {
      const float f = random() % 2 > 0 ? 0.25f + 0.1f * unit(random) : unit(random);
      v = (1 + f) / static_cast<float>(size - 1);
    }
    const Table table(std::vector<int>(static_cast<size_t>(dims), size), 1, entries, TableAlign::kEnds);
    const Node in = Pixels(coords, dims);
    for (const CubicKernel kernel :
         {CubicKernel::kCatmullRom, CubicKernel::kMitchell, CubicKernel::kBSpline}) {
      // A scale of 4 is the bound.
      EXPECT_LE(WorstError(Lookup(in, table, {.filter = TableFilter::kCubic, .cubic = kernel}), in),
                4.0 * 0.75)
          << dims << "-D, kernel " << int(kernel);
    }
  }
}

}  // namespace
}  // namespace tessera
