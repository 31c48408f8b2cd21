// The nodes of a graph, inputs before consumers.
#ifndef TESSERA_GRAPH_TOPOLOGY_H_
#define TESSERA_GRAPH_TOPOLOGY_H_

#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "graph/op.h"

namespace tessera::graph {

// Each node once. Iterative: a chain of a hundred thousand operations does not overflow the stack. Inputs for
// which follow(node data, input) is false are left out.
template <typename Follow>
std::vector<Node> TopologicalOrder(const Node& root, const Follow& follow) {
  std::vector<Node> order;
  std::unordered_set<const NodeData*> done;
  std::vector<std::pair<Node, size_t>> stack = {{root, 0}};
  while (!stack.empty()) {
    auto& [node, next] = stack.back();
    const NodeData& data = *node.data();
    if (done.count(&data)) {
      stack.pop_back();
    } else if (next < data.inputs.size()) {
      const size_t k = next++;
      if (!follow(data, static_cast<int>(k))) continue;
      Node input = data.inputs[k];
      if (!done.count(input.data())) stack.emplace_back(std::move(input), 0);
    } else {
      done.insert(&data);
      order.push_back(node);
      stack.pop_back();
    }
  }
  return order;
}
inline std::vector<Node> TopologicalOrder(const Node& root) {
  return TopologicalOrder(root, [](const NodeData&, int) { return true; });
}

// The graph with each node, inputs first, replaced by what replace(node with its new inputs, node as it was)
// returns. Nodes whose inputs stay are handed on as they are.
template <typename Replace>
Node Rewrite(const Node& root, const Replace& replace) {
  std::unordered_map<const NodeData*, Node> done;
  for (const Node& node : TopologicalOrder(root)) {
    const NodeData& d = *node.data();
    std::vector<Node> inputs;
    bool changed = false;
    for (const Node& input : d.inputs) {
      inputs.push_back(done.at(input.data()));
      changed |= inputs.back().data() != input.data();
    }
    done.emplace(&d, replace(changed ? MakeNode(d.op, std::move(inputs)) : node, node));
  }
  return done.at(root.data());
}

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_TOPOLOGY_H_
