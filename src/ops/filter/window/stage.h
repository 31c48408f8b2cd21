// A window as a stage of tiles.
#ifndef TESSERA_OPS_FILTER_WINDOW_STAGE_H_
#define TESSERA_OPS_FILTER_WINDOW_STAGE_H_

#include <memory>
#include <optional>
#include <utility>

#include "base/stage.h"
#include "ops/filter/codes/integer_sums.h"
#include "ops/filter/window/window.h"

namespace tessera::ops {

class WindowStage final : public graph::TileStage {
 public:
  WindowStage(std::shared_ptr<const Window> window, const ImageSpec& in)
      : window_(std::move(window)), data_window_(in.data_window) {
    if (!IntegerSums::Applies(in.type)) return;
    if (window_->SumsCodes(in.type)) {
      largest_ = IntegerSums::Largest(in.type);
    } else if (!window_->kernel().weights.empty()) {
      integers_.emplace(in.type, window_->kernel(), window_->options(), window_->ErrorBound());
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return window_->InputRoi(out, data_window_); }
  graph::TileSize Preferred() const override { return window_->PreferredTile(/*alone=*/false); }
  graph::TileSize PreferredAlone() const override { return window_->PreferredTile(/*alone=*/true); }
  bool Accepts(PixelType type) const override {
    return type == PixelType::kFloat ||
           (IntegerSums::Applies(type) && largest_ == IntegerSums::Largest(type) &&
            window_->SumsAsTheyAre(type));
  }
  void Run(const graph::TileArgs& args) const override {
    window_->Run(functions_, args, data_window_, largest_);
    if (!integers_) return;
    integers_->Settle(args.in[0], args.in_channels[0], args.out, args.channels, data_window_, args.scratch);
  }

 private:
  std::shared_ptr<const Window> window_;
  WindowFunctions functions_ = ChooseWindowFunctions();
  Roi data_window_;
  // Of integer pixels: their sums as codes, or what mends sums of floats.
  int largest_ = 0;
  std::optional<IntegerSums> integers_;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_STAGE_H_
