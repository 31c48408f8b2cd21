// The framebuffer's rules, outlines, halos, brushes and sprites.
#include "tessera/ops/framebuffer.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "support/composite.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/outline.h"

namespace tessera::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Roi kWindow{0, 0, 16, 8};

Image Flat(const Roi& window, const std::array<float, 4>& color) {
  ImageSpec spec(window.width(), window.height(), 4);
  spec.data_window = spec.display_window = window;
  const Image image(spec);
  for (int64_t i = 0; i < window.pixels(); ++i) std::memcpy(image.view().data + 16 * i, color.data(), 16);
  return image;
}
Fragments Paint(const std::array<float, 4>& color, float z = 0, const Roi& window = kWindow) {
  return {.color = FromImage(Flat(window, color)), .z = z};
}
std::vector<float> PixelOf(const Image& image, int x, int y) {
  std::vector<float> v;
  for (int c = 0; c < image.spec().channel_count(); ++c) v.push_back(image.at<float>(x, y, c));
  return v;
}

TEST(FramebufferTest, TestsInOrder) {
  Framebuffer f(kWindow);
  f.ClearColor({0, 0, 1, 1});
  EXPECT_EQ(f.Draw(Paint({1, 0, 0, 1}, 0.5f), {.scissor = Roi{2, 1, 6, 3}, .depth_test = true}), 8);
  EXPECT_THAT(PixelOf(f.color(), 2, 1), ElementsAre(1, 0, 0, 1));
  EXPECT_THAT(PixelOf(f.color(), 6, 1), ElementsAre(0, 0, 1, 1));
  EXPECT_EQ(f.depth().at<float>(2, 1), 0.5f);
  // Equal depth fails LESS; farther too; the far plane never overwrites.
  EXPECT_EQ(f.Draw(Paint({0, 1, 0, 1}, 0.5f), {.scissor = Roi{2, 1, 6, 3}, .depth_test = true}), 0);
  EXPECT_EQ(f.Draw(Paint({0, 1, 0, 1}, 1), {.depth_test = true}), 0);
  // Without the test depth is not written.
  EXPECT_EQ(f.Draw(Paint({0, 1, 0, 1}, 0.1f)), 128);
  EXPECT_EQ(f.depth().at<float>(2, 1), 0.5f);
  // Alpha test before everything that writes; colour mask.
  EXPECT_EQ(f.Draw(Paint({9, 9, 9, 0}), {.alpha_test = {Comparison::kNotEqual, 0}}), 0);
  f.Draw(Paint({0.5f, 0.5f, 0.5f, 0.5f}), {.color_mask = {false, true, false, false}});
  EXPECT_THAT(PixelOf(f.color(), 9, 7), ElementsAre(0, 0.5f, 0, 1));
}

TEST(FramebufferTest, StencilCountsAndSaturates) {
  Framebuffer f(kWindow, PixelType::kUint8);
  DrawState count;
  count.stencil_test = true;
  count.stencil.on_pass = StencilAction::kIncrement;
  count.color_mask = {false, false, false, false};
  for (int i = 0; i < 300; ++i) f.Draw(Paint({1, 1, 1, 1}, 0, {0, 0, i < 3 ? 16 : 4, 8}), count);
  EXPECT_EQ(f.stencil().at<uint8_t>(3, 3), 255);
  EXPECT_EQ(f.stencil().at<uint8_t>(4, 3), 3);
  // Fail, depth fail and pass have their own actions; the write mask keeps bits.
  f.ClearStencil(0xF0);
  DrawState s;
  s.stencil_test = s.depth_test = true;
  s.stencil = {Comparison::kAlways, 0x0A, 255, 0x0F, StencilAction::kZero, StencilAction::kReplace};
  s.on_depth_fail = StencilAction::kInvert;
  f.Draw(Paint({1, 1, 1, 1}, 0.5f, {0, 0, 8, 8}), s);
  f.Draw(Paint({1, 1, 1, 1}, 1), s);
  EXPECT_EQ(f.stencil().at<uint8_t>(2, 2), 0xF5);   // replaced by A, then its low bits inverted
  EXPECT_EQ(f.stencil().at<uint8_t>(12, 2), 0xFF);  // depth failed: low bits inverted
}

TEST(FramebufferTest, EveryComparisonIsIncomingAgainstStored) {
  // Less, equal, greater: whether a test passes.
  const std::array<std::array<bool, 3>, 8> passes = {{{false, false, false},
                                                      {true, false, false},
                                                      {false, true, false},
                                                      {true, true, false},
                                                      {false, false, true},
                                                      {true, false, true},
                                                      {false, true, true},
                                                      {true, true, true}}};
  const std::array<Comparison, 8> tests = {
      Comparison::kNever,   Comparison::kLess,     Comparison::kEqual,          Comparison::kLessOrEqual,
      Comparison::kGreater, Comparison::kNotEqual, Comparison::kGreaterOrEqual, Comparison::kAlways};
  const std::array<float, 3> incoming = {0.25f, 0.5f, 0.75f};
  for (size_t t = 0; t < tests.size(); ++t) {
    for (size_t i = 0; i < incoming.size(); ++i) {
      Framebuffer f(kWindow);
      f.ClearDepth(0.5f);
      f.ClearStencil(2);
      const int64_t all = passes[t][i] ? kWindow.pixels() : 0;
      const Fragments fragments = Paint({1, 1, 1, incoming[i]}, incoming[i]);
      EXPECT_EQ(f.Draw(fragments, {.depth_test = true, .depth_function = tests[t], .depth_write = false}),
                all);
      EXPECT_EQ(f.Draw(fragments, {.alpha_test = {tests[t], 0.5f}}), all);
      DrawState stencil{.stencil_test = true};
      stencil.stencil.test = tests[t], stencil.stencil.reference = static_cast<int>(i) + 1;
      EXPECT_EQ(f.Draw(fragments, stencil), all) << t << " " << i;
    }
  }
}

TEST(FramebufferTest, EveryActionOnAStencil) {
  struct Expected {
    StencilAction action;
    std::array<int, 3> after;  // of 0, 100, 255
  };
  for (const auto& [action, after] : {Expected{StencilAction::kKeep, {0, 100, 255}},
                                      {StencilAction::kZero, {0, 0, 0}},
                                      {StencilAction::kReplace, {7, 7, 7}},
                                      {StencilAction::kIncrement, {1, 101, 255}},
                                      {StencilAction::kDecrement, {0, 99, 254}},
                                      {StencilAction::kInvert, {255, 155, 0}},
                                      {StencilAction::kIncrementWrap, {1, 101, 0}},
                                      {StencilAction::kDecrementWrap, {255, 99, 254}}}) {
    for (size_t i = 0; i < 3; ++i) {
      Framebuffer f(kWindow);
      f.ClearStencil(std::array<uint8_t, 3>{0, 100, 255}[i]);
      DrawState state{.stencil_test = true};
      state.stencil = {Comparison::kAlways, 7, 255, 255, StencilAction::kKeep, action};
      f.Draw(Paint({1, 1, 1, 1}), state);
      EXPECT_EQ(f.stencil().at<uint8_t>(5, 5), after[i]) << static_cast<int>(action);
    }
  }
}

TEST(FramebufferTest, DepthsAreScaledAndThenMoved) {
  Framebuffer f(kWindow);
  Fragments fragments = Paint({1, 1, 1, 1}, 0.5f);
  fragments.depth_scale = 0.5f, fragments.depth_bias = 0.125f;
  EXPECT_EQ(f.Draw(fragments, {.depth_test = true}), kWindow.pixels());
  EXPECT_EQ(f.depth().at<float>(3, 3), 0.375f);
  EXPECT_EQ(f.Draw(Paint({0, 0, 0, 1}, 0.375f), {.depth_test = true}), 0);
}

TEST(FramebufferTest, StippleDrawsTheOnes) {
  Framebuffer f(kWindow);
  std::array<uint32_t, 32> rows{};
  rows.fill(0x0000000Fu);
  EXPECT_EQ(f.Draw(Paint({1, 1, 1, 1}), {.stipple = rows}), 4 * 8);
  EXPECT_EQ(f.color().at<float>(3, 0, 0), 1);
  EXPECT_EQ(f.color().at<float>(4, 0, 0), 0);
}

TEST(FramebufferTest, BytesSaturateAndStall) {
  Framebuffer f(kWindow, PixelType::kUint8);
  f.Draw(Paint({2, -1, 0.5f, 1}));
  EXPECT_EQ(f.color().at<uint8_t>(0, 0, 0), 255);
  EXPECT_EQ(f.color().at<uint8_t>(0, 0, 1), 0);
  EXPECT_EQ(f.color().at<uint8_t>(0, 0, 2), 128);
  // 256 dabs of alpha 0.0015: 8 bits lose every one of them, floats do not.
  Framebuffer wide(kWindow);
  f.ClearColor({0, 0, 0, 0});
  const DrawState state{.blend = true, .blending = {.mode = BlendMode::kStraightOver}};
  for (int i = 0; i < 256; ++i)
    f.Draw(Paint({1, 1, 1, 0.0015f}), state), wide.Draw(Paint({1, 1, 1, 0.0015f}), state);
  EXPECT_EQ(f.color().at<uint8_t>(0, 0, 0), 0);
  EXPECT_NEAR(wide.color().at<float>(0, 0, 0), 1 - std::pow(1 - 0.0015, 256), 1e-5);
}

TEST(FramebufferTest, TwoPassDepthCompositeEqualsOnePass) {
  const Image depth = Flat({0, 0, 16, 8}, {0, 0, 0, 0});
  std::mt19937 random(3);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) depth.at<float>(x, y, 0) = static_cast<float>(random() % 5) / 4;
  }
  const Node z = SelectChannels(FromImage(depth), "R");
  Fragments second = Paint({0, 1, 0, 1});
  second.depth = z;
  Framebuffer one(kWindow), two(kWindow);
  for (Framebuffer* f : {&one, &two}) f->Draw(Paint({1, 0, 0, 1}, 0.5f), {.depth_test = true});
  one.Draw(second, {.depth_test = true});
  DrawState mark;
  mark.depth_test = mark.stencil_test = true;
  mark.color_mask = {false, false, false, false};
  mark.stencil = {Comparison::kAlways, 1, 255, 255, StencilAction::kKeep, StencilAction::kReplace};
  two.Draw(second, mark);
  DrawState paint;
  paint.stencil_test = true;
  paint.stencil = {Comparison::kEqual, 1, 255, 255, StencilAction::kKeep, StencilAction::kKeep};
  two.Draw(second, paint);
  EXPECT_EQ(LargestDifference(one.color(), two.color()), 0);
  EXPECT_EQ(LargestDifference(one.depth(), two.depth()), 0);
}

TEST(FramebufferTest, DecalsByPriority) {
  // Decal k covers the columns whose bit k is set; the base passes its depth test in the upper half.
  Framebuffer f(kWindow);
  f.Draw(Paint({0, 0, 1, 1}, 0.2f, {0, 4, 16, 8}), {.depth_test = true});
  std::vector<Fragments> decals;
  for (int k = 0; k < 4; ++k) {
    const Image cover(ImageSpec(16, 8, 1));
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 16; ++x) cover.at<float>(x, y) = static_cast<float>(x >> k & 1);
    }
    Fragments d = Paint({static_cast<float>(k + 1), 0, 0, 1});
    d.coverage = FromImage(cover);
    decals.push_back(d);
  }
  DrawDecals(f, Paint({0.5f, 0, 0, 1}, 0.4f), decals);
  for (int x = 0; x < 16; ++x) {
    float want = 0.5f;
    for (int k = 3; k >= 0; --k) {
      if (x >> k & 1) want = static_cast<float>(k + 1);
    }
    EXPECT_EQ(f.color().at<float>(x, 1, 0), want) << x;
    EXPECT_THAT(PixelOf(f.color(), x, 5), ElementsAre(0, 0, 1, 1)) << x;
  }
  // The source's mask of 0 compares 0 with 0: nothing is drawn.
  DrawState state;
  state.stencil_test = true;
  state.stencil = {Comparison::kLess, 1, 0, 255, StencilAction::kKeep, StencilAction::kKeep};
  EXPECT_EQ(f.Draw(Paint({1, 1, 1, 1}), state), 0);
}

TEST(FramebufferTest, DissolveAndAccumulation) {
  const Image pattern(ImageSpec(16, 8, 1));
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 8; ++y) pattern.at<float>(x, y) = static_cast<float>(x) / 16;
  }
  Framebuffer f(kWindow);
  for (const float t : {0.0f, 0.25f, 1.0f}) {
    f.ClearColor({0, 0, 0, 1});
    DrawDissolve(f, Paint({1, 1, 1, 1}), FromImage(pattern), t);
    for (int x = 0; x < 16; ++x)
      EXPECT_EQ(f.color().at<float>(x, 3, 0), static_cast<float>(x) / 16 < t ? 1 : 0);
  }
  using Op = Framebuffer::AccumulationOp;
  f.ClearColor({0.25f, 0, 0, 1});
  f.Accumulate(Op::kLoad, 0.5);
  f.ClearColor({0.75f, 1, 4, 1});
  f.Accumulate(Op::kAccumulate, 0.5);
  f.Accumulate(Op::kReturn, 1);
  EXPECT_THAT(PixelOf(f.color(), 0, 0), ElementsAre(0.5f, 0.5f, 2, 1));
  f.Accumulate(Op::kAdd, 0.5);
  f.Accumulate(Op::kMultiply, 2);
  f.Accumulate(Op::kReturn, 1);
  EXPECT_THAT(PixelOf(f.color(), 0, 0), ElementsAre(2, 2, 5, 3));
}

TEST(FramebufferTest, Refusals) {
  EXPECT_THAT(Refusal([] { Framebuffer f(Roi{}); }), HasSubstr("empty window"));
  Framebuffer f(kWindow);
  Fragments bad = Paint({1, 1, 1, 1});
  bad.color = SelectChannels(bad.color, "R,G,B");
  EXPECT_THAT(Refusal([&] { f.Draw(bad); }), HasSubstr("expected R,G,B,A"));
}

Image Mask(const std::vector<std::string>& rows) {
  const Image image(ImageSpec(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()), 1));
  for (size_t y = 0; y < rows.size(); ++y) {
    for (size_t x = 0; x < rows[y].size(); ++x) {
      image.at<float>(static_cast<int>(x), static_cast<int>(y)) = rows[y][x] == '#' ? 1.0f : 0.0f;
    }
  }
  return image;
}
std::vector<std::string> Drawn(const Node& node) {
  const Image image = Render(node);
  std::vector<std::string> rows;
  for (int y = 0; y < image.spec().height(); ++y) {
    rows.emplace_back();
    for (int x = 0; x < image.spec().width(); ++x) rows.back() += image.at<float>(x, y) > 0 ? '#' : '.';
  }
  return rows;
}

TEST(OutlineTest, SquareConcaveCornerAndThinLines) {
  const Image square = Mask({".......", ".#####.", ".#####.", ".#####.", ".#####.", ".#####.", "......."});
  EXPECT_THAT(Drawn(Outline(FromImage(square))),
              ElementsAre(".......", ".#####.", ".#...#.", ".#...#.", ".#...#.", ".#####.", "......."));
  EXPECT_THAT(Drawn(Outline(FromImage(square), {.kind = OutlineKind::kOuter})),
              ElementsAre(".#####.", "#.....#", "#.....#", "#.....#", "#.....#", "#.....#", ".#####."));
  const Image counts = Render(Outline(FromImage(square), {.kind = OutlineKind::kCount}));
  EXPECT_EQ(counts.at<float>(1, 1), 0.5f);
  EXPECT_EQ(counts.at<float>(2, 1), 0.75f);
  EXPECT_EQ(counts.at<float>(3, 3), 1.0f);
  EXPECT_EQ(counts.at<float>(2, 0), 0.25f);
  // An outside pixel in a concave corner is no part of the inner line; isolated pixels and line ends are.
  const Image odd = Mask({"#....", "#....", "###..", "....#", "....."});
  EXPECT_THAT(Drawn(Outline(FromImage(odd))), ElementsAre("#....", "#....", "###..", "....#", "....."));
  // At the image's border.
  EXPECT_THAT(Drawn(Outline(FromImage(Mask({"###", "###", "###"})))), ElementsAre("###", "#.#", "###"));
  EXPECT_THAT(Drawn(Outline(FromImage(Mask({"###", "###", "###"})), {.clamp = true})),
              ElementsAre("...", "...", "..."));
}

TEST(EdgesTest, PlanesGiveNothingStepsALine) {
  const Image depth(ImageSpec(32, 24, 1));
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      // A floor seen at a slant: 1/z is affine on the screen.
      depth.at<float>(x, y) = static_cast<float>(1 / (0.02 + 0.013 * x + 0.04 * y));
    }
  }
  EXPECT_THAT(Values(Edges({.depth = FromImage(depth)}, {.depth_tolerance = 1e-5})), ::testing::Each(0.0f));
  for (int y = 0; y < 24; ++y) {
    for (int x = 16; x < 32; ++x) depth.at<float>(x, y) *= 0.5f;
  }
  const Image step = Render(Edges({.depth = FromImage(depth)}));
  for (int x = 0; x < 32; ++x) EXPECT_EQ(step.at<float>(x, 12), x == 15 || x == 16 ? 1 : 0) << x;
}

TEST(EdgesTest, NormalsAndIds) {
  ImageSpec spec(6, 1, 3);
  const Image normals(spec);
  const float rows[6][3] = {
      {0, 0, 1},   {0, 0, 2}, {0, 0.5f, 0.8660254f}, {0, 0.5f, 0.8660254f}, {0, 0.5f, 0.8660254f},
      {kNaN, 0, 1}};
  for (int x = 0; x < 6; ++x) {
    for (int c = 0; c < 3; ++c) normals.at<float>(x, 0, c) = rows[x][c];
  }
  // 30 degrees between the second and the third.
  EXPECT_THAT(Values(Edges({.normal = FromImage(normals)}, {.normal_degrees = 29})),
              ElementsAre(0, 1, 1, 0, 1, 0));
  EXPECT_THAT(Values(Edges({.normal = FromImage(normals)}, {.normal_degrees = 31})),
              ElementsAre(0, 0, 0, 0, 1, 0));
  const Node id = FromImage(Row({"id"}, {7, 7, 8, 8, 8, 7}));
  EXPECT_THAT(Values(Edges({.id = id})), ElementsAre(0, 1, 1, 0, 1, 1));
  EXPECT_THAT(Refusal([] { Edges({}); }), HasSubstr("neither depth nor normals nor ids"));
}

// A disc in front of nothing: nothing has no lines of its own, however it is said.
TEST(EdgesTest, BackgroundIsLeftAlone) {
  for (const float nothing : {0.0f, kNaN, kInf}) {
    const Image depth(ImageSpec(40, 40, 1)), normals(ImageSpec(40, 40, 3));
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        const bool disc = std::hypot(x - 20, y - 20) < 12;
        depth.at<float>(x, y) = disc ? 3.0f : nothing;
        for (int c = 0; c < 3; ++c) normals.at<float>(x, y, c) = disc && c == 2 ? 1.0f : 0.0f;
      }
    }
    for (const EdgeInputs& inputs :
         {EdgeInputs{.depth = FromImage(depth)}, EdgeInputs{.normal = FromImage(normals)},
          EdgeInputs{.depth = FromImage(depth), .normal = FromImage(normals)}}) {
      const Image lines = Render(Edges(inputs));
      int on = 0;
      for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 40; ++x) {
          const double r = std::hypot(x - 20, y - 20);
          on += lines.at<float>(x, y) == 1 ? 1 : 0;
          if (r >= 12 || r < 10) EXPECT_EQ(lines.at<float>(x, y), 0) << x << ' ' << y << ' ' << nothing;
        }
      }
      EXPECT_GT(on, 60);
    }
  }
}

// Lines of one pixel: across a boundary at any angle the coverages add up to one pixel's width, and they are
// near those of the band itself.
TEST(EdgesTest, SmoothLinesAreOnePixelWide) {
  constexpr int kSide = 96;
  for (const double degrees : {0.0, 10.0, 27.0, 45.0, 71.0, 90.0}) {
    const double c = std::cos(degrees * std::numbers::pi / 180),
                 s = std::sin(degrees * std::numbers::pi / 180);
    const auto at = [&](double x, double y) { return (x - 47.5) * c + (y - 47.5) * s - 0.21; };
    const Image id(ImageSpec(kSide, kSide, 1));
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) id.at<float>(x, y) = at(x, y) < 0 ? 1.0f : 2.0f;
    }
    const Image lines = Render(Edges({.id = FromImage(id)}, {.smooth = true}));
    double sum = 0, length = 0, squares = 0;
    int64_t near = 0;
    for (int y = 8; y < kSide - 8; ++y) {
      for (int x = 8; x < kSide - 8; ++x) {
        const double d = std::fabs(at(x, y)), tent = std::max(1 - d, 0.0);
        sum += lines.at<float>(x, y), length += tent;
        if (d < 2.5) squares += std::pow(lines.at<float>(x, y) - tent, 2), ++near;
        if (d > 2) EXPECT_EQ(lines.at<float>(x, y), 0) << x << ' ' << y;
      }
    }
    EXPECT_NEAR(sum / length, 1, 0.08) << degrees;
    EXPECT_LT(std::sqrt(squares / static_cast<double>(near)), 0.17) << degrees;
  }
}

TEST(HaloTest, CrossingLinesLeaveAGapInTheFarOne) {
  const Image lines(ImageSpec(31, 31, 1)), depth(ImageSpec(31, 31, 1));
  for (int i = 0; i < 31; ++i) {
    lines.at<float>(i, 15) = lines.at<float>(15, i) = 1;
    depth.at<float>(i, 15) = 2;  // across, far
  }
  for (int i = 0; i < 31; ++i) depth.at<float>(15, i) = 1;
  const Image kept = Render(Halo(FromImage(lines), FromImage(depth), {.radius = 4}));
  for (int i = 0; i < 31; ++i) {
    EXPECT_EQ(kept.at<float>(15, i), 1) << i;
    EXPECT_EQ(kept.at<float>(i, 15), std::abs(i - 15) <= 4 && i != 15 ? 0 : 1) << i;
  }
  // A slanted line erases itself when epsilon is below radius times its slope, and stays when it is not.
  for (int i = 0; i < 31; ++i)
    depth.at<float>(i, 15) = 0.1f * static_cast<float>(i), lines.at<float>(15, i) = i == 15 ? 1 : 0;
  depth.at<float>(15, 15) = 1.5f;
  EXPECT_EQ(Render(Halo(FromImage(lines), FromImage(depth), {.radius = 3, .epsilon = 0.2})).at<float>(20, 15),
            0);
  EXPECT_EQ(
      Render(Halo(FromImage(lines), FromImage(depth), {.radius = 3, .epsilon = 0.31})).at<float>(20, 15), 1);
}

TEST(BrushTest, DabsAndStrokes) {
  const ImageSpec spec(21, 9, 1);
  const Dab dab{10.5, 4.5, 4, 0.25, 0};
  const Image many = Render(AirbrushMask(spec, std::vector<Dab>(7, dab)));
  EXPECT_NEAR(many.at<float>(10, 4), 1 - std::pow(0.75, 7), 1e-6);
  EXPECT_EQ(many.at<float>(0, 0), 0);
  const std::vector<Dab> stroke = Stroke({{0, 0}, {10, 0}, {10, 5}}, 4, dab);
  ASSERT_EQ(stroke.size(), 4u);
  EXPECT_DOUBLE_EQ(stroke[2].x, 8);
  EXPECT_DOUBLE_EQ(stroke[3].x, 10);  // two of four pixels were left over: the corner does not restart
  EXPECT_DOUBLE_EQ(stroke[3].y, 2);
  EXPECT_THAT(Refusal([&] { AirbrushMask(spec, {{.opacity = 2}}); }), HasSubstr("opacity in [0, 1]"));
}

TEST(SpriteTest, PuffsFadeAndGrow) {
  PuffParams p;
  p.time = 3;
  const std::vector<Sprite> puffs = Puffs(p);
  EXPECT_EQ(puffs.size(), 50u);
  for (size_t i = 1; i < puffs.size(); ++i) {
    EXPECT_LT(puffs[i].depth, puffs[i - 1].depth);
    EXPECT_LT(puffs[i].radius, puffs[i - 1].radius);
    EXPECT_GT(puffs[i].alpha, puffs[i - 1].alpha);
  }
  p.interval = 1e-6;
  EXPECT_THROW(Puffs(p), Error);
  // The far one is hidden where the near one is opaque; both are premultiplied.
  const Image image =
      Render(Sprites(ImageSpec(9, 9, 4), {{4.5, 4.5, 4, 1, 1, 0, 0, 1}, {4.5, 4.5, 4, 0.5, 0, 1, 0, 5}}));
  EXPECT_THAT(PixelOf(image, 4, 4), ElementsAre(1, 0, 0, 1));
  const LightPoint near = AttenuatedLight(8, 1, 1, 0, 0, 2), far = AttenuatedLight(8, 8, 0, 0, 1, 2);
  EXPECT_EQ(near.size, 8);
  EXPECT_EQ(far.size, 2);
  EXPECT_EQ(far.alpha, 0.25);
}

}  // namespace
}  // namespace tessera::testing
