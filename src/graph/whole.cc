// Replaces whole-image operations by their results.
#include "graph/whole.h"

#include "graph/topology.h"

namespace tessera::graph {
namespace {

Node Resolve(const Node& root, bool with_root, const std::function<Image(const Node&)>& compute) {
  return Rewrite(root, [&](const Node& node, const Node& before) {
    const bool is_whole =
        node.data()->op->Kind() == OpKind::kWhole && (with_root || before.data() != root.data());
    return is_whole ? FromImage(compute(node)) : node;
  });
}

}  // namespace

Node ResolveWhole(const Node& root, const std::function<Image(const Node&)>& compute) {
  return Resolve(root, true, compute);
}
Node ResolveInputs(const Node& root, const std::function<Image(const Node&)>& compute) {
  return Resolve(root, false, compute);
}

}  // namespace tessera::graph
