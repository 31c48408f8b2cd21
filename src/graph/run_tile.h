// Runs a plan on one region of its result.
#ifndef TESSERA_GRAPH_RUN_TILE_H_
#define TESSERA_GRAPH_RUN_TILE_H_

#include <span>
#include <vector>

#include "base/arena.h"
#include "graph/plan.h"
#include "simd/pixels.h"

namespace tessera::graph {

// Pixels of a source that cover what the region needs; channel 0 of the view is channel `first` of the
// source; `margin` bytes after its last pixel may be read.
struct SourceView {
  ConstImageView view;
  int first = 0;
  ptrdiff_t margin = 0;
};

class TileRunner {
 public:
  // Uses the SIMD target of this moment.
  explicit TileRunner(const Plan& plan) : plan_(plan), pixels_(simd::CurrentPixelFunctions()) {}

  // Computes `out.roi` of the result into `out`. `regions` are RequiredRegions(plan, out.roi). Scratch memory
  // comes from the worker's arena, which is reset first. `stream`: write around the cache.
  void Run(const Regions& regions, std::span<const SourceView> sources, const ImageView& out, bool stream,
           base::Arena& arena) const;

 private:
  void RunPoints(const PointRun& run, std::span<const SourceView> sources,
                 std::span<const ConstImageView> tiles, const ImageView& out, bool stream,
                 base::Arena& arena) const;
  // A tile step from nothing but sources to the result, all of one type that it accepts; false where that is
  // not all there is to do.
  bool RunTyped(const Regions& regions, std::span<const SourceView> sources, const ImageView& out,
                bool stream, base::Arena& arena) const;
  void RunTile(const TileStep& step, std::span<const ConstImageView> tiles, const ImageView& out, bool stream,
               base::Arena& arena) const;

  const Plan& plan_;
  const simd::PixelFunctions pixels_;
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_TILE_H_
