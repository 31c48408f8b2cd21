// Solids as signed distances: what they are of, how they are combined, words for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }

TEST(Solid, DistancesAreDistances) {
  const Solid solids[] = {
      Solid::Sphere({0.1, 0, 0}, 0.5),
      Solid::Box({0, 0.1, 0}, {0.4, 0.3, 0.2}),
      Solid::Box({0, 0, 0}, {0.4, 0.3, 0.2}, 0.1),
      Solid::Torus({0, 0, 0}, 0.5, 0.2),
      Solid::Capsule({-0.3, 0, 0}, {0.3, 0.2, 0}, 0.2),
      Solid::Cone({0, -0.4, 0}, {0, 0.4, 0}, 0.3, 0.1),
      Solid::Plane({0, 1, 0}, 0.2),
      Solid::Ellipsoid({0, 0, 0}, {0.5, 0.3, 0.4}),
      Solid::Parse("body"),
      Solid::Parse("knot"),
      Solid::Sphere({0, 0, 0}, 0.3).Translated({0.2, 0, 0}).Rotated({0, 0, 1}, 30).Scaled(1.5)};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  for (size_t s = 0; s < std::size(solids); ++s) {
    SCOPED_TRACE(s);
    for (int n = 0; n < 3000; ++n) {
      const Vector3 p = {place(random), place(random), place(random)},
                    q = {place(random), place(random), place(random)};
      const double way = Length({p[0] - q[0], p[1] - q[1], p[2] - q[2]});
      // No steeper than 1: what leaping and the blocks of DistanceField rest on.
      ASSERT_LE(std::fabs(solids[s].Distance(p) - solids[s].Distance(q)),
                way * (s == 7 || s == 8 ? 1.75 : 1 + 1e-9));
    }
  }
  EXPECT_NEAR(solids[0].Distance({0.1, 0.7, 0}), 0.2, 1e-12);
  EXPECT_NEAR(solids[1].Distance({0.5, 0.5, 0.2}), std::hypot(0.1, 0.1), 1e-12);
  EXPECT_NEAR(solids[3].Distance({0.9, 0, 0}), 0.2, 1e-12);
}

TEST(Solid, PartsOfSolids) {
  const Solid left = Solid::Sphere({-0.3, 0, 0}, 0.5), right = Solid::Sphere({0.3, 0, 0}, 0.5);
  const Solid both = Intersection(left, right), blended = SmoothIntersection(left, right, 0.1);
  const Solid grown = left.Grown(0.2), shell = left.Shell(0.1);
  const Solid own = Solid::Function([](const Vector3& p) { return p[1] - 0.25; });
  const Solid words = Solid::Parse("sphere(-.3,0,0,.5) & sphere(.3,0,0,.5)"),
              blended_words = Solid::Parse("sphere(-.3,0,0,.5) &.1 sphere(.3,0,0,.5)");
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 p = {place(random), place(random), place(random)};
    const double l = Length({p[0] + 0.3, p[1], p[2]}) - 0.5, r = Length({p[0] - 0.3, p[1], p[2]}) - 0.5;
    EXPECT_NEAR(both.Distance(p), std::max(l, r), 1e-12);
    // The blend of -a and -b, from within.
    const double reach = std::max(0.1 - std::fabs(l - r), 0.0);
    EXPECT_NEAR(blended.Distance(p), std::max(l, r) + reach * reach / 0.4, 1e-12);
    EXPECT_NEAR(words.Distance(p), both.Distance(p), 1e-12);
    EXPECT_NEAR(blended_words.Distance(p), blended.Distance(p), 1e-12);
    EXPECT_NEAR(grown.Distance(p), l - 0.2, 1e-12);
    EXPECT_NEAR(shell.Distance(p), std::fabs(l) - 0.05, 1e-12);
    EXPECT_EQ(own.Distance(p), p[1] - 0.25);
  }
  // A cone one of whose ends is within the other is that end alone.
  const Solid cone = Solid::Cone({0, 0, 0}, {0.1, 0, 0}, 0.5, 0.2);
  EXPECT_NEAR(cone.Distance({1, 0, 0}), 0.5, 1e-12);
  EXPECT_NEAR(Solid::Cone({0.1, 0, 0}, {0, 0, 0}, 0.2, 0.5).Distance({-1, 0, 0}), 0.5, 1e-12);
}

TEST(Solid, WordsAndTheirErrors) {
  const Solid s = Solid::Parse("(sphere(0,0,0,.5) |.1 box(.5,0,0,.2,.2,.2)) - plane(0,1,0,-.2)");
  EXPECT_GT(s.Distance({0, -0.4, 0}), 0);
  EXPECT_LT(s.Distance({0, 0.2, 0}), 0);
  const auto message = [](const char* words) {
    try {
      Solid::Parse(words);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(message("spere(0,0,0,1)"), HasSubstr("expected one of"));
  EXPECT_THAT(message("sphere(0,0,0)"), HasSubstr("expected 4"));
  EXPECT_THAT(message("sphere(0,0,0,1) +"), HasSubstr("operator"));
  EXPECT_THAT(message("(sphere(0,0,0,1)"), HasSubstr("parenthesis"));
  EXPECT_THAT(message("sphere(0,0,0,-1)"), HasSubstr("positive"));
  EXPECT_THAT(message(""), HasSubstr("expected"));
}

}  // namespace
}  // namespace tessera
