// Turns of any size against long double, with what is exact.
#include "base/turn.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tessera::base {
namespace {

TEST(Turn, QuartersAreWholeNumbers) {
  for (int k = -9; k <= 9; ++k) {
    const auto [c, s] = TurnOf(90.0 * k);
    const int q = ((k % 4) + 4) % 4;
    EXPECT_EQ(c, q == 0 ? 1 : q == 2 ? -1 : 0) << k;
    EXPECT_EQ(s, q == 1 ? 1 : q == 3 ? -1 : 0) << k;
  }
}

TEST(Turn, WithinTwoRoundingsOfTheTruth) {
  for (double degrees = -1000; degrees < 1000; degrees += 0.37) {
    const auto [c, s] = TurnOf(degrees);
    const long double angle = static_cast<long double>(degrees) * std::numbers::pi_v<long double> / 180;
    EXPECT_NEAR(c, static_cast<double>(std::cos(angle)), 3e-16) << degrees;
    EXPECT_NEAR(s, static_cast<double>(std::sin(angle)), 3e-16) << degrees;
  }
}

// The double 1e30 has these digits, and its remainder is theirs.
TEST(Turn, LargeAnglesAreReducedExactly) {
  const char* const digits = "1000000000000000019884624838656";
  int rest = 0;
  for (const char* d = digits; *d != 0; ++d) rest = (rest * 10 + (*d - '0')) % 360;
  const auto large = TurnOf(1e30), small = TurnOf(rest);
  EXPECT_EQ(large.cosine, small.cosine);
  EXPECT_EQ(large.sine, small.sine);
}

TEST(Turn, NothingFiniteIsNothing) {
  EXPECT_TRUE(std::isnan(TurnOf(INFINITY).cosine));
  EXPECT_TRUE(std::isnan(TurnOf(NAN).sine));
}

}  // namespace
}  // namespace tessera::base
