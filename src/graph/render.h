// The engine's entrance for rooms that bring their own sinks; see tessera/render.h for the public one.
#ifndef TESSERA_GRAPH_RENDER_H_
#define TESSERA_GRAPH_RENDER_H_

#include "graph/source.h"
#include "tessera/export.h"
#include "tessera/render.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// Evaluates the whole data window into a sink, band by band in row order: read, compute and write overlap and
// memory stays within options.memory_budget.
void RenderToSink(const Node& node, PixelType type, RowSink& sink, const RenderOptions& options,
                  RunStats* stats = nullptr);

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_RENDER_H_
