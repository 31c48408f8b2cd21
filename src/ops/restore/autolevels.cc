// Levels by the picture's own darkest and brightest samples.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
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

// Floats in the order of their values, as integers; both zeros are one.
uint32_t OrderOf(float v) {
  const auto bits = std::bit_cast<uint32_t>(v + 0.0f);
  return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}
float FloatOf(uint32_t order) {
  return std::bit_cast<float>((order >> 31) != 0 ? order & 0x7fffffffu : ~order);
}

// How many samples have each of 65,536 halves of an order.
using Counts = std::vector<int64_t>;
// The one that the sample of a rank among them has; the rank becomes that within it.
uint32_t HalfOf(const Counts& counts, int64_t& rank) {
  size_t half = 0;
  while (rank >= counts[half]) rank -= counts[half++];
  return static_cast<uint32_t>(half);
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
    std::vector<Ends> ends(channels_.size());
    if (params_.apart) {
      for (size_t k = 0; k < ends.size(); ++k)
        ends[k] = EndsOf(in[0], std::span(channels_).subspan(k, 1), workers);
    } else {
      std::fill(ends.begin(), ends.end(), EndsOf(in[0], channels_, workers));
    }
    workers.For(roi.height(), [&](int64_t line, int) {
      const int y = roi.y0 + static_cast<int>(line);
      auto* const to = reinterpret_cast<float*>(out.At(roi.x0, y));
      std::copy_n(reinterpret_cast<const float*>(in[0].At(roi.x0, y)), ptrdiff_t{roi.width()} * n, to);
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
  // Of the finite samples of these channels, those whose order passes `counted`, by 16 of its bits.
  template <class Counted>
  static Counts CountsOf(const ConstImageView& in, std::span<const int> channels, int shift,
                         const graph::Workers& workers, const Counted& counted) {
    std::vector<Counts> own(static_cast<size_t>(workers.count()));
    workers.For(in.roi.height(), [&](int64_t line, int worker) {
      Counts& counts = own[static_cast<size_t>(worker)];
      counts.resize(1 << 16);
      const auto* const row =
          reinterpret_cast<const float*>(in.At(in.roi.x0, in.roi.y0 + static_cast<int>(line)));
      for (const float* p = row; p != row + ptrdiff_t{in.roi.width()} * in.channels; p += in.channels) {
        for (const int c : channels) {
          const uint32_t order = OrderOf(p[c]);
          if (std::isfinite(p[c]) && counted(order)) ++counts[order >> shift & 0xffff];
        }
      }
    });
    Counts all(1 << 16);
    for (const Counts& counts : own) {
      for (size_t i = 0; i < counts.size(); ++i) all[i] += counts[i];
    }
    return all;
  }
  // Exact ranks by counting: first the upper halves of the samples' orders, then the lower ones where the
  // upper is known.
  Ends EndsOf(const ConstImageView& in, std::span<const int> channels, const graph::Workers& workers) const {
    const Counts uppers = CountsOf(in, channels, 16, workers, [](uint32_t) { return true; });
    const int64_t total = std::accumulate(uppers.begin(), uppers.end(), int64_t{0});
    if (total == 0) return {};
    const auto ranked = [&](double place) {
      auto rank = static_cast<int64_t>(place);
      const uint32_t upper = HalfOf(uppers, rank);
      const Counts lowers =
          CountsOf(in, channels, 0, workers, [&](uint32_t order) { return order >> 16 == upper; });
      return double{FloatOf(upper << 16 | HalfOf(lowers, rank))};
    };
    const auto last = static_cast<double>(total - 1);
    return {ranked(std::floor(params_.low * last)), ranked(last - std::floor(params_.high * last))};
  }

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
