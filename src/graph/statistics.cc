// Compensated means over rows.
#include "graph/statistics.h"

#include <cmath>
#include <limits>

namespace tessera::graph {
namespace {

// Keeps the first three channels.
class ColorChannelsOp final : public Op {
 public:
  std::string Name() const override { return "color channels"; }
  OpKind Kind() const override { return OpKind::kShuffle; }
  const std::any& Parameters() const override { return none_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    RequireColor("mean", inputs[0]);
    ImageSpec spec = inputs[0];
    spec.channels.resize(3);
    spec.alpha = -1;
    return spec;
  }
  std::vector<ChannelRef> ChannelMap(std::span<const ImageSpec>) const override {
    return {{0, 0, 0}, {0, 1, 0}, {0, 2, 0}};
  }

 private:
  std::any none_;
};

}  // namespace

Node ColorOf(const Node& node) { return MakeNode(std::make_shared<const ColorChannelsOp>(), {node}); }

void MeanSink::Add(double value) {
  const double total = sum_ + value;
  lost_ += std::fabs(sum_) >= std::fabs(value) ? (sum_ - total) + value : (value - total) + sum_;
  sum_ = total;
}

void MeanSink::Write(const ConstImageView& rows) {
  for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
    const float* p = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
    for (int x = 0; x < rows.roi.width(); ++x, p += 3) {
      if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
      Add(weights_[0] * p[0] + weights_[1] * p[1] + weights_[2] * p[2]);
      ++count_;
    }
  }
}

double MeanSink::Mean() const {
  return count_ > 0 ? (sum_ + lost_) / static_cast<double>(count_) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tessera::graph
