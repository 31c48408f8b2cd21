// Every rewrite rule: where it is applied, where it is not, and that the pixels are those without it.
#include "graph/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "support/apply.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::Contains;
using testing::Content;
using testing::ExpectSameBits;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Picture;
using testing::UnifyNans;

using T = PixelType;

// An operation of the registry by its name and an argument line.
Node Apply(const std::string& op, const std::vector<Node>& inputs, const std::string& arguments = "") {
  return testing::Apply({op, arguments}, inputs);
}

// Five blocks wide and a tail, off the origin.
const Roi kWindow{-5, 3, 5 * kBlockPixels + 2, 13};

// Shown as a whole: filters see no black surround.
Image Shown(int channels, T type, uint32_t seed, Content content) {
  const Image picture = Picture(kWindow, channels, type, seed, content);
  ImageSpec spec = picture.spec();
  spec.display_window = kWindow;
  const Image shown(spec);
  std::memcpy(shown.view().data, picture.view().data,
              static_cast<size_t>(kWindow.pixels()) * static_cast<size_t>(picture.view().pixel_stride));
  return shown;
}

Node Source(int channels, T type, uint32_t seed = 1, Content content = Content::kSpecial) {
  return FromImage(Shown(channels, type, seed, content));
}

std::vector<std::string> RulesOf(const Node& node, T type) {
  RunStats stats;
  Render(node, type, {}, &stats);
  return stats.rules;
}

Image Unified(const Node& node, T type, const std::vector<std::string>& off) {
  const Image image = Render(node, type, {.rules_off = off});
  UnifyNans(image);
  return image;
}

// On every target: the rule is among those applied, and switching it or all of them off changes no bit.
void ExpectApplied(const std::string& rule, const Node& node, T type, bool rounds = false) {
  for (const std::string& target : SimdTargets()) {
    SCOPED_TRACE(rule + " on " + target + ", result " + PixelTypeName(type));
    SetSimdTarget(target);
    EXPECT_THAT(RulesOf(node, type), Contains(rule)) << Explain(node, type);
    const std::vector<std::string> rounding = {"codes"};
    const Image plain = Unified(node, type, {"all"});
    ExpectSameBits(Unified(node, type, rounding), plain);
    std::vector<std::string> without = {rule};
    if (!rounds) without.emplace_back("codes");
    const Image off = Unified(node, type, without);
    ExpectSameBits(off, plain);
  }
  SetSimdTarget("auto");
}
void ExpectNotApplied(const std::string& rule, const Node& node, T type) {
  EXPECT_THAT(RulesOf(node, type), Not(Contains(rule))) << Explain(node, type);
  ExpectSameBits(Unified(node, type, {"codes"}), Unified(node, type, {"all"}));
}

constexpr T kTypes[] = {T::kUint8, T::kUint16, T::kHalf, T::kFloat};
const std::string kMatrix = "0.5,0.25,0.25,0.1,0.8,0.1,0.3,0.3,0.4";

TEST(Rules, NamesAreUniqueAndUnknownOnesRefused) {
  std::vector<std::string> names;
  for (const RuleInfo& rule : RewriteRules()) {
    EXPECT_THAT(names, Not(Contains(rule.name)));
    EXPECT_FALSE(rule.help.empty()) << rule.name;
    names.push_back(rule.name);
  }
  try {
    Render(Source(3, T::kFloat), T::kFloat, {.rules_off = {"smaples"}});
    FAIL() << "an unknown rule was taken";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("smaples"));
    EXPECT_THAT(e.what(), HasSubstr("samples"));
  }
}

TEST(Rules, WithAllOffEverythingGoesThroughPlanes) {
  const Node node = Apply("mulc", {Apply("blur", {Source(4, T::kUint8)}, "3x3")}, "0.5");
  RunStats stats;
  Render(node, T::kUint8, {.rules_off = {"all"}}, &stats);
  EXPECT_TRUE(stats.rules.empty());
  const std::string plan = Explain(node, T::kUint8, {.rules_off = {"all"}});
  EXPECT_THAT(plan, Not(HasSubstr("{")));
  EXPECT_THAT(plan, HasSubstr("store result"));
}

// The line that once stored planes as pixels: a tile of floats, an operation that writes the pixels itself.
TEST(Rules, AnOperationBehindATileWritesPixelsOfEveryType) {
  for (const char* const tile : {"blur 3x3", "median 3x3", "resize 1200x9"}) {
    const std::string words = tile;
    const size_t blank = words.find(' ');
    for (const char* const point : {"mulc 0.5", "addc 0.1", "clamp", "invert", "saturate 1.5", "hue 30"}) {
      const std::string then = point;
      const size_t gap = std::min(then.find(' '), then.size());
      const Node node = Apply(then.substr(0, gap),
                              {Apply(words.substr(0, blank), {Source(4, T::kFloat, 3, Content::kOrdinary)},
                                     words.substr(blank + 1))},
                              gap == then.size() ? "" : then.substr(gap + 1));
      for (const T type : kTypes) {
        SCOPED_TRACE(words + ", " + then);
        const Image plain = Unified(node, type, {"all"});
        ExpectSameBits(Unified(node, type, {}), plain);
      }
    }
  }
}

// A tile operation is given the channels that it needs, whatever else is read of the same image.
TEST(Rules, ReadersOfOneImageMayNeedDifferentChannels) {
  for (const T type : {T::kUint8, T::kFloat}) {
    const Node image = Source(3, type, 4, Content::kOrdinary);
    const Image heights = Render(Apply("normalmap", {image}));
    const Node together = Apply("diffuselight", {Apply("normalmap", {image}), image});
    const Node apart = Apply("diffuselight", {FromImage(heights), image});
    for (const auto& off : {std::vector<std::string>{}, {"all"}}) {
      ExpectSameBits(Render(together, T::kFloat, {.tile_width = 100, .tile_height = 3, .rules_off = off}),
                     Render(apart));
    }
  }
}

// An input of one channel goes with each channel of the result, also where the first one is not wanted.
TEST(Rules, OneChannelGoesWithEveryWantedChannel) {
  const Node a = Source(3, T::kFloat, 1, Content::kOrdinary), b = Source(3, T::kFloat, 2, Content::kOrdinary);
  const Node mask = Source(1, T::kFloat, 3, Content::kOrdinary);
  const Node all = Apply("dissolve", {a, b}, "0.5");
  ExpectSameBits(Render(Apply("ch", {all}, "B")), Render(Apply("ch", {FromImage(Render(all))}, "B")));
  const Node added = Apply("add", {a, mask});
  ExpectSameBits(Render(Apply("ch", {added}, "1")), Render(Apply("ch", {FromImage(Render(added))}, "1")));
  const Node tested = Apply("depthtest", {a, b}, "less depth=2");
  ExpectSameBits(Render(Apply("ch", {tested}, "1")), Render(Apply("ch", {FromImage(Render(tested))}, "1")));
}

TEST(Rules, AlphaAmongTheColoursIsRefused) {
  const Node turned = Apply("ch", {Source(4, T::kFloat)}, "R,A,B,G");
  ASSERT_EQ(turned.spec().alpha, 1);
  EXPECT_THROW(Apply("hue", {turned}, "30"), Error);
  EXPECT_NO_THROW(Apply("hue", {Apply("ch", {turned}, "R,G=A,B")}, "30"));
}

// Rows of a file that a tile does not need at all: what is beyond them is black.
TEST(Rules, TilesBeyondAStreamedSourceAreBlack) {
  for (const T type : {T::kUint8, T::kFloat}) {
    const Image small = Picture({0, 0, 7, 3}, 2, type, 9);
    const auto crop = [](const Node& in) { return Apply("crop", {in}, "40x30-5-4"); };
    const Node streamed = crop(graph::MakeSource(std::make_shared<testing::FakeFile>(small)));
    for (const T result : {type, T::kFloat}) {
      const Image want = Render(crop(FromImage(small)), result, {.rules_off = {"all"}});
      for (const int height : {0, 2}) {
        ExpectSameBits(Render(streamed, result, {.tile_height = height}), want);
      }
    }
  }
}

TEST(Rules, JoinsMatricesWithClamps) {
  const std::string clamp = "min=0 max=1";
  Node node = Source(4, T::kFloat);
  for (int i = 0; i < 2; ++i) node = Apply("clamp", {Apply("ccmatrix", {node}, kMatrix)}, clamp);
  for (const T type : kTypes) ExpectApplied("join", node, type);
  ExpectNotApplied("join", Apply("ccmatrix", {Source(4, T::kFloat)}, kMatrix), T::kFloat);
}

TEST(Rules, TileOperationsWorkOnIntegersAsTheyAre) {
  for (const T type : {T::kUint8, T::kUint16}) {
    for (const int channels : {1, 3, 4}) {
      const Node source = Source(channels, type);
      ExpectApplied("typed-window", Apply("median", {source}, "3x3"), type);
      ExpectApplied("typed-window", Apply("blur", {source}, "21x21 kernel=box"), type);
    }
  }
  const Node median = Apply("median", {Source(3, T::kUint8)}, "3x3");
  ExpectNotApplied("typed-window", median, T::kUint16);
  ExpectNotApplied("typed-window", Apply("mulc", {median}, "0.5"), T::kUint8);
  ExpectNotApplied("typed-window", Apply("median", {Apply("mulc", {Source(3, T::kUint8)}, "0.5")}, "3x3"),
                   T::kUint8);
}

TEST(Rules, TilesAreTheSourceOrTheResultWhereTheyMayBe) {
  for (const int channels : {1, 2, 3, 4, 5}) {
    const Node blur = Apply("blur", {Source(channels, T::kFloat)}, "3x3");
    ExpectApplied("source-as-tile", blur, T::kFloat);
    ExpectApplied("tile-in-result", blur, T::kFloat);
    ExpectApplied("source-as-tile", blur, T::kUint8);
  }
  const Node blur = Apply("blur", {Source(4, T::kHalf)}, "3x3");
  ExpectNotApplied("source-as-tile", blur, T::kFloat);
  ExpectNotApplied("tile-in-result", blur, T::kHalf);
}

TEST(Rules, ChannelsThatAreOnlySelectedAreMoved) {
  for (const T type : {T::kUint8, T::kUint16, T::kHalf}) {
    ExpectApplied("move-bytes", Apply("ch", {Source(4, type)}, "B,G,R"), type);
    ExpectApplied("move-bytes", Apply("ch", {Source(3, type)}, "R,G,B,A=0.5"), type);
  }
  ExpectApplied("move-bytes", Apply("ch", {Source(4, T::kFloat)}, "G"), T::kFloat);
  for (const T type : kTypes) ExpectApplied("move-bytes", Source(5, type), type);
  ExpectNotApplied("move-bytes", Source(4, T::kHalf), T::kFloat);
}

TEST(Rules, SamplesThatAreTreatedAlikeStayInRows) {
  for (const T type : kTypes) {
    for (const int channels : {1, 2, 3, 4}) {
      ExpectApplied("samples", Apply("mulc", {Source(channels, type)}, "0.5"), type);
      ExpectApplied("samples", Apply("add", {Source(channels, type), Source(channels, type, 2)}), type);
    }
    ExpectNotApplied("samples", Apply("mulc", {Source(4, type)}, "0.5,0.25,1,1"), type);
    ExpectNotApplied("samples", Apply("mulc", {Source(5, type)}, "0.5"), type);
  }
}

TEST(Rules, OperationsReadAndWriteRgbaThemselves) {
  for (const T type : kTypes) {
    const Node matrix = Apply("ccmatrix", {Source(4, type)}, kMatrix);
    ExpectApplied("load-in-operation", matrix, type);
    ExpectApplied("whole-rows", matrix, type);
    for (const T result : kTypes) {
      ExpectApplied("load-in-operation", matrix, result);
      ExpectApplied("store-in-operation", matrix, result);
    }
    ExpectApplied("all-in-operation", Apply("over", {Source(4, type), Source(4, type, 2)}), type);
  }
  ExpectNotApplied("load-in-operation", Apply("ccmatrix", {Source(3, T::kFloat)}, kMatrix), T::kFloat);
  ExpectNotApplied("all-in-operation", Apply("over", {Source(4, T::kHalf), Source(4, T::kFloat)}), T::kHalf);
}

TEST(Rules, AffineOperationsWorkOnCodesWithinOneOfThem) {
  for (const T type : {T::kUint8, T::kUint16}) {
    const Node node = Apply("ccmatrix", {Source(4, type)}, kMatrix);
    ExpectApplied("codes", node, type, /*rounds=*/true);
    const Image on = Render(node, type), off = Render(node, type, {.rules_off = {"codes"}});
    for (int y = kWindow.y0; y < kWindow.y1; ++y) {
      for (int x = kWindow.x0; x < kWindow.x1; ++x) {
        for (int c = 0; c < 4; ++c) {
          const int a = type == T::kUint8 ? on.at<uint8_t>(x, y, c) : on.at<uint16_t>(x, y, c);
          const int b = type == T::kUint8 ? off.at<uint8_t>(x, y, c) : off.at<uint16_t>(x, y, c);
          ASSERT_LE(std::abs(a - b), 1);
        }
      }
    }
  }
  ExpectNotApplied("codes", Apply("ccmatrix", {Source(4, T::kHalf)}, kMatrix), T::kHalf);
}

TEST(Rules, WholeImagesAreNotCopied) {
  const Node floats = Source(4, T::kFloat, 1, Content::kOrdinary);
  const Node warp = Apply("warp", {floats}, "0.9,0.1,0,-0.1,0.9,0,0,0,1");
  ExpectApplied("source-as-whole", warp, T::kFloat);
  const Node recursive = Apply("blur", {floats}, "sigma=4 method=recursive");
  ExpectApplied("whole-in-result", recursive, T::kFloat);
  ExpectNotApplied("whole-in-result", recursive, T::kHalf);
}

// Pixels that lie otherwise: planar, spread, upside down. Rules that want dense ones stay away.
TEST(Rules, LayoutsDecideOnceAndForAllTiles) {
  const Image dense = Shown(4, T::kUint16, 5, Content::kOrdinary);
  const ptrdiff_t width = kWindow.width(), height = kWindow.height();
  struct Strides {
    ptrdiff_t channel, pixel, row, offset;
  };
  const Strides layouts[] = {
      {2 * width * height, 2, 2 * width, 0},         // planar
      {2, 10, 10 * width, 0},                        // a gap behind every pixel
      {2, 8, -8 * width, 8 * width * (height - 1)},  // bottom up
      {3, 13, 13 * width + 1, 1},                    // odd bytes
  };
  for (const Strides& s : layouts) {
    std::vector<std::byte> memory(static_cast<size_t>(14 * width * height + 64));
    const ImageView view(memory.data() + s.offset, kWindow, 4, T::kUint16, s.channel, s.pixel, s.row);
    for (int y = kWindow.y0; y < kWindow.y1; ++y) {
      for (int x = kWindow.x0; x < kWindow.x1; ++x) {
        for (int c = 0; c < 4; ++c) std::memcpy(view.At(x, y, c), dense.view().At(x, y, c), 2);
      }
    }
    for (const char* const op : {"mulc 0.5", "median 3x3", "blur 21x21 kernel=box", "blur 3x3"}) {
      const std::string words = op;
      const size_t blank = words.find(' ');
      const auto apply = [&](const Node& in) {
        return Apply(words.substr(0, blank), {in}, words.substr(blank + 1));
      };
      const Image want = Render(apply(FromImage(dense)), T::kUint16, {.rules_off = {"all"}});
      ExpectSameBits(Render(apply(FromView(view, dense.spec())), T::kUint16, {.rules_off = {"codes"}}), want);
      std::vector<std::byte> written(memory.size());
      const ImageView out(written.data() + s.offset, kWindow, 4, T::kUint16, s.channel, s.pixel, s.row);
      RenderInto(apply(FromImage(dense)), out, {.tile_width = 77, .tile_height = 4, .rules_off = {"codes"}});
      for (int y = kWindow.y0; y < kWindow.y1; ++y) {
        for (int x = kWindow.x0; x < kWindow.x1; ++x) {
          for (int c = 0; c < 4; ++c) {
            ASSERT_EQ(std::memcmp(out.At(x, y, c), want.view().At(x, y, c), 2), 0)
                << op << " " << x << "," << y;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera
