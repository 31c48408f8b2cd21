// A window made ready for one instruction set and one type of pixels.
#ifndef TESSERA_OPS_FILTER_WINDOW_RUN_H_
#define TESSERA_OPS_FILTER_WINDOW_RUN_H_

#include <memory>
#include <optional>
#include <vector>

#include "base/stage.h"
#include "ops/filter/codes/integer_sums.h"
#include "ops/filter/window/window.h"

namespace tessera::ops {

class WindowRun {
 public:
  WindowRun(std::shared_ptr<const Window> window, PixelType type);

  const Window& window() const { return *window_; }
  // Whether pixels of that type may come and go as they are.
  bool Accepts(PixelType type) const;
  // Computes args.out from args.in[0], which covers InputRoi; edges are extended here, where they are needed.
  void Run(const graph::TileArgs& args, const Roi& data_window) const;
  // The same for a whole image of floats, tile by tile.
  void RunWhole(const ConstImageView& in, const ImageView& out, const graph::Workers& workers) const;

 private:
  int PlaneOf(int channel) const { return window_->planes() == 1 ? 0 : channel; }
  const WindowSums& SumsOf(int channel) const { return *sums_[static_cast<size_t>(PlaneOf(channel))]; }
  void RunBlocks(const graph::TileArgs& args, const Roi& data_window) const;
  void RunPart(const graph::TileArgs& args, const ConstImageView& in, const Roi& part) const;
  void RunPlanes(const graph::TileArgs& args, const ConstImageView& in, const ImageView& out) const;
  void MendEdges(const graph::TileArgs& args, const Roi& data_window) const;
  void AddBias(const graph::TileArgs& args) const;

  std::shared_ptr<const Window> window_;
  PixelType type_;
  std::vector<std::unique_ptr<const WindowSums>> sums_;  // of every plane
  FftFunctions fft_ = ChooseFft();
  std::optional<IntegerSums> integers_;  // of integer pixels whose codes are not summed
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_WINDOW_RUN_H_
