// Histogram equalisation of whole images.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/flow/flow_ops.h"
#include "tessera/ops/flow.h"

namespace tessera::ops::flow {
namespace {

constexpr int kClasses = 65536;

class EqualizeStage final : public graph::WholeStage {
 public:
  explicit EqualizeStage(int alpha) : alpha_(alpha) {}
  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    workers.For(out.channels, [&](int64_t c, int) { Channel(in[0], static_cast<int>(c), out); });
  }

 private:
  // f(sample, result) where alpha, if there is one, is not 0; other samples stay as they are.
  template <class F>
  void ForEach(const ConstImageView& in, int channel, const ImageView& out, const F& f) const {
    for (int y = in.roi.y0; y < in.roi.y1; ++y) {
      const auto* from = reinterpret_cast<const float*>(in.At(in.roi.x0, y, channel));
      auto* to = reinterpret_cast<float*>(out.At(in.roi.x0, y, channel));
      for (int x = 0; x < in.roi.width(); ++x) {
        const bool counts = alpha_ < 0 || from[x * in.channels + alpha_ - channel] != 0;
        if (counts && !std::isnan(from[x * in.channels])) {
          f(from[x * in.channels], to[x * in.channels]);
        } else {
          to[x * in.channels] = from[x * in.channels];
        }
      }
    }
  }
  void Channel(const ConstImageView& in, int channel, const ImageView& out) const {
    if (channel == alpha_) return ForEach(in, channel, out, [](float v, float& to) { to = v; });
    float low = std::numeric_limits<float>::infinity(), high = -low;
    ForEach(in, channel, out, [&](float v, float&) {
      if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    });
    const double scale = high > low ? (kClasses - 1) / (double{high} - low) : 0;
    const auto class_of = [&](float v) {
      if (!std::isfinite(v)) return v > 0 ? kClasses - 1 : 0;
      return static_cast<int>(std::lround((double{v} - low) * scale));
    };
    std::vector<int64_t> count(kClasses);
    int64_t total = 0;
    ForEach(in, channel, out, [&](float v, float&) { ++count[static_cast<size_t>(class_of(v))], ++total; });
    std::vector<float> share(kClasses);
    int64_t below = 0;
    for (size_t i = 0; i < kClasses && total > 0; ++i) {
      share[i] = static_cast<float>((static_cast<double>(below) + 0.5 * static_cast<double>(count[i])) /
                                    static_cast<double>(total));
      below += count[i];
    }
    ForEach(in, channel, out, [&](float v, float& to) { to = share[static_cast<size_t>(class_of(v))]; });
  }

  int alpha_;
};

struct EqualizeParams {};

class EqualizeOp final : public graph::OpWith<EqualizeParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "equalize"; }
  graph::OpKind Kind() const override { return graph::OpKind::kWhole; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return std::make_unique<EqualizeStage>(context.output.alpha);
  }
};

}  // namespace
}  // namespace tessera::ops::flow

namespace tessera::ops {

OpInfo EqualizeInfo() {
  OpInfo info;
  info.name = "equalize";
  info.family = "flow";
  info.summary = "Histogram equalisation";
  info.help =
      "Each sample becomes the share of the channel's samples that are smaller, plus half of those in its "
      "own of 65,536 classes between the smallest and the largest number: results spread evenly over [0,1]. "
      "Alpha, NaN and pixels of alpha 0 stay and do not count, infinities count with the extremes, an image "
      "of one value becomes 1/2.";
  info.help += " The image and the result are held in memory whole.";
  info.bound = "1 u; of computed images the share of the samples in a value's class and its two neighbours";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Equalize(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Equalize(const Node& image) {
  return graph::MakeNode(std::make_shared<const ops::flow::EqualizeOp>(ops::flow::EqualizeParams{}), {image});
}

}  // namespace tessera
