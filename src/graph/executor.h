// Runs a plan over many tiles: resident pixels on a grid, files in bands of rows.
#ifndef TESSERA_GRAPH_EXECUTOR_H_
#define TESSERA_GRAPH_EXECUTOR_H_

#include <functional>

#include "graph/program.h"
#include "graph/source.h"
#include "sched/progress.h"
#include "tessera/render.h"

namespace tessera::graph {

// Who keeps memory and prepared things for that evaluation.
Context& ContextOf(const RenderOptions& options);

// Width and height of the tiles that `roi` of a result of that type is cut into.
struct TileShape {
  int width = 0, height = 0;
};
// The region cut into such tiles, row by row.
std::vector<Roi> Tiles(const Roi& roi, const TileShape& shape);
TileShape ChooseTileShape(const Program& program, const Roi& roi, const RenderOptions& options);

// Rows per band and bands alive at once for a result of `row_bytes` a row.
struct BandShape {
  int rows = 0, tokens = 0;
};
BandShape ChooseBandShape(const Plan& plan, const Roi& roi, int64_t row_bytes, int granularity,
                          const RenderOptions& options);

// Bytes read from sources and written for `roi`.
int64_t BytesMoved(const Plan& plan, const Roi& roi, PixelType type);

// The layouts of a plan's sources: of their pixels, or of the rows that are read from files.
std::vector<Layout> SourceLayouts(const Plan& plan);

// Computes out.roi from sources that are all resident, as a pass of `progress`.
void RunResident(const Program& program, const ImageView& out, const RenderOptions& options,
                 sched::Progress& progress);

// Computes `roi` in bands of rows in order, reading files as it goes. Exactly one of `out` (memory) and
// `sink` is given. Adds to `phases`, where there are some.
void RunBands(const Program& program, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink,
              const RenderOptions& options, sched::Progress& progress, RunPhases* phases);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_EXECUTOR_H_
