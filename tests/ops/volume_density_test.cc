// Density modulation functions on density volumes, and where they act: closed forms of constant and linear
// densities, leaps, bounds, words, errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/oracle.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using ::testing::HasSubstr;
using testing::ReferenceOf;

constexpr int kPixels = 5;  // from -0.8 to 0.8

// Looks down -z at [-1, 1], parallel.
VolumeParams Ahead(VolumeMode mode, const std::string& dmf) {
  VolumeParams p;
  p.mode = mode;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  p.transfer = {{{0, {1, 1, 1}, 0}, {1, {1, 0.5, 0.25}, 0.5}}, 0.5};
  p.termination = 0;
  if (!dmf.empty()) p.dmf = ParseDmf(dmf);
  return p;
}
Volume Of(const std::function<double(const Vector3&)>& density, PixelType type = PixelType::kFloat) {
  return Volume(VolumeSpec::Centred({16, 16, 16}, type), density);
}
Node Picture(const Volume& volume, const VolumeParams& p) {
  return RenderVolume(ImageSpec(kPixels, kPixels, 4), volume, p);
}
double Across(int pixel) { return (pixel + 0.5) * 2 / kPixels - 1; }

// Of mode mip: what the chain leaves of the density at x, y (up), as picture and reference have it.
void ExpectDensity(const Volume& volume, const VolumeParams& p,
                   const std::function<double(double, double)>& expected, double within = 2e-6) {
  const Node node = Picture(volume, p);
  const Image image = Render(node);
  const reference::ImageD reference = ReferenceOf(node);
  for (int y = 0; y < kPixels; ++y) {
    for (int x = 0; x < kPixels; ++x) {
      const double value = expected(Across(x), -Across(y));
      EXPECT_NEAR(image.at<float>(x, y, 0), value, within) << x << " " << y;
      EXPECT_NEAR(reference.at(x, y, 0), value, within) << x << " " << y;
    }
  }
}
double Smooth(double t) {
  const double u = std::clamp(t, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

TEST(VolumeDensity, FunctionsOfDensityHaveTheirClosedForms) {
  const std::function<double(double)> gain = [](double t) {
    const double e = std::log(1 - 0.7) / std::log(0.5);
    return t < 0.5 ? 0.5 * std::pow(2 * t, e) : 1 - 0.5 * std::pow(2 - 2 * t, e);
  };
  struct Case {
    const char* words;
    std::function<double(double)> expected;
  };
  const Case cases[] = {
      {"bias(.3)", [](double t) { return std::pow(t, std::log(0.3) / std::log(0.5)); }},
      {"gain(.7)", gain},
      {"threshold(.2,.4)", [](double t) { return Smooth((t - 0.2) / 0.4); }},
      {"table(0,1,.5,.5,.5,.25,1,.75)",  // falls, a step, rises
       [](double t) { return t <= 0    ? 0
                             : t < 0.5 ? 1 - t
                                       : 0.25 + (t - 0.5); }},
      {"bias(.3),gain(.7)", [&](double t) { return gain(std::pow(t, std::log(0.3) / std::log(0.5))); }},
      {"table(.25,.5)", [](double t) { return t > 0 ? 0.5 : 0; }}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.words);
    for (const double t : {-0.5, 0.0, 0.125, 0.4375, 0.8125, 1.0, 1.5}) {
      const double inside = std::clamp(t, 0.0, 1.0);
      const Volume fog = Of([=](const Vector3&) { return t; });
      ExpectDensity(fog, Ahead(VolumeMode::kMip, c.words),
                    [&](double, double) { return c.expected(inside); });
      // Of a domain from -1 to 3, and through compositing: 1 - (1 - a)^(2 / length).
      VolumeParams p = Ahead(VolumeMode::kUnder, c.words);
      p.transfer = {{{-1, {1, 1, 1}, 0}, {3, {1, 1, 1}, 0.5}}, 0.5};
      const Node node = Picture(Of([=](const Vector3&) { return 4 * t - 1; }), p);
      const double alpha = 1 - std::pow(1 - 0.5 * c.expected(inside), 4);
      EXPECT_NEAR(Render(node).at<float>(2, 2, 3), alpha, 1e-5);
      EXPECT_NEAR(ReferenceOf(node).at(2, 2, 3), alpha, 1e-5);
    }
  }
  VolumeParams p = Ahead(VolumeMode::kMip, "");
  Dmf own;
  own.kind = Dmf::Kind::kFunction;
  own.function = [](const DmfSamples& s) {
    for (int i = 0; i < s.count; ++i)
      s.density[i] = 0.5f * s.density[i] + 0.25f * (s.y[i] + 1) * s.distance[i];
  };
  p.dmf = {own};
  ExpectDensity(Of([](const Vector3&) { return 0.5; }), p,
                [](double, double y) { return 0.25 + 0.125 * (y + 1); });
}

TEST(VolumeDensity, DisplacementsAndNoiseOfABlockOfOneValue) {
  // 0.5 + 0.25 x between the centres of the outermost voxels.
  const Volume slope = Of([](const Vector3& p) { return 0.5 + 0.25 * p[0] + 0.125 * p[1]; });
  const auto block = [](int channels, float value) {
    return NoiseBlock(std::vector<float>(static_cast<size_t>(64 * channels), value), 4, channels);
  };
  VolumeParams p = Ahead(VolumeMode::kMip, "warp(.2)");
  p.dmf[0].block = block(4, 0.5f);
  ExpectDensity(slope, p, [](double x, double y) { return 0.5 + 0.25 * (x + 0.1) + 0.125 * (y + 0.1); });
  p = Ahead(VolumeMode::kMip, "lift(.3)");
  p.dmf[0].block = block(1, 0.25f);
  ExpectDensity(slope, p, [](double x, double y) { return 0.5 + 0.25 * x + 0.125 * (y - 0.075); });
  p = Ahead(VolumeMode::kMip, "lift(.3)*half(1,0,0,0,0)");  // where x >= 0
  p.dmf[0].block = block(1, 0.25f);
  const auto moved = [](double x, double y) {
    return 0.5 + 0.25 * x + 0.125 * (y - (x >= -1e-9 ? 0.075 : 0));
  };
  p.dmf[0].inputs[0].points = {{-0.01, 0}, {-0.01, 1}};  // not on a pixel's centre
  ExpectDensity(slope, p, moved);
  p = Ahead(VolumeMode::kMip, "turbulence(.5)");
  p.dmf[0].block = block(1, 0.25f);
  ExpectDensity(slope, p, [](double x, double y) { return (0.5 + 0.25 * x + 0.125 * y) * 0.625; });
  p = Ahead(VolumeMode::kMip, "noise(.4)");
  p.dmf[0].block = block(1, 0.25f);
  ExpectDensity(slope, p, [](double x, double y) { return 0.5 + 0.25 * x + 0.125 * y + 0.1; });
  p = Ahead(VolumeMode::kMip, "swell(.4)");  // no turbulence but its mean
  p.dmf[0].block = block(1, 0.25f);
  ExpectDensity(slope, p, [](double x, double y) { return 0.5 + 0.25 * x + 0.125 * y; });
}

TEST(VolumeDensity, StepsActWhereTheirInputsSay) {
  const Volume fog = Of([](const Vector3&) { return 0.5; });
  const double full = 0.25;  // of the table that is used
  const auto mixed = [=](double w) { return 0.5 + w * (full - 0.5); };
  const auto ramp = [](double a, double b, double v) { return std::clamp((v - a) / (b - a), 0.0, 1.0); };
  struct Case {
    const char* input;
    std::function<double(double, double)> weight;
  };
  const Case places[] = {
      {"height(-.5,.7)", [&](double, double y) { return ramp(-0.5, 0.7, y); }},
      {"height(.7,-.5)", [&](double, double y) { return ramp(0.7, -0.5, y); }},
      {"~height(-.5,.7)", [&](double, double y) { return 1 - ramp(-0.5, 0.7, y); }},
      {"height(-.9,.2,-.1,.2,-.1,.6,.9,1)",
       [&](double, double y) { return y < -0.1 ? 0.2 : 0.6 + 0.4 * ramp(-0.1, 0.9, y); }},
      {"half(1,.5,0,.1,.6)", [&](double x, double y) { return ramp(-0.5, 0.1, x + 0.5 * y); }},
      {"band(-.1,.3,.5)", [&](double, double y) { return std::min(ramp(-0.6, -0.1, y), ramp(0.8, 0.3, y)); }},
      {"density(0,.8)", [&](double, double) { return 0.625; }},
      {"height(-.5,.7)*half(1,0,0,0,1)",
       [&](double x, double y) { return ramp(-0.5, 0.7, y) * ramp(-1, 0, x); }}};
  for (const Case& c : places) {
    SCOPED_TRACE(c.input);
    ExpectDensity(fog, Ahead(VolumeMode::kMip, std::string("table(0,.25) * ") + c.input),
                  [&](double x, double y) { return mixed(c.weight(x, y)); });
  }
  // The largest along the ray: the sphere's middle makes it less, its outside more.
  ExpectDensity(fog, Ahead(VolumeMode::kMip, "table(0,.75)*sphere(0,0,0,.3,.5)"),
                [&](double x, double y) { return 0.5 + 0.25 * ramp(0.8, 0.3, std::hypot(x, y, 0.0625)); });
  // Of a slope along x: gradient 0.25, outward -x; along z towards the eye and away.
  const auto along = [](double x, double z) {
    return Of([=](const Vector3& p) { return 0.5 + 0.25 * (x * p[0] + z * p[2]); });
  };
  VolumeParams p = Ahead(VolumeMode::kMip, "table(0,.25)*gradient(0,.5)");
  const auto inner = [](double x) { return std::clamp(x, -0.9375, 0.9375); };
  ExpectDensity(along(1, 0), p, [&](double x, double) { return 0.5 * (0.5 + 0.25 * inner(x)) + 0.5 * full; });
  p = Ahead(VolumeMode::kMip, "table(0,.25)*light(-1,1)");
  p.material.light = {-3, 4, 0};
  ExpectDensity(along(1, 0), p, [&](double x, double) { return 0.2 * (0.5 + 0.25 * x) + 0.8 * full; });
  p.material.light = {3, 4, 0};
  ExpectDensity(along(1, 0), p, [&](double x, double) { return 0.8 * (0.5 + 0.25 * x) + 0.2 * full; });
  p = Ahead(VolumeMode::kMip, "table(0,.25)*eye(0,1)");
  ExpectDensity(along(0, -1), p, [&](double, double) { return full; });  // faces the eye
  ExpectDensity(
      along(0, 1), p, [&](double, double) { return 0.5 + 0.25 * 0.9375; }, 1e-3);  // faces away
}

TEST(VolumeDensity, RegionsHaveFunctionsOfTheirOwn) {
  const Volume fog = Of([](const Vector3&) { return 0.5; });
  const VolumeParams p =
      Ahead(VolumeMode::kMip, "table(0,.75)*half(1,0,0,.1,0), table(0,.125)*~half(1,0,0,.1,0)");
  ExpectDensity(fog, p, [](double x, double) { return x > 0.1 ? 0.75 : 0.125; });
}

Volume Cloud(PixelType type) {
  return Of(
      [](const Vector3& p) {
        const double lumps = std::sin(5 * p[0] + 1) * std::sin(4 * p[1]) * std::sin(6 * p[2] + 2);
        return std::clamp(0.8 - std::sqrt(Dot(p, p)) + 0.3 * lumps, 0.0, 1.0);
      },
      type);
}
const char* const kChains[] = {"noise(.4,1)",
                               "turbulence(.8,1),bias(.4)",
                               "warp(.1,1)",
                               "warp(.2,.7)*height(-.5,.5),gain(.7)*~sphere(0,0,0,.4,.2),threshold(.1,.2)",
                               "lift(.2,1),turbulence(.9,1)*band(-.3,.3,.2)",
                               "swell(.2,.8),table(0,0,.5,.9,1,.3)",
                               "gain(.8)*light(-.5,.5)*eye(0,1),bias(.6)*gradient(.2,1)",
                               "threshold(.3,.1)*density(.2,.6)"};

TEST(VolumeDensity, ChainsAreWithinTheirBoundAndLeapWithoutChange) {
  for (const char* words : kChains) {
    for (const PixelType type : {PixelType::kFloat, PixelType::kUint8}) {
      for (const VolumeMode mode : {VolumeMode::kOver, VolumeMode::kUnder, VolumeMode::kAttenuate,
                                    VolumeMode::kXray, VolumeMode::kMip, VolumeMode::kHyper}) {
        SCOPED_TRACE(std::string(words) + " " + std::to_string(static_cast<int>(mode)) + " " +
                     std::to_string(static_cast<int>(type)));
        VolumeParams p = Ahead(mode, words);
        const Volume volume = mode == VolumeMode::kHyper ? DistanceField(Cloud(type), {0.3}) : Cloud(type);
        p.camera = OrbitCamera(volume, 30, 20, 30, 1);
        p.shade = mode == VolumeMode::kOver;
        p.scatter.shadow = mode == VolumeMode::kUnder || mode == VolumeMode::kHyper ? 0.8 : 0;
        const Node node = Picture(volume, p);
        const VerifyReport report = Verify(node);
        EXPECT_TRUE(report.within_bound) << report.Summary();
        p.leap = false;
        ExpectSameBits(Render(node), Render(Picture(volume, p)));
      }
    }
  }
}

TEST(VolumeDensity, SeveralMediaHaveTheirChains) {
  VolumeParams p = Ahead(VolumeMode::kUnder, "turbulence(.8,1)*height(-.5,.5)");
  p.camera = OrbitCamera(Cloud(PixelType::kFloat), 30, 20, 30, 1);
  PlacedVolume one{Cloud(PixelType::kFloat), p}, two = one;
  two.to_world[3] = 0.5;
  const PlacedVolume both[] = {one, two};
  const VerifyReport report = Verify(RenderVolumes(ImageSpec(8, 8, 4), both));
  EXPECT_TRUE(report.within_bound) << report.Summary();
}

std::string MessageOf(const std::function<void()>& make) {
  try {
    make();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(VolumeDensity, WordsOfInputsAreThoseOfTheGrammar) {
  const std::vector<Dmf> chain =
      ParseDmf("gain(.5) * height(-1, 1) * ~ sphere(.1,.2,.3,.4,.5), bias(.3)*band(0,1,.5),noise(.4,6)");
  ASSERT_EQ(chain.size(), 3u);
  ASSERT_EQ(chain[0].inputs.size(), 2u);
  EXPECT_EQ(chain[0].inputs[0].kind, DmfInput::Kind::kHeight);
  EXPECT_EQ(chain[0].inputs[1].kind, DmfInput::Kind::kSphere);
  EXPECT_EQ(chain[0].inputs[1].place, (Vector3{0.1, 0.2, 0.3}));
  EXPECT_EQ(chain[0].inputs[1].points, (std::vector<std::array<double, 2>>{{0.4, 0}, {0.9, 1}}));
  EXPECT_EQ(chain[1].inputs[0].points.size(), 4u);
  EXPECT_TRUE(chain[2].inputs.empty());
  const std::string file = ::testing::TempDir() + "weights.txt";
  std::ofstream(file) << "# height weight\n-1 0\n\n0 .25  # half way\n1 1\n";
  EXPECT_EQ(ParseDmf("gain(.5)*height(" + file + ")")[0].inputs[0].points,
            (std::vector<std::array<double, 2>>{{-1, 0}, {0, 0.25}, {1, 1}}));
  EXPECT_EQ(ParseDmf("table(" + file + ")")[0].table.size(), 3u);
  std::ofstream(file) << "1 2 3\n";
  EXPECT_THAT(MessageOf([&] { ParseDmf("table(" + file + ")"); }), HasSubstr("line 1"));
  std::remove(file.c_str());
  struct Case {
    const char *words, *found;
  };
  for (const Case& c : std::initializer_list<Case>{{"gain(.5)*", "\"\""},
                                                   {"gain(.5)*depth(1,2)", "\"depth\""},
                                                   {"gain(.5)*height", "0 numbers"},
                                                   {"gain(.5)*height(1,2,3)", "3 numbers"},
                                                   {"gain(.5)*height(1,x)", "\"x\""},
                                                   {"gain(.5)*sphere(1,2,3)", "3 numbers"},
                                                   {"gain(.5)*sphere(0,0,0,1,-1)", "a soft edge below 0"},
                                                   {"gain(.5)*band(1,0,.1)", "low end"},
                                                   {"table(1,2,3)", "3 numbers"},
                                                   {"table", "0 numbers"},
                                                   {"table(/nowhere/at/all.txt)", "/nowhere/at/all.txt"}}) {
    EXPECT_THAT(MessageOf([&] { ParseDmf(c.words); }), HasSubstr(c.found)) << c.words;
  }
}

TEST(VolumeDensity, WhatCannotBeIsRefused) {
  const Volume fog = Of([](const Vector3&) { return 0.5; });
  const auto message = [&](const char* words, const std::function<void(VolumeParams&)>& change) {
    return MessageOf([&] {
      VolumeParams p = Ahead(VolumeMode::kOver, words);
      change(p);
      Picture(fog, p);
    });
  };
  const auto nothing = [](VolumeParams&) {};
  EXPECT_EQ(message("bias(.4)", nothing), "");
  EXPECT_THAT(message("warp(.1)*light(0,1)", nothing), HasSubstr("a displacement by"));
  EXPECT_THAT(message("bias(.4)*height(1,0,0,1)", nothing), HasSubstr("found a point at 0"));
  EXPECT_THAT(message("bias(.4)*height(0,0,1,2)", nothing), HasSubstr("value of 2, expected 0 to 1"));
  EXPECT_THAT(message("bias(.4)*sphere(1e9,0,0,1,1)", nothing), HasSubstr("place of 1e+09"));
  EXPECT_THAT(message("bias(.4)", [](VolumeParams& p) { p.dmf[0].inputs.resize(1); }),
              HasSubstr("points, 0"));
  EXPECT_THAT(message("bias(.4)", [](VolumeParams& p) { p.mode = VolumeMode::kIso; }),
              HasSubstr("a surface"));
  EXPECT_THAT(message("bias(.4)", [](VolumeParams& p) { p.classification = Classification::kPre; }),
              HasSubstr("expected post"));
  EXPECT_THAT(message("bias(.4)", [](VolumeParams& p) { p.method = VolumeMethod::kShearWarp; }),
              HasSubstr("shearwarp"));
}

}  // namespace
}  // namespace tessera
