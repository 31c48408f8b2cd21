// The bound plan: once the pixels' layouts are known, a list of steps over named buffers that a worker
// carries out for any region without a question. Rules (rules.h) rewrite the list; bits do not depend on
// them.
#ifndef TESSERA_GRAPH_PROGRAM_H_
#define TESSERA_GRAPH_PROGRAM_H_

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "graph/plan.h"
#include "simd/pixels.h"
#include "tessera/image.h"

namespace tessera::graph {

class RuleSet;

// What is known of a buffer's pixels before any of them is there.
struct Layout {
  PixelType type = PixelType::kFloat;
  int channels = 0;
  ptrdiff_t channel_stride = 0, pixel_stride = 0;  // bytes
  bool aligned = true;                             // every sample lies at a multiple of its size
  bool ascending = true;                           // a row begins behind the end of the one before
  int first = 0;                                   // of a source: the source's channel that is channel 0 here

  bool operator==(const Layout&) const = default;
  static Layout Of(const ConstImageView& view);
  static Layout Packed(PixelType type, int channels, int first = 0);
  // Of that type, channels side by side, pixels too.
  bool IsDense(PixelType of) const;
  // Pixels of four samples side by side.
  bool IsRgba() const;
};

// Which pixels: the plan's buffers by their index, the last being the result; after them its sources.
using BufferId = int;

// Loads up to four channels of a block into planes.
struct LoadOp {
  BufferId from = 0;
  std::array<int, 4> channel = {-1, -1, -1, -1};  // of the layout; -1: plane unused
  std::array<PlaneId, 4> plane = {};
};

// Runs a stage on a block of planes, or on pixels where it says so.
struct ComputeOp {
  const PointStage* stage = nullptr;
  std::string label;
  std::vector<std::array<PlaneId, 4>> in;
  std::array<PlaneId, 4> out = {};
  static constexpr size_t kMostDirect = 3;
  std::array<BufferId, kMostDirect> direct = {-1, -1, -1};  // whose pixels an input reads itself
  bool to_result = false;                                   // writes the step's pixels itself
  bool codes = false;                                       // PointArgs::codes

  bool IsDirect(size_t input) const { return input < kMostDirect && direct[input] >= 0; }
};
using BlockOp = std::variant<LoadOp, ComputeOp>;

// Point operations block by block, then a store of every channel.
struct Points {
  std::vector<BlockOp> ops;
  std::vector<ConstantPlane> constants;
  std::vector<PlaneId> result;  // plane of every stored channel; empty where an op writes the result itself
  int planes = kFirstFreePlane;
  bool whole_rows = false;  // one op from pixels to pixels: rows are not cut into blocks
};

// Rows of samples, all treated alike, four of which are a pixel to the stage.
struct Samples {
  const PointStage* stage = nullptr;
  std::string label;
  std::vector<BufferId> in;
  bool codes = false;
};

// Bytes moved: every byte of a result's pixel is a copy of an input's, or a constant.
struct ByteMoves {
  std::vector<BufferId> in;
  simd::Moves moves;
  bool same = false;  // pixels of the one input as they are
};

// A tile stage: regions of its inputs, extended at the image's edge, to a region.
struct Window {
  const TileStep* planned = nullptr;
  struct Input {
    BufferId pixels = -1;  // -1: wanted whole, in `planned`
    int tile = -1;         // the plan's buffer that says which region
  };
  std::vector<Input> in;
  PixelType type = PixelType::kFloat;  // of inputs and result
};

struct Step {
  int made = 0;     // the plan's buffer that it makes
  BufferId to = 0;  // whose pixels it writes: that buffer's own, or the result's
  std::variant<Points, Samples, ByteMoves, Window> how;
  std::vector<std::string> rules;  // that were applied, by name
};

class Program {
 public:
  // `sources`, `result`: the layouts of all pixels that will ever be given to it. The plan must outlive it.
  Program(const Plan& plan, std::span<const Layout> sources, const Layout& result, const RuleSet& rules);

  const Plan& plan() const { return *plan_; }
  BufferId result() const { return static_cast<BufferId>(plan_->buffers.size()) - 1; }
  BufferId source(int k) const { return result() + 1 + k; }
  bool IsSource(BufferId id) const { return id > result(); }
  const Layout& layout(BufferId id) const { return layouts_[static_cast<size_t>(id)]; }
  // A single tile stage from the sources' own pixels to the result's.
  bool IsOneWindow() const;
  // The plan's buffers that need memory of their own.
  bool IsTile(int buffer) const;
  // Names of the rules that were applied, each once.
  std::vector<std::string> AppliedRules() const;

  std::vector<Step> steps;                                // rules change it
  std::vector<std::unique_ptr<const PointStage>> stages;  // made by rules

 private:
  const Plan* plan_;
  std::vector<Layout> layouts_;
};

// Where a step hands on all channels of one buffer, in order, that buffer; else -1.
BufferId OnlyCopies(const Program& program, const Step& step);
// How often every plane is read, stores included.
std::vector<int> PlaneReaders(const Points& points);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PROGRAM_H_
