// Stages that want whole images, stages that make pixels from nothing, and pixels that are used where they
// lie.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>

#include "graph/render.h"
#include "support/test_ops.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/geometry.h"
#include "tessera/prepared_graph.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::BoxSum;
using testing::BoxSumOf;
using testing::DifferenceOf;
using testing::ExpectSameBits;
using testing::FakeFile;
using testing::RandomImage;
using testing::SlowAffine;
using testing::SlowAffineOf;

float& Sample(const ImageView& v, int x, int y, int c) { return *reinterpret_cast<float*>(v.At(x, y, c)); }
float Sample(const ConstImageView& v, int x, int y, int c) {
  return *reinterpret_cast<const float*>(v.At(x, y, c));
}

// Running sums along rows: no part of a row can be had without all that is left of it.
struct RunningSum {
  std::atomic<int>* runs = nullptr;
};
class RunningSumOp final : public graph::OpWith<RunningSum> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-running-sum"; }
  graph::OpKind Kind() const override { return graph::OpKind::kWhole; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext&) const override {
    class Stage final : public graph::WholeStage {
     public:
      explicit Stage(const RunningSum& p) : p_(p) {}
      void Run(std::span<const ConstImageView> in, const ImageView& out,
               const graph::Workers& workers) const override {
        if (p_.runs != nullptr) ++*p_.runs;
        EXPECT_TRUE(graph::IsDenseFloat(in[0]) && graph::IsDenseFloat(out));
        workers.For(out.roi.height(), [&](int64_t i, int worker) {
          EXPECT_LT(worker, workers.count());
          const int y = out.roi.y0 + static_cast<int>(i);
          for (int c = 0; c < out.channels; ++c) {
            float sum = 0;
            for (int x = out.roi.x0; x < out.roi.x1; ++x)
              Sample(out, x, y, c) = sum += Sample(in[0], x, y, c);
          }
        });
      }

     private:
      RunningSum p_;
    };
    return std::make_unique<Stage>(params());
  }
};
Node RunningSumOf(const Node& in, std::atomic<int>* runs = nullptr) {
  return graph::MakeNode(std::make_shared<const RunningSumOp>(RunningSum{runs}), {in});
}

// Input 0 plus the sample of input 1 in the opposite corner, as a tile operation and as a point operation.
struct Opposite {
  graph::OpKind kind = graph::OpKind::kTile;
};
class OppositeOp final : public graph::OpWith<Opposite> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-opposite"; }
  graph::OpKind Kind() const override { return params().kind; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  bool NeedsWhole(int k) const override { return k == 1; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    class Stage final : public graph::TileStage {
     public:
      Roi InputRoi(int k, const Roi& out) const override {
        EXPECT_EQ(k, 0);
        return out;
      }
      void Run(const graph::TileArgs& args) const override {
        const Roi& w = args.in[1].roi;
        for (int y = args.out.roi.y0; y < args.out.roi.y1; ++y) {
          for (int x = args.out.roi.x0; x < args.out.roi.x1; ++x) {
            for (int c = 0; c < args.out.channels; ++c) {
              Sample(args.out, x, y, c) = Sample(args.in[0], x, y, c) +
                                          Sample(args.in[1], w.x0 + w.x1 - 1 - x, w.y0 + w.y1 - 1 - y, c);
            }
          }
        }
      }
    };
    return std::make_unique<Stage>();
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    class Stage final : public graph::PointStage {
     public:
      explicit Stage(const graph::StageContext& c) : table_(c.whole[1]) {
        EXPECT_EQ(c.whole[0].data, nullptr);
        std::copy_n(c.channels, 4, channels_);
      }
      void Run(const graph::PointArgs& a) const override {
        const Roi& w = table_.roi;
        for (int i = 0; i < a.count; ++i) {
          const int x = a.x + a.order[i];
          for (int c = 0; c < 4; ++c) {
            EXPECT_EQ(a.in[1][c][i], 0.0f);
            const bool inside = channels_[c] >= 0 && x < w.x1;  // the block's end may be padding
            const float other =
                inside ? Sample(table_, w.x0 + w.x1 - 1 - x, w.y0 + w.y1 - 1 - a.y, channels_[c]) : 0;
            a.out[c][i] = a.in[0][c][i] + other;
          }
        }
      }

     private:
      ConstImageView table_;
      int channels_[4];
    };
    return std::make_unique<Stage>(context);
  }
};
Node OppositeOf(const Node& a, const Node& b, graph::OpKind kind) {
  return graph::MakeNode(std::make_shared<const OppositeOp>(Opposite{kind}), {a, b});
}

// x + 100 y, made a tile at a time; remembers where it was made.
struct Numbers {
  Roi window;
  std::atomic<const std::byte*>* made_at = nullptr;
};
class NumbersOp final : public graph::OpWith<Numbers> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-numbers"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override {
    ImageSpec spec(1, 1, 1);
    spec.data_window = spec.display_window = params().window;
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    class Stage final : public graph::TileStage {
     public:
      explicit Stage(const Numbers& p) : p_(p) {}
      Roi InputRoi(int, const Roi&) const override { return {}; }
      graph::TileSize Preferred() const override { return {5, 3}; }
      void Run(const graph::TileArgs& args) const override {
        const Roi& o = args.out.roi;
        EXPECT_TRUE(o.width() <= 5 && o.height() <= 3);
        for (int y = o.y0; y < o.y1; ++y) {
          for (int x = o.x0; x < o.x1; ++x) Sample(args.out, x, y, 0) = static_cast<float>(x + 100 * y);
        }
        if (o.x0 == p_.window.x0 && o.y0 == p_.window.y0 && p_.made_at != nullptr)
          *p_.made_at = args.out.data;
      }

     private:
      Numbers p_;
    };
    return std::make_unique<Stage>(params());
  }
};
Node NumbersOf(const Numbers& p) { return graph::MakeNode(std::make_shared<const NumbersOp>(p), {}); }

TEST(Whole, RunningSumsAloneAndInsideAChain) {
  const Image in = RandomImage({-3, 2, 64, 31}, 3, 7);
  const Image sums = Render(RunningSumOf(FromImage(in)));
  for (int y = 2; y < 31; ++y) {
    for (int c = 0; c < 3; ++c) {
      float sum = 0;
      for (int x = -3; x < 64; ++x) ASSERT_EQ(sums.at<float>(x, y, c), sum += in.at<float>(x, y, c));
    }
  }
  const SlowAffine half{0.5f, 0.25f};
  const Node chain = BoxSumOf(SlowAffineOf(RunningSumOf(SlowAffineOf(FromImage(in), half)), half), {2, 1});
  const Image eager = Render(BoxSumOf(
      SlowAffineOf(FromImage(Render(RunningSumOf(FromImage(Render(SlowAffineOf(FromImage(in), half)))))),
                   half),
      {2, 1}));
  for (const int threads : {1, 2, 3}) {
    RenderOptions o;
    o.threads = threads, o.tile_width = 17, o.tile_height = 5, o.shuffle_tiles = threads == 3;
    ExpectSameBits(Render(chain, PixelType::kFloat, o), eager);
  }
}

TEST(Whole, SharedResultIsComputedOnceAndFilesAreRead) {
  std::atomic<int> runs = 0;
  const Image in = RandomImage({0, 0, 40, 30}, 4, 8);
  const Node file = graph::MakeSource(std::make_shared<const FakeFile>(in));
  const Node sums = RunningSumOf(file, &runs);
  const Image got = Render(DifferenceOf(BoxSumOf(sums, {1, 1}), sums));
  EXPECT_EQ(runs, 1);
  const Node eager = FromImage(Render(RunningSumOf(FromImage(in))));
  ExpectSameBits(got, Render(DifferenceOf(BoxSumOf(eager, {1, 1}), eager)));
}

TEST(Whole, ResultGoesStraightToTheCallersFloatsOrThroughConversion) {
  const Image in = RandomImage({0, 0, 33, 9}, 4, 9);
  const Image want = Render(RunningSumOf(FromImage(in)));
  const Image half = Render(RunningSumOf(FromImage(in)), PixelType::kHalf);
  ExpectSameBits(half, Render(FromImage(want), PixelType::kHalf));
  const Image part{[&] {
    ImageSpec spec = in.spec();
    spec.data_window = {5, 2, 20, 7};
    return spec;
  }()};
  RenderInto(RunningSumOf(FromImage(in)), part.view());
  for (int x = 5; x < 20; ++x) EXPECT_EQ(part.at<float>(x, 4, 2), want.at<float>(x, 4, 2));
}

TEST(Whole, InputsWantedWholeByTilesAndPoints) {
  const Image a = RandomImage({1, 1, 50, 20}, 4, 1), b = RandomImage({1, 1, 50, 20}, 4, 2);
  const SlowAffine twice{2, 0};
  for (const graph::OpKind kind : {graph::OpKind::kTile, graph::OpKind::kChannel}) {
    // The whole input is a computed one, a source of its own, and the same node as the other input.
    const Image got =
        Render(OppositeOf(SlowAffineOf(FromImage(a), twice), SlowAffineOf(FromImage(b), twice), kind));
    const Node shared = SlowAffineOf(FromImage(a), twice);
    const Image self = Render(OppositeOf(shared, shared, kind));
    for (int y = 1; y < 20; ++y) {
      for (int x = 1; x < 50; ++x) {
        for (int c = 0; c < 4; ++c) {
          ASSERT_EQ(got.at<float>(x, y, c), 2 * a.at<float>(x, y, c) + 2 * b.at<float>(50 - x, 20 - y, c));
          ASSERT_EQ(self.at<float>(x, y, c), 2 * a.at<float>(x, y, c) + 2 * a.at<float>(50 - x, 20 - y, c));
        }
      }
    }
  }
}

TEST(Whole, PlansAreExplainedWithoutRunning) {
  std::atomic<int> runs = 0;
  const Image in = RandomImage({0, 0, 8, 8}, 4, 3);
  const Node sums = RunningSumOf(FromImage(in), &runs);
  const std::string text = Explain(OppositeOf(sums, sums, graph::OpKind::kTile));
  EXPECT_EQ(runs, 0);
  EXPECT_NE(text.find("test-running-sum on the whole image"), std::string::npos) << text;
  EXPECT_NE(text.find("all of input 1 of test-opposite"), std::string::npos) << text;
}

TEST(Whole, GeneratedTilesLieInTheCallersPixels) {
  std::atomic<const std::byte*> made_at = nullptr;
  const Roi window{-2, 3, 61, 29};
  const Node numbers = NumbersOf({window, &made_at});
  ImageSpec spec = numbers.spec();
  const Image out(spec);
  RenderInto(numbers, out.view());
  EXPECT_EQ(made_at, out.view().data);
  for (int y = 3; y < 29; ++y) {
    for (int x = -2; x < 61; ++x) ASSERT_EQ(out.at<float>(x, y), static_cast<float>(x + 100 * y));
  }
  spec.type = PixelType::kHalf;
  const Image half(spec);
  RenderInto(numbers, half.view());
  EXPECT_NE(made_at, half.view().data);
}

// A budget that whole images do not fit into: rows in, rows out, the same bits.
TEST(WholeTest, RowsGiveTheBitsOfWholeImages) {
  for (const Roi& window : {Roi{0, 0, 150, 97}, Roi{-7, 5, 30, 6}, Roi{3, 3, 4, 90}, Roi{0, 0, 1, 1}}) {
    for (const int channels : {1, 3, 4, 6}) {
      for (const Wrap wrap : {Wrap::kClamp, Wrap::kBlack}) {
        for (const bool special : {false, true}) {
          SCOPED_TRACE(std::to_string(window.width()) + "x" + std::to_string(window.height()) + " " +
                       std::to_string(channels) + " " + std::to_string(static_cast<int>(wrap)) +
                       (special ? " with NaN" : ""));
          const Image image = RandomImage(window, channels, 7);
          if (special) Sample(image.view(), window.x0, window.y1 - 1, channels - 1) = std::nanf("");
          const Node source = FromImage(image);
          const Node blurred = GaussianBlur(source, {17, 23, wrap, 0.25});
          // Whole, of some channels, from the bottom to the top, and of what is blurred already.
          const Node nodes[] = {blurred,
                                SelectChannels(blurred, std::vector<ChannelChoice>{{channels - 1, 0, {}}}),
                                Zoom(blurred, {.x = 1, .y = -1}), GaussianBlur(blurred, {16, 16})};
          for (const Node& node : nodes) {
            const Image whole = Render(node);
            ExpectSameBits(whole, Render(node, PixelType::kFloat, {.memory_budget = 1}));
            ExpectSameBits(whole, Render(node, PixelType::kFloat,
                                         {.threads = 1, .memory_budget = 1, .rules_off = {"all"}}));
          }
          RenderOptions little;
          little.memory_budget = 1;
          const PreparedGraph prepared(blurred, little);
          const Image again = Image::Uninitialized(blurred.spec());
          prepared.RenderInto(again.view());
          ExpectSameBits(Render(blurred), again);
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera
