// Runs that compute nothing: pixels copied, channels selected, reordered, joined, set to constants.
#ifndef TESSERA_GRAPH_RUN_MOVES_H_
#define TESSERA_GRAPH_RUN_MOVES_H_

#include <span>

#include "graph/plan.h"
#include "graph/run_tile.h"
#include "simd/pixels.h"
#include "tessera/image.h"

namespace tessera::graph {

// Does the run by moving bytes, which keeps the bits of every sample, and returns true where it computes
// nothing and all its pixels are dense, of the result's type and short enough (copies may have any length).
bool RunMoves(const PointRun& run, std::span<const SourceView> sources, std::span<const ConstImageView> tiles,
              const ImageView& out, bool stream, const simd::PixelFunctions& pixels);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_MOVES_H_
