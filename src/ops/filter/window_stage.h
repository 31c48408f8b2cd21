// A window as a stage of tiles.
#ifndef TESSERA_OPS_FILTER_WINDOW_STAGE_H_
#define TESSERA_OPS_FILTER_WINDOW_STAGE_H_

#include <memory>
#include <utility>

#include "graph/stage.h"
#include "ops/filter/window.h"

namespace tessera::ops {

class WindowStage final : public graph::TileStage {
 public:
  WindowStage(std::shared_ptr<const Window> window, const Roi& data_window)
      : window_(std::move(window)), data_window_(data_window) {}
  Roi InputRoi(int, const Roi& out) const override { return window_->InputRoi(out, data_window_); }
  graph::TileSize Preferred() const override { return window_->PreferredTile(); }
  void Run(const graph::TileArgs& args) const override { window_->Run(args, data_window_); }

 private:
  std::shared_ptr<const Window> window_;
  Roi data_window_;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_STAGE_H_
