// Several volumes in one picture: closed forms of slabs apart and merged, order, surfaces among media,
// errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;

ImageSpec Size(int width, int height) { return ImageSpec(width, height, 4); }
Matrix4 Moved(double x, double y, double z) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}; }

// Looks down -z at [-1, 1], parallel.
VolumeParams Ahead(VolumeMode mode) {
  VolumeParams p;
  p.mode = mode;
  p.camera = Camera::Parallel({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 2, 1, 0.1, 10);
  p.termination = 0;
  return p;
}
// A cube of side 2 of one colour, optical depth `kappa` per unit.
PlacedVolume Slab(const std::array<double, 3>& color, double kappa, double z, double step) {
  PlacedVolume v;
  v.volume = Volume(VolumeSpec::Centred({8, 8, 8}), [](const Vector3&) { return 0.5; });
  v.params = Ahead(VolumeMode::kUnder);
  const double a = -std::expm1(-kappa);
  v.params.transfer = {{{0, color, a}, {1, color, a}}, 1};
  v.params.step = step;
  v.to_world = Moved(0, 0, z);
  return v;
}
PlacedVolume Ball(VolumeMode mode, double radius, const Vector3& at) {
  PlacedVolume v;
  v.volume = DistanceField(Solid::Sphere({0, 0, 0}, radius), VolumeSpec::Centred({32, 32, 32}));
  v.params = Ahead(mode);
  v.params.depth = true;
  v.to_world = Moved(at[0], at[1], at[2]);
  return v;
}
double MaxDifference(const Image& a, const Image& b) {
  double most = 0;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < static_cast<int>(a.spec().channels.size()); ++c) {
        const double u = a.at<float>(x, y, c), v = b.at<float>(x, y, c);
        if (u != v) most = std::max(most, std::fabs(u - v));
      }
    }
  }
  return most;
}

TEST(VolumeScene, SlabsHaveTheirClosedForm) {
  const std::array<double, 3> red = {1, 0.2, 0}, blue = {0, 0.3, 1};
  const double kr = 0.7, kb = 1.3;
  struct Part {
    double r, b, length;  // optical depths per unit
  };
  for (const double step : {0.5, 0.1, 0.0731}) {
    for (const double apart : {3.0, 2.0, 1.0, 0.0}) {  // between the centres, red in front
      SCOPED_TRACE(std::to_string(step) + " " + std::to_string(apart));
      const PlacedVolume both[] = {Slab(blue, kb, -apart / 2, step), Slab(red, kr, apart / 2, 2 * step)};
      const double shared = std::max(2 - apart, 0.0);
      const Part parts[] = {{kr, 0, 2 - shared}, {kr, kb, shared}, {0, kb, 2 - shared}};
      double alpha = 0, color[3] = {0, 0, 0};
      for (const Part& p : parts) {
        const double k = p.r + p.b, a = -std::expm1(-k * p.length) * (1 - alpha);
        for (size_t c = 0; c < 3; ++c) color[c] += a * (p.r * red[c] + p.b * blue[c]) / k;
        alpha += a;
      }
      const Image image = Render(RenderVolumes(Size(5, 5), both));
      EXPECT_NEAR(image.at<float>(2, 2, 3), alpha, 1e-5);
      // A segment across a face mixes what lies one after the other in it.
      const bool exact = step == 0.5 || shared == 2;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(image.at<float>(2, 2, c), color[c], exact ? 1e-5 : 0.05 * step) << c;
      }
      const PlacedVolume turned[] = {both[1], both[0]};
      EXPECT_LT(MaxDifference(image, Render(RenderVolumes(Size(5, 5), turned))), 2e-6);
    }
  }
}

// Extinctions add up: two clouds that interleave are the cloud of their sum.
TEST(VolumeScene, CloudsThatOverlapAreTheirSum) {
  const VolumeSpec grid = VolumeSpec::Centred({40, 40, 40});
  const auto density = [](const Vector3& p, double x) {
    const Vector3 q = {p[0] - x, p[1], p[2] - 0.5 * x};
    return std::max(0.0, 0.5 - Dot(q, q));
  };
  // Thin enough for extinction to be linear in the value.
  const VolumeTransferFunction linear = {{{0, {1, 0.5, 0.2}, 0}, {1, {1, 0.5, 0.2}, 1e-4}}, 1e-4 / 3};
  const auto cloud = [&](double a, double b) {
    PlacedVolume v;
    v.volume = Volume(grid, [=](const Vector3& p) { return a * density(p, 0.3) + b * density(p, -0.3); });
    v.params = Ahead(VolumeMode::kUnder);
    v.params.transfer = linear;
    v.params.camera = OrbitCamera(v.volume, 30, 20, 30, 1);
    return v;
  };
  const PlacedVolume two[] = {cloud(1, 0), cloud(0, 1)}, one[] = {cloud(1, 1)};
  const Image sum = Render(RenderVolumes(Size(30, 30), one));
  EXPECT_GT(sum.at<float>(15, 15, 3), 0.3f);
  EXPECT_LT(MaxDifference(sum, Render(RenderVolumes(Size(30, 30), two))), 2e-4);
}

TEST(VolumeScene, OneVolumeIsItsPictureAndMovingItMovesTheCamera) {
  const PlacedVolume ball = Ball(VolumeMode::kFire, 0.5, {0, 0, 0});
  const PlacedVolume one[] = {ball};
  const Image alone = Render(RenderVolume(Size(20, 20), ball.volume, ball.params));
  ExpectSameBits(alone, Render(RenderVolumes(Size(20, 20), one)));
  // Turned by 90 degrees around y and moved, seen by a camera that is turned and moved likewise.
  PlacedVolume moved[] = {ball};
  moved[0].to_world = {0, 0, 1, 0.5, 0, 1, 0, -0.25, -1, 0, 0, 2, 0, 0, 0, 1};
  const Camera& c = ball.params.camera;
  const Matrix4 back = Inverse(moved[0].to_world);
  moved[0].params.camera = Camera(Product(c.world_to_camera(), back), Product(c.world_to_clip(), back));
  EXPECT_LT(MaxDifference(alone, Render(RenderVolumes(Size(20, 20), moved))), 1e-4);
}

TEST(VolumeScene, SurfacesEndTheRaysOfMedia) {
  PlacedVolume near = Ball(VolumeMode::kIso, 0.4, {0.2, 0, 0.1}),
               far = Ball(VolumeMode::kIso, 0.5, {-0.2, 0, -0.3});
  near.params.material.color = {1, 0, 0};
  const PlacedVolume fog = Slab({0.2, 0.4, 0.9}, 0.8, 0, 0.05);
  const auto picture = [&](const PlacedVolume& v) {
    const PlacedVolume one[] = {v};
    return Render(RenderVolumes(Size(24, 24), one));
  };
  const Image n = picture(near), f = picture(far);
  Image surface(n.spec()), depth(ImageSpec(24, 24, 1));
  for (int i = 0; i < 24 * 24; ++i) {
    const int x = i % 24, y = i / 24;
    const Image& nearest = n.at<float>(x, y, 4) < f.at<float>(x, y, 4) ? n : f;
    for (int c = 0; c < 5; ++c) surface.at<float>(x, y, c) = nearest.at<float>(x, y, c);
    depth.at<float>(x, y) = nearest.at<float>(x, y, 4);
  }
  const PlacedVolume two[] = {far, near};
  EXPECT_LT(MaxDifference(surface, Render(RenderVolumes(Size(24, 24), two))), 1e-4);
  const Image before = Render(RenderVolume(Size(24, 24), fog.volume, fog.params, FromImage(depth)));
  const PlacedVolume all[] = {fog, far, near};
  const Image together = Render(RenderVolumes(Size(24, 24), all));
  for (int i = 0; i < 24 * 24; ++i) {
    for (int c = 0; c < 4; ++c) {
      const double a = before.at<float>(i % 24, i / 24, 3);
      EXPECT_NEAR(together.at<float>(i % 24, i / 24, c),
                  before.at<float>(i % 24, i / 24, c) + (1 - a) * surface.at<float>(i % 24, i / 24, c), 1e-5);
    }
  }
  // The same, one by one; and what stands before everything hides everything.
  Node added = AddVolume(AddVolume(RenderVolumes(Size(24, 24), std::span(all, 1)), far), near);
  ExpectSameBits(together, Render(added));
  Image wall(ImageSpec(24, 24, 1));
  const Image hidden =
      Render(AddVolume(RenderVolume(Size(24, 24), fog.volume, fog.params, FromImage(wall)), near));
  for (int i = 0; i < 24 * 24; ++i) EXPECT_EQ(hidden.at<float>(i % 24, i / 24, 3), 0);
}

// Volumes far before and behind the first are found where they are.
TEST(VolumeScene, DepthsOfVolumesMayDifferWidely) {
  for (const bool perspective : {false, true}) {
    PlacedVolume first = Ball(VolumeMode::kIso, 0.3, {0, 0, 0}),
                 near = Ball(VolumeMode::kIso, 0.3, {0.5, 0, 5}),
                 far = Ball(VolumeMode::kFire, 0.45, {-0.6, 0, -6});
    first.params.camera = perspective ? Camera::Perspective({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 40, 1, 0.1, 40)
                                      : Camera::Parallel({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 2.5, 1, 0.1, 40);
    const PlacedVolume all[] = {first, near, far};
    std::vector<PlacedVolume> walked(std::begin(all), std::end(all));
    for (PlacedVolume& v : walked) v.params.leap = false;
    const Image leaping = Render(RenderVolumes(Size(40, 40), all));
    ExpectSameBits(leaping, Render(RenderVolumes(Size(40, 40), walked)));
    std::array<int, 2> seen = {0, 0};
    for (int i = 0; i < 40 * 40; ++i) {
      seen[0] += leaping.at<float>(i % 40, i / 40, 4) < 6;
      seen[1] +=
          std::isfinite(leaping.at<float>(i % 40, i / 40, 4)) && leaping.at<float>(i % 40, i / 40, 4) > 12;
    }
    EXPECT_GT(seen[0], 20);
    EXPECT_GT(seen[1], 2);
  }
}

TEST(VolumeScene, LeapingTilesAndThreadsChangeNoBitAndTheReferenceAgrees) {
  std::vector<PlacedVolume> scene = {
      Ball(VolumeMode::kFire, 0.4, {-0.3, 0, 0.2}), Ball(VolumeMode::kFur, 0.4, {0.3, -0.1, 0}),
      Ball(VolumeMode::kIso, 0.3, {0, 0.4, -0.2}), Slab({1, 1, 1}, 0.2, 0.5, 0)};
  scene[0].params.camera = OrbitCamera(scene[0].volume, 20, 15, 30, 1, 1.2);
  for (PlacedVolume& v : scene) v.params.termination = 1.0 / 512;
  const Node node = RenderVolumes(Size(40, 36), scene);
  const Image image = Render(node, PixelType::kFloat, {.threads = 1});
  EXPECT_GT(image.at<float>(20, 18, 3), 0.5f);
  EXPECT_TRUE(Verify(node, PixelType::kFloat, {.samples = 3, .tile_size = 8, .render = {}}).within_bound);
  ExpectSameBits(image, Render(node, PixelType::kFloat, {.threads = 2}));
  for (PlacedVolume& v : scene) v.params.leap = false;
  ExpectSameBits(image, Render(RenderVolumes(Size(40, 36), scene)));
  // The mean of shifted pictures, also before opaque objects.
  Image wall(ImageSpec(12, 12, 1));
  for (int i = 0; i < 144; ++i) wall.at<float>(i % 12, i / 12) = std::numeric_limits<float>::infinity();
  ExpectSameBits(Render(RenderVolumes(Size(12, 12), scene, FromImage(wall), 4)),
                 Render(RenderVolumes(Size(12, 12), scene, 4)));
  scene.pop_back();
  const Image many = Render(RenderVolumes(Size(12, 12), scene, 4)),
              one = Render(RenderVolumes(Size(12, 12), scene));
  EXPECT_GT(MaxDifference(many, one), 1e-3);
}

// --volume:... --volume:...:with=1
TEST(VolumeScene, TheCommandAddsToThePictureBelow) {
  const ops::OpInfo& op = *ops::FindOp("volume");
  const auto node = [&](const std::string& words, std::vector<Node> inputs) {
    const ops::Arguments a = ops::ParseExample(op, words);
    EXPECT_EQ(op.operands(a), static_cast<int>(inputs.size()));
    return op.make(inputs, a, nullptr);
  };
  // Steps fine enough that it does not matter where on a ray they lie.
  const std::string ball = "solid=sphere(0,0,0,.4) dims=24 step=.01 ";
  const Node first = node(ball + "size=20x18 mode=fire at=-.4,0,0 fov=0", {});
  const Image both = Render(node(ball + "with=1 mode=fur at=.4,.1,0 turn=30", {first}));
  EXPECT_EQ(both.spec().width(), 20);
  const Image alone = Render(first);
  EXPECT_GT(both.at<float>(14, 8, 3), 0.5f);
  EXPECT_LT(alone.at<float>(14, 8, 3), 0.1f);
  EXPECT_NEAR(both.at<float>(5, 9, 3), alone.at<float>(5, 9, 3), 0.02);
  EXPECT_THROW(node(ball + "with=1 size=20x20", {first}), Error);
  EXPECT_THROW(node(ball + "with=1", {FromImage(alone)}), Error);
}

// Integers keep the distances up to the levels that are drawn.
TEST(VolumeScene, LevelsFarFromTheSurfaceAreKept) {
  const ops::OpInfo& op = *ops::FindOp("volume");
  const auto picture = [&](const std::string& words) {
    return Render(op.make({}, ops::ParseExample(op, words + " dims=32 size=24x24"), nullptr));
  };
  for (const std::string words : {"solid=sphere(0,0,0,.6) mode=hyper soft=0.3",
                                  "solid=sphere(0,0,0,.4) iso=0.26", "solid=sphere(0,0,0,.6) iso=-0.3"}) {
    const Image floats = picture(words + " type=float");
    EXPECT_GT(floats.at<float>(12, 12, 3), 0.5f) << words;
    EXPECT_LT(floats.at<float>(0, 0, 3), 0.5f) << words;
    // Rounded distances move silhouettes by a hair.
    const Image codes = picture(words);
    double sum = 0;
    for (int i = 0; i < 24 * 24; ++i)
      sum += std::fabs(codes.at<float>(i % 24, i / 24, 3) - floats.at<float>(i % 24, i / 24, 3));
    EXPECT_LT(sum / (24 * 24), 0.01) << words;
    EXPECT_THROW(picture(words + " range=0.2"), Error) << words;
  }
  EXPECT_THROW(picture("solid=body file=body.vdb"), Error);
}

// Modes, methods and chains that would be left out of the picture.
TEST(VolumeScene, RefusesWhatItWouldIgnore) {
  const Volume v = DistanceField(Solid::Parse("knot"), VolumeSpec::Centred({16, 16, 16}));
  const auto refused = [&](const std::function<void(VolumeParams&)>& change) {
    VolumeParams p = Ahead(VolumeMode::kUnder);
    p.method = VolumeMethod::kShearWarp;
    change(p);
    EXPECT_THROW(RenderVolume(Size(4, 4), v, p), Error);
  };
  refused([](VolumeParams& p) {
    p.dmf = ParseDmf("bias(.3)"), p.mode = VolumeMode::kIso, p.method = VolumeMethod::kRays;
  });
  refused([](VolumeParams& p) { p.mode = VolumeMode::kIso, p.method = VolumeMethod::kSlices; });
  refused([](VolumeParams& p) { p.mode = VolumeMode::kFur; });
  refused([](VolumeParams& p) { p.mode = VolumeMode::kMip; });
  refused([](VolumeParams& p) { p.classification = Classification::kPre; });
  refused([](VolumeParams& p) { p.shade = true; });
  refused([](VolumeParams& p) { p.depth = true; });
  refused([](VolumeParams& p) { p.planes = {{{0, 0, 1}, 0}}; });
  // Back to front has a depth too.
  VolumeParams p = Ahead(VolumeMode::kOver);
  p.transfer = {{{-0.1, {1, 1, 1}, 0.6}, {0.02, {1, 1, 1}, 0}}, 0.03};
  p.depth = true;
  const Image over = Render(RenderVolume(Size(24, 24), v, p));
  p.mode = VolumeMode::kUnder;
  p.termination = 0;
  ExpectSameBits(over, Render(RenderVolume(Size(24, 24), v, p)));
  float nearest = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 24 * 24; ++i) nearest = std::min(nearest, over.at<float>(i % 24, i / 24, 4));
  EXPECT_LT(nearest, 5);
}

// Words that a mode, a source or another word leaves without a use.
TEST(VolumeScene, WordsWithoutAUseAreRefused) {
  const ops::OpInfo& op = *ops::FindOp("volume");
  const auto message = [&](const std::string& words) {
    try {
      op.make({}, ops::ParseExample(op, words + " dims=8 size=4x4"), nullptr);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  struct Case {
    const char *words, *first, *second;
  };
  for (const Case& c :
       std::initializer_list<Case>{{"solid=knot mode=iso dmf=bias(.3)", "dmf=", "mode=iso"},
                                   {"solid=knot mode=bump dmf=bias(.3)", "dmf=", "mode=bump"},
                                   {"solid=knot mode=melt step=.1", "step=", "mode=melt"},
                                   {"solid=knot mode=mip iso=.1", "iso=", "mode=mip"},
                                   {"solid=knot mode=solid color=1,0,0", "color=", "mode=solid"},
                                   {"solid=knot mode=under specular=.3", "specular=", "shade=1"},
                                   {"solid=knot mode=xray light=0,1,0", "light=", "mode=xray"},
                                   {"solid=knot mode=over transferlength=.3", "transferlength=", "transfer="},
                                   {"solid=knot mode=over method=stacks step=.1", "step=", "method=stacks"},
                                   {"solid=knot mode=fire dmf=lift(.2,1) freq=3", "freq=", "dmf="},
                                   {"solid=knot slices=4", "slices=", "solid="},
                                   {"solid=knot bigendian=1", "bigendian=", "solid="},
                                   {"file=none.raw signed=1", "signed=", "type=uint16"}}) {
    const std::string found = message(c.words);
    EXPECT_NE(found.find(c.first), std::string::npos) << c.words << ": " << found;
    EXPECT_NE(found.find(c.second), std::string::npos) << c.words << ": " << found;
  }
  EXPECT_EQ(message("solid=knot mode=hyper dmf=turbulence(.8,2) lookup=exact shade=1 specular=.2"), "");
  EXPECT_EQ(message("solid=knot mode=mip transfer=-.1,1,1,1,0,.1,1,1,1,1"), "");
}

TEST(VolumeScene, RefusesWhatIsNoScene) {
  const PlacedVolume fog = Slab({1, 1, 1}, 0.2, 0, 0);
  std::vector<PlacedVolume> two = {fog, fog};
  two[1].params.mode = VolumeMode::kMip;
  EXPECT_THROW(RenderVolumes(Size(4, 4), two), Error);
  two[1] = fog;
  two[0].params.method = VolumeMethod::kStacks;
  EXPECT_THROW(RenderVolumes(Size(4, 4), two), Error);
  two[0] = fog;
  two[1].to_world[0] = 2;  // scales
  EXPECT_THROW(RenderVolumes(Size(4, 4), two), Error);
  EXPECT_THROW(RenderVolumes(Size(4, 4), std::vector<PlacedVolume>(9, fog)), Error);
  EXPECT_THROW(RenderVolumes(Size(4, 4), std::vector<PlacedVolume>()), Error);
  EXPECT_THROW(AddVolume(FromImage(Image(Size(4, 4))), fog), Error);
}

}  // namespace
}  // namespace tessera
