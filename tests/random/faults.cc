// What may be wrong with an operation or with how the engine runs it.
#include "random/faults.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "graph/op.h"
#include "random/samples.h"
#include "reference/reference.h"
#include "support/pictures.h"
#include "tessera/targets.h"

namespace tessera::random {
namespace {

enum class Wrong {
  kNone,
  kLastOfBlock,  // the last pixel of a block
  kLoad,         // pixels read from halves, swapped
  kStore,        // planes stored as bytes in place of pixels
  kSamples,      // its way through samples
  kOfSamples,    // what that way leads to
  kThen,         // joined with itself
  kThreads,      // another result on other threads
  kOrder,        // counts its blocks
  kTarget,       // another result with AVX2
  kReference,    // half a percent too large
  kInPlace,      // reads a pixel that it may have written
  kTileCorner,   // a tile stage that knows where its tile begins
  kTileHalo,     // a tile stage that reads beyond what it asked for
  kTileBytes,    // a tile stage that rounds bytes down
  kTileBeyond,   // a tile stage that writes behind its rows
  kTileInput,    // a tile stage that looks at how much it was given
};

struct Params {
  Wrong kind = Wrong::kNone;
};

float Half(float v) { return 0.5f * v; }

// v -> v / 2, but for the fault.
class PointFault final : public graph::PointStage {
 public:
  explicit PointFault(Wrong kind) : kind_(kind), maker_(std::this_thread::get_id()) {}
  bool CanFuse(bool load, PixelType type) const override {
    if (kind_ == Wrong::kLoad) return load && type == PixelType::kHalf;
    if (kind_ == Wrong::kStore) return !load && type == PixelType::kUint8;
    if (kind_ == Wrong::kInPlace) return type == PixelType::kFloat;
    if (kind_ == Wrong::kOfSamples) return true;
    return false;
  }
  bool AnyLength() const override { return kind_ == Wrong::kOfSamples; }
  std::unique_ptr<graph::PointStage> OfSamples(int) const override {
    if (kind_ != Wrong::kSamples) return nullptr;
    return std::make_unique<PointFault>(Wrong::kOfSamples);
  }
  std::unique_ptr<graph::PointStage> Then(const graph::PointStage& next) const override {
    if (kind_ != Wrong::kThen || dynamic_cast<const PointFault*>(&next) == nullptr) return nullptr;
    return std::make_unique<PointFault>(Wrong::kNone);  // once where twice was meant
  }
  void Run(const graph::PointArgs& a) const override {
    float factor = 0.5f;
    if (kind_ == Wrong::kReference || kind_ == Wrong::kOfSamples) factor = 0.5025f;
    if (kind_ == Wrong::kThreads) {
      const bool other = std::this_thread::get_id() != maker_;
      if (other) factor = 0.25f;
      // Leaves some of the work to others.
      if (!other) std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    if (kind_ == Wrong::kTarget && SimdTarget() == "AVX2") factor = 0.50000006f;
    if (kind_ == Wrong::kOrder) factor = blocks_++ % 3 == 0 ? 0.5f : 0.25f;
    float first[4] = {};
    for (int i = 0; i < a.count; ++i) {
      float r[4];
      for (int c = 0; c < 4; ++c) {
        float v = a.source.read == nullptr ? a.in[0][c][i] : 0;
        if (a.source.read != nullptr) {
          const int from = kind_ == Wrong::kLoad ? i ^ 1 : i;
          const ConstImageView view(a.source.read, {0, 0, 4 * a.count, 1}, 1, a.source.type);
          v = static_cast<float>(SampleAt(view, 4 * from + c, 0, 0));
          // The first pixel is read once more, and may have been overwritten.
          const auto again = static_cast<float>(SampleAt(view, c, 0, 0));
          if (i == 0) first[c] = again;
          if (kind_ == Wrong::kInPlace && again != first[c]) v = 0;
        }
        r[c] = factor * v;
        if (kind_ == Wrong::kLastOfBlock && i + 1 == a.count) r[c] = v;
      }
      Store(a, i, r);
    }
  }

 private:
  void Store(const graph::PointArgs& a, int i, const float (&r)[4]) const {
    for (int c = 0; c < 4; ++c) {
      if (a.sink.write == nullptr) {
        a.out[c][i] = r[c];
        continue;
      }
      const int at = kind_ == Wrong::kStore ? c * a.count + i : 4 * i + c;
      const ImageView view(a.sink.write, {0, 0, 4 * (a.count + 1), 1}, 1, a.sink.type);
      testing::StoreSample(view, at, 0, 0, r[c]);
    }
  }

  Wrong kind_;
  std::thread::id maker_;
  mutable std::atomic<int> blocks_{0};
};

class TileFault final : public graph::TileStage {
 public:
  explicit TileFault(Wrong kind) : kind_(kind) {}
  Roi InputRoi(int, const Roi& out) const override { return out; }
  bool Accepts(PixelType type) const override {
    return type == PixelType::kFloat || (kind_ == Wrong::kTileBytes && type == PixelType::kUint8);
  }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    if (kind_ == Wrong::kTileBeyond && o.height() > 2) {
      const float one = 1;
      std::memcpy(args.out.At(o.x1, o.y0 + 1), &one, sizeof one);
    }
    for (int y = o.y0; y < o.y1; ++y) {
      for (int x = o.x0; x < o.x1; ++x) {
        for (int c = 0; c < args.out.channels; ++c) {
          const std::byte* const from = args.in[0].At(x, y, c);
          if (args.out.type == PixelType::kUint8) {
            *args.out.At(x, y, c) = *from >> 1;
            continue;
          }
          float v = Half(*reinterpret_cast<const float*>(from));
          if (kind_ == Wrong::kTileCorner && x == o.x0 && y == o.y0) v = 0.75f;
          if (kind_ == Wrong::kTileHalo && x + 1 == o.x1)
            v = Half(*reinterpret_cast<const float*>(from + args.in[0].pixel_stride));
          if (kind_ == Wrong::kTileInput && o.height() < 3) v *= 0.5f;
          *reinterpret_cast<float*>(args.out.At(x, y, c)) = v;
        }
      }
    }
  }

 private:
  Wrong kind_;
};

bool IsTile(Wrong kind) { return kind >= Wrong::kTileCorner; }

class FaultOp final : public graph::OpWith<Params> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return IsTile(params().kind) ? "fault-tile" : "fault-point"; }
  graph::OpKind Kind() const override {
    return IsTile(params().kind) ? graph::OpKind::kTile : graph::OpKind::kChannel;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return std::make_unique<PointFault>(params().kind);
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<TileFault>(params().kind);
  }
};

template <Wrong kWrong>
Fault Row(const char* name, std::vector<Check> found_by) {
  ops::OpInfo op;
  op.name = name;
  op.family = "fault";
  op.bound_u = 1;
  op.make = [](std::span<const Node> in, const ops::Arguments&, const ImageSpec*) {
    return graph::MakeNode(std::make_shared<const FaultOp>(Params{kWrong}), {in[0]});
  };
  op.examples = {""};
  return {op, std::move(found_by)};
}

void Halved(const reference::Call& call) {
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    call.out.samples[i] = 0.5 * call.in[0].samples[i];
    if (call.scale != nullptr) call.scale->samples[i] = std::fabs(call.out.samples[i]);
  }
}

}  // namespace

const std::vector<Fault>& Faults() {
  static const std::vector<Fault> faults = [] {
    reference::Register({.op = "fault-point", .evaluate = Halved});
    reference::Register({.op = "fault-tile", .evaluate = Halved});
    // Whatever depends on tiles shows in several ways; which one is met first is chance.
    const std::vector<Check> ways = {Check::kTiles,  Check::kThreads, Check::kShuffle,   Check::kPixels,
                                     Check::kStream, Check::kRules,   Check::kReference, Check::kVerify,
                                     Check::kEager,  Check::kTypes,   Check::kPlain,     Check::kEachRule};
    return std::vector<Fault>{
        Row<Wrong::kLastOfBlock>("last-of-block",
                                 {Check::kTiles, Check::kRules, Check::kTypes, Check::kThreads}),
        Row<Wrong::kLoad>("load", {Check::kRules}),
        Row<Wrong::kStore>("store", {Check::kRules}),
        Row<Wrong::kSamples>("samples", {Check::kRules, Check::kEager}),
        Row<Wrong::kThen>("then", {Check::kRules}),
        Row<Wrong::kThreads>("threads", {Check::kThreads, Check::kStream}),
        Row<Wrong::kOrder>("order", {Check::kTiles, Check::kShuffle, Check::kTypes, Check::kThreads}),
        Row<Wrong::kTarget>("target", {Check::kTargets}),
        Row<Wrong::kReference>("reference", {Check::kReference, Check::kPlain, Check::kVerify}),
        Row<Wrong::kInPlace>("in-place", {Check::kRules, Check::kEachRule, Check::kInPlace, Check::kStream}),
        Row<Wrong::kTileCorner>("tile-corner", ways),
        Row<Wrong::kTileHalo>("tile-halo", ways),
        Row<Wrong::kTileBytes>("tile-bytes", {Check::kRules}),
        Row<Wrong::kTileBeyond>("tile-beyond", ways),
        Row<Wrong::kTileInput>("tile-input", ways),
    };
  }();
  return faults;
}

const ops::OpInfo& Faultless() {
  static const Fault row = (Faults(), Row<Wrong::kNone>("faultless", {}));
  return row.op;
}

}  // namespace tessera::random
