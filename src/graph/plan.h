// The plan: a graph after optimisation as a flat list of steps over tiles. It says what is computed from
// what; how, once the pixels' layouts are known, is what binding decides (program.h).
#ifndef TESSERA_GRAPH_PLAN_H_
#define TESSERA_GRAPH_PLAN_H_

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/stage.h"
#include "graph/op.h"
#include "graph/source.h"
#include "tessera/node.h"

namespace tessera::graph {

// A float plane of one block inside a run. A plan numbers them freely; binding (program.h) gives them places.
using PlaneId = int;
inline constexpr PlaneId kZeroPlane = 0, kOnePlane = 1, kDummyPlane = 2, kFirstFreePlane = 3;

// Where a run reads pixels: a source of the plan, or a tile that an earlier step made.
struct PlaneLoad {
  bool from_tile = false;
  int index = 0;                      // into Plan::sources or Plan::buffers
  int channel[4] = {-1, -1, -1, -1};  // of the source / of the tile; -1: plane unused
  PlaneId plane[4] = {};
};

struct PointStep {
  std::unique_ptr<PointStage> stage;
  std::string label;
  std::vector<std::array<PlaneId, 4>> in;
  std::array<PlaneId, 4> out = {};
};

// A plane that holds one value, beside kZeroPlane and kOnePlane.
struct ConstantPlane {
  PlaneId plane = 0;
  float value = 0;
};

// A run of point operations: loads, point steps, then one store of every channel.
struct PointRun {
  struct Item {
    bool is_load = false;
    int index = 0;  // into loads or steps
  };
  std::vector<Item> items;  // in order of execution
  std::vector<PlaneLoad> loads;
  std::vector<PointStep> steps;
  std::vector<ConstantPlane> constants;
  std::vector<PlaneId> result;   // plane of every stored channel
  int planes = kFirstFreePlane;  // numbered so far
};

// A window or gather operation: tiles to a tile.
struct TileStep {
  struct Input {
    int buffer = -1;  // -1: wanted whole
    Roi window;       // its data window
    ConstImageView whole;
    std::vector<int> channels;  // of its node, in the order of the pixels
  };
  std::unique_ptr<TileStage> stage;
  std::string label;
  std::vector<Input> in;
  std::vector<int> channels;  // of the result, in the order of the pixels
};

// A materialised result inside a tile; the last one is the plan's result.
struct Buffer {
  Roi window;                     // data window of its node
  std::vector<int> channels;      // node channels held, in tile order
  std::unique_ptr<PointRun> run;  // exactly one of the two makes it
  std::unique_ptr<TileStep> tile;
};

struct PlannedSource {
  const PixelSource* source = nullptr;
  Node node;                 // keeps it alive
  std::vector<bool> needed;  // channels
  int first = 0, last = 0;   // the range read from a file
};

struct Plan {
  Node root;       // optimised; keeps ops alive
  ImageSpec spec;  // of the result
  std::vector<PlannedSource> sources;
  std::vector<Buffer> buffers;
  std::vector<std::string> prepasses;  // what was computed beforehand, for Explain
  int operations = 0;                  // nodes before optimisation
};

// What planning must know of the pixels themselves; Explain makes it up.
class Prepass {
 public:
  virtual ~Prepass() = default;
  virtual double Statistic(const Node& input, const StatisticRequest& request) = 0;
  // All of a node as dense float pixels, which stay as long as the Prepass.
  virtual ConstImageView Whole(const Node& input) = 0;
  virtual const Workers& workers() const = 0;
};

// An op's context, its statistics and whole inputs taken from `prepass`. Owns what the context refers to.
class ContextOf {
 public:
  ContextOf(const NodeData& data, Prepass& prepass, std::vector<std::string>* prepasses = nullptr);
  StageContext For(const std::array<int, 4>& channels) const;

 private:
  const NodeData& data_;
  const Workers& workers_;
  std::vector<ImageSpec> specs_;
  std::vector<double> statistics_;
  std::vector<ConstImageView> whole_;
};

// `root` is optimised and free of kWhole nodes (whole.h); `operations` counts what it was made from. What
// `prepass` gives must outlive the plan.
Plan MakePlan(const Node& root, int operations, Prepass& prepass);

// The region of every buffer and source needed for `out` of the result. Source regions are within their
// windows.
struct Regions {
  std::vector<Roi> buffers, sources;
};
Regions RequiredRegions(const Plan& plan, const Roi& out);
// The same into lists that have been filled before, without an allocation.
void FindRequiredRegions(const Plan& plan, const Roi& out, Regions& regions);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PLAN_H_
