// Weighted sums and means of any number of images in one pass.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/arena_vector.h"
#include "graph/op.h"
#include "ops/accumulate/accumulate_ops.h"
#include "ops/accumulate/sum_kernel.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops {
namespace {

constexpr int kMostImages = 65536;

class SumStage final : public graph::TileStage {
 public:
  explicit SumStage(const WeightedSumParams& p) : params_(p), run_(ChooseSum()) {}
  Roi InputRoi(int, const Roi& out) const override { return out; }
  // Whole rows: as many streams as images, each as long as can be.
  graph::TileSize Preferred() const override { return {4096, 32}; }
  void Run(const graph::TileArgs& args) const override {
    base::ArenaVector<ConstImageView> in(args.scratch);
    base::ArenaVector<double> weights(args.scratch);
    for (size_t k = 0; k < params_.weights.size(); ++k) {
      if (params_.weights[k] == 0) continue;
      in.push_back(InputChannels(args, k));
      weights.push_back(params_.weights[k]);
    }
    base::ArenaVector<const float*> rows(in.size(), args.scratch);
    const Roi& roi = args.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (size_t k = 0; k < in.size(); ++k) rows[k] = reinterpret_cast<const float*>(in[k].At(roi.x0, y));
      run_({rows, weights, reinterpret_cast<float*>(args.out.At(roi.x0, y)),
            int64_t{roi.width()} * args.out.channels, 1, params_.bits, args.stream});
    }
  }

 private:
  WeightedSumParams params_;
  SumFunction run_;
};

class AccumOp final : public graph::OpWith<WeightedSumParams> {
 public:
  AccumOp(const char* name, WeightedSumParams p) : OpWith(std::move(p)), name_(name) {}
  std::string Name() const override { return name_; }
  std::string Describe() const override {
    return std::string(name_) + " of " + std::to_string(params().weights.size());
  }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override {
    return params().weights == std::vector<double>{1} && params().bits == 0;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    if (inputs.empty() || inputs.size() > kMostImages || inputs.size() != params().weights.size()) {
      throw Error(name_, "found " + std::to_string(inputs.size()) + " images and " +
                             std::to_string(params().weights.size()) +
                             " weights, expected as many, 1 to 65536");
    }
    for (const double w : params().weights) {
      if (!std::isfinite(w)) throw Error(name_, "found a weight that is not finite, expected a number");
    }
    if (params().bits != 0 && (params().bits < 8 || params().bits > 32)) {
      throw Error(name_, "found " + std::to_string(params().bits) + " bits, expected 8 to 32, or 0 for none");
    }
    graph::RequireSameWindow(name_, inputs);
    for (const ImageSpec& in : inputs) {
      if (in.channel_count() != inputs[0].channel_count()) {
        throw DataError(name_, "found images of " + std::to_string(inputs[0].channel_count()) + " and " +
                                   std::to_string(in.channel_count()) + " channels, expected equal numbers");
      }
    }
    return inputs[0];
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<SumStage>(params());
  }

 private:
  const char* name_;
};

ParamInfo BitsModifier() {
  return IntegerModifier(
      "bits", "0", 0, 32,
      "models an accumulation buffer in fixed point with that many binary places, 8 to 32; 0 is exact");
}

}  // namespace

OpInfo AccumInfo() {
  OpInfo info;
  info.name = "accum";
  info.family = "accumulate";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return static_cast<int>(a.Numbers("W1,W2,...").size()); };
  info.summary = "Weighted sum of as many images as there are weights";
  info.help =
      "Takes one image per weight, the first weight for the lowest of them, and adds weight * image in one "
      "pass, in double, rounded once. Weights are kept as asked, never normalised; an image whose weight is "
      "0 has no effect, NaN included. bits= models the fixed-point buffer of the papers: numbers in [-1, 1] "
      "with that many binary places, rounded and saturated after every image.";
  info.bound =
      "1 u * |result| + 2^-29 u * (sum of |weight * value|): 1 ULP; with bits=: exact but at ties of a step";
  info.bound_u = 1;
  info.arguments = {ListModifier("W1,W2,...", "", kMostImages, "one weight per image")};
  info.modifiers = {BitsModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return WeightedSum({in.begin(), in.end()}, {a.Numbers("W1,W2,..."), a.Integer("bits")});
  };
  info.identity = "1";
  info.examples = {
      "0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625,0.0625",
      "0.25,0.5,-0.125", "1,0,-1e-3,7.3", "0.7"};
  return info;
}

OpInfo AverageInfo() {
  OpInfo info;
  info.name = "average";
  info.family = "accumulate";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Integer("N"); };
  info.summary = "Mean of N images";
  info.help =
      "Takes N images and gives their mean: --accum with N weights of 1/N, in one pass, in double, rounded once.";
  info.bound = "1 u * |result| + 2^-29 u * (sum of |value| / N): 1 ULP";
  info.bound_u = 1;
  info.arguments = {IntegerModifier("N", "", 1, kMostImages, "number of images")};
  info.modifiers = {BitsModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Average({in.begin(), in.end()}, a.Integer("bits"));
  };
  info.identity = "1";
  info.examples = {"4", "3", "1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node WeightedSum(const std::vector<Node>& images, const WeightedSumParams& params) {
  return graph::MakeNode(std::make_shared<const ops::AccumOp>("accum", params), images);
}

Node Average(const std::vector<Node>& images, int bits) {
  const double weight = 1.0 / static_cast<double>(std::max<size_t>(1, images.size()));
  return graph::MakeNode(std::make_shared<const ops::AccumOp>(
                             "average", WeightedSumParams{std::vector(images.size(), weight), bits}),
                         images);
}

}  // namespace tessera
