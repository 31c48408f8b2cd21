// OpenColorIO's own CPU processor as a point operation, for transforms that have no nodes.
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/block.h"
#include "graph/op.h"
#include "model/foreign_pixels.h"
#include "ocio/config.h"

namespace tessera::ocio {
namespace {

// A processor on rows of RGBA floats.
model::ForeignPixels::Function OnRows(lib::ConstCPUProcessorRcPtr processor) {
  return [processor = std::move(processor)](float* rgba, int count) {
    lib::PackedImageDesc row(rgba, count, 1, lib::CHANNEL_ORDERING_RGBA);
    processor->apply(row);
  };
}

class CpuStage final : public graph::PointStage {
 public:
  explicit CpuStage(model::ForeignPixels::Function run) : run_(std::move(run)) {}
  void Run(const graph::PointArgs& args) const override {
    alignas(64) float pixels[kBlockPixels * 4];
    for (int i = 0; i < args.count; ++i) {
      for (int p = 0; p < 4; ++p) pixels[4 * i + p] = args.in[0][p][i];
    }
    run_(pixels, args.count);
    for (int i = 0; i < args.count; ++i) {
      for (int p = 0; p < 4; ++p) args.out[p][i] = pixels[4 * i + p];
    }
  }

 private:
  model::ForeignPixels::Function run_;
};

class CpuOp final : public graph::OpWith<model::ForeignPixels> {
 public:
  explicit CpuOp(model::ForeignPixels params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "ociocpu"; }
  std::string Describe() const override { return "OpenColorIO"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    return inputs[0];
  }
  bool ReadsAlpha() const override { return params().alpha; }
  bool WritesAlpha() const override { return params().alpha; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return std::make_unique<CpuStage>(params().run);
  }
};

}  // namespace

Node ApplyCpuProcessor(const Node& image, const lib::ConstProcessorRcPtr& processor) {
  model::ForeignPixels params;
  params.run = OnRows(processor->getOptimizedCPUProcessor(lib::OPTIMIZATION_LOSSLESS));
  params.check = OnRows(processor->getOptimizedCPUProcessor(lib::OPTIMIZATION_NONE));
  params.alpha = image.spec().alpha >= 3;
  return graph::MakeNode(std::make_shared<const CpuOp>(std::move(params)), {image});
}

}  // namespace tessera::ocio
