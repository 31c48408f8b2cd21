// The mean of an image, in long double.
#include <cmath>
#include <limits>

#include "reference/reference.h"

namespace tessera::reference {
namespace {

class MeanReduction final : public Reduction {
 public:
  explicit MeanReduction(int channels)
      : sum_(static_cast<size_t>(channels)), size_(static_cast<size_t>(channels)) {}

  void Take(const ImageD& band) override {
    const auto channels = sum_.size();
    for (size_t at = 0; at < band.samples.size(); at += channels) {
      bool counts = true;
      for (size_t c = 0; c < channels; ++c) counts = counts && std::isfinite(band.samples[at + c]);
      if (!counts) continue;
      ++count_;
      for (size_t c = 0; c < channels; ++c) {
        sum_[c] += band.samples[at + c];
        size_[c] += std::fabs(band.samples[at + c]);
      }
    }
  }

  // The engine adds in double; a mean of both signs may cancel.
  void Give(ImageD& out, ImageD* scale) const override {
    const auto count = static_cast<long double>(count_);
    for (size_t c = 0; c < out.samples.size(); ++c) {
      out.samples[c] =
          count_ > 0 ? static_cast<double>(sum_[c] / count) : std::numeric_limits<double>::quiet_NaN();
      if (scale == nullptr) continue;
      scale->samples[c] =
          count_ > 0 ? std::fabs(out.samples[c]) + 0x1p-20 * static_cast<double>(size_[c] / count) : 0;
    }
  }

 private:
  std::vector<long double> sum_, size_;
  int64_t count_ = 0;
};

std::unique_ptr<Reduction> NewMean(const ImageSpec& input) {
  return std::make_unique<MeanReduction>(input.channel_count());
}

void EvaluateMean(const Call& call) {
  MeanReduction mean(call.out.channels);
  mean.Take(call.in[0]);
  mean.Give(call.out, call.scale);
}

Roi Everything(const std::any&, int, const Roi&) {
  constexpr int kFar = std::numeric_limits<int>::max() / 2;
  return {-kFar, -kFar, kFar, kFar};
}

}  // namespace

std::vector<Entry> MeanEntries() {
  Entry mean{"mean", EvaluateMean, Everything};
  mean.reduction = NewMean;
  return {mean};
}

}  // namespace tessera::reference
