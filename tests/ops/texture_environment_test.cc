// Texture environments: OpenGL's tables written out by base format, combine's functions and arguments.
#include "tessera/ops/texture_environment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "support/every_target.h"
#include "support/refusal.h"
#include "tessera/error.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using testing::OnEveryTarget;

constexpr int kWidth = 37;

// Values beyond [0, 1] too.
Image Colors(int channels, int seed) {
  const Image image(ImageSpec(kWidth, 2, channels));
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.at<float>(x, y, c) =
            static_cast<float>(std::sin(1.7 * x + 0.9 * y + 2.3 * c + seed) * 0.7 + 0.4);
      }
    }
  }
  return image;
}
Image AlphaAlone() {
  ImageSpec spec(kWidth, 2, 1);
  spec.channels = {"A"}, spec.alpha = 0;
  const Image image(spec);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < kWidth; ++x) image.at<float>(x, y) = 0.02f * static_cast<float>(x + y);
  }
  return image;
}

using Pixel = std::array<double, 4>;
// As the tables of base formats take it: colours and alpha, 1 without; grey in all three.
Pixel At(const Image& image, int x, int y) {
  const int n = image.spec().channel_count(), alpha = image.spec().alpha, colors = n - (alpha >= 0 ? 1 : 0);
  Pixel p = {0, 0, 0, alpha >= 0 ? image.at<float>(x, y, alpha) : 1.0};
  for (int c = 0; c < 3 && colors > 0; ++c)
    p[static_cast<size_t>(c)] = image.at<float>(x, y, colors == 1 ? 0 : c);
  return p;
}
void Expect(const Image& texture, const Image& fragment, const TextureEnvironmentParams& params, int channels,
            const std::function<Pixel(const Pixel&, const Pixel&)>& formula) {
  OnEveryTarget([&] {
    const Image got = Render(TextureEnvironment(FromImage(texture), FromImage(fragment), params));
    ASSERT_EQ(got.spec().channel_count(), channels);
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Pixel wanted = formula(At(texture, x, y), At(fragment, x, y));
        for (int c = 0; c < channels; ++c) {
          const double v = wanted[static_cast<size_t>(c)];
          ASSERT_NEAR(got.at<float>(x, y, c), v, 2e-6 + 5e-7 * std::fabs(v)) << x << " " << c;
        }
      }
    }
  });
}

TEST(TextureEnvironment, FollowsTheTableOfEveryBaseFormat) {
  TextureEnvironmentParams p;
  p.constant = {0.9, 0.3, -0.2, 0.7};
  const Pixel& c = p.constant;
  for (const int fragment : {3, 4}) {
    const Image surface = Colors(fragment, 5);
    for (const int texture : {1, 2, 3, 4}) {
      const Image image = Colors(texture, 1);
      const bool has_alpha = texture % 2 == 0;
      const int channels = fragment == 4 || has_alpha ? 4 : 3;
      const auto all = [&](const std::function<double(double, double, double, size_t)>& color,
                           const std::function<double(double, double)>& alpha) {
        return [&, color, alpha](const Pixel& t, const Pixel& f) {
          Pixel r;
          for (size_t k = 0; k < 3; ++k) r[k] = color(t[k], f[k], t[3], k);
          r[3] = has_alpha ? alpha(t[3], f[3]) : f[3];
          return r;
        };
      };
      const auto product = [](double t, double f) { return t * f; };
      SCOPED_TRACE(::testing::Message() << texture << " on " << fragment);
      p.mode = TextureMode::kModulate;
      Expect(image, surface, p, channels,
             all([](double t, double f, double, size_t) { return t * f; }, product));
      p.mode = TextureMode::kBlend;
      Expect(image, surface, p, channels,
             all([&](double t, double f, double, size_t k) { return f * (1 - t) + c[k] * t; }, product));
      p.mode = TextureMode::kReplace;
      Expect(image, surface, p, channels,
             all([](double t, double, double, size_t) { return t; }, [](double t, double) { return t; }));
      p.mode = TextureMode::kAdd;
      Expect(image, surface, p, channels,
             all([](double t, double f, double, size_t) { return t + f; }, product));
      p.mode = TextureMode::kDecal;
      Expect(image, surface, p, fragment,
             all([](double t, double f, double a, size_t) { return f * (1 - a) + t * a; },
                 [](double, double f) { return f; }));
    }
    // Alpha alone leaves colours.
    for (const TextureMode mode :
         {TextureMode::kModulate, TextureMode::kBlend, TextureMode::kAdd, TextureMode::kReplace}) {
      p.mode = mode;
      Expect(AlphaAlone(), surface, p, 4, [&](const Pixel& t, const Pixel& f) {
        return Pixel{f[0], f[1], f[2], mode == TextureMode::kReplace ? t[3] : t[3] * f[3]};
      });
    }
  }
}

TEST(TextureEnvironment, CombinesAnyArguments) {
  TextureEnvironmentParams p;
  p.mode = TextureMode::kCombine, p.constant = {0.2, 0.6, 0.1, 0.8};
  const Image texture = Colors(4, 2), surface = Colors(4, 9);
  for (int first = 0; first < 12; ++first) {
    for (const int scale : {1, 4}) {
      for (int function = 0; function < 7; ++function) {
        p.arguments = {static_cast<TextureArgument>(first),
                       static_cast<TextureArgument>((5 * first + 3) % 12),
                       static_cast<TextureArgument>((7 * first + 6) % 12)};
        p.function = static_cast<TextureFunction>(function), p.scale = scale;
        Expect(texture, surface, p, 4, [&](const Pixel& t, const Pixel& f) {
          const auto argument = [&](size_t k, size_t c) {
            const auto number = static_cast<size_t>(p.arguments[k]);
            const Pixel& of = number < 4 ? t : number < 8 ? f : p.constant;
            const double v = of[number % 4 >= 2 ? 3 : c];
            return number % 2 == 1 ? 1 - v : v;
          };
          Pixel r;
          double dot = 0;
          for (size_t c = 0; c < 4; ++c) {
            const double a = argument(0, c), b = argument(1, c), w = argument(2, c);
            if (c < 3) dot += 4 * (a - 0.5) * (b - 0.5);
            const double values[] = {a * b, a, a + b, a + b - 0.5, a * w + b * (1 - w), a - b};
            if (function < 6) r[c] = scale * values[function];
          }
          if (function == 6) r = {scale * dot, scale * dot, scale * dot, f[3]};
          return r;
        });
      }
    }
  }
}

TEST(TextureEnvironment, RefusesWhatOpenGlHasNoTableFor) {
  const auto refusal = [](const Image& texture, const Image& fragment, const TextureEnvironmentParams& p) {
    return Refusal([&] { TextureEnvironment(FromImage(texture), FromImage(fragment), p); });
  };
  TextureEnvironmentParams p;
  ImageSpec vectors(kWidth, 2, 2);
  vectors.channels = {"U", "V"}, vectors.alpha = -1;
  EXPECT_THAT(refusal(Image(vectors), Colors(3, 1), p),
              HasSubstr("found a texture of 2 channels, expected R,G,B"));
  // Beyond the third colour nothing is read.
  EXPECT_EQ(Refusal([&] { TextureEnvironment(FromImage(Colors(6, 1)), FromImage(Colors(6, 2))); }),
            "accepted");
  p.mode = TextureMode::kDecal;
  EXPECT_THAT(refusal(AlphaAlone(), Colors(3, 1), p), HasSubstr("alpha alone, expected colours for decal"));
  p.scale = 3;
  EXPECT_THAT(refusal(Colors(3, 1), Colors(3, 1), p), HasSubstr("found scale=3, expected 1, 2 or 4"));
}

}  // namespace
}  // namespace tessera
