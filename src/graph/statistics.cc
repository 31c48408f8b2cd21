// Compensated means over rows.
#include "graph/statistics.h"

#include <algorithm>
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

// Knuth's exact sum of two.
void Add(double value, double& sum, double& lost) {
  const double total = sum + value, added = total - sum;
  lost += (sum - (total - added)) + (value - added);
  sum = total;
}

}  // namespace

Node ColorOf(const Node& node) { return MakeNode(std::make_shared<const ColorChannelsOp>(), {node}); }

void MeanSink::Write(const ConstImageView& rows) {
  const int width = rows.roi.width();
  for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
    const float* p = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
    for (int x = 0; x < width; x += kSums, p += 3 * kSums) {
      const int n = std::min(kSums, width - x);
      double value[kSums] = {};
      int64_t finite = 0;
      for (int i = 0; i < n; ++i) {
        const float r = p[3 * i], g = p[3 * i + 1], b = p[3 * i + 2];
        const bool all = (r - r) + (g - g) + (b - b) == 0;  // infinity less itself is NaN
        value[i] = all ? weights_[0] * r + weights_[1] * g + weights_[2] * b : 0;
        finite += all;
      }
      for (int i = 0; i < kSums; ++i) Add(value[i], sum_[i], lost_[i]);
      count_ += finite;
    }
  }
}

double MeanSink::Mean() const {
  double sum = 0, lost = 0;
  for (const double v : sum_) Add(v, sum, lost);
  for (const double v : lost_) Add(v, sum, lost);
  return count_ > 0 ? (sum + lost) / static_cast<double>(count_) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tessera::graph
