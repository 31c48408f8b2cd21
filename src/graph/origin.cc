// Origins live in the deleters of nodes, so that a node without one costs nothing and NodeData says what is
// computed, nothing else.
#include "graph/origin.h"

#include <new>
#include <utility>

#include "graph/op.h"

namespace tessera::graph {
namespace {

// Takes what a node holds that nobody else can see any more; what there is no memory for, it keeps and
// releases by recursion.
void TakeAll(std::vector<Node>& inputs, std::vector<Node>& taken) noexcept try {
  taken.insert(taken.end(), inputs.begin(), inputs.end());
  inputs.clear();
} catch (const std::bad_alloc&) {
}
void TakeInputs(const NodeData& data, std::vector<Node>& taken) noexcept {
  TakeAll(const_cast<NodeData&>(data).inputs, taken);
}

struct DeleteWithOrigin {
  Origin origin;

  // Releases a long chain without recursion, as ~NodeData does.
  void operator()(const NodeData* data) {
    std::vector<Node> orphans = std::move(origin.inputs);
    TakeInputs(*data, orphans);
    delete data;
    while (!orphans.empty()) {
      const Node node = std::move(orphans.back());
      orphans.pop_back();
      if (!node || node.shared().use_count() != 1) continue;
      TakeInputs(*node.data(), orphans);
      if (auto* const deleter = std::get_deleter<DeleteWithOrigin>(node.shared()))
        TakeAll(deleter->origin.inputs, orphans);
    }
  }
};

}  // namespace

Node WithOrigin(const Node& node, Origin origin) {
  if (!node) return node;
  const NodeData& data = *node.data();
  return Node(std::shared_ptr<const NodeData>(new NodeData(data), DeleteWithOrigin{std::move(origin)}));
}

const Origin* OriginOf(const Node& node) {
  const auto* const deleter = std::get_deleter<DeleteWithOrigin>(node.shared());
  return deleter == nullptr ? nullptr : &deleter->origin;
}

}  // namespace tessera::graph
