// A window as a stage of tiles.
#ifndef TESSERA_OPS_FILTER_WINDOW_STAGE_H_
#define TESSERA_OPS_FILTER_WINDOW_STAGE_H_

#include <memory>
#include <utility>

#include "base/stage.h"
#include "ops/filter/window/run.h"

namespace tessera::ops {

class WindowStage final : public graph::TileStage {
 public:
  // `codes`: CodesOf the image.
  WindowStage(std::shared_ptr<const Window> window, const ImageSpec& in, PixelType codes)
      : run_(std::move(window), codes), data_window_(in.data_window) {}
  Roi InputRoi(int, const Roi& out) const override { return run_.window().InputRoi(out, data_window_); }
  graph::TileSize Preferred() const override { return run_.window().PreferredTile(/*alone=*/false); }
  graph::TileSize PreferredAlone() const override { return run_.window().PreferredTile(/*alone=*/true); }
  bool Accepts(PixelType type) const override { return run_.Accepts(type); }
  void Run(const graph::TileArgs& args) const override { run_.Run(args, data_window_); }

 private:
  WindowRun run_;
  Roi data_window_;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_STAGE_H_
