// Pictures of volumes as parts of a pipeline: what a renderer adds, cameras, light, textures, the soft
// region, turbulence by all of its lookups, volumes that are made once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Modifiers = std::vector<std::pair<std::string, std::string>>;

Node Command(const std::string& name, const Modifiers& modifiers, const std::vector<Node>& in = {}) {
  const ops::OpInfo& info = *ops::FindOp(name);
  return info.make(in, ops::ParseArguments(info, {}, modifiers), nullptr);
}
std::string Refusal(const Modifiers& modifiers, const std::vector<Node>& in = {}) {
  try {
    Command("volume", modifiers, in);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}
Vector3 At(const Image& image, int x, int y, int first) {
  return {image.at<float>(x, y, first), image.at<float>(x, y, first + 1), image.at<float>(x, y, first + 2)};
}
Vector3 Minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }
double Rms(const Image& a, const Image& b) {
  double sum = 0, count = 0;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < 4; ++c, ++count) sum += std::pow(a.at<float>(x, y, c) - b.at<float>(x, y, c), 2);
    }
  }
  return std::sqrt(sum / count);
}

// A ball that was turned and moved, in perspective: everything is known.
PlacedVolume Ball(VolumeMode mode) {
  PlacedVolume v;
  v.volume =
      DistanceField(Solid::Sphere({0, 0, 0}, 0.6), VolumeSpec::Centred({64, 64, 64}, PixelType::kFloat));
  v.params.mode = mode;
  v.params.aovs = true;
  v.params.camera = Camera::Perspective({0.5, 0.7, 4}, {0.3, 0.1, -0.2}, {0, 1, 0}, 30, 1);
  const double c = std::cos(0.4), s = std::sin(0.4);
  v.to_world = {c, 0, s, 0.3, 0, 1, 0, 0.1, -s, 0, c, -0.2, 0, 0, 0, 1};
  return v;
}

TEST(VolumeAov, ABallHasTheNormalsPositionsAndDistancesOfABall) {
  const Vector3 centre = {0.3, 0.1, -0.2}, eye = {0.5, 0.7, 4};
  for (const VolumeMode mode :
       {VolumeMode::kIso, VolumeMode::kSolid, VolumeMode::kHyper, VolumeMode::kUnder}) {
    PlacedVolume ball = Ball(mode);
    ball.params.soft = 0.02;
    if (mode == VolumeMode::kUnder) {  // dense inside: the transfer function has it
      ball.params.transfer = {{{-0.01, {1, 1, 1}, 1}, {0.01, {1, 1, 1}, 0}}, 0.01};
      ball.params.step = 0.005;
    }
    const PlacedVolume one[] = {ball};
    const Node node = RenderVolumes(ImageSpec(48, 48, 4), one);
    EXPECT_THAT(node.spec().channels,
                ElementsAre("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "distance"));
    const Image image = Render(node);
    int seen = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 48; ++x) {
        const Vector3 n = At(image, x, y, 5), p = At(image, x, y, 8);
        if (image.at<float>(x, y, 3) < 0.5f) {
          EXPECT_EQ(image.at<float>(x, y, 4), std::numeric_limits<float>::infinity());
          EXPECT_EQ(image.at<float>(x, y, 11), std::numeric_limits<float>::infinity());
          EXPECT_EQ(Length(n) + Length(p), 0);
          continue;
        }
        ++seen;
        const double near = mode <= VolumeMode::kSolid ? 2e-3 : 0.06;  // a soft edge, grazed
        ASSERT_NEAR(Length(Minus(p, centre)), 0.6, near) << static_cast<int>(mode);
        ASSERT_NEAR(Length(n), 1, 1e-5);
        // The field is dense inside where it is a density: normals point outward all the same.
        const double sign = mode == VolumeMode::kUnder ? -1 : 1;
        ASSERT_NEAR(sign * Dot(n, Minus(p, centre)) / Length(Minus(p, centre)), 1, 2e-3);
        ASSERT_NEAR(image.at<float>(x, y, 11), Length(Minus(p, eye)), 1e-5);
        const auto camera = Camera::FromMetadata(node.spec());
        ASSERT_TRUE(camera.has_value());
        ASSERT_NEAR(image.at<float>(x, y, 4), camera->PlanarDepth(p), 1e-5);
      }
    }
    EXPECT_GT(seen, 300);
    EXPECT_TRUE(Verify(node, PixelType::kFloat, {.samples = 3}).within_bound) << static_cast<int>(mode);
  }
}

TEST(VolumeAov, PicturesGoThroughWhatTakesARenderersPictures) {
  const Modifiers body = {{"solid", "body"}, {"dims", "32"}, {"size", "40x32"}, {"aovs", "1"}};
  const Node picture = Command("volume", body);
  const Image drawn = Render(picture);
  // Positions from depths and the camera in the metadata are those of the picture itself.
  const Image found = Render(Command("position", {}, {picture}));
  int seen = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 40; ++x) {
      if (drawn.at<float>(x, y, 3) < 1) continue;
      ++seen;
      ASSERT_LT(Length(Minus(At(found, x, y, 0), At(drawn, x, y, 8))), 1e-5);
    }
  }
  EXPECT_GT(seen, 100);
  // Jittered pictures are of the one camera.
  Modifiers jittered = body;
  jittered.push_back({"samples", "4"});
  const auto one = Camera::FromMetadata(picture.spec()),
             mean = Camera::FromMetadata(Command("volume", jittered).spec());
  ASSERT_TRUE(one && mean);
  EXPECT_EQ(one->world_to_clip(), mean->world_to_clip());
  // The nearest of several volumes has the pixel.
  const Node two = Command(
      "volume", {{"solid", "sphere(0,0,0,.3)"}, {"dims", "32"}, {"at", "0,0,.6"}, {"with", "1"}}, {picture});
  ASSERT_EQ(two.spec().channel_count(), 12);
  const Image both = Render(two);
  bool ball = false;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 40; ++x) {
      const Vector3 p = At(both, x, y, 8);
      if (both.at<float>(x, y, 3) == 1)
        ball |= std::fabs(Length(Minus(p, {0, 0, 0.6})) - 0.3) < 0.01 && Dot(At(both, x, y, 5), p) != 0;
    }
  }
  EXPECT_TRUE(ball);
  EXPECT_TRUE(Verify(two, PixelType::kFloat, {.samples = 2}).within_bound);
}

TEST(VolumeAov, LightsMayBePointsAndColoursUnlit) {
  PlacedVolume ball = Ball(VolumeMode::kIso);
  ball.params.aovs = false;
  const auto draw = [&] {
    const PlacedVolume one[] = {ball};
    return Render(RenderVolumes(ImageSpec(32, 32, 4), one));
  };
  const Image distant = draw();
  const Vector3 light = ball.params.material.light;
  ball.params.material.point = true;
  for (size_t a = 0; a < 3; ++a) ball.params.material.light[a] = 1e4 * light[a];
  EXPECT_LT(Rms(draw(), distant), 1e-3);
  for (size_t a = 0; a < 3; ++a) ball.params.material.light[a] = light[a];
  EXPECT_GT(Rms(draw(), distant), 0.01);
  ball.params.material.flat = true;
  const Image flat = draw();
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double color = ball.params.material.color[static_cast<size_t>(c)];
        ASSERT_NEAR(flat.at<float>(x, y, c), flat.at<float>(x, y, 3) * color, 1e-6);
      }
    }
  }
  EXPECT_THAT(Refusal({{"solid", "body"}, {"flat", "1"}, {"lightat", "1,1,1"}}), HasSubstr("flat=1"));
  EXPECT_THAT(Refusal({{"solid", "body"}, {"light", "0,0,1"}, {"lightat", "1,1,1"}}), HasSubstr("lightat="));
}

TEST(VolumeAov, SolidTexturesTakeBlocksAndRamps) {
  PlacedVolume ball = Ball(VolumeMode::kSolid);
  ball.params.aovs = false, ball.params.material.flat = true;
  // A block that rises along its x, from 0.5 to 7.5, and a ramp of pure colours beyond 2 and 6.
  std::vector<float> samples;
  for (int i = 0; i < 512; ++i) samples.push_back(static_cast<float>(i % 8) + 0.5f);
  ball.params.block = NoiseBlock(samples, 8, 1);
  ball.params.frequency = 0.5;
  ball.params.colors = {{2, {1, 0, 0}, 0}, {6, {0, 0, 1}, 0}};
  const PlacedVolume one[] = {ball};
  const Node node = RenderVolumes(ImageSpec(32, 32, 4), one);
  EXPECT_TRUE(Verify(node, PixelType::kFloat, {.samples = 4}).within_bound);
  const Image image = Render(node);
  int red = 0, blue = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      if (image.at<float>(x, y, 3) < 1) continue;
      ASSERT_NEAR(image.at<float>(x, y, 0) + image.at<float>(x, y, 2), 1, 1e-5);
      red += image.at<float>(x, y, 0) > 0.999f, blue += image.at<float>(x, y, 2) > 0.999f;
    }
  }
  EXPECT_GT(red, 20);
  EXPECT_GT(blue, 20);
  const auto texture = [](const Modifiers& words) {
    Modifiers all = {{"solid", "knot"}, {"dims", "32"}, {"size", "32x24"}, {"mode", "solid"}};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  const Image marble = Render(Command("volume", texture({})));
  EXPECT_GT(Rms(marble, Render(Command("volume", texture({{"texture", "wood"}})))), 0.02);
  EXPECT_GT(Rms(marble, Render(Command("volume", texture({{"texture", "clouds"}})))), 0.02);
  EXPECT_GT(Rms(marble, Render(Command("volume", texture({{"ramp", "0,1,0,0,1,0,1,0"}})))), 0.05);
  EXPECT_THAT(Refusal(texture({{"ramp", "0,1,0"}})), HasSubstr("value,r,g,b"));
  EXPECT_THAT(Refusal({{"solid", "knot"}, {"texture", "wood"}}),
              AllOf(HasSubstr("texture="), HasSubstr("mode=iso")));
}

TEST(VolumeAov, DeformationsActInTheSoftRegionAlone) {
  VolumeParams p;
  p.mode = VolumeMode::kHyper;
  p.soft = 0.2, p.shade = true, p.termination = 0;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  const Volume v =
      DistanceField(Solid::Sphere({0, 0, 0}, 0.4), VolumeSpec::Centred({32, 32, 32}, PixelType::kFloat));
  const Image plain = Render(RenderVolume(ImageSpec(40, 40, 4), v, p));
  for (const char* words : {"noise(.3,1)", "noise(.9,4),gain(.8)", "noise(1,2),noise(1,3)",
                            "threshold(-.3,.2)", "noise(.6,2),threshold(-.3,.2)"}) {
    SCOPED_TRACE(words);
    p.dmf = ParseDmf(words);
    const Node node = RenderVolume(ImageSpec(40, 40, 4), v, p);
    const Image image = Render(node);
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        const double away = std::hypot((x + 0.5) / 20 - 1, (y + 0.5) / 20 - 1);
        if (away > 0.66) ASSERT_EQ(image.at<float>(x, y, 3), 0) << x << "," << y;
        if (away < 0.3) ASSERT_GT(image.at<float>(x, y, 3), 0.99f) << x << "," << y;
      }
    }
    EXPECT_GT(Rms(image, plain), 0.005);
    EXPECT_TRUE(Verify(node, PixelType::kFloat, {.samples = 3}).within_bound);
  }
}

TEST(VolumeAov, DensitiesAreNoDistances) {
  const Image image(ImageSpec(8, 64, 1));
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 8; ++x) image.at<float>(x, y) = x > 2 && x < 6 ? 1.0f : 0.0f;
  }
  const std::vector<Node> in = {FromImage(image)};
  for (const char* mode : {"fur", "fire", "melt", "hyper"}) {
    const Modifiers words = {{"mode", mode}, {"slices", "8"}};
    EXPECT_THAT(Refusal(words, in), AllOf(HasSubstr(std::string("mode=") + mode), HasSubstr("distance=LEVEL"),
                                          HasSubstr("below=1")));
    Modifiers more = words;
    more.push_back({"distance", "0.5"});
    EXPECT_EQ(Refusal(more, in), "accepted");
    more.back() = {"below", "1"};
    EXPECT_EQ(Refusal(more, in), "accepted");
  }
}

TEST(VolumeAov, StrongHighlightsAreWithinBound) {
  for (const char* mode : {"fur", "iso"}) {
    const Node node = Command("volume", {{"solid", "sphere(0,0,0,.5)"},
                                         {"dims", "24"},
                                         {"size", "24x20"},
                                         {"mode", mode},
                                         {"specular", "727"},
                                         {"exponent", "500"}});
    const VerifyReport report = Verify(node, PixelType::kFloat, {.samples = 60});
    EXPECT_TRUE(report.within_bound) << mode << ": " << report.Summary();
  }
}

TEST(VolumeAov, TurbulenceIsTheSameByAllItsLookups) {
  const auto fire = [](const char* lookup) {
    return Command("volume", {{"solid", "sphere(0,0,0,.5)"},
                              {"dims", "48"},
                              {"size", "60x60"},
                              {"mode", "fire"},
                              {"soft", ".2"},
                              {"lookup", lookup}});
  };
  const Image exact = Render(fire("exact"));
  const Image nothing(exact.spec());
  EXPECT_GT(Rms(exact, nothing), 0.25);
  for (const auto& [lookup, most] :
       {std::pair("block", 0.03), std::pair("channels", 0.03), std::pair("4", 0.01), std::pair("8", 0.04)}) {
    const double rms = Rms(Render(fire(lookup)), exact);
    EXPECT_LT(rms, most) << lookup;
    EXPECT_GT(rms, 0) << lookup;
    EXPECT_TRUE(Verify(fire(lookup), PixelType::kFloat, {.samples = 2}).within_bound) << lookup;
  }
}

TEST(VolumeAov, VolumesThatDoNotChangeAreMadeOnce) {
  const auto at = [](const char* azimuth, const char* dims) {
    return Command("volume",
                   {{"solid", "torus(0,0,0,.5,.2)"}, {"dims", dims}, {"size", "8x8"}, {"azimuth", azimuth}});
  };
  at("10", "29");
  const size_t entries = Context::Default().Use().entries;
  const Node again = at("20", "29");
  EXPECT_EQ(Context::Default().Use().entries, entries);
  at("10", "31");
  EXPECT_GT(Context::Default().Use().entries, entries);
  // The distance field of a picture's slices, as long as the picture is the same.
  const Image slices(ImageSpec(8, 64, 1));
  const auto field = [&](const char* azimuth) {
    return Command("volume", {{"slices", "8"}, {"distance", "0.5"}, {"size", "8x8"}, {"azimuth", azimuth}},
                   {FromImage(slices)});
  };
  slices.at<float>(4, 30) = 1;
  field("10");
  const size_t fields = Context::Default().Use().entries;
  field("20");
  EXPECT_EQ(Context::Default().Use().entries, fields);
  slices.at<float>(3, 30) = 1;
  field("20");
  EXPECT_EQ(Context::Default().Use().entries, fields + 1);
  // What is kept is what would be made.
  const Image kept = Render(again);
  Context::Default().Release();
  EXPECT_EQ(Rms(kept, Render(at("20", "29"))), 0);
}

}  // namespace
}  // namespace tessera
