// Carries out the point operations of one step, block by block in L1.
#ifndef TESSERA_GRAPH_RUN_POINTS_H_
#define TESSERA_GRAPH_RUN_POINTS_H_

#include <array>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "base/arena.h"
#include "base/stage.h"
#include "graph/program.h"
#include "simd/pixels.h"

namespace tessera::graph {

// A tail shorter than a group goes through here; four floats a pixel is the widest that is read directly.
struct PixelGroup {
  alignas(base::kAlignment) std::byte pixels[kGroupPixels * 16] = {};
};

// One worker's: its planes and, prepared once, everything that a call of a load, a stage or a store is told
// but the place of the pixels.
class PointsRunner {
 public:
  PointsRunner() = default;
  // `to`: the buffer that is written.
  PointsRunner(const Program& program, const Points& points, BufferId to, Context& context);

  // Computes out.roi; `views` by BufferId.
  void Run(std::span<const ConstImageView> views, const ImageView& out, bool stream);

 private:
  struct Load {
    simd::LoadArgs args;
    BufferId from = 0;
  };
  struct Compute {
    const PointStage* stage = nullptr;
    PointArgs args;
    std::array<BufferId, ComputeOp::kMostDirect> direct = {-1, -1, -1};
    bool to_result = false;
    std::unique_ptr<const float*[][4]> inputs;  // args.in
  };
  void RunBlock(std::span<const ConstImageView> views, const ImageView& out, int x, int y, int count);

  simd::PixelFunctions pixels_ = {};
  std::shared_ptr<std::byte> planes_;
  std::vector<std::variant<Load, Compute>> items_;
  std::vector<simd::StoreArgs> stores_;
  bool whole_rows_ = false;
  PixelGroup tail_in_[ComputeOp::kMostDirect], tail_out_;
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_RUN_POINTS_H_
