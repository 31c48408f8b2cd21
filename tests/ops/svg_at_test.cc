// SVG's turbulence at positions: a picture's bits where they are whole, librsvg's values where they are not,
// hard positions, and every option against the reference.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/every_target.h"
#include "support/noise_values.h"
#include "support/pictures.h"
#include "support/refusal.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using tessera::testing::OnEveryTarget;
using tessera::testing::Values;
using ::testing::HasSubstr;

// A pixel's own place, times `scale`, with a third channel that is not read.
Node Places(const ImageSpec& like, double scale = 1) {
  ImageSpec spec(like.data_window.width(), like.data_window.height(), 3);
  spec.data_window = like.data_window, spec.display_window = like.display_window;
  const Image image(spec);
  const Roi& w = spec.data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      image.at<float>(x, y, 0) = static_cast<float>(x * scale);
      image.at<float>(x, y, 1) = static_cast<float>(y * scale);
      image.at<float>(x, y, 2) = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return FromImage(image);
}

TEST(SvgAt, WholePositionsHaveAPicturesBits) {
  ImageSpec spec(70, 41, 5);
  spec.data_window = {-33, -7, 67, 54};  // off the origin, and beyond the frame that is stitched
  spec.display_window = {0, 0, 60, 40};
  OnEveryTarget([&] {
    for (const bool fractal : {false, true}) {
      for (const bool stitch : {false, true}) {
        for (const std::array<double, 2> frequency : {std::array{0.05, 0.05}, {0.031, 1.3}, {0.0, 97.7}}) {
          for (const int octaves : {0, 1, 5, 64}) {
            SvgTurbulenceParams p;
            p.fractal_noise = fractal, p.stitch = stitch, p.base_frequency = frequency, p.octaves = octaves;
            p.seed = 7;
            const std::vector<float> picture = Values(SvgTurbulence(spec, p));
            RenderOptions tiles;
            tiles.tile_width = 17, tiles.tile_height = 13, tiles.threads = 2;
            const std::vector<float> at = Values(SvgTurbulenceAt(Places(spec), p, 5), tiles);
            ASSERT_EQ(picture.size(), at.size());
            ASSERT_EQ(std::memcmp(picture.data(), at.data(), at.size() * sizeof(float)), 0)
                << fractal << stitch << " " << frequency[0] << " " << octaves;
          }
        }
      }
    }
  });
}

// The fourth channel, in codes, as librsvg 2.54 draws it four times as large (transform="scale(4)"):
// positions between pixels. <feTurbulence seed="7" baseFrequency="0.03 0.07" numOctaves="4">.
TEST(SvgAt, ValuesOfLibrsvgBetweenPixels) {
  const struct {
    int x, y;
    double turbulence, fractal_noise;
  } kDrawn[] = {{0, 0, 0, 128}, {17, 5, 32, 144}, {63, 40, 76, 89}, {120, 77, 72, 92}, {199, 99, 47, 118}};
  SvgTurbulenceParams p;
  p.seed = 7;
  p.base_frequency = {0.03, 0.07};
  p.octaves = 4;
  OnEveryTarget([&] {
    for (const bool fractal : {false, true}) {
      p.fractal_noise = fractal;
      const std::vector<float> v = Values(SvgTurbulenceAt(Places(ImageSpec(200, 100, 1), 0.25), p));
      for (const auto& at : kDrawn) {
        EXPECT_NEAR(v[static_cast<size_t>((at.y * 200 + at.x) * 4 + 3)] * 255,
                    fractal ? at.fractal_noise : at.turbulence, 0.51);
      }
    }
  });
}

TEST(SvgAt, EveryOptionIsWithinItsBound) {
  const Node position =
      MulConstant(FromImage(testing::Picture({-3, 2, 60, 21}, 4, PixelType::kFloat, 5)), {90});
  const ops::OpInfo& op = *ops::FindOp("turbulenceat");
  VerifyOptions options;
  options.samples = 2, options.tile_size = 32;
  OnEveryTarget([&] {
    for (const char* const example :
         {"", "type=fractalnoise octaves=7 seed=-5", "stitch=1 basefreq=0.07,0.3 octaves=3 channels=6",
          "type=fractalnoise stitch=1 basefreq=1.7 seed=2147483647 channels=1", "octaves=0 channels=2"}) {
      SCOPED_TRACE(example);
      const Node node = op.make(std::vector{position}, ops::ParseExample(op, example), nullptr);
      const VerifyReport report = Verify(node, PixelType::kFloat, options);
      EXPECT_TRUE(report.within_bound) << report.Summary();
    }
  });
}

TEST(SvgAt, HardPositions) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  const std::vector<std::array<float, 2>> places = {{kNaN, 0},
                                                    {0.5f, kInf},
                                                    {-kInf, kNaN},
                                                    {3e38f, -3e38f},
                                                    {1e-40f, -0.0f},
                                                    {-5000.25f, 8388609.0f},
                                                    {-81920.0f, 81920.0f}};
  const Image image(ImageSpec(static_cast<int>(places.size()), 1, 2));
  for (size_t i = 0; i < places.size(); ++i) {
    image.at<float>(static_cast<int>(i), 0, 0) = places[i][0];
    image.at<float>(static_cast<int>(i), 0, 1) = places[i][1];
  }
  OnEveryTarget([&] {
    for (const bool fractal : {false, true}) {
      SvgTurbulenceParams p;
      p.fractal_noise = fractal, p.octaves = 64, p.base_frequency = {0.37, 1e6};
      const std::vector<float> v = Values(SvgTurbulenceAt(FromImage(image), p));
      for (size_t i = 0; i < v.size(); ++i) {
        const bool number = i >= 3 * 4;
        EXPECT_TRUE(number || v[i] == (fractal ? 0.5f : 0.0f)) << i;
        EXPECT_GE(v[i], 0);
        EXPECT_LE(v[i], 1);
      }
    }
  });
}

TEST(SvgAt, RefusalsNameWhatIsWrong) {
  const Node one = FromImage(Image(ImageSpec(2, 2, 1))), two = FromImage(Image(ImageSpec(2, 2, 2)));
  EXPECT_THAT(Refusal([&] { SvgTurbulenceAt(one, {}); }), HasSubstr("found 1 channels, expected at least 2"));
  EXPECT_THAT(Refusal([&] { SvgTurbulenceAt(two, {}, 0); }), HasSubstr("channels: found 0"));
  EXPECT_THAT(Refusal([&] { SvgTurbulenceAt(two, {.octaves = 65}); }), HasSubstr("found 65 octaves"));
  EXPECT_THAT(Refusal([&] {
                SvgTurbulenceAt(two, {.base_frequency = {-1, 0}});
              }),
              HasSubstr("base frequency -1"));
}

}  // namespace
}  // namespace tessera
