// An image's mean: rows are added as they come.
#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "graph/little_memory.h"
#include "ops/channels/channels_ops.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

// Knuth's exact sum of two.
void Add(double value, double& sum, double& lost) {
  const double total = sum + value, added = total - sum;
  lost += (sum - (total - added)) + (value - added);
  sum = total;
}

// The order of summation depends on the image alone.
class MeanStage final : public graph::RowsStage {
 public:
  explicit MeanStage(int channels) : channels_(channels), sums_(static_cast<size_t>(channels)) {}

  void Take(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const auto* const row = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
      if (channels_ == 1) {
        TakeRow<1>(row, rows.roi.width());
      } else {
        TakeRow<0>(row, rows.roi.width());
      }
    }
  }
  bool End(const graph::Workers&) override { return true; }
  void Give(const ImageView& rows) const override {
    if (rows.roi.empty()) return;
    auto* const out = reinterpret_cast<float*>(rows.At(0, 0));
    for (int c = 0; c < channels_; ++c) {
      const Sums& sums = sums_[static_cast<size_t>(c)];
      double sum = 0, lost = 0;
      for (const double v : sums.sum) Add(v, sum, lost);
      for (const double v : sums.lost) Add(v, sum, lost);
      out[c] = count_ > 0 ? static_cast<float>((sum + lost) / static_cast<double>(count_))
                          : std::numeric_limits<float>::quiet_NaN();
    }
  }

 private:
  // Every eighth column has a sum of its own: one alone would wait for itself.
  static constexpr int kSums = 8;
  struct Sums {
    double sum[kSums] = {}, lost[kSums] = {};  // and what it lost in rounding
  };

  // kChannels: their number where it is known, else 0.
  template <int kChannels>
  void TakeRow(const float* p, int width) {
    const int channels = kChannels > 0 ? kChannels : channels_;
    for (int x = 0; x < width; x += kSums, p += kSums * channels) {
      const int n = std::min(kSums, width - x);
      bool counts[kSums] = {};
      for (int i = 0; i < n; ++i) {
        float zero = 0;  // infinity less itself is NaN
        for (int c = 0; c < channels; ++c) zero += p[i * channels + c] - p[i * channels + c];
        counts[i] = zero == 0;
        count_ += counts[i];
      }
      for (int c = 0; c < channels; ++c) {
        double value[kSums] = {};
        for (int i = 0; i < n; ++i) value[i] = counts[i] ? p[i * channels + c] : 0.0f;
        Sums& sums = sums_[static_cast<size_t>(c)];
        for (int i = 0; i < kSums; ++i) Add(value[i], sums.sum[i], sums.lost[i]);
      }
    }
  }

  const int channels_;
  std::vector<Sums> sums_;
  int64_t count_ = 0;
};

class MeanWholeStage final : public graph::WholeStage {
 public:
  void Run(std::span<const ConstImageView> in, const ImageView& out, const graph::Workers&) const override {
    MeanStage stage(out.channels);
    stage.Take(in[0]);
    stage.Give(out);
  }
};

struct MeanParams {};

class MeanOp final : public graph::OpWith<MeanParams>, public graph::LittleMemory {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "mean"; }
  graph::OpKind Kind() const override { return graph::OpKind::kWhole; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    spec.data_window = spec.display_window = {0, 0, 1, 1};
    spec.type = PixelType::kFloat;
    return spec;
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext&) const override {
    return std::make_unique<MeanWholeStage>();
  }
  std::unique_ptr<graph::RowsStage> MakeRowsStage(const ImageSpec& input, Context&) const override {
    return std::make_unique<MeanStage>(input.channel_count());
  }
  bool PrefersRows() const override { return true; }
};

}  // namespace

OpInfo MeanInfo() {
  OpInfo info;
  info.name = "mean";
  info.family = "channels";
  info.summary = "The mean of all pixels, as one pixel";
  info.help =
      "The result is one pixel with the image's channels, as floats. Pixels with a sample that is not "
      "finite, in whatever channel, do not count; of an image without others the mean is NaN. Rows are "
      "added in double from the top to the bottom, so that the result depends on the image alone; the image "
      "is read once and not held in memory.";
  info.bound = "1 u; 2^-44 of the mean magnitude where samples of both signs cancel";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Mean(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Mean(const Node& image) {
  return graph::MakeNode(std::make_shared<const ops::MeanOp>(ops::MeanParams{}), {image});
}

}  // namespace tessera
