// The plan: a graph after optimisation as a flat list of steps over tiles. It says what is computed from
// what; how, once the pixels' layouts are known, is what binding decides (program.h).
#ifndef TESSERA_GRAPH_PLAN_H_
#define TESSERA_GRAPH_PLAN_H_

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "base/stage.h"
#include "graph/op.h"
#include "graph/source.h"
#include "tessera/node.h"

namespace tessera::graph {

// Which pixels: the plan's sources by their index, after them its buffers, of which the last is the result.
using BufferId = int;

// A float plane of one block inside a run. A plan numbers them freely; binding (program.h) gives them places.
using PlaneId = int;
inline constexpr PlaneId kZeroPlane = 0, kOnePlane = 1, kDummyPlane = 2, kFirstFreePlane = 3;

constexpr size_t Z(int i) { return static_cast<size_t>(i); }

// Loads up to four channels of a block into planes.
struct LoadOp {
  BufferId from = 0;
  std::array<int, 4> channel = {-1, -1, -1, -1};  // of the pixels; -1: plane unused
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

// A plane that holds one value, beside kZeroPlane and kOnePlane.
struct ConstantPlane {
  PlaneId plane = 0;
  float value = 0;
};

// Point operations block by block, then a store of every channel.
struct Points {
  std::vector<BlockOp> ops;  // in order of execution
  std::vector<ConstantPlane> constants;
  std::vector<PlaneId> result;   // plane of every stored channel; empty where an op writes the result itself
  int planes = kFirstFreePlane;  // numbered so far
  bool whole_rows = false;       // one op from pixels to pixels: rows are not cut into blocks
};

// A window or gather operation: tiles to a tile.
struct TileStep {
  struct Input {
    BufferId buffer = -1;  // -1: wanted whole
    Roi window;            // its data window
    ConstImageView whole;
    std::vector<int> channels;  // of its node, in the order of the pixels
  };
  std::unique_ptr<TileStage> stage;
  std::string label;
  std::vector<Input> in;
  std::vector<int> channels;  // of the result, in the order of the pixels
};

// A materialised result inside a tile.
struct Buffer {
  Roi window;                      // data window of its node
  std::vector<int> channels;       // node channels held, in tile order
  std::unique_ptr<TileStep> tile;  // makes it; else `points` do
  Points points;
};

struct PlannedSource {
  const PixelSource* source = nullptr;
  Node node;                 // keeps it alive
  std::vector<bool> needed;  // channels
  int first = 0, last = 0;   // the range that its pixels have: of a file no more than is needed
};

struct Plan {
  Node root;       // optimised; keeps ops alive
  ImageSpec spec;  // of the result
  std::vector<PlannedSource> sources;
  std::vector<Buffer> buffers;
  std::vector<std::unique_ptr<const PointStage>> stages;
  std::vector<std::string> prepasses;  // what was computed beforehand, for Explain
  int operations = 0;                  // nodes before optimisation

  BufferId result() const { return static_cast<BufferId>(sources.size() + buffers.size()) - 1; }
  bool IsSource(BufferId id) const { return Z(id) < sources.size(); }
  const Buffer& buffer(BufferId id) const { return buffers[Z(id) - sources.size()]; }
};

// What planning must know of the pixels themselves; Explain makes it up.
class Prepass {
 public:
  virtual ~Prepass() = default;
  // All of a node as dense float pixels, which stay as long as the Prepass.
  virtual ConstImageView Whole(const Node& input) = 0;
  virtual const Workers& workers() const = 0;
};

// An op's context, its whole inputs taken from `prepass`. Owns what the context refers to.
class StageContexts {
 public:
  StageContexts(const NodeData& data, Prepass& prepass, std::vector<std::string>* prepasses = nullptr);
  StageContext For(const std::array<int, 4>& channels) const;

 private:
  const NodeData& data_;
  const Workers& workers_;
  std::vector<ImageSpec> specs_;
  std::vector<ConstImageView> whole_;
};

// `root` is optimised and free of kWhole nodes (whole.h); `operations` counts what it was made from. What
// `prepass` gives must outlive the plan.
Plan MakePlan(const Node& root, int operations, Prepass& prepass);

// The region of all pixels, by BufferId, that is needed for `out` of the result; of sources within their
// windows. Into a list that has been filled before, without an allocation.
void FindRequiredRegions(const Plan& plan, const Roi& out, std::vector<Roi>& regions);
inline std::vector<Roi> RequiredRegions(const Plan& plan, const Roi& out) {
  std::vector<Roi> regions;
  FindRequiredRegions(plan, out, regions);
  return regions;
}

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PLAN_H_
