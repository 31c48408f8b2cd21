// Resampling at the edges of filters and far beyond those of images.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "support/every_target.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/ops/geometry.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::OnEveryTarget;
using testing::RandomImage;

// An image at the origin filled by f(x, y, c).
template <class F>
Image Filled(int width, int height, int channels, F f) {
  const Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = static_cast<float>(f(x, y, c));
    }
  }
  return image;
}

TEST(FilterEdgeTest, TheTailOfAFilterThatSeesTheEdgeIsWithinBound) {
  // Far from the projector's vanishing line filters are wide, and some reach the picture with their tails
  // alone.
  const Node image = FromImage(RandomImage({0, 0, 50, 37}, 3, 17));
  for (const char* filter : {"lanczos3", "mitchell", "gaussian", "sinc"}) {
    const VerifyReport report =
        Verify(Warp(image, {{1, 0, 0.05, 0, 1, 0.05, 0, 0, -1}, filter, Wrap::kBlack, false}));
    EXPECT_TRUE(report.within_bound) << filter << ": " << report.Summary();
  }
}

// At these ratios pixels lie at the very edge of filters, some of which end with a jump.
TEST(FilterEdgeTest, PixelsAtTheEdgeOfAFilterAreWithinBound) {
  const Node image = FromImage(RandomImage({0, 0, 64, 40}, 3, 5));
  for (const char* filter : {"blackman-harris", "box", "gaussian", "sharp-gaussian", "lanczos3", "disk"}) {
    for (const auto& [width, height] : {std::array{96, 60}, {80, 50}, {48, 30}, {32, 20}, {192, 120}}) {
      SCOPED_TRACE(std::string(filter) + " to " + std::to_string(width));
      const VerifyReport report = Verify(Resize(image, {.width = width, .height = height, .filter = filter}));
      EXPECT_TRUE(report.within_bound) << report.Summary();
    }
  }
}

// The same of look-ups anywhere between two pixels: up to the edge of a filter that ends with a jump, weights
// are those from inside, and of widened ones the edge is where it is on paper.
TEST(FilterEdgeTest, LookUpsNearTheEdgeOfAFilterAreWithinBound) {
  const Node image = FromImage(RandomImage({0, 0, 32, 20}, 3, 5));
  // Positions at every distance from the middle between two pixels, down to a tenth of a thousandth.
  const Node places = FromImage(Filled(96, 8, 2, [](int x, int y, int c) {
    const double near = std::ldexp(x % 2 == 0 ? 1 : -1, -(x / 2) % 14);
    return c == 0 ? (5 + y + 0.5 + 0.5 * (y % 2) + near) / 32 : (3 + y + 0.5 * (x % 2) + near) / 20;
  }));
  for (const char* filter :
       {"blackman-harris", "box", "gaussian", "sharp-gaussian", "lanczos3", "triangle"}) {
    SCOPED_TRACE(filter);
    OnEveryTarget([&] {
      StWarpParams st;
      st.filter = filter;
      const VerifyReport looked = Verify(StWarp(image, places, st));
      EXPECT_TRUE(looked.within_bound) << looked.Summary();
      EXPECT_EQ(looked.undecided, 0);
      for (const double factor : {2.0, 3.0, 7.0 / 3, 1.7}) {
        const VerifyReport reduced = Verify(Warp(
            image, {{1 / factor, 0, 0, 0, 1 / factor, 0, 0.25, 0.125, 1}, filter, Wrap::kMirror, false}));
        EXPECT_TRUE(reduced.within_bound) << factor << ": " << reduced.Summary();
      }
    });
  }
}

TEST(FilterEdgeTest, PlacesFarBeyondTheEdgeAreTheEdgesPixel) {
  const Image image = RandomImage({0, 0, 9, 5}, 4, 17);
  const Node far = FromImage(Filled(9, 5, 2, [](int x, int, int c) { return c == 0 ? x % 2 : -(x % 2); }));
  OnEveryTarget([&] {
    for (const double amount : {1e3, 1.4e8, 3e8, 1e9}) {
      const Image moved =
          Render(Distort(FromImage(image), far, {.amount = amount, .centre = 0, .wrap = Wrap::kClamp}));
      for (int c = 0; c < 4; ++c) {
        ASSERT_EQ(moved.at<float>(3, 2, c), image.at<float>(8, 0, c)) << amount;
        ASSERT_EQ(moved.at<float>(4, 2, c), image.at<float>(4, 2, c)) << amount;
      }
    }
  });
}

}  // namespace
}  // namespace tessera
