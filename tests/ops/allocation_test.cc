// What happens per tile and per block: nothing takes memory from the heap, and no stage asks for an
// instruction set, because it chose its kernels when it was made. Every example of the registry is rendered:
// with each of its stages watched, and as it is, with a look at the heap after every tile.
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <atomic>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "base/arena.h"
#include "graph/op.h"
#include "graph/topology.h"
#include "ops/filter/fft/fft.h"
#include "ops/registry.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "support/watched_new.h"
#include "tessera/context.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace {

// Of this thread, while it is counting.
thread_local bool counting = false;
thread_local int64_t allocations = 0;
// Of all threads, since the program began.
std::atomic<int64_t> all_allocations{0};

}  // namespace

static void WatchAllocation() {
  if (counting) ++allocations;
  all_allocations.fetch_add(1, std::memory_order_relaxed);
}

namespace tessera {
namespace {

// What the stages of one graph did while they ran.
struct Tally {
  int64_t runs = 0, allocations = 0, dispatches = 0;
};

// Counts what happens while it lives.
class Watch {
 public:
  explicit Watch(Tally& tally) : tally_(tally) {
    ++tally_.runs;
    // The next dispatch would choose anew.
    hwy::GetChosenTarget().DeInit();
    allocations = 0;
    counting = true;
  }
  ~Watch() {
    counting = false;
    tally_.allocations += allocations;
    if (hwy::GetChosenTarget().IsInitialized()) ++tally_.dispatches;
    SetSimdTarget("auto");
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  Tally& tally_;
};

class WatchedPoint final : public graph::PointStage {
 public:
  WatchedPoint(std::unique_ptr<graph::PointStage> stage, Tally& tally)
      : stage_(std::move(stage)), tally_(tally) {}
  void Run(const graph::PointArgs& args) const override {
    const Watch watch(tally_);
    stage_->Run(args);
  }
  bool CanFuse(bool load, PixelType type) const override { return stage_->CanFuse(load, type); }
  bool CanFuseAll(PixelType type) const override { return stage_->CanFuseAll(type); }
  std::unique_ptr<graph::PointStage> OfSamples(int channels) const override {
    return Watched(stage_->OfSamples(channels));
  }
  std::unique_ptr<graph::PointStage> Then(const graph::PointStage& next) const override {
    const auto* const watched = dynamic_cast<const WatchedPoint*>(&next);
    return watched == nullptr ? nullptr : Watched(stage_->Then(*watched->stage_));
  }

 private:
  std::unique_ptr<graph::PointStage> Watched(std::unique_ptr<graph::PointStage> stage) const {
    return stage == nullptr ? nullptr : std::make_unique<WatchedPoint>(std::move(stage), tally_);
  }

  std::unique_ptr<graph::PointStage> stage_;
  Tally& tally_;
};

class WatchedTile final : public graph::TileStage {
 public:
  WatchedTile(std::unique_ptr<graph::TileStage> stage, Tally& tally)
      : stage_(std::move(stage)), tally_(tally) {}
  Roi InputRoi(int k, const Roi& out) const override { return stage_->InputRoi(k, out); }
  Wrap InputBorder(int k) const override { return stage_->InputBorder(k); }
  graph::TileSize Preferred() const override { return stage_->Preferred(); }
  graph::TileSize PreferredAlone() const override { return stage_->PreferredAlone(); }
  bool Accepts(PixelType type) const override { return stage_->Accepts(type); }
  void Run(const graph::TileArgs& args) const override {
    // The worker's memory grows until it fits the largest tile, and then serves all.
    base::Arena arena(Context::Default());
    const graph::TileArgs own{args.in, args.out, args.stream, arena, args.channels, args.in_channels};
    stage_->Run(own);
    arena.Reset();
    const Watch watch(tally_);
    stage_->Run(own);
  }

 private:
  std::unique_ptr<graph::TileStage> stage_;
  Tally& tally_;
};

// Another operation whose stages are watched.
class WatchedOp final : public graph::Op {
 public:
  WatchedOp(std::shared_ptr<const Op> op, Tally& tally) : op_(std::move(op)), tally_(tally) {}
  std::string Name() const override { return op_->Name(); }
  graph::OpKind Kind() const override { return op_->Kind(); }
  const std::any& Parameters() const override { return op_->Parameters(); }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return op_->OutputSpec(inputs); }
  bool NeedsWhole(int k) const override { return op_->NeedsWhole(k); }
  bool ReadsAlpha() const override { return op_->ReadsAlpha(); }
  bool WritesAlpha() const override { return op_->WritesAlpha(); }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return std::make_unique<WatchedPoint>(op_->MakePointStage(context), tally_);
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<WatchedTile>(op_->MakeTileStage(context), tally_);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return op_->MakeWholeStage(context);
  }
  std::vector<bool> NeededChannels(int input, const std::vector<bool>& result,
                                   const ImageSpec& in) const override {
    return op_->NeededChannels(input, result, in);
  }
  std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec> inputs) const override {
    return op_->ChannelMap(inputs);
  }

 private:
  std::shared_ptr<const Op> op_;
  Tally& tally_;
};

// The same graph with its point and tile stages watched; sources are what they are. A node with several
// readers stays one: as a tree, what is made of itself a few times over would be planned for hours.
Node Watched(const Node& root, Tally& tally) {
  return graph::Rewrite(root, [&tally](const Node& node, const Node&) {
    const graph::NodeData& data = *node.data();
    if (data.op->Kind() == graph::OpKind::kSource) return node;
    return graph::MakeNode(std::make_shared<const WatchedOp>(data.op, tally), data.inputs);
  });
}

constexpr Roi kWindow{-5, 3, 91, 67};  // 96 x 64
const RenderOptions kManyTiles{.threads = 1, .tile_width = 24, .tile_height = 16};

Tally TallyOf(const Node& node, PixelType type) {
  Tally tally;
  Render(Watched(node, tally), type, kManyTiles);
  return tally;
}

struct Case {
  const ops::OpInfo* op;
  std::string example;

  Node On(int channels, PixelType type, const Roi& window = kWindow) const {
    const ops::Arguments arguments = ops::ParseExample(*op, example);
    std::vector<Node> inputs;
    for (int k = 0; k < op->Operands(arguments); ++k) {
      inputs.push_back(
          FromImage(testing::Picture(window, channels, type, 7u * static_cast<uint32_t>(k) + 1)));
    }
    const ImageSpec spec = testing::Picture(window, channels, type, 0).spec();
    return op->make(inputs, arguments, op->generator ? &spec : nullptr);
  }
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.op->name << " " << c.example; }

std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) cases.push_back({&op, example});
  }
  return cases;
}

std::string CaseName(const ::testing::TestParamInfo<Case>& info) {
  std::string name = info.param.op->name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}

class EveryStage : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Registry, EveryStage, ::testing::ValuesIn(AllCases()), CaseName);

TEST_P(EveryStage, TakesNoMemoryAndAsksForNoTargetPerTile) {
  for (const int channels : {3, 4, 6}) {
    for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kFloat}) {
      SCOPED_TRACE(std::to_string(channels) + " channels of " + PixelTypeName(type));
      const Tally tally = TallyOf(GetParam().On(channels, type), type);
      EXPECT_EQ(tally.allocations, 0) << "in " << tally.runs << " runs";
      EXPECT_EQ(tally.dispatches, 0) << "in " << tally.runs << " runs";
    }
  }
}

// What the heap had given after each tile of a rendering's last pass, on one thread.
class TileLog {
 public:
  explicit TileLog(const Node& node, PixelType type, int width, int height) {
    const Roi& window = node.spec().data_window;
    const int columns = (window.width() + width - 1) / width, rows = (window.height() + height - 1) / height;
    after_.resize(static_cast<size_t>(std::max(1, columns * rows)));
    RenderOptions options{.threads = 1, .tile_width = width, .tile_height = height};
    options.progress = [this](double share) {
      // The same share again says that time has passed; passes before the last are overwritten.
      if (share > last_share_) after_[calls_++ % after_.size()] = all_allocations;
      last_share_ = share;
      return true;
    };
    Render(node, type, options);
  }
  size_t tiles() const { return std::min(calls_, after_.size()); }
  // How many tiles after the first took memory.
  int Takers() const {
    int takers = 0;
    for (size_t i = calls_ - tiles() + 1; i < calls_; ++i)
      takers += after_[i % after_.size()] != after_[(i - 1) % after_.size()] ? 1 : 0;
    return takers;
  }

 private:
  std::vector<int64_t> after_;
  size_t calls_ = 0;
  double last_share_ = -1;
};

constexpr Roi kLarge{-5, 3, 187, 131};  // 8 x 16 tiles
// A worker's memory doubles where a tile needs more than all before it, at an edge or at another level of a
// chain, and is made one piece with the next tile. Few tiles can be such ones, far fewer than there are rows.
constexpr int kMostGrowths = 6;

TEST_P(EveryStage, TilesAfterTheFirstTakeNoMemory) {
  for (const int channels : {3, 4}) {
    for (const PixelType type : {PixelType::kUint8, PixelType::kFloat}) {
      SCOPED_TRACE(std::to_string(channels) + " channels of " + PixelTypeName(type));
      const TileLog log(GetParam().On(channels, type, kLarge), type, 24, 8);
      EXPECT_LE(log.Takers(), kMostGrowths) << "of " << log.tiles() << " tiles";
    }
  }
}

// Does to its input what the parameter says, once per tile, and nothing else.
struct Fault {
  bool allocates = false, dispatches = false;
};
class FaultyOp final : public graph::OpWith<Fault> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-faulty"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    class Stage final : public graph::TileStage {
     public:
      explicit Stage(const Fault& fault) : fault_(fault) {}
      Roi InputRoi(int, const Roi& out) const override { return out; }
      void Run(const graph::TileArgs& args) const override {
        std::vector<float> row;
        if (fault_.allocates) row.resize(static_cast<size_t>(args.out.roi.width()), 0.5f);
        const bool known = !fault_.dispatches || ops::ChooseFft().channel != nullptr;
        for (int y = args.out.roi.y0; y < args.out.roi.y1; ++y) {
          for (int x = args.out.roi.x0; x < args.out.roi.x1; ++x) {
            auto* const to = reinterpret_cast<float*>(args.out.At(x, y));
            std::fill_n(to, args.out.channels, known && row.empty() ? 0.0f : 1.0f);
          }
        }
      }

     private:
      Fault fault_;
    };
    return std::make_unique<Stage>(params());
  }
};
Node Faulty(const Fault& fault) {
  const Node in = FromImage(testing::RandomImage(kWindow, 4, 1));
  return graph::MakeNode(std::make_shared<const FaultyOp>(fault), {in});
}

TEST(AllocationTest, WhatIsDonePerTileIsSeen) {
  constexpr PixelType kType = PixelType::kFloat;
  const Tally good = TallyOf(Faulty({}), kType);
  EXPECT_EQ(good.runs, 16);
  EXPECT_EQ(good.allocations, 0);
  EXPECT_EQ(good.dispatches, 0);
  const Tally allocates = TallyOf(Faulty({.allocates = true}), kType);
  EXPECT_EQ(allocates.allocations, 16);
  EXPECT_EQ(allocates.dispatches, 0);
  const Tally dispatches = TallyOf(Faulty({.dispatches = true}), kType);
  EXPECT_EQ(dispatches.allocations, 0);
  EXPECT_EQ(dispatches.dispatches, 16);
  EXPECT_EQ(TileLog(Faulty({}), kType, 24, 16).Takers(), 0);
  const TileLog log(Faulty({.allocates = true}), kType, 24, 16);
  EXPECT_EQ(log.tiles(), 16u);
  EXPECT_EQ(log.Takers(), 15);
}

}  // namespace
}  // namespace tessera
