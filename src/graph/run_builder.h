// Turns the point operations of one run into loads, steps on planes and a store.
#ifndef TESSERA_GRAPH_RUN_BUILDER_H_
#define TESSERA_GRAPH_RUN_BUILDER_H_

#include <vector>

#include "graph/plan.h"

namespace tessera::graph {

// The graph as the planner sees it: nodes in topological order and, per node, what was found out about it.
struct PlannedGraph {
  std::vector<Node> nodes;
  std::vector<std::vector<int>> inputs;   // node indices; -1: wanted whole, not part of this plan
  std::vector<std::vector<bool>> needed;  // channels that somebody uses
  std::vector<int> owner;                 // the resident node whose run computes this one; -1: a tile step
  std::vector<BufferId> pixels;           // where it can be loaded from, -1 for nowhere yet
  std::vector<int> first;                 // of a source: the channel that these begin with
};

// Channels of input `k` that node `i` needs for its own needed channels.
std::vector<bool> NeededOfInput(const PlannedGraph& graph, int i, int k);

// What computes `channels` of node `root`. Its stages, and what the prepass had to do, go to the plan.
Points BuildPoints(const PlannedGraph& graph, int root, const std::vector<int>& channels, Prepass& prepass,
                   Plan& plan);

// What only stores channels of the tile of `node`, or of the source that it is.
Points BuildCopy(const PlannedGraph& graph, int node, const std::vector<int>& channels);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_BUILDER_H_
