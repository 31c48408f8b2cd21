// Carries out a program on one region after another: one worker's memory and prepared arguments.
#ifndef TESSERA_GRAPH_RUN_H_
#define TESSERA_GRAPH_RUN_H_

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "base/arena.h"
#include "graph/program.h"
#include "graph/run_points.h"

namespace tessera::graph {

// Pixels of a source that cover what the region needs, of the layout that the program was bound to; `margin`
// bytes after the last pixel may be read.
struct SourceView {
  ConstImageView view;
  ptrdiff_t margin = 0;
};

// Bytes of the tiles between steps that a region of the result takes, as a worker lays them out.
size_t TileMemory(const Program& program, const Roi& region);

// What a worker thread carries from tile to tile. After the first tiles nothing is allocated.
class TileWorker {
 public:
  // Uses the SIMD target of this moment. The program and the context, whose memory it takes, must outlive it.
  // `cancelled`: whether to leave tiles undone.
  TileWorker(const Program& program, Context& context, const std::atomic<bool>& cancelled);

  // Computes `out.roi` of the result into `out`. `stream`: write around the cache.
  void Run(std::span<const SourceView> sources, const ImageView& out, bool stream);

 private:
  void RunSamples(const Samples& step, const ImageView& out, bool stream);
  void RunMoves(const ByteMoves& step, const ImageView& out, bool stream);
  ConstImageView Fetch(const Window& window, size_t input, const Roi& out);

  const Program& program_;
  const std::atomic<bool>& cancelled_;
  const simd::MoveFunctions moves_;
  base::Arena arena_;
  std::vector<size_t> place_bytes_;
  std::vector<std::byte*> memory_;  // by place
  // By BufferId.
  std::vector<Roi> regions_;
  std::vector<int> places_;  // of tiles
  std::vector<ConstImageView> views_;
  std::vector<ImageView> made_;
  std::vector<ptrdiff_t> margins_;
  std::vector<PointsRunner> runners_;  // by step; unused where it is no Points
  struct Inputs {
    std::vector<ConstImageView> views;
    std::vector<std::span<const int>> channels;
  };
  std::vector<Inputs> inputs_;  // by step, of a Window
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_H_
