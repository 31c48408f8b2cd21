// Convolution as hardware without it does it: shift, accumulate, return; with the range analysis that keeps
// it in range.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/arena_vector.h"
#include "base/number_text.h"
#include "graph/op.h"
#include "ops/accumulate/accumulate_ops.h"
#include "ops/accumulate/sum_kernel.h"
#include "ops/filter/frame.h"
#include "ops/filter/window/window.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops {
namespace {

constexpr int kWidest = 255;

ShiftAccumulateParams WithAnchor(ShiftAccumulateParams p) {
  if (p.anchor_x < 0) p.anchor_x = (p.width - 1) / 2;
  if (p.anchor_y < 0) p.anchor_y = (p.height - 1) / 2;
  return p;
}

class ShiftAccumulateStage final : public graph::TileStage {
 public:
  explicit ShiftAccumulateStage(const ShiftAccumulateParams& p) : params_(p), run_(ChooseSum()) {
    const double scale = KernelRange(p.taps, p.low, p.high).scale;
    for (int j = 0; j < p.height; ++j) {
      for (int i = 0; i < p.width; ++i) {
        const double tap =
            p.taps[static_cast<size_t>(j) * static_cast<size_t>(p.width) + static_cast<size_t>(i)];
        if (tap == 0) continue;
        offsets_.push_back({i - p.anchor_x, j - p.anchor_y});
        weights_.push_back(tap * scale);
      }
    }
    factor_ = 1 / scale;
  }
  Roi InputRoi(int, const Roi& out) const override {
    return {out.x0 - params_.anchor_x, out.y0 - params_.anchor_y,
            out.x1 + params_.width - 1 - params_.anchor_x, out.y1 + params_.height - 1 - params_.anchor_y};
  }
  Wrap InputBorder(int) const override { return params_.wrap; }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = InputChannels(args, 0);
    base::ArenaVector<const float*> rows(offsets_.size(), args.scratch);
    const Roi& roi = args.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (size_t k = 0; k < rows.size(); ++k) {
        rows[k] = reinterpret_cast<const float*>(in.At(roi.x0 + offsets_[k].x, y + offsets_[k].y));
      }
      run_({rows, weights_, reinterpret_cast<float*>(args.out.At(roi.x0, y)),
            int64_t{roi.width()} * args.out.channels, factor_, params_.bits, args.stream});
    }
  }

 private:
  struct Offset {
    int x, y;
  };
  ShiftAccumulateParams params_;
  SumFunction run_;
  std::vector<Offset> offsets_;
  std::vector<double> weights_;
  double factor_ = 1;
};

class ShiftAccumulateOp final : public graph::OpWith<ShiftAccumulateParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "shiftaccum"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const ShiftAccumulateParams& p = params();
    const auto refuse = [](const std::string& reason) { throw Error("shiftaccum", reason); };
    if (p.width < 1 || p.height < 1 || p.width > kWidest || p.height > kWidest ||
        p.taps.size() != static_cast<size_t>(p.width) * static_cast<size_t>(p.height)) {
      refuse("found " + std::to_string(p.taps.size()) + " taps for a kernel of " + std::to_string(p.width) +
             "x" + std::to_string(p.height) + ", expected width times height of at most 255 each");
    }
    for (const double tap : p.taps) {
      if (!std::isfinite(tap)) refuse("found a tap that is not finite, expected a number");
    }
    if (p.anchor_x >= p.width || p.anchor_y >= p.height)
      refuse("found an anchor outside the kernel, expected one inside");
    if (p.bits != 0 && (p.bits < 8 || p.bits > 32)) {
      refuse("found " + std::to_string(p.bits) + " bits, expected 8 to 32, or 0 for none");
    }
    RequireWrap("shiftaccum", p.wrap,
                {Wrap::kClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101});
    if (!(p.low <= p.high) || !std::isfinite(p.low) || !std::isfinite(p.high)) {
      refuse("found a range from " + base::NumberText(p.low) + " to " + base::NumberText(p.high) +
             ", expected low <= high");
    }
    return inputs[0];
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<ShiftAccumulateStage>(params());
  }
};

}  // namespace

OpInfo ShiftAccumulateInfo() {
  OpInfo info;
  info.name = "shiftaccum";
  info.family = "accumulate";
  info.summary = "Correlate by shift and accumulate, as an accumulation buffer does";
  info.help =
      "For every tap that is not 0 the image is shifted and accumulated with the tap times a scale, and "
      "returned with the scale's inverse, unclamped. TAPS are row-major, top row first. The scale is 1 over "
      "the largest magnitude that a partial sum can reach, in any order of the taps, for samples in range= "
      "(widened to hold 0): with bits= the fixed-point buffer, numbers in [-1, 1] with that many binary "
      "places, is then used to the full and never saturates in that range. The edge is repeated. An image "
      "kernel of any border and method is --convolve's job.";
  info.bound = "1 u * |result| + 2^-29 u * (sum of |tap * value|); with bits=: taps * 2^-(bits+1) / scale";
  info.bound_u = 1;
  ParamInfo taps = ListModifier("TAPS", "", kWidest * kWidest, "width times height numbers");
  ParamInfo range =
      OnlyWith("bits", NumbersModifier("range", "0,1", 2, "least and greatest sample expected"));
  info.arguments = {taps};
  info.modifiers = {IntegerModifier("width", "3", 1, kWidest, "taps per row"),
                    NumbersModifier("anchor", "", 2, 0, kWidest - 1,
                                    "the tap that lies on the pixel, from 0; the middle when left out"),
                    IntegerModifier("bits", "0", 0, 32, "binary places of the buffer, 8 to 32; 0 is exact"),
                    range};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ShiftAccumulateParams p;
    p.taps = a.Numbers("TAPS");
    p.width = a.Integer("width");
    if (p.taps.size() % static_cast<size_t>(p.width) != 0) {
      throw Error("shiftaccum", "found " + std::to_string(p.taps.size()) +
                                    " taps, expected a multiple of width=" + std::to_string(p.width));
    }
    p.height = static_cast<int>(p.taps.size()) / p.width;
    if (a.Given("anchor")) {
      p.anchor_x = static_cast<int>(a.Numbers("anchor")[0]);
      p.anchor_y = static_cast<int>(a.Numbers("anchor")[1]);
    }
    p.bits = a.Integer("bits");
    p.low = a.Numbers("range")[0];
    p.high = a.Numbers("range")[1];
    return ShiftAccumulate(in[0], p);
  };
  info.identity = "1 width=1";
  info.examples = {"0.0625,0.125,0.0625,0.125,0.25,0.125,0.0625,0.125,0.0625", "-1,0,1,-2,0,2,-1,0,1",
                   "1,-2,0.5,3 width=4 anchor=3,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

AccumulationRange KernelRange(const std::vector<double>& taps, double low, double high) {
  // With 0 in the range a prefix of the taps cannot leave what all of them can reach.
  low = std::min(low, 0.0);
  high = std::max(high, 0.0);
  AccumulationRange r;
  for (const double tap : taps) {
    r.minimum += tap * (tap >= 0 ? low : high);
    r.maximum += tap * (tap >= 0 ? high : low);
  }
  const double m = std::max(std::fabs(r.minimum), std::fabs(r.maximum));
  r.scale = m > 0 ? 1 / m : 1;
  return r;
}

Node ShiftAccumulate(const Node& image, const ShiftAccumulateParams& params) {
  return ops::InDisplayWindow(image, params.wrap, [&](const Node& framed) {
    return graph::MakeNode(std::make_shared<const ops::ShiftAccumulateOp>(ops::WithAnchor(params)), {framed});
  });
}

}  // namespace tessera
