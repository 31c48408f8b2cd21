// Media that shadow themselves: closed forms of slabs and of a light within, opacity volumes against a march
// from every sample, phase, hard cases, errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <any>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "reference/volume_picture.h"
#include "support/oracle.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using testing::ReferenceOf;

constexpr double kKappa = 0.7;  // optical depth a unit

// Looks down -z at [-1, 1], parallel; 5 x 5 pixels, the middle one at 0.
Node Picture(const Volume& volume, const VolumeParams& given) {
  VolumeParams p = given;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  p.termination = 0;
  return RenderVolume(ImageSpec(5, 5, 4), volume, p);
}
Volume Constant(const std::array<int, 3>& size = {16, 16, 16}) {
  return Volume(VolumeSpec::Centred(size), [](const Vector3&) { return 0.5; });
}
// A white fog, lit by its diffuse light alone.
VolumeParams Fog(const Vector3& light, double kappa = kKappa) {
  VolumeParams p;
  p.mode = VolumeMode::kUnder;
  const double a = -std::expm1(-kappa);
  p.transfer = {{{0, {1, 1, 1}, a}, {1, {1, 1, 1}, a}}, 1};
  p.material.ambient = 0;
  p.material.diffuse = 1;
  p.material.light = light;
  p.scatter.shadow = 1;
  return p;
}
const ops::volume::VolumeDraw& DrawOf(const Node& node) {
  return **std::any_cast<ops::volume::VolumeDrawPointer>(&node.data()->op->Parameters());
}
// The largest difference to a picture whose samples march to the light themselves.
double AgainstMarches(const Node& node) {
  const reference::volume::Picture direct(DrawOf(node), true);
  const Image image = Render(node);
  const Roi& w = image.spec().data_window;
  double most = 0;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      const auto r = direct.Draw(x, y, reference::volume::kEndless, {0, 0, 0});
      for (int c = 0; c < 4; ++c) {
        most = std::max(most, std::fabs(r[static_cast<size_t>(c)] - image.at<float>(x, y, c)));
      }
    }
  }
  return most;
}
void ExpectMiddle(const Node& picture, double expected, double within) {
  EXPECT_NEAR(Render(picture).at<float>(2, 2, 0), expected, within) << "picture";
  EXPECT_NEAR(ReferenceOf(picture).at(2, 2, 0), expected, within) << "reference";
}

TEST(VolumeShadow, LightAcrossASlabHasItsClosedForm) {
  const double alpha = -std::expm1(-2 * kKappa), through = std::exp(-kKappa);
  for (const double step : {0.5, 0.1}) {
    for (const double strength : {1.0, 0.25}) {
      for (const Vector3& light :
           {Vector3{1, 0, 0}, Vector3{-3, 0, 0}, Vector3{0, 1, 0}, Vector3{0, -1, 0}}) {
        VolumeParams p = Fog(light);
        p.step = step;
        p.scatter.size = 5;
        p.scatter.shadow = strength;
        // Every sample of the ray lies as deep below the lit side as the node beside it.
        const double reaching = 1 - strength * (1 - through);
        ExpectMiddle(Picture(Constant(), p), alpha * reaching, 2e-6);
        p.material.ambient = 0.25;
        p.material.diffuse = 0.5;
        ExpectMiddle(Picture(Constant(), p), alpha * (0.25 + 0.5 * reaching), 2e-6);
      }
    }
  }
}

// Light from behind the eye goes the way of the ray twice: the integral of kappa exp(-2 kappa s).
TEST(VolumeShadow, LightFromTheEyeConvergesToItsIntegral) {
  double before = 1;
  for (const int size : {3, 9, 33}) {
    VolumeParams p = Fog({0, 0, 1});
    p.step = 0.01;
    p.scatter.size = size;
    const double expected = 0.5 * -std::expm1(-4 * kKappa);
    const double off = std::fabs(Render(Picture(Constant(), p)).at<float>(2, 2, 0) - expected);
    EXPECT_LT(off, 0.3 * before);
    before = off;
  }
  EXPECT_LT(before, 3e-4);
}

// A light in the middle of a fog, seen along a ray beside it: exp(-kappa |p|), in front and behind.
TEST(VolumeShadow, ALightWithinHasItsClosedForm) {
  VolumeParams p = Fog({0.25, 0, 0});
  p.material.point = true;
  p.step = 0.01;
  p.scatter.size = 65;
  double expected = 0;
  constexpr int kParts = 20000;
  for (int i = 0; i < kParts; ++i) {
    const double s = (i + 0.5) * 2 / kParts, z = 1 - s;
    expected += kKappa * std::exp(-kKappa * s) * std::exp(-kKappa * std::hypot(0.25, z)) * 2 / kParts;
  }
  ExpectMiddle(Picture(Constant(), p), expected, 1e-3);
}

Volume Cloud(int side) {
  return Volume(VolumeSpec::Centred({side, side, side}), [](const Vector3& p) {
    const double r = std::sqrt(Dot(p, p));
    const double lumps = std::sin(5 * p[0] + 1) * std::sin(4 * p[1]) * std::sin(6 * p[2] + 2);
    return std::max(0.0, 0.8 - r + 0.3 * lumps);
  });
}

// What the header says that nodes leave out, of a cloud that is dark on the far side.
TEST(VolumeShadow, NodesStandForMarchesFromEverySample) {
  VolumeParams p = Fog({1, 0.7, 0.3}, 0);
  p.transfer = {{{0, {1, 1, 1}, 0}, {0.6, {1, 0.9, 0.8}, 0.6}}, 0.1};
  const Volume cloud = Cloud(48);
  double dimmed = 0, before = 1;
  for (const int size : {7, 13, 25, 49}) {
    p.scatter.size = size;
    const double off = AgainstMarches(Picture(cloud, p));
    EXPECT_LT(off, 0.6 * before) << size;
    before = off;
    RecordProperty("off_" + std::to_string(size), std::to_string(off));
    if (size == 25) {
      EXPECT_LT(off, 0.02);  // the default's
    }
  }
  EXPECT_LT(before, 5e-3);
  p.scatter.size = 25;
  const Node lit = Picture(cloud, p);
  VolumeParams plain = p;
  plain.scatter = {};
  const Image with = Render(lit), without = Render(Picture(cloud, plain));
  for (int x = 0; x < 5; ++x)
    dimmed = std::max(dimmed, 1.0 - with.at<float>(x, 2, 0) / std::max(without.at<float>(x, 2, 0), 1e-3f));
  EXPECT_GT(dimmed, 0.7);
  const VerifyReport report = Verify(lit);
  EXPECT_TRUE(report.within_bound) << report.Summary();
}

TEST(VolumeShadow, PhaseHasAMeanOfOneAndItsEnds) {
  // Thin: nothing shadows anything, and the ratio to an even phase is P.
  const auto phase = [](double g, const Vector3& light) {
    VolumeParams p = Fog(light, 0.01);
    p.scatter = {};
    p.scatter.phase = g;
    p.step = 0.5;
    const double alpha = -std::expm1(-0.02);
    const Node picture = Picture(Constant({4, 4, 4}), p);
    const double found = Render(picture).at<float>(2, 2, 0) / alpha;
    EXPECT_NEAR(found, ReferenceOf(picture).at(2, 2, 0) / alpha, 1e-5 * std::max(found, 1.0));
    return found;
  };
  for (const double g : {-0.95, -0.6, 0.3, 0.8, 0.95}) {
    SCOPED_TRACE(g);
    const double size = std::fabs(g), most = (1 + size) / ((1 - size) * (1 - size));
    const double least = (1 - size) / ((1 + size) * (1 + size));
    // The eye looks along -z: light from (0, 0, -1) comes straight at it.
    EXPECT_NEAR(phase(g, {0, 0, -1}), g > 0 ? most : least, 1e-5 * most);
    EXPECT_NEAR(phase(g, {0, 0, 1}), g > 0 ? least : most, 1e-5 * most);
    double mean = 0;
    constexpr int kParts = 400;
    for (int i = 0; i < kParts; ++i) {  // over the cosine, substituted so that the peak is resolved
      const double u = (i + 0.5) / kParts, cosine = 1 - 2 * u * u * u, weight = 6 * u * u / kParts;
      const Vector3 light = {std::sqrt(1 - cosine * cosine), 0, g > 0 ? -cosine : cosine};
      mean += 0.5 * weight * phase(g, light);
    }
    EXPECT_NEAR(mean, 1, 5e-3);
  }
}

TEST(VolumeShadow, WhatIsCutAwayAndWhatStandsTurnedShadowsAsItShould) {
  // The lit half is cut away: the rest begins at x = 0.
  VolumeParams p = Fog({1, 0, 0});
  p.step = 0.125;
  p.scatter.size = 9;
  p.planes = {{{-1, 0, 0}, -0.5}};  // x <= 1/2 is kept
  const double alpha = -std::expm1(-2 * kKappa);
  ExpectMiddle(Picture(Constant(), p), alpha * std::exp(-0.5 * kKappa), 2e-6);
  p.planes = {{{-1, 0, 0}, -1e-3}};
  ExpectMiddle(Picture(Constant(), p), alpha * std::exp(-1e-3 * kKappa), 2e-6);
  // Turned by a quarter, the light stays the world's.
  p.planes.clear();
  PlacedVolume placed;
  placed.volume = Volume(VolumeSpec::Centred({16, 16, 8}), [](const Vector3&) { return 0.5; });
  placed.params = p;
  placed.params.scatter.size = 17;
  placed.params.termination = 0;
  placed.params.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  placed.to_world = {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1};
  // Its sides are 1 along the world's x, 2 along z.
  const PlacedVolume one[] = {placed};
  ExpectMiddle(RenderVolumes(ImageSpec(5, 5, 4), one), alpha * std::exp(-0.5 * kKappa), 2e-6);
}

// Lights add up, each with its own shadow and colour.
TEST(VolumeShadow, SeveralLightsAddUp) {
  const double alpha = -std::expm1(-2 * kKappa), through = std::exp(-kKappa);
  VolumeParams p = Fog({1, 0, 0});
  p.step = 0.125;
  p.scatter.size = 9;
  p.scatter.lights = {{{0, -2, 0}, false, {0.5, 0.25, 0}}, {{-1, 0, 0}, false, {0, 1, 2}}};
  const Image image = Render(Picture(Constant(), p));
  const double expected[3] = {1.5, 2.25, 3};
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at<float>(2, 2, c), alpha * through * expected[c], 1e-5);
  // Of a cloud: the sum of pictures by one light each, without ambient light.
  const Volume cloud = Cloud(24);
  for (const bool shade : {false, true}) {
    VolumeParams both = Fog({1, 0.5, 0}, 0);
    both.transfer = {{{0, {1, 1, 1}, 0}, {0.6, {1, 0.9, 0.8}, 0.6}}, 0.1};
    both.shade = shade;
    both.scatter.phase = 0.3;
    VolumeParams first = both, second = both;
    second.material.light = {0.2, -0.3, 0.7};
    second.material.point = true;
    both.scatter.lights = {{{0.2, -0.3, 0.7}, true, {0.5, 0.5, 0.5}}};
    const Image sum = Render(Picture(cloud, both)), a = Render(Picture(cloud, first)),
                b = Render(Picture(cloud, second));
    double most = 0;
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 5; ++x) {
        const float two = a.at<float>(x, y, 0) + 0.5f * b.at<float>(x, y, 0);
        EXPECT_NEAR(sum.at<float>(x, y, 0), two, 2e-6);
        most = std::max(most, static_cast<double>(two));
      }
    }
    EXPECT_GT(most, 0.2);
    const VerifyReport report = Verify(Picture(cloud, both));
    EXPECT_TRUE(report.within_bound) << report.Summary();
  }
}

TEST(VolumeShadow, HardCasesAreFiniteAndWithinTheBound) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                   kInf = std::numeric_limits<double>::infinity();
  const VolumeSpec grid = VolumeSpec::Centred({9, 7, 5});
  struct Case {
    const char* name;
    std::function<double(const Vector3&)> density;
    double opacity;
    bool finite;  // the reference knows what it is
  };
  const Case cases[] = {
      {"empty", [](const Vector3&) { return 0.0; }, 1, true},
      {"transparent", [](const Vector3&) { return 1.0; }, 0, true},
      {"opaque", [](const Vector3&) { return 1.0; }, 1, true},
      {"an opaque half", [](const Vector3& p) { return p[0] > 0.11 ? 1.0 : 0.0; }, 1, true},
      {"not a number", [=](const Vector3& p) { return p[1] > 0.1 ? kNaN : 0.7; }, 0.9, true},
      {"without end", [=](const Vector3& p) { return p[1] > 0.1   ? kInf
                                                     : p[0] > 0.1 ? -kInf
                                                                  : 0.7; }, 0.9,
       false}};
  for (const Case& c : cases) {
    const Volume volume(grid, c.density);
    for (const VolumeMode mode : {VolumeMode::kOver, VolumeMode::kUnder, VolumeMode::kAttenuate,
                                  VolumeMode::kHyper, VolumeMode::kFire}) {
      for (const bool point : {false, true}) {
        for (const bool shade : {false, true}) {
          SCOPED_TRACE(std::string(c.name) + " " + std::to_string(static_cast<int>(mode)));
          VolumeParams p = Fog({0, 0, 0});
          p.material.light = point ? Vector3{0.125, -0.25, 0.25} : Vector3{1, 0.2, 0};
          p.material.point = point;
          if (shade && !c.finite) continue;  // a normal of infinities
          p.mode = mode;
          p.shade = shade;
          p.soft = 0.3;
          p.transfer = {{{0, {1, 1, 1}, 0}, {1, {1, 0.5, 0.25}, c.opacity}}, 0.1};
          p.scatter.phase = 0.4;
          const Node node = Picture(volume, p);
          const Image image = Render(node);
          for (int y = 0; y < 5; ++y) {
            for (int x = 0; x < 5; ++x) {
              for (int k = 0; k < 4; ++k) EXPECT_TRUE(std::isfinite(image.at<float>(x, y, k)));
            }
          }
          if (!c.finite) continue;
          const VerifyReport report = Verify(node);
          EXPECT_TRUE(report.within_bound) << report.Summary();
        }
      }
    }
  }
  // One voxel, and two nodes a side.
  VolumeParams p = Fog({1, 0, 0});
  p.scatter.size = 2;
  const Node dot = Picture(Constant({1, 1, 1}), p);
  ExpectMiddle(dot, -std::expm1(-2 * kKappa) * 0.5 * (1 + std::exp(-2 * kKappa)), 2e-6);
}

TEST(VolumeShadow, NothingChangesWithoutIt) {
  const Volume cloud = Cloud(16);
  VolumeParams p = Fog({1, 0, 0});
  p.scatter = {};
  const Image plain = Render(Picture(cloud, p));
  p.scatter.size = 7, p.scatter.step = 0.1;
  ExpectSameBits(plain, Render(Picture(cloud, p)));
  p.scatter = {};
  p.scatter.lit = true;  // an even phase under a light of 1
  const Image lit = Render(Picture(cloud, p));
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 5; ++x) EXPECT_NEAR(lit.at<float>(x, y, 0), plain.at<float>(x, y, 0), 1e-6);
  }
  // Leaps are those of the picture: no bit changes without them.
  p.scatter.shadow = 0.7;
  const Image leaping = Render(Picture(cloud, p));
  p.leap = false;
  ExpectSameBits(leaping, Render(Picture(cloud, p)));
}

TEST(VolumeShadow, WhatHasNoUseForItIsRefused) {
  const Volume cloud = Cloud(8);
  const auto message = [&](const std::function<void(VolumeParams&)>& change) -> std::string {
    VolumeParams p = Fog({1, 0, 0});
    change(p);
    try {
      Picture(cloud, p);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([](VolumeParams&) {}), "");
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.shadow = 1.5; }).find("a shadow of 1.5, expected 0 to 1"),
            std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.phase = 1; }).find("a phase of 1"), std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.size = 1; }).find("size of 1, expected 2 to 256"),
            std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.step = -1; }).find("step of -1"), std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.step = std::nan(""); }).find("step of nan"),
            std::string::npos);
  for (const VolumeMode mode : {VolumeMode::kIso, VolumeMode::kFur, VolumeMode::kXray, VolumeMode::kMip}) {
    EXPECT_NE(message([=](VolumeParams& p) { p.mode = mode; }).find("fire, hyper, over"), std::string::npos);
  }
  EXPECT_NE(message([](VolumeParams& p) { p.method = VolumeMethod::kShearWarp; }).find("shearwarp"),
            std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) { p.scatter.lights.resize(8); }).find("8 further lights"),
            std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) {
              p.scatter.lights = {{{0, 1, 0}, false, {-1, 0, 0}}};
            }).find("colour of -1"),
            std::string::npos);
  // A way towards such a light would have no end.
  EXPECT_NE(message([](VolumeParams& p) {
              p.material.light = {0, 0, 0};
            }).find("direction 0,0,0"),
            std::string::npos);
  EXPECT_NE(message([](VolumeParams& p) {
              p.scatter.lights = {{{-0.0, 0, 0}, false, {1, 1, 1}}};
            }).find("direction 0,0,0"),
            std::string::npos);
  // Words.
  const auto refused = [](const char* words) -> std::string {
    try {
      testing::Command("volume", words, {});
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refused("solid=knot dims=8 size=4x4 mode=xray shadow=1").find("shadow= beside mode=xray"),
            std::string::npos);
  EXPECT_NE(refused("solid=knot dims=8 size=4x4 mode=over shadowsize=8").find("no shadow="),
            std::string::npos);
  EXPECT_NE(refused("solid=knot dims=8 size=4x4 mode=over shadow=1 exponent=3").find("shade=1"),
            std::string::npos);
}

}  // namespace
}  // namespace tessera
