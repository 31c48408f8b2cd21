// OpenColorIO's own CPU processor as a point operation, for transforms that have no nodes.
#include <memory>
#include <span>
#include <string>

#include "base/block.h"
#include "graph/op.h"
#include "ocio/config.h"

namespace tessera::ocio {
namespace {

struct CpuParams {
  lib::ConstCPUProcessorRcPtr processor;
  bool alpha = false;  // the image has one
};

class CpuStage final : public graph::PointStage {
 public:
  explicit CpuStage(lib::ConstCPUProcessorRcPtr processor) : processor_(std::move(processor)) {}
  void Run(const graph::PointArgs& args) const override {
    alignas(64) float pixels[kBlockPixels * 4];
    for (int i = 0; i < args.count; ++i) {
      for (int p = 0; p < 4; ++p) pixels[4 * i + p] = args.in[0][p][i];
    }
    lib::PackedImageDesc row(pixels, args.count, 1, lib::CHANNEL_ORDERING_RGBA);
    processor_->apply(row);
    for (int i = 0; i < args.count; ++i) {
      for (int p = 0; p < 4; ++p) args.out[p][i] = pixels[4 * i + p];
    }
  }

 private:
  lib::ConstCPUProcessorRcPtr processor_;
};

class CpuOp final : public graph::OpWith<CpuParams> {
 public:
  explicit CpuOp(CpuParams params) : OpWith(std::move(params)) {}
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
    return std::make_unique<CpuStage>(params().processor);
  }
};

}  // namespace

Node ApplyCpuProcessor(const Node& image, const lib::ConstProcessorRcPtr& processor) {
  CpuParams params;
  params.processor = processor->getOptimizedCPUProcessor(lib::OPTIMIZATION_LOSSLESS);
  params.alpha = image.spec().alpha >= 3;
  return graph::MakeNode(std::make_shared<const CpuOp>(std::move(params)), {image});
}

}  // namespace tessera::ocio
