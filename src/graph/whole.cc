// Replaces whole-image operations by their results.
#include "graph/whole.h"

#include <unordered_map>

#include "graph/topology.h"

namespace tessera::graph {
namespace {

Node Resolve(const Node& root, bool with_root, const std::function<Image(const Node&)>& compute) {
  std::unordered_map<const NodeData*, Node> done;
  for (const Node& node : TopologicalOrder(root)) {
    const NodeData& d = *node.data();
    std::vector<Node> inputs;
    bool changed = false;
    for (const Node& input : d.inputs) {
      inputs.push_back(done.at(input.data()));
      changed |= inputs.back().data() != input.data();
    }
    Node resolved = changed ? MakeNode(d.op, std::move(inputs)) : node;
    if (d.op->Kind() == OpKind::kWhole && (with_root || &d != root.data())) resolved = FromImage(compute(resolved));
    done.emplace(&d, std::move(resolved));
  }
  return done.at(root.data());
}

}  // namespace

Node ResolveWhole(const Node& root, const std::function<Image(const Node&)>& compute) {
  return Resolve(root, true, compute);
}
Node ResolveInputs(const Node& root, const std::function<Image(const Node&)>& compute) {
  return Resolve(root, false, compute);
}

}  // namespace tessera::graph
