// Media that glow: black bodies against the CIE's tables, fogs of one temperature, light besides other light,
// errors.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "model/black_body.h"
#include "ops/registry.h"
#include "support/oracle.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ReferenceOf;

// Planck's law (second constant 1.438777e-2 m K) through the CIE's 1931 observer, nanometre by nanometre:
// chromaticities, and luminances relative to that of 2,856 K, illuminant A.
struct Body {
  double kelvin, x, y, luminance;
};
constexpr Body kBodies[] = {{1000, 0.65275, 0.34446, 1.3605e-07}, {1200, 0.62504, 0.36745, 7.0551e-06},
                            {1500, 0.58572, 0.39312, 3.91919e-4}, {1900, 0.53778, 0.41120, 0.0122392},
                            {2000, 0.52668, 0.41330, 0.023482},   {2856, 0.44754, 0.40743, 1},
                            {3000, 0.43693, 0.40407, 1.53005},    {4000, 0.38044, 0.37675, 12.8005},
                            {5000, 0.34510, 0.35161, 46.4872},    {6500, 0.31353, 0.32363, 155.573},
                            {10000, 0.28063, 0.28829, 671.425},   {15000, 0.26371, 0.26728, 1807.3}};

TEST(VolumeEmission, BlackBodiesHaveTheirPublishedColours) {
  const double standard = model::BlackBodyLuminance(2856);
  for (const Body& b : kBodies) {
    SCOPED_TRACE(b.kelvin);
    const auto [u, v] = model::BlackBodyUv(b.kelvin);
    const double below = 2 * u - 8 * v + 4;
    EXPECT_NEAR(3 * u / below, b.x, 4e-4);
    EXPECT_NEAR(2 * v / below, b.y, 4e-4);
    EXPECT_NEAR(model::BlackBodyLuminance(b.kelvin) / standard / b.luminance, 1,
                b.kelvin < 1900 ? 8e-3 : 2.5e-3);
    const std::array<double, 3> c = model::BlackBodyColor(b.kelvin);
    for (const double channel : c) EXPECT_GE(channel, 0);
    if (b.kelvin < 1900) {  // out of the gamut: red and green alone
      EXPECT_EQ(c[2], 0);
      EXPECT_GT(c[0], c[1]);
      continue;
    }
    // From Rec.709 back: the columns are those of BT.709's primaries, of white D65.
    const double x = 0.412391 * c[0] + 0.357584 * c[1] + 0.180481 * c[2],
                 y = 0.212639 * c[0] + 0.715169 * c[1] + 0.072192 * c[2],
                 z = 0.019331 * c[0] + 0.119195 * c[1] + 0.950532 * c[2];
    EXPECT_NEAR(y, 1, 1e-5);
    EXPECT_NEAR(x / (x + y + z), b.x, 4.1e-4);
    EXPECT_NEAR(y / (x + y + z), b.y, 4.1e-4);
  }
}

constexpr double kKappa = 0.7;  // optical depth a unit

// A fog of one value; looks down -z at [-1, 1], parallel.
Node Fog(double value, const std::function<void(VolumeParams&)>& change) {
  VolumeParams p;
  p.mode = VolumeMode::kUnder;
  const double a = -std::expm1(-kKappa);
  p.transfer = {{{0, {0.5, 0.5, 0.5}, a}, {1, {0.5, 0.5, 0.5}, a}}, 1};
  p.emission = {1500, 3500, 2};
  p.material.ambient = 0;
  p.material.diffuse = 1;
  p.material.light = {1, 0, 0};
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  p.termination = 0;
  p.scatter.size = 5;
  change(p);
  return RenderVolume(ImageSpec(5, 5, 4),
                      Volume(VolumeSpec::Centred({8, 8, 8}), [=](const Vector3&) { return value; }), p);
}

TEST(VolumeEmission, AFogOfOneTemperatureGlowsOfItselfAndBesidesLight) {
  const double alpha = -std::expm1(-2 * kKappa);
  for (const double value : {-1.0, 0.0, 0.3, 1.0, 2.0}) {
    SCOPED_TRACE(value);
    const double share = std::clamp(value, 0.0, 1.0), kelvin = 1500 + 2000 * share;
    const double luminance = 2 * model::BlackBodyLuminance(kelvin) / model::BlackBodyLuminance(3500);
    const std::array<double, 3> c = model::BlackBodyColor(kelvin);
    const auto expect = [&](const Node& node, double besides) {
      const Image image = Render(node);
      const reference::ImageD reference = ReferenceOf(node);
      for (size_t k = 0; k < 3; ++k) {
        const int channel = static_cast<int>(k);
        // Between two of a thousand entries a temperature is 2 K: linear is as good.
        EXPECT_NEAR(image.at<float>(2, 2, channel), alpha * (luminance * c[k] + besides), 2e-5);
        EXPECT_NEAR(reference.at(2, 2, channel), alpha * (luminance * c[k] + besides), 2e-5);
      }
      EXPECT_NEAR(image.at<float>(2, 2, 3), alpha, 2e-6);
    };
    expect(Fog(value, [](VolumeParams&) {}), 0);
    expect(Fog(value, [](VolumeParams& p) { p.scatter.lit = true; }), 0.5);
    // What shadows the light does not shadow the glow.
    expect(Fog(value, [](VolumeParams& p) { p.scatter.shadow = 1; }), 0.5 * std::exp(-kKappa));
  }
}

TEST(VolumeEmission, FireIsWithinItsBound) {
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.5), VolumeSpec::Centred({20, 20, 20}));
  for (const bool shade : {false, true}) {
    for (const VolumeMode mode : {VolumeMode::kFire, VolumeMode::kHyper}) {
      VolumeParams p;
      p.mode = mode;
      p.shade = shade;
      p.emission = {1000, 15000, 5};
      p.scatter.shadow = shade ? 0.5 : 0;
      p.camera = OrbitCamera(ball, 30, 20, 30, 1);
      const VerifyReport report = Verify(RenderVolume(ImageSpec(12, 12, 4), ball, p));
      EXPECT_TRUE(report.within_bound) << report.Summary();
    }
  }
}

TEST(VolumeEmission, WhatHasNoUseForItIsRefused) {
  const auto message = [](const std::function<void(VolumeParams&)>& change) -> std::string {
    try {
      Fog(1, change);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const auto expect = [&](const std::function<void(VolumeParams&)>& change, const char* text) {
    EXPECT_NE(message(change).find(text), std::string::npos) << message(change);
  };
  EXPECT_EQ(message([](VolumeParams&) {}), "");
  expect([](VolumeParams& p) { p.emission.high = 20000; }, "a black body of 20000, expected 1000 to 15000");
  expect([](VolumeParams& p) { p.emission.low = 0; }, "a black body of 0, expected 1000");
  expect([](VolumeParams& p) { p.emission.high = 0; }, "a black body of 0, expected 1000");
  expect([](VolumeParams& p) { p.emission.strength = std::nan(""); }, "strength of nan");
  expect([](VolumeParams& p) { p.mode = VolumeMode::kXray; }, "fire, hyper, over");
  expect([](VolumeParams& p) { p.classification = Classification::kPre; }, "expected post");
  expect([](VolumeParams& p) { p.method = VolumeMethod::kShearWarp; }, "shearwarp");
  EXPECT_THROW(testing::Command("volume", "solid=knot dims=8 size=4x4 mode=iso blackbody=1000,2000", {}),
               Error);
  EXPECT_THROW(testing::Command("volume", "solid=knot dims=8 size=4x4 mode=fire blackbody=900,2000", {}),
               Error);
}

}  // namespace
}  // namespace tessera
