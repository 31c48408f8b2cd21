// Turns the point operations of one run into loads, steps on planes and a store.
#ifndef TESSERA_GRAPH_RUN_BUILDER_H_
#define TESSERA_GRAPH_RUN_BUILDER_H_

#include <memory>
#include <string>
#include <vector>

#include "graph/plan.h"

namespace tessera::graph {

// The graph as the planner sees it: nodes in topological order and, per node, what was found out about it.
struct PlannedGraph {
  std::vector<Node> nodes;
  std::vector<std::vector<int>> inputs;   // node indices; -1: wanted whole, not part of this plan
  std::vector<std::vector<bool>> needed;  // channels that somebody uses
  std::vector<int> owner;                 // the resident node whose run computes this one; -1: a tile step
  std::vector<int> buffer, source;        // index in the plan, -1 for none yet
};

// Channels of input `k` that node `i` needs for its own needed channels.
std::vector<bool> NeededOfInput(const PlannedGraph& graph, int i, int k);

// The run that computes `channels` of node `root`. What the prepass had to do is noted in `prepasses`.
std::unique_ptr<PointRun> BuildRun(const PlannedGraph& graph, int root, const std::vector<int>& channels,
                                   Prepass& prepass, std::vector<std::string>& prepasses);

// A run that only stores channels of the tile of `node`, or of the source that it is.
std::unique_ptr<PointRun> BuildCopyRun(const PlannedGraph& graph, int node, const std::vector<int>& channels);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_BUILDER_H_
