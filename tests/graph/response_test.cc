// How soon evaluations answer: progress and cancellation in preparations, whole images and windows; prepared
// graphs.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/ops/color.h"
#include "tessera/ops/filter.h"
#include "tessera/prepared_graph.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::ExpectSameBits;
using testing::RandomImage;
using testing::SlowAffineOf;
using Clock = std::chrono::steady_clock;

double Since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }
void Sleep(int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); }

// Takes its time somewhere: where a stage is made, in tasks for whole images, or in tiles, of which there are
// 256 of one pixel.
enum class Where { kMaking, kWhole, kTile };
class SleepyOp final : public graph::OpWith<Where> {
 public:
  SleepyOp(Where where, int naps) : OpWith(where), naps_(naps) {}
  std::string Name() const override { return "test-sleepy"; }
  graph::OpKind Kind() const override {
    return params() == Where::kWhole ? graph::OpKind::kWhole : graph::OpKind::kTile;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    if (params() == Where::kMaking) context.workers.For(naps_, [](int64_t, int) { Sleep(5); });
    class Stage final : public graph::TileStage {
     public:
      explicit Stage(int naps) : naps_(naps) {}
      Roi InputRoi(int, const Roi& out) const override { return out; }
      void Run(const graph::TileArgs&) const override {
        for (int k = 0; k < naps_; ++k) Sleep(5);
      }

     private:
      int naps_;
    };
    return std::make_unique<Stage>(params() == Where::kTile ? naps_ / 256 + 1 : 0);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext&) const override {
    class Stage final : public graph::WholeStage {
     public:
      explicit Stage(int naps) : naps_(naps) {}
      void Run(std::span<const ConstImageView>, const ImageView&,
               const graph::Workers& workers) const override {
        workers.For(naps_, [](int64_t, int) { Sleep(5); });
      }

     private:
      int naps_;
    };
    return std::make_unique<Stage>(naps_);
  }

 private:
  int naps_;
};
Node Sleepy(const Node& input, Where where, int naps) {
  return graph::MakeNode(std::make_shared<const SleepyOp>(where, naps), {input});
}

TEST(ResponseTest, ProgressIsCalledSoonAndOftenWhereverTimeIsSpent) {
  const Image in = RandomImage({0, 0, 16, 16}, 4, 1);
  for (const Where where : {Where::kMaking, Where::kWhole, Where::kTile}) {
    for (const int threads : {1, 2}) {
      RenderOptions options{.threads = threads, .tile_width = 1, .tile_height = 1};
      int calls = 0;
      double last = 0;
      options.progress = [&](double share) {
        EXPECT_GE(share, last);
        EXPECT_LE(share, 1);
        last = share;
        ++calls;
        return true;
      };
      Render(Sleepy(FromImage(in), where, 100), PixelType::kFloat, options);
      // Half a second, or a quarter on two threads; twenty-five calls are a second on a machine with time.
      EXPECT_GE(calls, 3) << static_cast<int>(where) << ", " << threads;
      EXPECT_EQ(last, 1.0);
    }
  }
}

TEST(ResponseTest, CancelsSoonWhereverTimeIsSpent) {
  const Image in = RandomImage({0, 0, 16, 16}, 4, 1);
  for (const Where where : {Where::kMaking, Where::kWhole, Where::kTile}) {
    const Clock::time_point start = Clock::now();
    EXPECT_THROW(Render(Sleepy(FromImage(in), where, 4000), PixelType::kFloat,
                        {.tile_width = 1, .tile_height = 1, .progress = [](double) { return false; }}),
                 Cancelled);
    EXPECT_LT(Since(start), 5) << static_cast<int>(where);  // of ten or twenty seconds
  }
}

TEST(ResponseTest, WhatTheCallbackThrowsComesOut) {
  const Image in = RandomImage({0, 0, 16, 16}, 4, 1);
  for (const Where where : {Where::kMaking, Where::kWhole, Where::kTile}) {
    const auto thrower = [](double) -> bool { throw std::domain_error("mine"); };
    EXPECT_THROW(Render(Sleepy(FromImage(in), where, 4000), PixelType::kFloat,
                        {.tile_width = 1, .tile_height = 1, .progress = thrower}),
                 std::domain_error);
  }
}

TEST(PreparedGraphTest, RegionsAreThoseOfTheWhole) {
  const Image in = RandomImage({-3, 5, 120, 90}, 4, 2);
  const Node source = FromImage(in);
  const Node graphs[] = {Contrast(Saturate(source, 1.5), 1.2),
                         GaussianBlur(SlowAffineOf(source, {2, 1}), 9.0),
                         Median(GaussianBlur(source, 20.0), {.width = 3, .height = 3})};
  for (const Node& node : graphs) {
    const Image whole = Render(node);
    const PreparedGraph prepared(node);
    EXPECT_EQ(prepared.spec().data_window, node.spec().data_window);
    std::vector<std::thread> threads;
    const Image result(whole.spec());
    for (int t = 0; t < 3; ++t) {
      threads.emplace_back([&, t] {
        for (int y = 5 + 17 * t; y < 90; y += 51) {
          for (int x = -3; x < 120; x += 31) prepared.RenderInto(result.view().Sub({x, y, x + 31, y + 17}));
        }
      });
    }
    for (std::thread& t : threads) t.join();
    ExpectSameBits(result, whole);
  }
}

TEST(PreparedGraphTest, EveryLayoutAndTypeAsRenderInto) {
  const Image in = RandomImage({0, 0, 70, 40}, 4, 3);
  const Node node = RotateHue(GaussianBlur(FromImage(in), 2.0), Degrees(60));
  const PreparedGraph prepared(node);
  for (const PixelType type : {PixelType::kUint8, PixelType::kHalf, PixelType::kFloat, PixelType::kUint8}) {
    ImageSpec spec = node.spec();
    spec.type = type;
    const Image a(spec), b(spec);
    RenderInto(node, a.view());
    prepared.RenderInto(b.view());
    ExpectSameBits(a, b);
  }
}

TEST(PreparedGraphTest, WhatIsWantedWholeIsComputedOnce) {
  const Image in = RandomImage({0, 0, 32, 32}, 4, 1);
  const PreparedGraph prepared(Sleepy(FromImage(in), Where::kWhole, 20));
  const Image out(in.spec());
  const Clock::time_point start = Clock::now();
  for (int k = 0; k < 20; ++k) prepared.RenderInto(out.view().Sub({k, 0, k + 8, 8}));
  EXPECT_LT(Since(start), 0.9);  // each would take a twentieth of a second and more
}

TEST(PreparedGraphTest, PreparationReportsAndCancelsAndThenIsSilent) {
  const Image in = RandomImage({0, 0, 16, 16}, 4, 1);
  for (const Where where : {Where::kMaking, Where::kWhole}) {
    std::atomic<int> calls = 0;
    std::atomic<double> last = 0;
    const auto count = [&](double share) {
      ++calls;
      last = share;
      return true;
    };
    const PreparedGraph prepared(Sleepy(FromImage(in), where, 60), {.threads = 1, .progress = count});
    EXPECT_GE(calls, 2) << static_cast<int>(where);
    EXPECT_EQ(last, 1.0);
    const int until_ready = calls;
    prepared.RenderInto(Image(in.spec()).view());
    Sleep(150);
    EXPECT_EQ(calls, until_ready) << static_cast<int>(where);
    const Clock::time_point start = Clock::now();
    EXPECT_THROW(
        PreparedGraph(Sleepy(FromImage(in), where, 4000), {.progress = [](double) { return false; }}),
        Cancelled);
    EXPECT_LT(Since(start), 5) << static_cast<int>(where);
  }
}

TEST(PreparedGraphTest, RefusesWhatRenderIntoRefuses) {
  const Image in = RandomImage({0, 0, 32, 32}, 4, 1);
  const PreparedGraph prepared(FromImage(in));
  EXPECT_THROW(prepared.RenderInto(Image(ImageSpec(33, 32, 4)).view()), Error);
  EXPECT_THROW(prepared.RenderInto(Image(ImageSpec(32, 32, 3)).view()), Error);
  EXPECT_THROW(PreparedGraph{Node()}, Error);
  EXPECT_THROW(prepared.RenderInto(Image(in.spec()).view(), [](double) { return false; }), Cancelled);
}

}  // namespace
}  // namespace tessera
