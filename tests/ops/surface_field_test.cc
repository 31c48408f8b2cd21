// Vectors on surfaces as fields of their pictures: planes and spheres against formulas, gaps that lines do
// not pass, the two passes of --lic.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "support/every_target.h"
#include "support/refusal.h"
#include "support/test_ops.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/flow.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Image Filled(int width, int height, const std::function<Vector3(int x, int y)>& at) {
  const Image image{ImageSpec(width, height, 3)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector3 v = at(x, y);
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(v[static_cast<size_t>(c)]);
    }
  }
  return image;
}
Image Everywhere(int width, int height, const Vector3& v) {
  return Filled(width, height, [&](int, int) { return v; });
}
Image Field(const Image& positions, const Image& vectors, const SurfaceFieldParams& p = {}) {
  return Render(SurfaceField(FromImage(positions), FromImage(vectors), p));
}
bool Masked(const Image& field, int x, int y) {
  return field.at<float>(x, y, 2) == 0 && field.at<float>(x, y, 0) == 0 && field.at<float>(x, y, 1) == 0;
}

TEST(SurfaceFieldTest, APlaneIsSolvedExactly) {
  // P_x = (2, 0, 1), P_y = (0, -4, 0.5): three of the one, -2 of the other and something across.
  const Image positions = Filled(19, 11, [](int x, int y) {
    return Vector3{2.0 * x, -4.0 * y, x + 0.5 * y};
  });
  const Vector3 px = {2, 0, 1}, py = {0, -4, 0.5}, across = Cross(px, py);
  Vector3 v;
  for (size_t c = 0; c < 3; ++c) v[c] = 3 * px[c] - 2 * py[c] + 0.25 * across[c];
  testing::OnEveryTarget([&] {
    const Image field = Field(positions, Everywhere(19, 11, v));
    for (int y = 0; y < 11; ++y) {
      for (int x = 0; x < 19; ++x) {
        ASSERT_NEAR(field.at<float>(x, y, 0), 3, 1e-6) << x << "," << y;
        ASSERT_NEAR(field.at<float>(x, y, 1), -2, 1e-6) << x << "," << y;
      }
    }
  });
}

// A sphere seen in parallel and in perspective: both ways find what the projection's derivative says.
TEST(SurfaceFieldTest, ASphereBothWays) {
  constexpr int kSize = 200;
  const Camera cameras[] = {Camera::Parallel({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 2.5, 1),
                            Camera::Perspective({1, 2, 5}, {0, 0, 0}, {0, 1, 0}, 30, 1)};
  const Vector3 v = {0.3, -0.5, 0.8};
  for (const Camera& camera : cameras) {
    const Roi window{0, 0, kSize, kSize};
    const Image positions = Filled(kSize, kSize, [&](int x, int y) {
      const Camera::Ray ray = camera.PixelRay(window, x, y);
      const double a = Dot(ray.direction, ray.direction), b = Dot(ray.origin, ray.direction);
      const double root = b * b - a * (Dot(ray.origin, ray.origin) - 1);
      if (root < 0) return Vector3{kNan, kNan, kNan};
      const double t = (-b - std::sqrt(root)) / a;
      return Vector3{ray.origin[0] + t * ray.direction[0], ray.origin[1] + t * ray.direction[1],
                     ray.origin[2] + t * ray.direction[2]};
    });
    const Image vectors = Everywhere(kSize, kSize, v);
    const Image by_differences = Field(positions, vectors);
    // The normals of a sphere of radius 1 are its positions.
    const Image by_camera = Render(
        SurfaceField(FromImage(positions), FromImage(positions), FromImage(vectors), {.camera = camera}));
    int seen = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const Vector3 p = {positions.at<float>(x, y, 0), positions.at<float>(x, y, 1),
                           positions.at<float>(x, y, 2)};
        if (std::isnan(p[0])) {
          ASSERT_TRUE(Masked(by_differences, x, y) && Masked(by_camera, x, y));
          continue;
        }
        const double across = Dot(p, v);
        constexpr double kStep = 1e-5;
        double moved[2] = {};
        for (const double side : {-1.0, 1.0}) {
          Vector3 q;
          for (size_t c = 0; c < 3; ++c) q[c] = p[c] + side * kStep * (v[c] - across * p[c]);
          const auto clip = Transform(camera.world_to_clip(), q);
          moved[0] += side * clip[0] / clip[3] * 0.5 * kSize / (2 * kStep);
          moved[1] -= side * clip[1] / clip[3] * 0.5 * kSize / (2 * kStep);
        }
        const bool facing = Dot(camera.RayAt(0, 0).direction, p) < -0.5;
        if (!facing) continue;  // near the outline differences say little
        ++seen;
        for (int c = 0; c < 2; ++c) {
          ASSERT_NEAR(by_camera.at<float>(x, y, c), moved[c], 2e-3) << x << "," << y;
          ASSERT_NEAR(by_differences.at<float>(x, y, c), moved[c], 0.25) << x << "," << y;
        }
      }
    }
    EXPECT_GT(seen, 5000);
  }
}

// No line gets from one of two planes to the other, however the edge between them runs.
TEST(SurfaceFieldTest, LinesEndAtGaps) {
  for (const double slope : {-5.0, -1.0, -0.4, 0.0, 0.3, 1.0, 4.0}) {
    const auto is_near = [&](int x, int y) { return slope * (x - 40) + (y - 40) * 0.9 > 0.1; };
    const Image positions = Filled(80, 80, [&](int x, int y) {
      return Vector3{0.1 * x, 0.1 * y, is_near(x, y) ? 4.0 : 0.0};
    });
    const Image texture{ImageSpec(80, 80, 1)};
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 80; ++x) texture.at<float>(x, y) = is_near(x, y) ? 1.0f : 0.0f;
    }
    int mixed = 0;
    for (const Vector3& v : {Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{1, 1, 0}, Vector3{1, -0.7, 0}}) {
      const Node field = SurfaceField(FromImage(positions), FromImage(Everywhere(80, 80, v)));
      const Image mask = Render(field), lines = Render(Lic(FromImage(texture), field, {.length = 12}));
      const Image joined = Render(Lic(
          FromImage(texture),
          SurfaceField(FromImage(positions), FromImage(Everywhere(80, 80, v)), {.edge = 0}), {.length = 12}));
      int masked = 0;
      for (int y = 0; y < 80; ++y) {
        for (int x = 0; x < 80; ++x) {
          mixed += joined.at<float>(x, y) > 0.01f && joined.at<float>(x, y) < 0.99f;
          if (Masked(mask, x, y)) {
            ++masked;
          } else {
            ASSERT_NEAR(lines.at<float>(x, y), texture.at<float>(x, y), 1e-6)
                << x << "," << y << " " << slope;
          }
        }
      }
      EXPECT_GE(masked, 80);
      EXPECT_LE(masked, 240);
    }
    EXPECT_GT(mixed, 500) << "without edge= lines go on";
  }
}

// The steepest outline that a curved surface has is none; repeated positions say nothing.
TEST(SurfaceFieldTest, CurvedOutlinesAreNoGaps) {
  const Image round = Filled(60, 9, [](int x, int y) {
    return Vector3{x * 1.0, y * 1.0, x == 0 ? 0.0 : std::sqrt(200.0 * x)};
  });
  const Image twice = Filled(60, 9, [](int x, int y) { return Vector3{x / 2 * 2.0, y / 2 * 2.0, 0}; });
  for (const Image& positions : {round, twice}) {
    const Image field = Field(positions, Everywhere(60, 9, {0, 1, 0}));
    for (int y = 1; y < 8; ++y) {
      for (int x = 1; x < 59; ++x) ASSERT_FALSE(Masked(field, x, y)) << x << "," << y;
    }
  }
}

TEST(SurfaceFieldTest, WithinBound) {
  const Node rough = FromImage(testing::RandomImage({-3, 2, 50, 40}, 3, 1)),
             vectors = FromImage(testing::RandomImage({-3, 2, 50, 40}, 3, 2)),
             normals = FromImage(testing::RandomImage({-3, 2, 50, 40}, 3, 3));
  const Camera camera = Camera::Perspective({1, 2, 9}, {0, 0, 0}, {0, 1, 0}, 40, 1.25);
  for (const double edge : {0.0, 1.0, 3.0}) {
    for (const Node& node : {SurfaceField(rough, vectors, {.edge = edge}),
                             SurfaceField(rough, normals, vectors, {.camera = camera, .edge = edge})}) {
      const VerifyReport report = Verify(node);
      EXPECT_TRUE(report.within_bound) << report.max_error;
      EXPECT_LT(report.undecided, report.samples / 100 + 1);
    }
  }
}

TEST(SurfaceFieldTest, Refusals) {
  const Node three = FromImage(Everywhere(8, 8, {1, 0, 0})), two = FromImage(Image{ImageSpec(8, 8, 2)}),
             wide = FromImage(Everywhere(9, 8, {1, 0, 0}));
  EXPECT_THAT(Refusal([&] { SurfaceField(two, three); }), HasSubstr("expected three coordinates"));
  EXPECT_THAT(Refusal([&] { SurfaceField(three, two); }),
              HasSubstr("found vectors of 2 channels, expected three"));
  EXPECT_THAT(Refusal([&] { SurfaceField(three, wide); }), HasSubstr("9x8"));
  EXPECT_THAT(Refusal([&] { SurfaceField(three, three, {.edge = 0.5}); }), HasSubstr("found edge 0.5"));
  EXPECT_THAT(Refusal([&] { SurfaceField(three, three, three, {}); }),
              HasSubstr("found normals without a camera"));
  EXPECT_THAT(Refusal([&] { SurfaceField(three, three, {.camera = Camera()}); }),
              HasSubstr("found a camera without normals"));
}

// ---- two passes ----

TEST(TwoPassesTest, AreTheDefinition) {
  constexpr int kSide = 40;
  const Image field = [&] {
    const Image f{ImageSpec(kSide, kSide, 2)};
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const bool hole = std::hypot(x - 20, y - 20) < 6;
        f.at<float>(x, y, 0) = hole ? kNan : static_cast<float>(20 - y);
        f.at<float>(x, y, 1) = static_cast<float>(x - 20);
      }
    }
    return f;
  }();
  const LicParams once{.length = 6, .contrast = LicContrast::kNone};
  LicParams twice = once;
  twice.passes = 2;
  const Image texture = testing::RandomImage({0, 0, kSide, kSide}, 3, 5);
  const Image lines = Render(Lic(FromImage(texture), FromImage(field), once));
  const Image sharp{ImageSpec(kSide, kSide, 3)};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        int count = 0;
        for (int k = 0; k < 9; ++k) {
          const int i = std::clamp(x + k % 3 - 1, 0, kSide - 1), j = std::clamp(y + k / 3 - 1, 0, kSide - 1);
          if (std::isnan(field.at<float>(i, j, 0))) continue;
          sum += lines.at<float>(i, j, c), ++count;
        }
        sharp.at<float>(x, y, c) =
            static_cast<float>(10 * lines.at<float>(x, y, c) - 9 * sum / std::max(count, 1));
      }
    }
  }
  const Image want = Render(Lic(FromImage(sharp), FromImage(field), once));
  const Image got = Render(Lic(FromImage(texture), FromImage(field), twice));
  ASSERT_EQ(got.spec().channel_count(), 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(got.at<float>(x, y, c), want.at<float>(x, y, c), 1e-4);
    }
  }
}

// What the second pass is for: more contrast across lines, and what is along them stays.
TEST(TwoPassesTest, LinesAreSharper) {
  const Image field{ImageSpec(128, 128, 2)};
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 128; ++x) field.at<float>(x, y, 0) = 1;
  }
  const auto differences = [&](const LicParams& p, int dx, int dy) {
    const Image lines = Render(Lic(FromImage(field), p));
    EXPECT_EQ(lines.spec().channel_count(), 1);
    double sum = 0;
    for (int y = 1; y < 127; ++y) {
      for (int x = 1; x < 127; ++x)
        sum += std::pow(lines.at<float>(x + dx, y + dy) - lines.at<float>(x, y), 2);
    }
    return std::sqrt(sum / (126.0 * 126));
  };
  const LicParams once{.length = 10, .contrast = LicContrast::kEqualize}, twice{.length = 10, .passes = 2};
  EXPECT_LT(differences(twice, 1, 0), 0.7 * differences(once, 1, 0));
  EXPECT_GT(differences(twice, 0, 1), 0.95 * differences(once, 0, 1));
}

TEST(TwoPassesTest, Refusals) {
  const Node field = FromImage(Image{ImageSpec(8, 8, 2)}), other = FromImage(Image{ImageSpec(9, 8, 3)}),
             alpha = FromImage(Image{ImageSpec(8, 8, 4)});
  EXPECT_THAT(Refusal([&] { Lic(field, {.passes = 3}); }), HasSubstr("found a number of passes of 3"));
  EXPECT_THAT(Refusal([&] { Lic(field, {.contrast = LicContrast::kRescale, .passes = 2}); }),
              HasSubstr("expected none or equalize"));
  EXPECT_THAT(Refusal([&] { Lic(field, {.magnitude = LicMagnitude::kColor, .passes = 2}); }),
              HasSubstr("expected none or length"));
  EXPECT_THAT(Refusal([&] { Lic(other, field, {.passes = 2}); }), HasSubstr("expected equal sizes"));
  EXPECT_THAT(Refusal([&] { Lic(alpha, field, {.passes = 2}); }), HasSubstr("an image with alpha"));
}

}  // namespace
}  // namespace tessera
