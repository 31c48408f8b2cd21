// Line integral convolution: hard fields, masks, sizes, shared lines, threads, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/fields.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/flow.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using namespace testing;  // NOLINT: the fields are this test's language
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(LicTest, SinksAndShearLinesKeepLinesWhereTheyAre) {
  const int n = 65;
  const Image texture = Coordinates(n, n);
  // Everything flows to the middle: the farthest taps pile up there.
  const Image sink = FieldOf(n, n, [](double x, double y) { return std::pair(32 - x, 32 - y); });
  const Image end = EndPoints(sink, {.length = 60});
  for (int y = 4; y < n - 4; ++y) {
    for (int x = 4; x < n - 4; ++x) {
      ASSERT_NEAR(end.at<float>(x, y, 0), 32, 0.8) << x << "," << y;
      ASSERT_NEAR(end.at<float>(x, y, 1), 32, 0.8) << x << "," << y;
    }
  }
  // Opposite vectors in neighbouring rows: between them the field is 0.
  const Image shear = FieldOf(n, n, [](double, double y) { return std::pair(y < 32 ? 1.0 : -1.0, 0.0); });
  const Image moved = EndPoints(shear, {.length = 10});
  EXPECT_NEAR(moved.at<float>(20, 31, 0), 30, 1e-4);
  EXPECT_NEAR(moved.at<float>(40, 32, 0), 30, 1e-4);
  // Two rows that meet head on: lines stop between them and never go further than length.
  const Image head_on = FieldOf(n, n, [](double, double y) { return std::pair(0.0, y < 32 ? 1.0 : -1.0); });
  const Image stopped = EndPoints(head_on, {.length = 50});
  for (int y = 2; y < n - 2; ++y) EXPECT_NEAR(stopped.at<float>(30, y, 1), 31.5, 1.01) << y;
  (void)texture;
}

TEST(LicTest, LongLinesEndInSinksAndKeepTheirWaysAroundCentres) {
  const int n = 97;
  // Lines to a node and to a focus end there, between pixels too; those of a centre half a pixel off go on.
  const auto toward = [](double x, double y) { return std::pair(48.3 - x, 1.5 * (47.6 - y)); };
  const auto spiral = [](double x, double y) {
    return std::pair(48.3 - x - 3 * (y - 47.6), 47.6 - y + 3 * (x - 48.3));
  };
  const auto centre = [](double x, double y) { return std::pair(47.6 - y, x - 48.3); };
  OnEveryTarget([&] {
    const Image node = EndPoints(FieldOf(n, n, toward), {.length = 80});
    const Image focus = EndPoints(FieldOf(n, n, spiral), {.length = 160});
    const Image around = EndPoints(FieldOf(n, n, centre), {.length = 100});
    for (int y = 32; y < 64; ++y) {
      for (int x = 32; x < 64; ++x) {
        for (const Image* end : {&node, &focus}) {
          ASSERT_NEAR(end->at<float>(x, y, 0), 48.3, 1e-3) << x << "," << y;
          ASSERT_NEAR(end->at<float>(x, y, 1), 47.6, 1e-3) << x << "," << y;
        }
        const double radius = std::hypot(x - 48.3, y - 47.6), angle = std::atan2(y - 47.6, x - 48.3);
        if (radius < 0.7) continue;  // more than twenty times around
        const double to = angle + 100 / radius;
        ASSERT_NEAR(around.at<float>(x, y, 0), 48.3 + radius * std::cos(to), 2e-2) << x << "," << y;
        ASSERT_NEAR(around.at<float>(x, y, 1), 47.6 + radius * std::sin(to), 2e-2) << x << "," << y;
      }
    }
  });
}

TEST(LicTest, MasksEndLinesAndAreTransparent) {
  Image field(ImageSpec(24, 24, 4));
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 24; ++x) {
      field.at<float>(x, y, 0) = 1, field.at<float>(x, y, 3) = x < 20 ? 1.0f : 0.0f;
    }
  }
  for (int y = 0; y < 24; ++y)
    field.at<float>(10, y, 1) = y % 3 == 0 ? kNaN : std::numeric_limits<float>::infinity();
  const Image texture = Texture(24, 24);
  OnEveryTarget([&] {
    for (const LicIntegrator integrator : {LicIntegrator::kAdaptive, LicIntegrator::kCell}) {
      const Image got = Lines(texture, field, {.length = 5, .integrator = integrator});
      for (int y = 1; y < 23; ++y) {
        EXPECT_EQ(got.at<float>(10, y), 0);
        EXPECT_EQ(got.at<float>(22, y), 0);
        double mean = 0;
        for (int x = 3; x <= 9; ++x) mean += texture.at<float>(x, y) / 7.0;
        EXPECT_NEAR(got.at<float>(8, y), mean, 1e-6) << y;
      }
      const Image noise =
          Render(Lic(FromImage(field), {.length = 5, .integrator = integrator, .alpha = true}));
      EXPECT_EQ(noise.at<float>(10, 5, 1), 0);
      EXPECT_EQ(noise.at<float>(9, 5, 1), 1);
    }
  });
}

TEST(LicTest, SizesFromTiniestToLargestAndNoiseThatIsNaN) {
  const Image texture = Texture(48, 40);
  texture.at<float>(24, 20) = kNaN;
  OnEveryTarget([&] {
    for (const double size : {1e-38, 1e-30, 1.0, 1e30, 1e38}) {
      const Image field = Constant(48, 40, size, 0);
      const Image got = Lines(texture, field, {.length = 6});
      for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 48; ++x) {
          const bool crosses = y == 20 && std::abs(x - 24) <= 6;
          ASSERT_EQ(std::isnan(got.at<float>(x, y)), crosses) << x << "," << y << " size " << size;
        }
      }
    }
  });
}

TEST(LicTest, LinesThatGoRoundForeverStayInThePicture) {
  // Vectors so long that after one step no float counts the pixels: lines with their lengths, wrap=repeat.
  const int n = 37;
  for (const double size : {1e6, 1e9, 1e20, 3e38}) {
    const Image field = FieldOf(n, n, [&](double x, double y) {
      return std::pair(size * std::sin(3 * x + y), size * std::cos(x - 2 * y));
    });
    OnEveryTarget([&] {
      const Image image = Render(Lic(FromImage(field), {.length = 7,
                                                        .integrator = LicIntegrator::kRk4,
                                                        .wrap = Wrap::kRepeat,
                                                        .contrast = LicContrast::kNone,
                                                        .speed = true}));
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          const float v = image.at<float>(x, y, 0);
          // Means of a texture in [0, 1]; positions beyond all floats are none.
          ASSERT_TRUE(std::isnan(v) || (v >= 0 && v <= 1)) << size << " " << x << "," << y << " " << v;
        }
      }
    });
  }
}

TEST(LicTest, VectorsFollowTheirUnits) {
  // Twice as wide as high: a diagonal of normalised units is not one of pixels.
  const Image field = Constant(64, 32, 1, 1);
  const auto end = [&](LicParams p) {
    p.length = 10;
    const Image e = EndPoints(field, p);
    return std::pair(e.at<float>(20, 16, 0) - 20, e.at<float>(20, 16, 1) - 16);
  };
  const auto near = [](std::pair<float, float> got, double x, double y) {
    EXPECT_NEAR(got.first, x, 1e-4);
    EXPECT_NEAR(got.second, y, 1e-4);
  };
  near(end({}), 10 / std::sqrt(2.0), 10 / std::sqrt(2.0));
  near(end({.y_up = true}), 10 / std::sqrt(2.0), -10 / std::sqrt(2.0));
  near(end({.units = LicUnits::kNormalized}), 20 / std::sqrt(5.0), 10 / std::sqrt(5.0));
  near(end({.scale_x = 3, .scale_y = 4}), 6, 8);
  near(end({.speed = true, .scale_x = 0.5, .scale_y = 0.25}), 5, 2.5);
  // A map: one degree east is shorter away from the equator.
  const Image east = Constant(72, 36, 1, 0), north = Constant(72, 36, 0, 1);
  EXPECT_NEAR(EndPoints(north, {.length = 5, .units = LicUnits::kLatLong}).at<float>(30, 20, 1), 15, 1e-4);
  const double latitude = kPi * (0.5 - 9.5 / 36);
  const Image both = Constant(72, 36, 1, 1);
  const Image e = EndPoints(both, {.length = 1, .units = LicUnits::kLatLong});
  EXPECT_NEAR((e.at<float>(30, 9, 0) - 30) / (9 - e.at<float>(30, 9, 1)), 1 / std::cos(latitude), 0.05);
  (void)east;
}

TEST(LicTest, MapsAreOneAcrossTheDateLine) {
  const Image texture = Texture(72, 36), east = Constant(72, 36, 1, 0), north = Constant(72, 36, 0, 1);
  OnEveryTarget([&] {
    for (const LicIntegrator integrator :
         {LicIntegrator::kAdaptive, LicIntegrator::kRk4, LicIntegrator::kEuler, LicIntegrator::kCell}) {
      for (const Wrap wrap : {Wrap::kRenormalize, Wrap::kClamp}) {
        const LicParams p{.length = 6, .integrator = integrator, .wrap = wrap, .units = LicUnits::kLatLong};
        const Image around = Lines(texture, east, p), up = Lines(texture, north, p);
        for (int x = 0; x < 72; ++x) {
          double mean = 0, pole = 0;
          for (int i = -6; i <= 6; ++i) mean += texture.at<float>((x + i + 72) % 72, 18) / 13.0;
          ASSERT_NEAR(around.at<float>(x, 18), mean, 1e-6) << x;
          // Not across the poles.
          for (int i = -6; i <= 6; ++i) {
            if (wrap == Wrap::kClamp) pole += texture.at<float>(x, std::max(i, 0)) / 13.0;
            if (wrap == Wrap::kRenormalize && i >= 0) pole += texture.at<float>(x, i) / 7.0;
          }
          ASSERT_NEAR(up.at<float>(x, 0), pole, 1e-6) << x;
        }
      }
    }
  });
}

TEST(LicTest, FieldsOfAnotherSizeBendNoDirection) {
  // A circle given at half the width and a third of the height stays one in the picture's pixels.
  const Image small = FieldOf(64, 42, [](double x, double y) {
    const double px = 2 * (x + 0.5) - 0.5, py = 3 * (y + 0.5) - 0.5;
    return std::pair(-(py - 63) / 2, (px - 63.5) / 3);
  });
  const Image texture = Coordinates(128, 126);
  LicParams p{.length = 20, .kernel = LicKernel::kUser, .linear = true};
  p.weights.assign(41, 0.0);
  p.weights.back() = 1;
  for (const bool bicubic : {false, true}) {
    p.bicubic = bicubic;
    const Image end = Lines(texture, small, p);
    for (const auto& [x, y] : {std::pair(95, 63), std::pair(60, 100), std::pair(30, 50)}) {
      const double before = std::hypot(x - 63.5, y - 63.0);
      EXPECT_NEAR(std::hypot(end.at<float>(x, y, 0) - 63.5, end.at<float>(x, y, 1) - 63), before, 2e-3)
          << bicubic;
    }
  }
  const Image large = Render(Lic(FromImage(small), {.width = 100, .height = 50}));
  EXPECT_EQ(large.spec().width(), 100);
  EXPECT_EQ(large.spec().height(), 50);
}

double Rms(const Image& a, const Image& b) {
  double sum = 0;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) sum += std::pow(a.at<float>(x, y) - b.at<float>(x, y), 2);
  }
  return std::sqrt(sum / static_cast<double>(w.pixels()));
}

TEST(LicTest, SharedLinesAreNearDirectOnes) {
  const int n = 320;
  const Image field = FieldOf(n, n, Swirls);
  // White noise, then noise smooth over 3 pixels. With the texture's nearest pixels a line half a pixel
  // beside reads other numbers.
  struct Row {
    double length, linear, nearest, smooth_linear, smooth_nearest;
  };
  for (const Row& row : {Row{10, 16, 42, 8, 13}, Row{20, 12, 31, 6, 10}, Row{60, 7, 20, 4.5, 7}}) {
    for (const LicKernel kernel : {LicKernel::kBox, LicKernel::kHann}) {
      for (const bool linear : {true, false}) {
        LicParams direct{.length = row.length,
                         .kernel = kernel,
                         .method = LicMethod::kDirect,
                         .contrast = LicContrast::kNone,
                         .linear = linear};
        LicParams shared = direct;
        shared.method = LicMethod::kShared;
        // A Hann kernel is a box of two thirds of the length.
        const double widen = kernel == LicKernel::kHann ? 1.3 : 1.0;
        const Node noise = FromImage(field);
        EXPECT_LT(Rms(Render(Lic(noise, direct)), Render(Lic(noise, shared))),
                  widen * (linear ? row.linear : row.nearest) / 1024)
            << row.length << linear;
        direct.noise = shared.noise = LicNoise::kFiltered, direct.spot = shared.spot = 3;
        EXPECT_LT(Rms(Render(Lic(noise, direct)), Render(Lic(noise, shared))),
                  widen * (linear ? row.smooth_linear : row.smooth_nearest) / 1024)
            << row.length << linear;
      }
    }
  }
}

TEST(LicTest, SharedLinesForgetNaN) {
  const int n = 300;
  const Image texture(ImageSpec(n, n, 1));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) texture.at<float>(x, y) = static_cast<float>((x * 7 + y * 13) % 32) / 32;
  }
  texture.at<float>(150, 150) = std::numeric_limits<float>::quiet_NaN();
  const Image field = FieldOf(n, n, Swirls);
  for (const bool linear : {false, true}) {
    const Image got = Lines(texture, field, {.length = 10, .method = LicMethod::kShared, .linear = linear});
    int lost = 0, far = 0;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        if (!std::isnan(got.at<float>(x, y))) continue;
        ++lost, far += std::hypot(x - 150, y - 150) > 13;
      }
    }
    EXPECT_GT(lost, 10);
    EXPECT_LT(lost, 120);
    EXPECT_EQ(far, 0);
  }
}

TEST(LicTest, ThreadsAndRunsGiveTheSameBytes) {
  const Image field = FieldOf(300, 270, Swirls);
  std::vector<LicParams> ways(3, {.length = 30, .magnitude = LicMagnitude::kColor});
  ways[0].method = LicMethod::kDirect, ways[1].method = LicMethod::kShared;
  ways[2] = {.length = 30, .integrator = LicIntegrator::kCell};
  for (const LicParams& p : ways) {
    const Node node = Lic(FromImage(field), p);
    const Image one = Render(node, PixelType::kFloat, {.threads = 1});
    for (const int threads : {2, 7})
      ExpectSameBits(one, Render(node, PixelType::kFloat, {.threads = threads}));
  }
}

TEST(LicTest, FramesLoopAndMoveDownstream) {
  const Image field = Constant(128, 32, 1, 0);
  const LicParams p{.length = 24, .contrast = LicContrast::kNone};
  const auto frame = [&](int k) { return Render(Lic(FromImage(field), LicFrame(p, k, 8))); };
  const Image first = frame(1), second = frame(2);
  LicParams whole = LicFrame(p, 1, 8);
  whole.phase += 1;
  const Image around = Render(Lic(FromImage(field), whole));
  double up = 0, down = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 30; x < 98; ++x) {
      ASSERT_NEAR(first.at<float>(x, y), around.at<float>(x, y), 1e-6);
      // An eighth of a wave of 25 pixels is about 3 of them.
      down += std::fabs(second.at<float>(x + 3, y) - first.at<float>(x, y));
      up += std::fabs(second.at<float>(x - 3, y) - first.at<float>(x, y));
    }
  }
  EXPECT_LT(down, 0.8 * up);
}

TEST(LicTest, MagnitudeShowsAsLengthAndColour) {
  const Image field = FieldOf(64, 16, [](double, double y) { return std::pair(y < 8 ? 1.0 : 0.25, 0.0); });
  const Image texture = Texture(64, 16);
  const Image got = Lines(texture, field, {.length = 8, .magnitude = LicMagnitude::kLength});
  double mean = 0;
  for (int i = -2; i <= 2; ++i) mean += texture.at<float>(30 + i, 14) / 5.0;
  EXPECT_NEAR(got.at<float>(30, 14), mean, 1e-6);
  const Image color = Render(Lic(
      FromImage(field), {.length = 8, .contrast = LicContrast::kNone, .magnitude = LicMagnitude::kColor}));
  EXPECT_EQ(color.spec().channel_count(), 3);
  EXPECT_GT(color.at<float>(30, 2, 0), color.at<float>(30, 2, 2));
  EXPECT_LT(color.at<float>(30, 14, 0), color.at<float>(30, 14, 2));
}

TEST(LicTest, LongLinesInSmallPicturesAndCriticalPointsStayInBounds) {
  const Image saddle = FieldOf(20, 20, [](double x, double y) { return std::pair(x - 9.5, 9.5 - y); });
  for (const Wrap wrap : {Wrap::kRenormalize, Wrap::kClamp, Wrap::kRepeat}) {
    for (const LicMethod method : {LicMethod::kDirect, LicMethod::kShared}) {
      const Image got =
          Render(Lic(FromImage(saddle),
                     {.length = 3000, .method = method, .wrap = wrap, .contrast = LicContrast::kNone}));
      for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 20; ++x)
          ASSERT_TRUE(got.at<float>(x, y) >= 0 && got.at<float>(x, y) <= 1) << x << "," << y;
      }
    }
  }
}

// Vectors as measurements have them: a bend at every pixel's edge, gaps.
TEST(LicTest, MeasuredFieldsStayInBounds) {
  std::mt19937 random(5);
  std::normal_distribution<double> wobble(0, 0.08);
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  const Image field = FieldOf(128, 96, [&](double x, double y) {
    if (std::hypot(x - 90, y - 30) < 12) return std::pair(nan, nan);
    const double angle = 0.02 * x + wobble(random);
    return std::pair(6 * std::cos(angle), 6 * std::sin(angle));
  });
  for (const double length : {2.0, 6.0, 20.0}) {
    const VerifyReport report =
        Verify(Lic(FromImage(field), {.length = length}), PixelType::kFloat, {.samples = 2});
    EXPECT_TRUE(report.within_bound) << length << ": " << report.Summary();
    EXPECT_GT(report.samples, 0);
  }
}

TEST(LicTest, RefusalsSayWhatWasFound) {
  const Node field = FromImage(Constant(8, 8, 1, 0)), one = FromImage(Texture(8, 8));
  EXPECT_EQ(Refusal([&] { Lic(one); }),
            "lic: the field has 1 channel, expected two: the vector's components");
  EXPECT_THAT(Refusal([&] { Lic(field, {.length = -1}); }), HasSubstr("expected 0. to 100000"));
  EXPECT_THAT(Refusal([&] { Lic(field, {.step = 0}); }), HasSubstr("found a step of 0"));
  EXPECT_THAT(Refusal([&] {
                Lic(field, {.kernel = LicKernel::kUser, .weights = {1, 2}});
              }),
              HasSubstr("an odd number"));
  EXPECT_THAT(Refusal([&] {
                Lic(field, {.kernel = LicKernel::kUser, .weights = {0, 0, 0}});
              }),
              HasSubstr("sum to 0"));
  EXPECT_THAT(
      Refusal([&] { Lic(field, {.integrator = LicIntegrator::kCell, .method = LicMethod::kShared}); }),
      HasSubstr("shared lines"));
  EXPECT_THAT(Refusal([&] { LicFrame({}, 9, 8); }), HasSubstr("found frame 9 of 8"));
}

TEST(EqualizeTest, SharesAreEven) {
  const Image image = Render(Equalize(FromImage(Texture(200, 200))));
  std::vector<int> count(10);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) ++count[static_cast<size_t>(std::min(9.0f, image.at<float>(x, y) * 10))];
  }
  for (const int n : count) EXPECT_NEAR(n, 4000, 20);
  EXPECT_EQ(Render(Equalize(FromImage(Constant(4, 4, 7, 7)))).at<float>(1, 1), 0.5f);
}

TEST(EqualizeTest, MaskedPixelsDoNotCount) {
  const Image field = FieldOf(
      80, 60, [](double x, double) { return x < 40 ? std::pair(std::nan(""), 0.0) : std::pair(1.0, 0.5); });
  const Image image = Render(Lic(FromImage(field), {.length = 5, .contrast = LicContrast::kEqualize}));
  ASSERT_EQ(image.spec().channel_count(), 1);
  double sum = 0;
  for (int y = 0; y < 60; ++y) {
    EXPECT_EQ(image.at<float>(10, y), 0);
    for (int x = 40; x < 80; ++x) sum += image.at<float>(x, y);
  }
  EXPECT_NEAR(sum / (40 * 60), 0.5, 1e-3);
}

TEST(LicTest, ModifiersThatOthersSilenceAreRefused) {
  const ops::OpInfo& info = *ops::FindOp("lic");
  const Node field = FromImage(Constant(16, 12, 1, 0)), image = FromImage(Texture(16, 12));
  using Modifiers = std::vector<std::pair<std::string, std::string>>;
  const auto message = [&](const Modifiers& modifiers, bool with_image) -> std::string {
    const std::vector<Node> in = with_image ? std::vector<Node>{image, field} : std::vector<Node>{field};
    try {
      info.make(in, ops::ParseArguments(info, {}, modifiers), nullptr);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  for (const auto& [name, value] :
       {std::pair("size", "32,32"), std::pair("noise", "sparse"), std::pair("spot", "2"),
        std::pair("seed", "3"), std::pair("alpha", "1"), std::pair("magnitude", "noise")}) {
    EXPECT_THAT(message({{"input", "1"}, {name, value}}, true),
                AllOf(HasSubstr(std::string(name) + "="), HasSubstr("input=1")));
    EXPECT_EQ(message({{name, value}}, false), "accepted") << name;
  }
  EXPECT_THAT(message({{"phase", "0.5"}}, false), AllOf(HasSubstr("phase="), HasSubstr("kernel=ripple")));
  EXPECT_THAT(message({{"weights", "1,2,1"}, {"kernel", "tent"}}, false),
              AllOf(HasSubstr("kernel="), HasSubstr("weights=")));
  EXPECT_EQ(message({{"gain", "1"}}, false), "accepted");
  EXPECT_THAT(message({{"gain", "1"}, {"input", "1"}}, true), HasSubstr("contrast=rescale"));
  EXPECT_THAT(message({{"gain", "1"}, {"contrast", "none"}}, false),
              AllOf(HasSubstr("gain="), HasSubstr("contrast=rescale")));
  EXPECT_THAT(message({{"integrator", "cell"}, {"step", "2"}}, false),
              AllOf(HasSubstr("step="), HasSubstr("integrator=cell")));
  EXPECT_THAT(message({{"frame", "2"}}, false), AllOf(HasSubstr("frame="), HasSubstr("animate=")));
  EXPECT_EQ(message({{"animate", "4"}, {"frame", "2"}, {"waves", "3"}}, false), "accepted");
  EXPECT_EQ(message({{"input", "1"}, {"length", "10"}, {"contrast", "equalize"}}, true), "accepted");
}

}  // namespace
}  // namespace tessera
