// Sources of which only a part is in memory: what an evaluation may ask of them.
#ifndef TESSERA_GRAPH_PARTS_H_
#define TESSERA_GRAPH_PARTS_H_

#include "graph/plan.h"
#include "tessera/node.h"

namespace tessera::graph {

// Throws DataError that names the operation where one needs all of an image that hangs on a part. `root` is
// the graph as it is planned.
void RequireNoWholeOfPart(const Node& root);

// Throws DataError unless the parts have the pixels that the region `out` of the plan's result needs.
void RequireParts(const Plan& plan, const Roi& out);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PARTS_H_
