// Rewriting a graph before it is planned: identities out, neighbours composed to a fixed point.
#ifndef TESSERA_GRAPH_OPTIMIZE_H_
#define TESSERA_GRAPH_OPTIMIZE_H_

#include "tessera/node.h"

namespace tessera::graph {

// The same picture, within every operation's bound, from fewer operations. The root's channels and data
// window do not change.
Node Optimize(const Node& root);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_OPTIMIZE_H_
