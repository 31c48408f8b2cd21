// Volume pictures and their reference against closed forms: a constant and a linear density, steps of many
// lengths.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/oracle.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ReferenceOf;

constexpr int kVoxels = 16;
constexpr double kSide = 2, kVoxel = kSide / kVoxels;

// Looks down -z at [-1, 1], parallel; 3 x 3 pixels.
Node Picture(const Volume& volume, VolumeMode mode, const VolumeTransferFunction& transfer, double step,
             VolumeMethod method = VolumeMethod::kRays) {
  VolumeParams p;
  p.mode = mode;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  p.transfer = transfer;
  p.step = step;
  p.method = method;
  p.termination = 0;
  return RenderVolume(ImageSpec(3, 3, 4), volume, p);
}

Volume Along(const std::function<double(const Vector3&)>& density) {
  return Volume(VolumeSpec::Centred({kVoxels, kVoxels, kVoxels}, PixelType::kFloat), density);
}

// Pixel (1, 1) of the picture and of its reference.
void ExpectPixel(const Node& picture, int channel, double expected, double within) {
  EXPECT_NEAR(Render(picture).at<float>(1, 1, channel), expected, within) << "picture, channel " << channel;
  EXPECT_NEAR(ReferenceOf(picture).at(1, 1, channel), expected, within) << "reference, channel " << channel;
}

const double kSteps[] = {0.5, 0.3, 0.1, 0.05, 0.0173, 0.01, 0.002};

// Of a material that has opacity a per length l over a way s: alpha is 1 - (1 - a)^(s / l), whatever the
// step.
TEST(VolumeOracle, ConstantDensity) {
  const Volume volume = Along([](const Vector3&) { return 1.0; });
  constexpr double kOpacity = 0.3, kLength = 0.1;
  const VolumeTransferFunction transfer = {{{0, {1, 0.5, 0.25}, 0}, {1, {1, 0.5, 0.25}, kOpacity}}, kLength};
  const double alpha = 1 - std::pow(1 - kOpacity, kSide / kLength);
  for (const double step : kSteps) {
    SCOPED_TRACE(step);
    const Node attenuated = Picture(volume, VolumeMode::kAttenuate, transfer, step);
    ExpectPixel(attenuated, 0, kOpacity, 2e-6);
    ExpectPixel(attenuated, 2, kOpacity * 0.25, 2e-6);
    ExpectPixel(attenuated, 3, kOpacity, 2e-6);
    for (const VolumeMode mode : {VolumeMode::kOver, VolumeMode::kUnder}) {
      const Node image = Picture(volume, mode, transfer, step);
      ExpectPixel(image, 1, alpha * 0.5, 4e-6);
      ExpectPixel(image, 3, alpha, 4e-6);
    }
    ExpectPixel(Picture(volume, VolumeMode::kXray, transfer, step), 0, 1 - alpha, 4e-6);
    ExpectPixel(Picture(volume, VolumeMode::kMip, transfer, step), 0, 1, 1e-6);
  }
  ExpectPixel(Picture(volume, VolumeMode::kUnder, transfer, 0, VolumeMethod::kShearWarp), 3, alpha, 4e-6);
}

// A density that rises from 0 to 1 along the ray, constant in the outermost half voxels, and an opacity a v:
// the mean of a v is a / 2; the optical depth is the integral of -log(1 - a v), ((1 - a) log(1 - a) + a) / a.
TEST(VolumeOracle, LinearDensity) {
  const double first = -1 + kVoxel / 2, last = 1 - kVoxel / 2;
  const Volume volume = Along([](const Vector3& p) { return p[2]; });
  constexpr double kOpacity = 0.3, kLength = 0.1;
  const VolumeTransferFunction transfer = {{{first, {1, 1, 0.5}, 0}, {last, {1, 1, 0.5}, kOpacity}}, kLength};
  const double ramp = ((1 - kOpacity) * std::log1p(-kOpacity) + kOpacity) / kOpacity;
  const double depth = ((last - first) * ramp - kVoxel / 2 * std::log1p(-kOpacity)) / kLength;
  double before = 1;
  for (const double step : {0.2, 0.05, 0.0125, 0.003125}) {
    SCOPED_TRACE(step);
    // Midpoints miss a part that shrinks with the square of the step; the integral of `attenuate` is even.
    const double missed = step * step;
    const Node attenuated = Picture(volume, VolumeMode::kAttenuate, transfer, step);
    EXPECT_NEAR(ReferenceOf(attenuated).at(1, 1, 0), kOpacity / 2, 1e-6);
    EXPECT_NEAR(Render(attenuated).at<float>(1, 1, 0), kOpacity / 2, 2e-6 + 0.1 * missed);
    ExpectPixel(attenuated, 2, kOpacity / 4, 2e-6 + 0.1 * missed);
    const Node ray = Picture(volume, VolumeMode::kXray, transfer, step);
    ExpectPixel(ray, 0, std::exp(-depth), 2e-6 + missed);
    const double off = std::fabs(Render(ray).at<float>(1, 1, 0) - std::exp(-depth));
    EXPECT_LE(off, before + 1e-6);
    before = off;
    const Node under = Picture(volume, VolumeMode::kUnder, transfer, step);
    ExpectPixel(under, 3, -std::expm1(-depth), 4e-6 + missed);
    ExpectPixel(under, 2, -std::expm1(-depth) / 2, 4e-6 + missed);
  }
}

// A reference that followed the step would let a kernel pass that does: both have to be far from it.
TEST(VolumeOracle, VerifyTellsAMeanOfStepsFromTheIntegral) {
  const Volume volume = Along([](const Vector3& p) { return 0.5 + 0.5 * std::sin(3 * p[2]); });
  const VolumeTransferFunction transfer = {{{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, 0.6}}, 0.2};
  double coarse = 0;
  for (const double step : {0.1, 0.02}) {
    const Node picture = Picture(volume, VolumeMode::kAttenuate, transfer, step);
    const VerifyReport report = Verify(picture);
    EXPECT_TRUE(report.within_bound) << report.Summary();
    EXPECT_LT(report.bound, step == 0.1 ? 2e-3 : 1e-4);
    const double value = ReferenceOf(picture).at(1, 1, 3);
    EXPECT_GT(value, 0.1);
    if (coarse > 0) {
      EXPECT_NEAR(value, coarse, 1e-6);
    }
    coarse = value;
  }
}

// All that composite converge: four times as many steps bring a picture nearer to one of many.
TEST(VolumeOracle, PicturesConvergeAsTheStepShrinks) {
  const Volume ball =
      DistanceField(Solid::Sphere({0, 0, 0}, 0.5), VolumeSpec::Centred({24, 24, 24}, PixelType::kFloat));
  struct Mode {
    VolumeMode mode;
    const char* dmf;
  };
  for (const Mode& m :
       {Mode{VolumeMode::kFur, ""}, Mode{VolumeMode::kFire, ""},
        Mode{VolumeMode::kHyper, "noise(.3,1),bias(.4)"}, Mode{VolumeMode::kOver, ""},
        Mode{VolumeMode::kUnder, ""}, Mode{VolumeMode::kAttenuate, ""}, Mode{VolumeMode::kXray, ""}}) {
    SCOPED_TRACE(static_cast<int>(m.mode));
    VolumeParams p;
    p.mode = m.mode;
    p.camera = OrbitCamera(ball, 20, 10, 0, 1, 1.2);
    p.termination = 0;
    if (m.mode <= VolumeMode::kHyper) p.soft = 0.3;
    if (m.dmf[0] != 0) p.dmf = ParseDmf(m.dmf);
    const auto mean = [&](double step) {
      p.step = step;
      const Image image = Render(RenderVolume(ImageSpec(24, 24, 4), ball, p));
      double sum = 0;
      for (int i = 0; i < 24 * 24; ++i) sum += image.at<float>(i % 24, i / 24, 0);
      return sum / (24 * 24);
    };
    const double fine = mean(0.002), coarse = mean(0.064), middle = mean(0.016);
    EXPECT_LT(std::fabs(middle - fine), 2e-3 * (1 + fine));
    EXPECT_LE(std::fabs(middle - fine), std::fabs(coarse - fine) + 1e-5);
    EXPECT_LT(std::fabs(coarse - fine), 0.03 * (1 + fine));
  }
}

// Rays that graze a surface have its place, too: at one of these pixels four secants left it off by 1e-4.
TEST(VolumeOracle, GrazingRaysCloseIn) {
  const ops::OpInfo& op = *ops::FindOp("volume");
  const Node picture = op.make({}, ops::ParseExample(op, "solid=body zoom=2 depth=1"), nullptr);
  const Roi roi{28, 268, 34, 274};
  verify::ReferenceEngine engine([](const std::string&) { return 0.0; });
  const verify::Evaluated want = engine.Evaluate(picture, roi);
  const Image got = Render(picture);
  int hits = 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      if (want.Undecided(x, y, 4) || !std::isfinite(want.value.at(x, y, 4))) continue;
      ++hits;
      EXPECT_NEAR(got.at<float>(x, y, 4), want.value.at(x, y, 4), 2e-6) << x << "," << y;
    }
  }
  EXPECT_GT(hits, 15);
}

}  // namespace
}  // namespace tessera
