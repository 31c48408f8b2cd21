// Distance fields drawn out along their columns, against the minimum that they are defined by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

Volume Ball(PixelType type = PixelType::kFloat, size_t memory = 0) {
  VolumeSpec spec = VolumeSpec::Centred({21, 33, 17}, type, {1, 0.8, 1.3});
  spec.memory = memory;
  return DistanceField(Solid::Sphere({0.1, -0.2, 0}, 0.3), spec, 0.5);
}
double SlopeAt(double x, double z) { return 0.4 + 0.3 * std::sin(5 * x) + (z > 0.2 ? 1e300 : 0.1); }

TEST(DrawnFieldTest, IsTheMinimumItIsDefinedBy) {
  const Volume ball = Ball();
  const VolumeSpec& spec = ball.spec();
  for (const bool down : {false, true}) {
    const Volume drawn = Drawn(ball, {.down = down, .iso = 0.05, .depth = 0.1, .slope = SlopeAt});
    for (int k = 0; k < spec.size[2]; ++k) {
      for (int i = 0; i < spec.size[0]; ++i) {
        const Vector3 p = spec.Position(i, 0, k);
        for (int j = 0; j < spec.size[1]; ++j) {
          double least = ball.At(i, j, k);
          for (int other = 0; other < spec.size[1]; ++other) {
            const int away = down ? other - j : j - other;
            if (away <= 0) continue;
            const double own = std::max(ball.At(i, other, k), 0.05 - 0.1);
            least = std::min(least, own + SlopeAt(p[0], p[2]) * away * spec.spacing[1]);
          }
          EXPECT_NEAR(drawn.At(i, j, k), least, 2e-6) << i << " " << j << " " << k;
        }
      }
    }
  }
}

// A body is drawn its depth over the slope beyond its end, and nowhere else.
TEST(DrawnFieldTest, LengthsAreThoseAskedFor) {
  const VolumeSpec spec = VolumeSpec::Centred({33, 65, 33}, PixelType::kFloat, {1, 1, 1});
  const Volume ball = DistanceField(Solid::Sphere({0, -0.5, 0}, 0.3), spec, 1);
  const double slope = 0.25;
  const Volume flame = Drawn(ball, {.depth = 0, .slope = [&](double, double) { return slope; }});
  const auto at = [&](const Volume& v, double y) {
    return v.Sample(16, (y - spec.origin[1]) / spec.spacing[1], 16);
  };
  EXPECT_NEAR(at(flame, -0.2 + 0.4), 0.1, 0.01);  // 0.4 above the top
  EXPECT_NEAR(at(flame, -0.2 + 0.8), 0.2, 0.01);
  EXPECT_EQ(at(flame, -0.9), at(ball, -0.9));  // below nothing changes
  const Volume same = Drawn(
      ball, {.down = true, .slope = [](double, double) { return std::numeric_limits<double>::infinity(); }});
  for (int j = 0; j < 65; ++j) EXPECT_EQ(same.At(16, j, 16), ball.At(16, j, 16));
}

TEST(DrawnFieldTest, PagedIsTheSame) {
  for (const PixelType type : {PixelType::kFloat, PixelType::kUint16}) {
    const DrawnParams params{.down = true, .depth = 0.1, .slope = SlopeAt};
    const Volume whole = Drawn(Ball(type), params), paged = Drawn(Ball(type, 20000), params);
    const auto& n = whole.spec().size;
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i) ASSERT_EQ(whole.At(i, j, k), paged.At(i, j, k));
      }
    }
  }
}

TEST(DrawnFieldTest, RefusesWhatItCannotDo) {
  const auto refused = [](const Volume& field, const DrawnParams& params, const std::string& named) {
    try {
      Drawn(field, params);
      ADD_FAILURE() << named << " was taken";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(named), std::string::npos) << e.what();
    }
  };
  refused(Volume(), {.slope = SlopeAt}, "empty");
  refused(Ball(), {}, "no slope");
  refused(Ball(), {.depth = -1, .slope = SlopeAt}, "depth of -1");
  refused(Ball(), {.slope = [](double, double) { return -2.0; }}, "slope of -2");
}

}  // namespace
}  // namespace tessera
