// Histogram equalisation of whole images.
#include <algorithm>
#include <cmath>
#include <cstdint>
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
    std::vector<Classes> classes(static_cast<size_t>(out.channels));
    for (int c = 0; c < out.channels; ++c) {
      if (c != alpha_) classes[static_cast<size_t>(c)] = ClassesOf(in[0], c, workers);
    }
    const int n = out.channels;
    ForRows(in[0], workers, [&](int y, const float* from, int) {
      auto* const to = reinterpret_cast<float*>(out.At(out.roi.x0, y));
      std::copy_n(from, ptrdiff_t{in[0].roi.width()} * n, to);
      for (int c = 0; c < n; ++c) {
        if (c == alpha_) continue;
        const Classes& of = classes[static_cast<size_t>(c)];
        ForCounted(in[0], c, from, [&](float v, ptrdiff_t at) { to[at] = of.share[of.Of(v)]; });
      }
    });
  }

 private:
  // A channel's classes, and what becomes of their samples.
  struct Classes {
    float low = 0;
    double scale = 0;
    std::vector<float> share;
    size_t Of(float v) const {
      if (!std::isfinite(v)) return v > 0 ? kClasses - 1 : 0;
      return static_cast<size_t>(std::lround((double{v} - low) * scale));
    }
  };
  // What one thread has seen.
  struct Seen {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    std::vector<int64_t> count;
  };

  template <class F>
  static void ForRows(const ConstImageView& in, const graph::Workers& workers, const F& f) {
    workers.For(in.roi.height(), [&](int64_t row, int worker) {
      const int y = in.roi.y0 + static_cast<int>(row);
      f(y, reinterpret_cast<const float*>(in.At(in.roi.x0, y)), worker);
    });
  }
  // f(sample, its place in the row) where alpha, if there is one, is not 0; NaN does not count.
  template <class F>
  void ForCounted(const ConstImageView& in, int channel, const float* row, const F& f) const {
    for (int x = 0; x < in.roi.width(); ++x) {
      const ptrdiff_t pixel = ptrdiff_t{x} * in.channels, at = pixel + channel;
      if ((alpha_ < 0 || row[pixel + alpha_] != 0) && !std::isnan(row[at])) f(row[at], at);
    }
  }
  Classes ClassesOf(const ConstImageView& in, int channel, const graph::Workers& workers) const {
    std::vector<Seen> seen(static_cast<size_t>(workers.count()));
    ForRows(in, workers, [&](int, const float* row, int worker) {
      Seen& s = seen[static_cast<size_t>(worker)];
      ForCounted(in, channel, row, [&](float v, ptrdiff_t) {
        if (std::isfinite(v)) s.low = std::min(s.low, v), s.high = std::max(s.high, v);
      });
    });
    Seen all;
    for (const Seen& s : seen) all.low = std::min(all.low, s.low), all.high = std::max(all.high, s.high);
    Classes classes;
    classes.low = all.low;
    classes.scale = all.high > all.low ? (kClasses - 1) / (double{all.high} - all.low) : 0;
    ForRows(in, workers, [&](int, const float* row, int worker) {
      std::vector<int64_t>& count = seen[static_cast<size_t>(worker)].count;
      count.resize(kClasses);
      ForCounted(in, channel, row, [&](float v, ptrdiff_t) { ++count[classes.Of(v)]; });
    });
    all.count.resize(kClasses);
    int64_t total = 0;
    for (const Seen& s : seen) {
      for (size_t i = 0; i < s.count.size(); ++i) all.count[i] += s.count[i], total += s.count[i];
    }
    classes.share.resize(kClasses);
    int64_t below = 0;
    for (size_t i = 0; i < kClasses && total > 0; ++i) {
      const int64_t own = all.count[i];
      classes.share[i] = static_cast<float>((static_cast<double>(below) + 0.5 * static_cast<double>(own)) /
                                            static_cast<double>(total));
      below += own;
    }
    return classes;
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
