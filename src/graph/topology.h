// The nodes of a graph, inputs before consumers.
#ifndef TESSERA_GRAPH_TOPOLOGY_H_
#define TESSERA_GRAPH_TOPOLOGY_H_

#include <unordered_set>
#include <utility>
#include <vector>

#include "graph/op.h"

namespace tessera::graph {

// Each node once. Iterative: a chain of a hundred thousand operations does not overflow the stack.
inline std::vector<Node> TopologicalOrder(const Node& root) {
  std::vector<Node> order;
  std::unordered_set<const NodeData*> done;
  std::vector<std::pair<Node, size_t>> stack = {{root, 0}};
  while (!stack.empty()) {
    auto& [node, next] = stack.back();
    if (done.count(node.data())) {
      stack.pop_back();
    } else if (next < node.data()->inputs.size()) {
      Node input = node.data()->inputs[next++];
      if (!done.count(input.data())) stack.emplace_back(std::move(input), 0);
    } else {
      done.insert(node.data());
      order.push_back(node);
      stack.pop_back();
    }
  }
  return order;
}

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_TOPOLOGY_H_
