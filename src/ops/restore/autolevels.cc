// Levels by the picture's own darkest and brightest samples.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/restore/restore_ops.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

// The samples that so large a share of the finite ones lies below and above; 0 and 1 where there is none.
struct Ends {
  double low = 0, high = 1;
};
Ends EndsOf(std::vector<float>& samples, const AutoLevelsParams& p) {
  if (samples.empty()) return {};
  const auto last = static_cast<double>(samples.size() - 1);
  const auto ranked = [&](double place) {
    const auto at = samples.begin() + static_cast<ptrdiff_t>(place);
    std::nth_element(samples.begin(), at, samples.end());
    return double{*at};
  };
  return {ranked(std::floor(p.low * last)), ranked(last - std::floor(p.high * last))};
}

class AutoLevelsStage final : public graph::WholeStage {
 public:
  AutoLevelsStage(const AutoLevelsParams& p, const ImageSpec& in)
      : params_(p), channels_(ComparedChannels(in)) {}
  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    const Roi& roi = out.roi;
    if (roi.empty()) return;
    const int n = in[0].channels;
    const auto row = [&](int y) { return reinterpret_cast<const float*>(in[0].At(roi.x0, y)); };
    const auto sampled = [&](std::span<const int> channels) {
      std::vector<float> samples;
      samples.reserve(static_cast<size_t>(roi.pixels()) * channels.size());
      for (int y = roi.y0; y < roi.y1; ++y) {
        for (const float* p = row(y); p != row(y) + ptrdiff_t{roi.width()} * n; p += n) {
          for (const int c : channels) {
            if (std::isfinite(p[c])) samples.push_back(p[c]);
          }
        }
      }
      return EndsOf(samples, params_);
    };
    std::vector<Ends> ends(channels_.size());
    if (params_.apart) {
      workers.For(static_cast<int64_t>(ends.size()), [&](int64_t k, int) {
        ends[static_cast<size_t>(k)] = sampled(std::span(channels_).subspan(static_cast<size_t>(k), 1));
      });
    } else {
      std::fill(ends.begin(), ends.end(), sampled(channels_));
    }
    workers.For(roi.height(), [&](int64_t line, int) {
      const int y = roi.y0 + static_cast<int>(line);
      auto* const to = reinterpret_cast<float*>(out.At(roi.x0, y));
      std::copy_n(row(y), ptrdiff_t{roi.width()} * n, to);
      for (size_t k = 0; k < channels_.size(); ++k) {
        const Ends& e = ends[k];
        if (!(e.low < e.high)) continue;
        for (float* v = to + channels_[k]; v < to + ptrdiff_t{roi.width()} * n; v += n) {
          const double level = (double{*v} - e.low) / (e.high - e.low);
          *v = static_cast<float>(params_.clamp && level < 0 ? 0 : params_.clamp && level > 1 ? 1 : level);
        }
      }
    });
  }

 private:
  AutoLevelsParams params_;
  std::vector<int> channels_;
};

class AutoLevelsOp final : public graph::OpWith<AutoLevelsParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "autolevels"; }
  graph::OpKind Kind() const override { return graph::OpKind::kWhole; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return std::make_unique<AutoLevelsStage>(params(), context.inputs[0]);
  }
};

}  // namespace

OpInfo AutoLevelsInfo() {
  OpInfo info;
  info.name = "autolevels";
  info.family = "restore";
  info.summary = "Stretch the picture's own range to black and white";
  info.help =
      "(v - black)/(white - black), limited to [0,1]: black is the sample with the share low= of the others below it, "
      "white the one with the share high= above; 0 and 0 take the smallest and the largest. R,G,B, the first three "
      "channels but alpha, have one black and white in common, so that colours stay; apart=1 stretches each by its own, "
      "which takes a colour cast away. clamp=0 limits nothing. Samples that are not finite take no part; a picture of "
      "one value stays as it is. The image is held in memory whole. --levels sets both by hand.";
  info.bound = "2 u |result|";
  info.bound_u = 2;
  info.modifiers = {NumberModifier("low", "0.001", 0, 0.49, "the share of samples that become black"),
                    NumberModifier("high", "0.001", 0, 0.49, "the share of samples that become white"),
                    FlagModifier("apart", "1: every channel for itself"),
                    FlagModifier("clamp", "0: nothing is limited", "1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return AutoLevels(in[0], {a.Number("low"), a.Number("high"), a.Flag("apart"), a.Flag("clamp")});
  };
  info.examples = {"", "low=0.05 high=0.1 apart=1", "low=0.02 high=0 clamp=0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node AutoLevels(const Node& image, const AutoLevelsParams& p) {
  for (const double share : {p.low, p.high}) {
    if (!(share >= 0 && share <= 0.49)) {
      throw Error("autolevels", "found a share of " + base::NumberText(share) + ", expected 0 to 0.49");
    }
  }
  return graph::MakeNode(std::make_shared<const ops::AutoLevelsOp>(p), {image});
}

}  // namespace tessera
