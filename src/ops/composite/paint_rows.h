// Pictures painted row by row in double, without inputs.
#ifndef TESSERA_OPS_COMPOSITE_PAINT_ROWS_H_
#define TESSERA_OPS_COMPOSITE_PAINT_ROWS_H_

#include <algorithm>
#include <any>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"

namespace tessera::ops {

// A generator of rows: paint(y, first x, one past the last x, row of samples).
class PaintOp final : public graph::Op {
 public:
  using Paint = std::function<void(int y, int x0, int x1, double* row)>;
  PaintOp(const char* name, std::any parameters, ImageSpec spec, Paint paint)
      : name_(name), parameters_(std::move(parameters)), spec_(std::move(spec)), paint_(std::move(paint)) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  const std::any& Parameters() const override { return parameters_; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return spec_; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<Stage>(paint_, spec_.channel_count());
  }

 private:
  class Stage final : public graph::TileStage {
   public:
    Stage(Paint paint, int channels) : paint_(std::move(paint)), channels_(static_cast<size_t>(channels)) {}
    Roi InputRoi(int, const Roi& out) const override { return out; }
    void Run(const graph::TileArgs& args) const override {
      const Roi& o = args.out.roi;
      const size_t count = static_cast<size_t>(o.width()) * channels_;
      double* const row = args.scratch.Allocate<double>(count);
      for (int y = o.y0; y < o.y1; ++y) {
        std::fill_n(row, count, 0.0);
        paint_(y, o.x0, o.x1, row);
        auto* to = reinterpret_cast<float*>(args.out.At(o.x0, y));
        for (size_t i = 0; i < count; i += channels_) {
          for (const int c : args.channels) *to++ = static_cast<float>(row[i + static_cast<size_t>(c)]);
        }
      }
    }

   private:
    Paint paint_;
    size_t channels_;
  };

  const char* name_;
  std::any parameters_;
  ImageSpec spec_;
  Paint paint_;
};

inline ImageSpec SpecWith(ImageSpec spec, std::vector<std::string> channels) {
  spec.alpha = static_cast<int>(channels.size()) - 1;
  spec.channels = std::move(channels);
  return spec;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COMPOSITE_PAINT_ROWS_H_
