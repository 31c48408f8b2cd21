// Operations on whole images: before planning they become sources of their results.
#ifndef TESSERA_GRAPH_WHOLE_H_
#define TESSERA_GRAPH_WHOLE_H_

#include <functional>

#include "graph/op.h"

namespace tessera::graph {

// `root` with every kWhole node replaced by a source of the image that compute(node) gives, inner nodes
// first: the inputs of the node it is called with hold no kWhole node.
Node ResolveWhole(const Node& root, const std::function<Image(const Node&)>& compute);

// The same for the inputs of a node alone.
Node ResolveInputs(const Node& root, const std::function<Image(const Node&)>& compute);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_WHOLE_H_
