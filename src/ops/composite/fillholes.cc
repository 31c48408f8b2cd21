// Fills what is transparent from its surroundings: push and pull through a pyramid, in double.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/composite/composite_ops.h"
#include "tessera/ops/composite.h"

namespace tessera::ops {
namespace {

// Pixels in double, rows one after the other; not cleared, which would take long and could not be cancelled.
struct Level {
  int width, height, channels;
  std::unique_ptr<double[]> samples;
  Level(int w, int h, int c)
      : width(w),
        height(h),
        channels(c),
        samples(std::make_unique_for_overwrite<double[]>(static_cast<size_t>(w) * static_cast<size_t>(h) *
                                                         static_cast<size_t>(c))) {}
  double* Row(int y) { return samples.get() + static_cast<ptrdiff_t>(y) * width * channels; }
  const double* Row(int y) const { return samples.get() + static_cast<ptrdiff_t>(y) * width * channels; }
};

// What a pixel of a resized axis is made of: a triangle as wide as two pixels of the coarser axis; beyond the
// ends the last pixel goes on.
struct Taps {
  int first = 0;
  std::vector<double> weights;
};
std::vector<Taps> TapsOf(int from, int to) {
  std::vector<Taps> all;
  // In halves of a pixel of either axis times the other's length, so that what lies at the triangle's foot
  // weighs 0 and not a rounding, which the division by alpha would make all there is.
  const int64_t foot = 2 * int64_t{std::max(from, to)};
  for (int i = 0; i < to; ++i) {
    const int64_t center = (2 * int64_t{i} + 1) * from;  // of pixel k: (2 k + 1) to
    const auto low = static_cast<int>((center - foot) / (2 * int64_t{to})) - 1,
               high = static_cast<int>((center + foot) / (2 * int64_t{to})) + 1;
    const int first = std::clamp(low, 0, from - 1), last = std::clamp(high, 0, from - 1);
    Taps taps{first, std::vector<double>(static_cast<size_t>(last - first) + 1)};
    double sum = 0;
    for (int k = low; k <= high; ++k) {
      const auto w =
          static_cast<double>(std::max(int64_t{0}, foot - std::abs((2 * int64_t{k} + 1) * to - center)));
      taps.weights[static_cast<size_t>(std::clamp(k, first, last) - first)] += w;
      sum += w;
    }
    for (double& w : taps.weights) w /= sum;
    all.push_back(std::move(taps));
  }
  return all;
}

// One row of `from` resized to `width` and height as `tall` says; a weight of 0 takes no part.
void ResizedRow(const Level& from, const std::vector<Taps>& wide, const Taps& tall,
                std::vector<double>& column, double* out) {
  const size_t n = static_cast<size_t>(from.width * from.channels);
  column.assign(n, 0.0);
  for (size_t k = 0; k < tall.weights.size(); ++k) {
    const double w = tall.weights[k];
    const double* const row = from.Row(tall.first + static_cast<int>(k));
    for (size_t i = 0; i < n && w != 0; ++i) column[i] += w * row[i];
  }
  const auto channels = static_cast<size_t>(from.channels);
  for (const Taps& taps : wide) {
    std::fill_n(out, channels, 0.0);
    for (size_t k = 0; k < taps.weights.size(); ++k) {
      const double* const pixel = column.data() + (static_cast<size_t>(taps.first) + k) * channels;
      for (size_t c = 0; c < channels && taps.weights[k] != 0; ++c) out[c] += taps.weights[k] * pixel[c];
    }
    out += channels;
  }
}

Level Smaller(const Level& big, int alpha, const graph::Workers& workers) {
  Level small(std::max(1, big.width / 2), std::max(1, big.height / 2), big.channels);
  const std::vector<Taps> wide = TapsOf(big.width, small.width), tall = TapsOf(big.height, small.height);
  workers.For(small.height, [&](int64_t y, int) {
    std::vector<double> column;
    double* pixel = small.Row(static_cast<int>(y));
    ResizedRow(big, wide, tall[static_cast<size_t>(y)], column, pixel);
    for (int x = 0; x < small.width; ++x, pixel += big.channels) {
      // Spread: what is there at all counts as all.
      const double a = pixel[alpha];
      for (int c = 0; c < big.channels && a != 0; ++c) pixel[c] /= a;
    }
  });
  return small;
}

// big over small.
void Under(Level& big, const Level& small, int alpha, const graph::Workers& workers) {
  const std::vector<Taps> wide = TapsOf(small.width, big.width), tall = TapsOf(small.height, big.height);
  workers.For(big.height, [&](int64_t y, int) {
    std::vector<double> column, behind(static_cast<size_t>(big.width * big.channels));
    ResizedRow(small, wide, tall[static_cast<size_t>(y)], column, behind.data());
    double* pixel = big.Row(static_cast<int>(y));
    for (size_t x = 0; x < behind.size(); x += static_cast<size_t>(big.channels), pixel += big.channels) {
      const double open = 1 - std::clamp(pixel[alpha], 0.0, 1.0);
      for (int c = 0; c < big.channels && open != 0; ++c)
        pixel[c] += open * behind[x + static_cast<size_t>(c)];
    }
  });
}

class FillHolesStage final : public graph::WholeStage {
 public:
  explicit FillHolesStage(int alpha) : alpha_(alpha) {}
  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    const Roi& roi = out.roi;
    if (roi.empty()) return;
    std::vector<Level> levels;
    levels.emplace_back(roi.width(), roi.height(), in[0].channels);
    const size_t n = static_cast<size_t>(roi.width() * in[0].channels);
    workers.For(roi.height(), [&](int64_t y, int) {
      const auto* const from = reinterpret_cast<const float*>(in[0].At(roi.x0, roi.y0 + static_cast<int>(y)));
      std::copy_n(from, n, levels[0].Row(static_cast<int>(y)));
    });
    while (levels.back().width > 1 || levels.back().height > 1) {
      Level small = Smaller(levels.back(), alpha_, workers);
      levels.push_back(std::move(small));
    }
    for (size_t k = levels.size() - 1; k-- > 0;) {
      Under(levels[k], levels[k + 1], alpha_, workers);
      levels.pop_back();
    }
    workers.For(roi.height(), [&](int64_t y, int) {
      const double* const from = levels[0].Row(static_cast<int>(y));
      auto* const to = reinterpret_cast<float*>(out.At(roi.x0, roi.y0 + static_cast<int>(y)));
      for (size_t i = 0; i < n; ++i) to[i] = static_cast<float>(from[i]);
    });
  }

 private:
  int alpha_;
};

class FillHolesOp final : public graph::OpWith<FillHolesParams> {
 public:
  FillHolesOp() : OpWith({}) {}
  std::string Name() const override { return "fillholes"; }
  graph::OpKind Kind() const override { return graph::OpKind::kWhole; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return std::make_unique<FillHolesStage>(context.inputs[0].alpha);
  }
};

}  // namespace

OpInfo FillHolesInfo() {
  OpInfo info;
  info.name = "fillholes";
  info.family = "composite";
  info.summary = "Fill transparent parts smoothly from their surroundings";
  info.help =
      "The image is halved again and again by a triangle filter, each time divided by its alpha where that is "
      "not 0, and then laid, level by level, over the next smaller one enlarged: pixels with alpha 1 keep their "
      "bits, others are filled from what is near, and alpha becomes 1 wherever anything is. Pixels are "
      "premultiplied. An image without alpha has no holes and comes back as it is (oiiotool refuses it). NaN "
      "and infinities spread. The image is held in memory whole, in double. As oiiotool's --fillholes, which in "
      "2.4 misses holes of an image whose data window is not its display window.";
  info.bound = "2 u |result|";
  info.bound_u = 2;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return FillHoles(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node FillHoles(const Node& image) {
  if (image.spec().alpha < 0) return image;
  return graph::MakeNode(std::make_shared<const ops::FillHolesOp>(), {image});
}

}  // namespace tessera
