// The named shuffles and byte tables of every target against what their names say, lane by lane.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "simd/pixels.h"
#include "tessera/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/shuffle_test.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/code_maps-inl.h"
#include "simd/gather-inl.h"
#include "simd/rows-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// What a vector holds.
struct Lanes {
  alignas(64) float lane[kLanes];
  HWY_ATTR explicit Lanes(V v) { hn::Store(v, D(), lane); }
};
HWY_ATTR V Numbers(int first) { return hn::Iota(D(), static_cast<float>(first)); }

// Names of the helpers whose lanes are not what they should be.
HWY_ATTR std::vector<std::string> WrongShuffles() {
  std::vector<std::string> wrong;
  const auto expect = [&](const std::string& name, V got, const auto& want) HWY_ATTR {
    const Lanes lanes(got);
    for (int i = 0; i < kLanes; ++i) {
      if (lanes.lane[i] != static_cast<float>(want(i))) return wrong.push_back(name);
    }
  };
  const V a = Numbers(0), b = Numbers(100);
  // Lane i of a is i, of b it is 100 + i.
  const auto in_blocks = [](int i, int odd) { return i / 4 * 4 + i % 2 * 2 + odd + (i % 4 >= 2 ? 100 : 0); };
  expect("EvenInBlocks", EvenInBlocks(a, b), [&](int i) { return in_blocks(i, 0); });
  expect("OddInBlocks", OddInBlocks(a, b), [&](int i) { return in_blocks(i, 1); });
  const auto in_order = [](int i, int odd) {
    return i < kLanes / 2 ? 2 * i + odd : 100 + 2 * (i - kLanes / 2) + odd;
  };
  V even, odd;
  SplitInBlocks(a, b, even, odd);
  expect("SplitInBlocks, even", LanesOfBlocks(even), [&](int i) { return in_order(i, 0); });
  expect("SplitInBlocks, odd", LanesOfBlocks(odd), [&](int i) { return in_order(i, 1); });
  if constexpr (kLanes >= 8) {
    const auto blocks = [](int i, int second) {
      const int block = i / 4 * 2 + second, all = kLanes / 4;
      return (block >= all ? 100 + 4 * (block - all) : 4 * block) + i % 4;
    };
    expect("EvenBlocks", EvenBlocks(a, b), [&](int i) { return blocks(i, 0); });
    expect("OddBlocks", OddBlocks(a, b), [&](int i) { return blocks(i, 1); });
  } else {
    expect("EvenBlocks", EvenBlocks(a, b), [](int i) { return i; });
    expect("OddBlocks", OddBlocks(a, b), [](int i) { return 100 + i; });
  }

  const auto shifted = [](int blocks) {
    return
        [blocks](int i) { return i + 4 * blocks < kLanes ? i + 4 * blocks : 100 + i + 4 * blocks - kLanes; };
  };
  // Where there are that many blocks.
  const auto expect_shifted = [&](const char* name, auto blocks) HWY_ATTR {
    constexpr int kBlocks = decltype(blocks)::value;
    if constexpr (4 * kBlocks < kLanes) expect(name, ShiftBlocks<kBlocks>(a, b), shifted(kBlocks));
  };
  expect_shifted("ShiftBlocks<1>", std::integral_constant<int, 1>());
  expect_shifted("ShiftBlocks<2>", std::integral_constant<int, 2>());
  expect_shifted("ShiftBlocks<3>", std::integral_constant<int, 3>());
  expect("Held", Held(a), [](int i) { return i; });

  alignas(64) int32_t lane[kLanes];
  for (int i = 0; i < kLanes; ++i) lane[i] = (7 * i + 3) % (2 * kLanes);
  expect("OfBoth", OfBoth(a, b, lane),
         [&](int i) { return lane[i] < kLanes ? lane[i] : 100 + lane[i] - kLanes; });

  expect("OneOn", OneOn(a, b), [](int i) { return i + 1 < kLanes ? i + 1 : 100; });

  alignas(64) uint32_t index[kLanes];
  for (int i = 0; i < kLanes; ++i) index[i] = 0x9e3779b9u * static_cast<uint32_t>(i + 1);  // upper bits too
  const VU indices = hn::Load(DU(), index);
  expect("OneOfLanes", OneOfLanes(a, indices), [&](int i) { return index[i] % kLanes; });
  alignas(16) static constexpr float kFour[4] = {10, 11, 12, 13};
  expect("OneOfFour", OneOfFour(hn::LoadDup128(D(), kFour), indices),
         [&](int i) { return kFour[index[i] % 4]; });

  const V sign = hn::OddEven(hn::Set(D(), -1e-30f), hn::Set(D(), 2.0f));
  expect("IfNegative", IfNegative(sign, a, b), [](int i) { return i % 2 == 1 ? i : 100 + i; });

  const LaneList list(indices);
  for (int i = 0; i < kLanes; ++i) {
    if (list[i] != index[i]) wrong.push_back("LaneList");
  }

  uint16_t words[kTableWords];
  for (int i = 0; i < kTableWords; ++i) words[i] = static_cast<uint16_t>(40503 * (i + 1));
  alignas(64) uint32_t found[kLanes];
  hn::Store(LookUpWords(words, indices), DU(), found);
  for (int i = 0; i < kLanes; ++i) {
    const uint32_t want = words[index[i] % kTableWords] | uint32_t{words[(index[i] >> 16) % kTableWords]}
                                                              << 16;
    if (found[i] != want) wrong.push_back("LookUpWords");
  }

  uint8_t bytes[400];
  for (size_t i = 0; i < sizeof bytes; ++i) bytes[i] = static_cast<uint8_t>(i * 37 + 11);
  for (int i = 0; i < kLanes; ++i) index[i] = static_cast<uint32_t>(i * 53 % 97);
  const auto expect_words = [&](const std::string& name, VU got, uint32_t unit) HWY_ATTR {
    hn::Store(got, DU(), found);
    for (int i = 0; i < kLanes; ++i) {
      if (std::memcmp(&found[i], bytes + unit * index[i], 4) != 0) wrong.push_back(name);
    }
  };
  const VU places = hn::Load(DU(), index);
  expect_words("LoadWords of bytes", LoadWords(bytes, places), 1);
  expect_words("LoadWords of words", LoadWords(reinterpret_cast<const int32_t*>(bytes), places), 4);
  expect_words("GatherWords", hn::BitCast(DU(), GatherWords<4>(bytes, hn::BitCast(DI(), places))), 4);
  return wrong;
}

// Rows of every length to 40 that come out wrong.
HWY_ATTR int WrongRows() {
  int wrong = 0;
  float from[4 * kLanes];
  for (int i = 0; i < 4 * kLanes; ++i) from[i] = static_cast<float>(i * 29 % 300 - 20);
  for (int count = 0; count <= 40 && count <= 3 * kLanes; ++count) {
    float to[4 * kLanes];
    std::fill_n(to, 4 * kLanes, -7.0f);
    StoreRow(D(), count, to, [&](int i) HWY_ATTR { return LoadPart(D(), from + i, count - i); });
    for (int i = 0; i < 4 * kLanes; ++i) wrong += to[i] != (i < count ? from[i] : -7.0f);
    const Lanes part(LoadPart(D(), from, count % kLanes));
    for (int i = 0; i < kLanes; ++i) wrong += part.lane[i] != (i < count % kLanes ? from[i] : 0.0f);
  }
  uint8_t bytes[4 * kLanes];
  StoreBytes(hn::LoadU(D(), from), hn::LoadU(D(), from + kLanes), hn::LoadU(D(), from + 2 * kLanes),
             hn::LoadU(D(), from + 3 * kLanes), bytes);
  for (int i = 0; i < 4 * kLanes; ++i) wrong += bytes[i] != std::clamp(from[i], 0.0f, 255.0f);
  return wrong;
}

// Pixels that come out wrong: with one table for all channels and with four, of every length to 70.
HWY_ATTR int WrongCodes() {
  int wrong = 0;
  for (const bool one : {false, true}) {
    uint8_t maps[4][CodeMaps::kCodes];
    for (int c = 0; c < 4; ++c) {
      for (int i = 0; i < CodeMaps::kCodes; ++i)
        maps[c][i] = static_cast<uint8_t>(i * 167 + 13 * (one ? 0 : c) + 5);
    }
    const CodeMaps code_maps(maps);
    for (int count = 0; count <= 70; ++count) {
      std::vector<uint8_t> from(static_cast<size_t>(4 * count)), to(from.size() + 1, 77);
      for (size_t i = 0; i < from.size(); ++i)
        from[i] = static_cast<uint8_t>(i * 29 + static_cast<size_t>(count));
      code_maps.Run(from.data(), to.data(), count, false);
      for (size_t i = 0; i < from.size(); ++i) wrong += to[i] != maps[i % 4][from[i]];
      wrong += to.back() != 77;
    }
  }
  return wrong;
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::simd {
HWY_EXPORT(WrongShuffles);
HWY_EXPORT(WrongCodes);
HWY_EXPORT(WrongRows);

class ShuffleTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};

TEST_P(ShuffleTest, LanesAreWhatTheNamesSay) {
  EXPECT_EQ(HWY_DYNAMIC_DISPATCH(WrongShuffles)(), std::vector<std::string>());
}
TEST_P(ShuffleTest, RowsEndWhereTheyShould) { EXPECT_EQ(HWY_DYNAMIC_DISPATCH(WrongRows)(), 0); }
TEST_P(ShuffleTest, CodesGoThroughTheirTables) { EXPECT_EQ(HWY_DYNAMIC_DISPATCH(WrongCodes)(), 0); }

INSTANTIATE_TEST_SUITE_P(Targets, ShuffleTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

}  // namespace tessera::simd
#endif  // HWY_ONCE
