// Pictures of volumes: closed forms, leaping against not leaping, operators, methods, hard cases, memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ImageSpec Size(int width, int height) { return ImageSpec(width, height, 4); }

// Looks down -z at [-1, 1], parallel.
VolumeParams Ahead(VolumeMode mode) {
  VolumeParams p;
  p.mode = mode;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  return p;
}
// Opacity `a` per `length` everywhere from value 0.5 up.
VolumeTransferFunction Uniform(double a, double length) {
  return {{{0, {1, 0.5, 0.25}, a}, {1, {1, 0.5, 0.25}, a}}, length};
}
Volume Constant(double value, const std::array<int, 3>& size = {16, 16, 16}) {
  return Volume(VolumeSpec::Centred(size), [=](const Vector3&) { return value; });
}
double MaxDifference(const Image& a, const Image& b, int channels = 4) {
  double most = 0;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < channels; ++c) {
        most = std::max(most, std::fabs(static_cast<double>(a.at<float>(x, y, c)) - b.at<float>(x, y, c)));
      }
    }
  }
  return most;
}

TEST(VolumePicture, HomogeneousSlabHasItsClosedForm) {
  const Volume v = Constant(0.5);
  for (const double a : {1e-8, 1e-3, 0.2, 0.9, 1.0}) {
    for (const double step : {0.02, 0.0731, 0.5}) {
      VolumeParams p = Ahead(VolumeMode::kUnder);
      p.transfer = Uniform(a, 0.05);
      p.step = step;
      p.termination = 0;
      const Image image = Render(RenderVolume(Size(5, 5), v, p));
      const double expected = -std::expm1(2 / 0.05 * std::log1p(-a));  // the box is 2 deep, whatever the step
      EXPECT_NEAR(image.at<float>(2, 2, 3), expected, 1e-5 * expected) << a << " " << step;
      EXPECT_NEAR(image.at<float>(2, 2, 1), 0.5 * expected, 1e-5 * expected);
    }
  }
}

// 003 equation 1 along a diameter, ri = 0.5, ro = 1: the integral of D is 14/9.
TEST(VolumePicture, XrayOfTheSoftSphereConvergesToItsClosedForm) {
  const Volume v(VolumeSpec::Centred({129, 129, 129}), [](const Vector3& p) {
    const double q = Dot(p, p);
    return q <= 0.25 ? 1 : q >= 1 ? 0 : (1 - q) / 0.75;
  });
  VolumeParams p = Ahead(VolumeMode::kXray);
  const double kappa = 0.3, length = 1;
  p.transfer = {{{0, {1, 1, 1}, 0}, {1, {1, 1, 1}, -std::expm1(-kappa * length)}}, length};
  double previous = 1;
  for (const double step : {0.1, 0.02}) {
    p.step = step;
    const Image image = Render(RenderVolume(Size(3, 3), v, p));
    const double sum = -std::log(image.at<float>(1, 1, 0)) / kappa;
    // Opacity, not extinction, is linear between the two points: its mean is a little below.
    const auto exact = [&] {
      double total = 0;
      const double a = -std::expm1(-kappa);
      constexpr int kParts = 20000;
      for (int i = 0; i < kParts; ++i) {
        const double z = -1 + 2 * (i + 0.5) / kParts, q = z * z;
        const double density = q <= 0.25 ? 1 : (1 - q) / 0.75;
        total += -std::log1p(-a * density) / kappa * 2 / kParts;
      }
      return total;
    }();
    const double error = std::fabs(sum - exact);
    EXPECT_LT(error, previous / 3);
    previous = error;
  }
  EXPECT_LT(previous, 3e-3);
}

TEST(VolumePicture, CorrectedOpacityAgreesForTwiceTheSamples) {
  const Volume v(VolumeSpec::Centred({32, 32, 32}),
                 [](const Vector3& p) { return std::exp(-4 * Dot(p, p)); });
  VolumeParams p = Ahead(VolumeMode::kUnder);
  p.transfer = {{{0, {0, 0, 1}, 0}, {1, {1, 0.4, 0}, 0.3}}, 0.1};
  p.termination = 0;
  p.step = 0.02;
  const Image once = Render(RenderVolume(Size(20, 20), v, p));
  p.step = 0.01;
  EXPECT_LT(MaxDifference(once, Render(RenderVolume(Size(20, 20), v, p))), 1e-3);
}

TEST(VolumePicture, UnderEqualsOverAndTerminationIsBounded) {
  const Volume v = DistanceField(Solid::Parse("knot"), VolumeSpec::Centred({40, 40, 40}));
  VolumeParams p;
  p.camera = OrbitCamera(v, 30, 20, 35, 1);
  p.transfer = {{{-0.15, {1, 0.2, 0.1}, 0.2}, {0, {0.2, 0.9, 0.3}, 0.05}, {0.2, {0, 0, 1}, 0}}, 0.02};
  p.termination = 0;
  p.mode = VolumeMode::kUnder;
  const Image under = Render(RenderVolume(Size(48, 48), v, p));
  p.mode = VolumeMode::kOver;
  EXPECT_LT(MaxDifference(under, Render(RenderVolume(Size(48, 48), v, p))), 2e-6);
  p.mode = VolumeMode::kUnder;
  p.termination = 0.05;
  const double ends = MaxDifference(under, Render(RenderVolume(Size(48, 48), v, p)));
  EXPECT_LE(ends, 0.05);
  EXPECT_GT(ends, 1e-4);
}

// The torture body: plates of a voxel, spikes, crossed boxes; all modes, displacement at its largest.
TEST(VolumePicture, LeapingChangesNoBit) {
  const Volume thin = DistanceField(
      Solid::Parse("box(0,0,0,.7,.7,.016) | box(.1,.1,.1,.016,.7,.7) | cone(-.6,-.7,.3,.2,.8,.5,.09,.004) | "
                   "cone(.7,-.7,-.3,.5,.8,-.5,.08,.004) | torus(0,-.2,0,.6,.02)"),
      VolumeSpec::Centred({64, 64, 64}, PixelType::kUint16), 0.3);
  for (const VolumeMode mode : {VolumeMode::kIso, VolumeMode::kBump, VolumeMode::kMelt, VolumeMode::kFur,
                                VolumeMode::kFire, VolumeMode::kUnder, VolumeMode::kXray}) {
    SCOPED_TRACE(static_cast<int>(mode));
    for (const double fov : {0.0, 40.0}) {
      VolumeParams p;
      p.mode = mode;
      p.camera = OrbitCamera(thin, 33, 27, fov, 1.2, 1.5);
      p.soft = 0.1;
      p.time = 1.3;
      p.depth = true;
      if (mode == VolumeMode::kMelt) p.amount = 0.5;
      if (mode == VolumeMode::kFire) p.amount = 0.35;
      if (mode >= VolumeMode::kOver) p.transfer = {{{-0.1, {1, 1, 1}, 0.3}, {0.02, {1, 1, 1}, 0}}, 0.03};
      const Image leaping = Render(RenderVolume(Size(48, 40), thin, p));
      p.leap = false;
      ExpectSameBits(leaping, Render(RenderVolume(Size(48, 40), thin, p)));
      double covered = 0;
      for (int i = 0; i < 48 * 40; ++i) covered += leaping.at<float>(i % 48, i / 48, 3) > 0;
      EXPECT_GT(covered, 200);
    }
  }
}

TEST(VolumePicture, UserChainsLeapOverNothing) {
  const Volume v = DistanceField(Solid::Parse("knot"), VolumeSpec::Centred({32, 32, 32}));
  VolumeParams p;
  p.mode = VolumeMode::kHyper;
  p.camera = OrbitCamera(v, 10, 20, 30, 1, 1.4);
  p.shade = true;
  for (const char* words : {"warp(.2,1),bias(.4)", "swell(.3,1),gain(.7)", "noise(.6,2),threshold(.3,.2)",
                            "lift(.3,1,.5),turbulence(.9,2)", "threshold(-1,.5)"}) {
    SCOPED_TRACE(words);
    p.dmf = ParseDmf(words);
    p.leap = true;
    const Image leaping = Render(RenderVolume(Size(30, 30), v, p));
    p.leap = false;
    ExpectSameBits(leaping, Render(RenderVolume(Size(30, 30), v, p)));
  }
  // Where nothing is seen too, nothing is leapt over.
  p.dmf = ParseDmf("bias(.4)");
  p.transfer = {{{0, {1, 1, 1}, 0.02}, {1, {1, 0.5, 0}, 0.3}}, 0.05};
  p.leap = true;
  const Image foggy = Render(RenderVolume(Size(30, 30), v, p));
  int covered = 0;
  for (int i = 0; i < 900; ++i) covered += foggy.at<float>(i % 30, i / 30, 3) > 0;
  EXPECT_GT(covered, 600);
  p.leap = false;
  ExpectSameBits(foggy, Render(RenderVolume(Size(30, 30), v, p)));
  // What a chain and its colours leave unseen, is not looked at.
  p.transfer = {{{0, {1, 1, 1}, 0}, {0.3, {1, 1, 1}, 0}, {1, {1, 0.5, 0}, 0.4}}, 0.05};
  for (const char* words : {"bias(.6)", "gain(.7)", "gain(.2),bias(.3)", "threshold(.2,.6)",
                            "bias(.7),turbulence(1.4,2),gain(.6)", "lift(.2,1),turbulence(-.5,2)"}) {
    SCOPED_TRACE(words);
    p.dmf = ParseDmf(words);
    p.leap = true;
    const Image leaping = Render(RenderVolume(Size(30, 30), v, p));
    p.leap = false;
    ExpectSameBits(leaping, Render(RenderVolume(Size(30, 30), v, p)));
  }
  p.transfer = {};
  // A function of C++, against the built-in that it repeats.
  Dmf mine;
  mine.kind = Dmf::Kind::kFunction;
  mine.function = [](const DmfSamples& s) {
    for (int i = 0; i < s.count; ++i) s.density[i] = s.density[i] * s.density[i];
  };
  p.dmf = {mine};
  const Image squared = Render(RenderVolume(Size(30, 30), v, p));
  p.dmf = ParseDmf("bias(.25)");  // t^2
  EXPECT_LT(MaxDifference(squared, Render(RenderVolume(Size(30, 30), v, p))), 1e-5);
  p.dmf[0].amount = 1.5;
  EXPECT_THROW(RenderVolume(Size(4, 4), v, p), Error);
}

TEST(VolumePicture, ComplementaryPlanesCompositeToTheWhole) {
  const Volume v(VolumeSpec::Centred({24, 24, 24}),
                 [](const Vector3& p) { return std::exp(-3 * Dot(p, p)); });
  VolumeParams p = Ahead(VolumeMode::kUnder);
  p.camera = OrbitCamera(v, 20, 10, 30, 1);
  p.transfer = {{{0, {1, 0, 0}, 0}, {1, {0, 1, 0}, 0.2}}, 0.05};
  p.termination = 0;
  const Image whole = Render(RenderVolume(Size(24, 24), v, p));
  const Vector3 n = p.camera.forward();
  const double middle = 0.0137;  // within a step
  p.planes = {{{-n[0], -n[1], -n[2]}, -middle}};
  const Image front = Render(RenderVolume(Size(24, 24), v, p));
  p.planes = {{n, middle}};
  const Image back = Render(RenderVolume(Size(24, 24), v, p));
  Image both(whole.spec());
  for (int i = 0; i < 24 * 24; ++i) {
    for (int c = 0; c < 4; ++c) {
      both.at<float>(i % 24, i / 24, c) =
          front.at<float>(i % 24, i / 24, c) +
          (1 - front.at<float>(i % 24, i / 24, 3)) * back.at<float>(i % 24, i / 24, c);
    }
  }
  EXPECT_LT(MaxDifference(whole, both), 3e-6);
  // A surface is cut open: the section faces the viewer.
  VolumeParams cut = Ahead(VolumeMode::kIso);
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.6), VolumeSpec::Centred({32, 32, 32}));
  cut.depth = true;
  cut.planes = {{{0, 0, -1}, 0}};  // z <= 0 stays
  EXPECT_NEAR(Render(RenderVolume(Size(9, 9), ball, cut)).at<float>(4, 4, 4), 4, 1e-4);
}

TEST(VolumePicture, DepthIsPlanarAndOpaqueObjectsStopRays) {
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.6), VolumeSpec::Centred({64, 64, 64}));
  VolumeParams p = Ahead(VolumeMode::kIso);
  p.camera = OrbitCamera(ball, 0, 0, 30, 1);
  p.depth = true;
  const Node node = RenderVolume(Size(33, 33), ball, p);
  EXPECT_EQ(node.spec().channels.back(), "Z");
  const Image image = Render(node);
  EXPECT_NEAR(image.at<float>(16, 16, 4), p.camera.PlanarDepth({0, 0, 0.6}), 1e-3);
  EXPECT_EQ(image.at<float>(0, 0, 4), kInfinity);
  EXPECT_EQ(image.at<float>(0, 0, 3), 0);
  Image scene(ImageSpec(33, 33, 1));
  for (int i = 0; i < 33 * 33; ++i) {
    const int x = i % 33;
    scene.at<float>(x, i / 33) = x < 11 ? 0.0f : x < 22 ? std::numeric_limits<float>::infinity() : NAN;
  }
  const Image hidden = Render(RenderVolume(Size(33, 33), ball, p, FromImage(scene)));
  for (int x = 0; x < 33; ++x) {
    EXPECT_EQ(hidden.at<float>(x, 16, 3), x >= 11 && x < 22 ? image.at<float>(x, 16, 3) : 0) << x;
  }
  // Half a slab in front of a wall.
  VolumeParams slab = Ahead(VolumeMode::kUnder);
  slab.transfer = Uniform(0.1, 0.05);
  slab.step = 0.3;
  slab.termination = 0;
  Image wall(ImageSpec(4, 4, 1));
  for (int i = 0; i < 16; ++i) wall.at<float>(i % 4, i / 4) = 4;
  const Image half = Render(RenderVolume(Size(4, 4), Constant(0.5), slab, FromImage(wall)));
  EXPECT_NEAR(half.at<float>(1, 1, 3), -std::expm1(1 / 0.05 * std::log1p(-0.1)), 1e-5);
  EXPECT_THROW(RenderVolume(Size(5, 5), ball, p, FromImage(wall)), Error);
}

TEST(VolumePicture, MethodsShowTheSame) {
  const Volume v(VolumeSpec::Centred({48, 40, 44}), [](const Vector3& p) {
    return std::exp(-5 * Dot(p, p)) * (1 + 0.5 * std::sin(5 * p[0]) * std::cos(4 * p[1] + 3 * p[2]));
  });
  VolumeParams p;
  p.mode = VolumeMode::kUnder;
  p.transfer = {{{0.1, {0.1, 0.2, 1}, 0}, {0.6, {1, 0.6, 0.2}, 0.08}, {1.2, {1, 1, 1}, 0.2}}, 0.03};
  p.termination = 0;
  for (const double azimuth : {0.0, 20.0, 44.0, 200.0, 300.0, -20.0, -130.0}) {
    const double view = azimuth < 0 ? 30 : 0;  // negative ones in perspective
    p.camera = OrbitCamera(v, azimuth, azimuth / 9, view, 1, 1.3);
    p.method = VolumeMethod::kRays;
    p.step = 0.005;
    const Image fine = Render(RenderVolume(Size(40, 40), v, p));
    p.step = 0;
    for (const VolumeMethod method :
         {VolumeMethod::kSlices, VolumeMethod::kShells, VolumeMethod::kStacks, VolumeMethod::kShearWarp}) {
      SCOPED_TRACE(std::to_string(azimuth) + " " + std::to_string(static_cast<int>(method)));
      p.method = method;
      const Image image = Render(RenderVolume(Size(40, 40), v, p));
      double sum = 0;
      for (int i = 0; i < 1600; ++i) {
        const double e = image.at<float>(i % 40, i / 40, 3) - fine.at<float>(i % 40, i / 40, 3);
        sum += e * e;
      }
      EXPECT_LT(std::sqrt(sum / 1600), 0.02);
      EXPECT_LT(MaxDifference(image, fine), 0.08);
    }
    const VerifyReport report = Verify(RenderVolume(Size(40, 40), v, p), PixelType::kFloat,
                                       {.samples = 2, .tile_size = 12, .render = {}});
    EXPECT_TRUE(report.within_bound) << azimuth << ": " << report.Summary();
  }
  p.method = VolumeMethod::kShearWarp;
  p.camera = Camera::Perspective({0, 0, 0.5}, {0, 0, 0}, {0, 1, 0}, 30, 1, 0.1, 10);  // within the volume
  EXPECT_THROW(RenderVolume(Size(4, 4), v, p), Error);
}

// A narrow peak at 1/2 between voxels of 0 and 1: looked up after interpolation it is seen, before it is not.
TEST(VolumePicture, ClassificationAfterInterpolationSeesTheThinLayer) {
  const Volume v(VolumeSpec::Centred({8, 8, 8}), [](const Vector3& p) { return p[2] > 0 ? 1.0 : 0.0; });
  VolumeParams p = Ahead(VolumeMode::kUnder);
  p.transfer = {
      {{0, {1, 1, 1}, 0}, {0.4, {1, 1, 1}, 0}, {0.5, {1, 1, 1}, 0.9}, {0.6, {1, 1, 1}, 0}, {1, {1, 1, 1}, 0}},
      0.02};
  p.step = 0.01;
  const auto alpha = [&](Classification c, double step) {
    p.classification = c;
    p.step = step;
    return Render(RenderVolume(Size(5, 5), v, p)).at<float>(2, 2, 3);
  };
  const float post = alpha(Classification::kPost, 0.002);
  EXPECT_GT(post, 0.5f);
  EXPECT_EQ(alpha(Classification::kPre, 0.01), 0);
  // With steps as long as a voxel the pre-integrated table still has the layer's alpha.
  EXPECT_NEAR(alpha(Classification::kPreIntegrated, 0.2), post, 0.15);
}

TEST(VolumePicture, OperatorsOnConstants) {
  const Volume v = Constant(0.5);
  VolumeParams p = Ahead(VolumeMode::kAttenuate);
  p.transfer = Uniform(0.4, 0.1);
  p.step = 0.1;
  EXPECT_NEAR(Render(RenderVolume(Size(5, 5), v, p)).at<float>(2, 2, 0), 0.4, 1e-5);  // a c
  p.mode = VolumeMode::kMip;
  EXPECT_NEAR(Render(RenderVolume(Size(5, 5), v, p)).at<float>(2, 2, 1), 0.5, 1e-6);
  p.mode = VolumeMode::kXray;
  EXPECT_NEAR(Render(RenderVolume(Size(5, 5), v, p)).at<float>(2, 2, 1), std::pow(0.6, 20), 1e-6);
  p.mode = VolumeMode::kUnder;
  p.transfer = Uniform(0, 0.1);
  const Image clear = Render(RenderVolume(Size(5, 5), v, p));
  for (int c = 0; c < 4; ++c) EXPECT_EQ(clear.at<float>(2, 2, c), 0);
  p.transfer.points[0].opacity = NAN, p.transfer.points[1].opacity = -3;  // clamped
  EXPECT_EQ(Render(RenderVolume(Size(5, 5), v, p)).at<float>(2, 2, 3), 0);
}

TEST(VolumePicture, HardCases) {
  // A hard step, d_in = d_out; a 1-voxel axis; no gradient; a view along an axis through a face.
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.5), VolumeSpec::Centred({24, 24, 24}));
  VolumeParams p = Ahead(VolumeMode::kHyper);
  p.soft = 0;
  EXPECT_GT(Render(RenderVolume(Size(9, 9), ball, p)).at<float>(4, 4, 3), 0.99f);
  p.soft = -0.1;
  EXPECT_THROW(RenderVolume(Size(9, 9), ball, p), Error);
  VolumeParams flat = Ahead(VolumeMode::kUnder);
  flat.transfer = Uniform(0.5, 0.1);
  flat.shade = true;  // without a gradient: the ambient light alone
  const Image lit = Render(RenderVolume(Size(5, 5), Constant(0.5, {6, 6, 1}), flat));
  EXPECT_GT(lit.at<float>(2, 2, 3), 0);
  EXPECT_NEAR(lit.at<float>(2, 2, 0) / lit.at<float>(2, 2, 3), flat.material.ambient, 1e-5);
  VolumeParams miss = Ahead(VolumeMode::kIso);
  miss.camera = Camera::Parallel({9, 0, 4}, {9, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  EXPECT_EQ(Render(RenderVolume(Size(5, 5), ball, miss)).at<float>(2, 2, 3), 0);
  VolumeParams within = Ahead(VolumeMode::kIso);
  within.camera = Camera::Perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60, 1);
  within.depth = true;
  const Image inside = Render(RenderVolume(Size(5, 5), ball, within));  // the eye is in the ball
  EXPECT_EQ(inside.at<float>(2, 2, 4), 0);
  EXPECT_EQ(inside.at<float>(2, 2, 3), 1);
  EXPECT_THROW(RenderVolume(Size(5, 5), Volume(), within), Error);
  within.block = NoiseBlock(NoiseContent::kNoise, 4, 1, 0, 16);
  within.mode = VolumeMode::kBump;
  EXPECT_THROW(RenderVolume(Size(5, 5), ball, within), Error);  // one channel where four are read
  EXPECT_THROW(NoiseBlock(NoiseContent::kNoise, 65), Error);
}

TEST(VolumePicture, BricksInOrderEqualTheWhole) {
  const auto rho = [](const Vector3& p) {
    return 0.5 + 0.5 * std::sin(3 * p[0] + 2 * p[1]) * std::cos(4 * p[2]);
  };
  const Volume whole(VolumeSpec::Centred({32, 32, 32}), rho);
  VolumeParams p = Ahead(VolumeMode::kUnder);
  p.transfer = {{{0, {1, 0, 0}, 0}, {1, {0, 1, 0}, 0.2}}, 0.05};
  p.termination = 0;
  p.method = VolumeMethod::kSlices;  // samples at the same places
  p.step = whole.spec().spacing[2];
  // Two halves along z that share the voxels at the seam, each cut there.
  const auto half = [&](int first) {
    VolumeSpec s = whole.spec();
    s.size[2] = 17;
    s.origin[2] = whole.spec().Position(0, 0, first)[2];
    return Volume(s, rho);
  };
  const double seam = whole.spec().Position(0, 0, 15.5)[2];
  const Image all = Render(RenderVolume(Size(24, 24), whole, p));
  p.planes = {{{0, 0, 1}, seam}};
  const Image front = Render(RenderVolume(Size(24, 24), half(15), p));
  p.planes = {{{0, 0, -1}, -seam}};
  const Image back = Render(RenderVolume(Size(24, 24), half(0), p));
  double most = 0;
  for (int i = 0; i < 24 * 24; ++i) {
    for (int c = 0; c < 4; ++c) {
      const double f = front.at<float>(i % 24, i / 24, c), a = front.at<float>(i % 24, i / 24, 3);
      most = std::max(most, std::fabs(f + (1 - a) * back.at<float>(i % 24, i / 24, c) -
                                      all.at<float>(i % 24, i / 24, c)));
    }
  }
  EXPECT_LT(most, 1e-6);
}

TEST(VolumePicture, SupersamplingIsTheMeanOfShiftedPictures) {
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.6), VolumeSpec::Centred({32, 32, 32}));
  VolumeParams p = Ahead(VolumeMode::kIso);
  const Image one = Render(RenderVolume(Size(20, 20), ball, p)),
              many = Render(RenderVolumeSupersampled(Size(20, 20), ball, p, 8));
  double area = 0, partial = 0;
  for (int i = 0; i < 400; ++i) {
    area += many.at<float>(i % 20, i / 20, 3);
    partial += many.at<float>(i % 20, i / 20, 3) > 0 && many.at<float>(i % 20, i / 20, 3) < 1;
  }
  EXPECT_NEAR(area / 100, 3.14159265 * 0.36, 0.03);  // pixels of 0.1 x 0.1
  EXPECT_GT(partial, 10);
  EXPECT_EQ(many.at<float>(10, 10, 3), one.at<float>(10, 10, 3));
}

TEST(VolumePicture, TurbulenceLookupsDiffer) {
  const Volume ball = DistanceField(Solid::Sphere({0, 0, 0}, 0.5), VolumeSpec::Centred({32, 32, 32}));
  VolumeParams p = Ahead(VolumeMode::kFire);
  std::vector<Image> images;
  for (const TurbulenceLookup lookup :
       {TurbulenceLookup::kBlock, TurbulenceLookup::kFourChannels, TurbulenceLookup::kFour,
        TurbulenceLookup::kEight, TurbulenceLookup::kExact}) {
    p.lookup = lookup;
    const Node node = RenderVolume(Size(16, 16), ball, p);
    images.push_back(Render(node));
    EXPECT_TRUE(Verify(node, PixelType::kFloat, {.samples = 2, .tile_size = 8, .render = {}}).within_bound);
  }
  EXPECT_GT(MaxDifference(images[0], images[2]), 1e-3);
  EXPECT_LT(MaxDifference(images[2], images[3]), 0.8);
  // The block is made of the same noise: finer samples come closer to it.
  const auto block = [&](int size) {
    p.lookup = TurbulenceLookup::kBlock;
    p.block = NoiseBlock();
    p.dmf = ParseDmf("lift(.17,1.15),turbulence(1.35,1.15)");
    for (Dmf& step : p.dmf) {
      step.block = NoiseBlock(NoiseContent::kTurbulence, kTurbulenceCells, kTurbulenceOctaves, 0, size);
    }
    return Render(RenderVolume(Size(24, 24), ball, p));
  };
  const Image coarse = block(32), fine = block(128);
  for (Dmf& step : p.dmf) step.lookup = TurbulenceLookup::kExact, step.block = NoiseBlock();
  const Image exact = Render(RenderVolume(Size(24, 24), ball, p));
  EXPECT_GT(MaxDifference(coarse, exact), 0.01);
  EXPECT_LT(MaxDifference(fine, exact), 0.5 * MaxDifference(coarse, exact));
}

// Bytes beyond the samples: bounds of blocks and leaps are small.
TEST(VolumePicture, NeedsLittleMoreThanItsSamples) {
  VolumeSpec spec = VolumeSpec::Centred({352, 96, 96}, PixelType::kUint8);
  const Volume v = DistanceField(Solid::Box({0, 0, 0}, {0.7, 0.1, 0.1}), spec);
  VolumeParams p = Ahead(VolumeMode::kIso);
  Render(RenderVolume(Size(32, 32), v, p));
  EXPECT_LT(static_cast<double>(v.bytes()), 1.15 * 352 * 96 * 96);
}

}  // namespace
}  // namespace tessera
