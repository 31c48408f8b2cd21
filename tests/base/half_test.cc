// base/half.h against halves made of powers of two: every half, and the floats around every half and every
// tie.
#include "base/half.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::base {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The value of a finite half's magnitude; that of infinity's code is the power of two behind the largest.
double ValueOf(uint32_t magnitude) {
  const int exponent = static_cast<int>(magnitude >> 10);
  const int mantissa = static_cast<int>(magnitude & 0x3FF);
  return exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
}

TEST(HalfTest, EveryHalfBecomesItsValueAndComesBack) {
  for (uint32_t magnitude = 0; magnitude < 0x7C00; ++magnitude) {
    for (const uint32_t sign : {0u, 0x8000u}) {
      const auto half = static_cast<uint16_t>(magnitude | sign);
      const float value = FloatFromHalf(half);
      ASSERT_EQ(value, sign != 0 ? -ValueOf(magnitude) : ValueOf(magnitude)) << half;
      ASSERT_EQ(std::signbit(value), sign != 0) << half;
      ASSERT_EQ(HalfFromFloat(value), half);
    }
  }
  EXPECT_EQ(FloatFromHalf(0x7C00), kInfinity);
  EXPECT_EQ(FloatFromHalf(0xFC00), -kInfinity);
  EXPECT_EQ(HalfFromFloat(kInfinity), 0x7C00);
  EXPECT_EQ(HalfFromFloat(-kInfinity), 0xFC00);
}

TEST(HalfTest, FloatsGoToTheNearestTiesToEven) {
  for (uint32_t lower = 0; lower < 0x7C00; ++lower) {
    const auto tie = static_cast<float>((ValueOf(lower) + ValueOf(lower + 1)) / 2);  // exact
    ASSERT_EQ(HalfFromFloat(tie), lower + (lower & 1)) << std::hexfloat << tie;
    ASSERT_EQ(HalfFromFloat(std::nextafter(tie, 0.0f)), lower) << std::hexfloat << tie;
    ASSERT_EQ(HalfFromFloat(std::nextafter(tie, kInfinity)), lower + 1) << std::hexfloat << tie;
    ASSERT_EQ(HalfFromFloat(-tie), 0x8000 | (lower + (lower & 1)));
  }
  EXPECT_EQ(HalfFromFloat(std::numeric_limits<float>::max()), 0x7C00);
  EXPECT_EQ(HalfFromFloat(std::numeric_limits<float>::denorm_min()), 0);
}

TEST(HalfTest, NanStaysNanAndIsMadeQuiet) {
  for (uint32_t payload = 1; payload < 0x400; ++payload) {
    const uint32_t bits = std::bit_cast<uint32_t>(FloatFromHalf(static_cast<uint16_t>(0xFC00 | payload)));
    ASSERT_EQ(bits, 0xFFC00000u | (payload << 13));
    const float signalling = std::bit_cast<float>(0x7F800000u | (payload << 13));
    ASSERT_EQ(HalfFromFloat(signalling), 0x7E00 | payload);
  }
  EXPECT_EQ(HalfFromFloat(std::bit_cast<float>(0x7F800001u)), 0x7E00);  // not infinity
}

}  // namespace
}  // namespace tessera::base
