// The optimiser: knows only Op::IsIdentity and Op::Compose.
#include "graph/optimize.h"

#include "graph/op.h"
#include "graph/topology.h"

namespace tessera::graph {
namespace {

// One node whose inputs are optimised already. Composing goes on while the input composes as well.
Node Simplify(const Node& node) {
  Node n = node;
  for (;;) {
    const NodeData& d = *n.data();
    if (d.op->Kind() == OpKind::kSource) return n;
    if (!d.inputs.empty() && d.op->IsIdentity()) return d.inputs[0];
    if (d.inputs.size() != 1) return n;
    const NodeData& before = *d.inputs[0].data();
    if (before.inputs.size() != 1) return n;
    std::shared_ptr<const Op> both = before.op->Compose(*d.op);
    if (both == nullptr) return n;
    n = MakeNode(std::move(both), before.inputs);
  }
}

}  // namespace

Node Optimize(const Node& root) {
  return Rewrite(root, [](const Node& node, const Node&) { return Simplify(node); });
}

}  // namespace tessera::graph
