// Pictures with depth seen by other cameras: shifts by disparity, planes against their own formula, edges,
// holes, what is seen from behind; on every target.
#include "tessera/ops/reproject.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "support/every_target.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr int kWidth = 96, kHeight = 64;
constexpr Roi kFrame{0, 0, kWidth, kHeight};
// Focal length in pixels of a camera of 90 degrees upwards: half the height.
constexpr double kFocal = kHeight / 2.0;

Camera Straight(const Vector3& eye = {0, 0, 0}) {
  return Camera::Perspective(eye, {eye[0], eye[1], eye[2] - 1}, {0, 1, 0}, 90, double{1} * kWidth / kHeight);
}
struct View {
  Image color{ImageSpec(kWidth, kHeight, 3)};
  Image depth{ImageSpec(kWidth, kHeight, 1)};
};
// What a camera sees of z = f(ray): colours by world position.
View Seen(const Camera& camera, const std::function<double(const Camera::Ray&)>& depth,
          const std::function<double(const Vector3&, int)>& color) {
  View view;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Camera::Ray ray = camera.PixelRay(kFrame, x, y);
      const double z = depth(ray);
      view.depth.at<float>(x, y) = static_cast<float>(z);
      Vector3 p;
      for (size_t k = 0; k < 3; ++k) p[k] = ray.origin[k] + z * ray.direction[k];
      for (int c = 0; c < 3; ++c) view.color.at<float>(x, y, c) = static_cast<float>(color(p, c));
    }
  }
  return view;
}
Image Other(const View& view, const Camera& from, const Camera& to, int samples = 2, double tear = 0.1) {
  ReprojectParams p;
  p.from = from, p.to = to, p.samples = samples, p.tear = tear;
  return Render(Reproject(FromImage(view.color), FromImage(view.depth), p));
}
double Waves(const Vector3& p, int c) {
  return 0.5 + 0.2 * std::sin(1.1 * p[0] + c) + 0.2 * std::cos(0.9 * p[1] - 0.3 * p[2]);
}

TEST(Reproject, AWallMovesByItsDisparity) {
  std::mt19937 random(1);
  View view = Seen(
      Straight(), [](const Camera::Ray&) { return 4.0; },
      [&](const Vector3&, int) { return static_cast<double>(random() % 1000) / 1000; });
  OnEveryTarget([&] {
    // 3 pixels: 3 z / f to the right.
    const Image got = Other(view, Straight(), Straight({3 * 4 / kFocal, 0, 0}), 1);
    ASSERT_EQ(got.spec().channel_count(), 4);
    ASSERT_EQ(got.spec().alpha, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(got.at<float>(x, y, 3), x + 3 < kWidth ? 1 : 0) << x;
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(got.at<float>(x, y, c), x + 3 < kWidth ? view.color.at<float>(x + 3, y, c) : 0, 1e-5)
              << x;
        }
      }
    }
    // To itself: the same picture.
    const Image same = Other(view, Straight(), Straight(), 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(same.at<float>(x, y, c), view.color.at<float>(x, y, c), 1e-6);
      }
    }
  });
}

TEST(Reproject, ASlopeIsWhatTheOtherCameraWouldHaveRendered) {
  // A plane through (0, 0, -6) that leans away upwards and to the right.
  const Vector3 normal = Normalized({-0.3, -0.5, 1});
  const auto plane = [&](const Camera::Ray& ray) {
    const Vector3 to = {-ray.origin[0], -ray.origin[1], -6 - ray.origin[2]};
    return Dot(normal, to) / Dot(normal, ray.direction);
  };
  const Camera from = Straight();
  const Camera to =
      Camera::Perspective({1, 0.7, 0.5}, {0.4, 0.1, -6}, {0.1, 1, 0}, 70, double{1} * kWidth / kHeight);
  const View view = Seen(from, plane, Waves), truth = Seen(to, plane, Waves);
  OnEveryTarget([&] {
    const Image got = Other(view, from, to, 3);
    double worst = 0;
    int whole = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        // Towards the horizon pixels are larger than the waves.
        if (got.at<float>(x, y, 3) < 1 || truth.depth.at<float>(x, y) > 8) continue;
        ++whole;
        for (int c = 0; c < 3; ++c) {
          worst = std::max<double>(worst, std::fabs(got.at<float>(x, y, c) - truth.color.at<float>(x, y, c)));
        }
      }
    }
    EXPECT_GT(whole, kWidth * kHeight / 2);
    EXPECT_LT(worst, 6e-3);  // of linear interpolation between pixels, and the outermost half pixel
  });
}

TEST(Reproject, ObjectsKeepTheirEdgesAndUncoverHoles) {
  // A red square at depth 2 before a green wall at 8.
  const auto depth = [](const Camera::Ray& ray) {
    return std::fabs(ray.direction[0]) < 0.5 && std::fabs(ray.direction[1]) < 0.5 ? 2.0 : 8.0;
  };
  const View view = Seen(Straight(), depth, [](const Vector3& p, int c) {
    return (p[2] > -5) == (c == 0) && c < 2 ? 1.0 : 0.0;
  });
  OnEveryTarget([&] {
    // 8 pixels for the square, 2 for the wall.
    const Image got = Other(view, Straight(), Straight({8 * 2 / kFocal, 0, 0}), 2);
    const int y = kHeight / 2, left = kWidth / 2 - 16, right = kWidth / 2 + 16;
    for (int x = 0; x < kWidth; ++x) {
      const double red = got.at<float>(x, y, 0), green = got.at<float>(x, y, 1),
                   alpha = got.at<float>(x, y, 3);
      EXPECT_NEAR(red + green, alpha, 1e-6) << x;
      const bool square = x >= left - 8 && x < right - 8, hole = x >= right - 8 && x < right - 2;
      if (x < kWidth - 2) {
        EXPECT_EQ(red, square ? 1 : 0) << x;
        EXPECT_EQ(green, square || hole ? 0 : 1) << x;
      } else {
        EXPECT_EQ(alpha, 0);
      }
    }
    // With everything joined there is rubber in place of a hole.
    const Image rubber = Other(view, Straight(), Straight({8 * 2 / kFocal, 0, 0}), 2, 1e9);
    for (int x = 0; x < kWidth - 2; ++x) EXPECT_NEAR(rubber.at<float>(x, y, 3), 1, 1e-6) << x;
  });
}

TEST(Reproject, ThereAndBackIsThePicture) {
  const auto bumpy = [](const Camera::Ray& ray) {
    return 5 + 0.4 * std::sin(2 * ray.direction[0]) + 0.4 * std::cos(3 * ray.direction[1]);
  };
  const Camera from = Straight(), to = Straight({0.4, -0.2, -0.3});
  const View view = Seen(from, bumpy, Waves);
  ReprojectParams p;
  p.from = from, p.to = to, p.samples = 3;
  const Node depth = FromImage(view.depth);
  // The depth goes along as a colour; it is what the new camera sees but for how far it moved forward.
  const Image there = Render(Reproject(FromImage(view.color), depth, p));
  View again{Render(Reproject(FromImage(view.color), depth, p)), Image(ImageSpec(kWidth, kHeight, 1))};
  const Image far = Render(Reproject(depth, depth, p));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      again.depth.at<float>(x, y) = far.at<float>(x, y, 1) == 1 ? far.at<float>(x, y, 0) - 0.3f : NAN;
    }
  }
  p.from = to, p.to = from;
  const Image back = Render(Reproject(FromImage(again.color), FromImage(again.depth), p));
  ASSERT_EQ(back.spec().channel_count(), 4);
  int whole = 0;
  for (int y = 1; y < kHeight - 1; ++y) {
    for (int x = 1; x < kWidth - 1; ++x) {
      if (back.at<float>(x, y, 3) < 1) continue;
      ++whole;
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(back.at<float>(x, y, c), view.color.at<float>(x, y, c), 1.5e-2);
    }
  }
  EXPECT_GT(whole, kWidth * kHeight * 3 / 4);
}

TEST(Reproject, WhatWasNeverSeenIsNothing) {
  View view = Seen(
      Straight(), [](const Camera::Ray&) { return 4.0; }, [](const Vector3&, int) { return 1.0; });
  // From behind the wall, and with the wall behind the eye.
  const Camera behind = Camera::Perspective({0, 0, -8}, {0, 0, 0}, {0, 1, 0}, 90, 1.5);
  const Camera past = Straight({0, 0, -8});
  for (const Camera& camera : {behind, past}) {
    const Image got = Other(view, Straight(), camera);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) ASSERT_EQ(got.at<float>(x, y, 3), 0);
    }
  }
  // No depth, no surface.
  const float bad[] = {NAN, INFINITY, -INFINITY, 0, -1};
  for (int k = 0; k < 5; ++k) view.depth.at<float>(10 * k + 5, 20) = bad[k];
  const Image got = Other(view, Straight(), Straight(), 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(got.at<float>(x, y, 3), y == 20 && x % 10 == 5 && x < 50 ? 0 : 1);
  }
}

TEST(Reproject, AnyDepthsAreWithinTheBound) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  View view;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      view.depth.at<float>(x, y) = 3 + 2 * unit(random) * (x > 40 ? 1.0f : 0.1f);
      for (int c = 0; c < 3; ++c) view.color.at<float>(x, y, c) = unit(random) * 2 - 1;
    }
  }
  const Camera parallel = Camera::Parallel({0, 0, 0}, {0.1, 0, -1}, {0, 1, 0}, 4, 1.5);
  const Camera cameras[] = {Straight(), Straight({0.5, 0.3, -1}), parallel};
  OnEveryTarget([&] {
    for (const Camera& from : cameras) {
      for (const Camera& to : cameras) {
        ReprojectParams p;
        p.from = from, p.to = to, p.width = 20, p.height = 15;
        const VerifyReport report = Verify(Reproject(FromImage(view.color), FromImage(view.depth), p));
        EXPECT_TRUE(report.within_bound) << report.Summary();
      }
    }
  });
}

TEST(Reproject, TheResultKnowsItsCamera) {
  const View view = Seen(
      Straight(), [](const Camera::Ray&) { return 4.0; }, Waves);
  ReprojectParams p;
  p.from = Straight(), p.to = Moved(p.from, {0.5, -0.25, 2});
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(p.to.eye()[k], (Vector3{0.5, -0.25, -2}[k]), 1e-12);
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(p.to.forward()[k], p.from.forward()[k], 1e-12);
  const Node node = Reproject(FromImage(view.color), FromImage(view.depth), p);
  const auto camera = Camera::FromMetadata(node.spec());
  ASSERT_TRUE(camera.has_value());
  for (size_t k = 0; k < 16; ++k) EXPECT_NEAR(camera->world_to_clip()[k], p.to.world_to_clip()[k], 1e-6);
}

TEST(Reproject, WrongParametersAreNamed) {
  const View view;
  const auto refusal = [&](const ReprojectParams& p) {
    return Refusal([&] { Reproject(FromImage(view.color), FromImage(view.depth), p); });
  };
  ReprojectParams p;
  p.tear = -1;
  EXPECT_THAT(refusal(p), HasSubstr("found tear=-1, expected 0 or more"));
  p.tear = 0.1, p.samples = 9;
  EXPECT_THAT(refusal(p), HasSubstr("found samples=9, expected 1 to 8"));
  p.samples = 1, p.width = 10;
  EXPECT_THAT(refusal(p), HasSubstr("found a size of 10x0"));
}

}  // namespace
}  // namespace tessera
