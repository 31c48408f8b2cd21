// The optimiser: knows only Op::IsIdentity and Op::Compose.
#include "graph/optimize.h"

#include "graph/op.h"
#include "graph/topology.h"

namespace tessera::graph {
namespace {

// Whether what follows sees the same: a mip chain's level 0 has the pixels of its input and another frame.
bool LooksTheSame(const ImageSpec& a, const ImageSpec& b) {
  return a.data_window == b.data_window && a.display_window == b.display_window && a.alpha == b.alpha &&
         a.channel_count() == b.channel_count() && a.type == b.type;
}

// One node whose inputs are optimised already. Composing goes on while the input composes as well.
Node Simplify(const Node& node) {
  Node n = node;
  for (;;) {
    const NodeData& d = *n.data();
    if (d.op->Kind() == OpKind::kSource) return n;
    if (!d.inputs.empty() && d.op->IsIdentity() && LooksTheSame(d.spec, d.inputs[0].spec()))
      return d.inputs[0];
    if (d.inputs.size() != 1) return n;
    const NodeData& before = *d.inputs[0].data();
    if (before.inputs.size() != 1) return n;
    std::shared_ptr<const Op> both = before.op->Compose(*d.op);
    if (both == nullptr) return n;
    Node composed = MakeNode(std::move(both), before.inputs);
    if (!LooksTheSame(composed.spec(), d.spec)) return n;
    n = std::move(composed);
  }
}

}  // namespace

Node Optimize(const Node& root) {
  return Rewrite(root, [](const Node& node, const Node&) { return Simplify(node); });
}

}  // namespace tessera::graph
