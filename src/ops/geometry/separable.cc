// Taps of both axes, the region they read, and the choice between the separable kernel and the plain 2-D sum.
#include "ops/geometry/separable.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/arena_vector.h"
#include "base/tile.h"
#include "ops/codes.h"

namespace tessera::ops {
namespace {

class SeparableStage final : public graph::TileStage {
 public:
  SeparableStage(const SeparableMap& map, PixelType type)
      : x_(MakeAxisTaps(map.x, *map.filter, map.wrap)),
        y_(MakeAxisTaps(map.y, *map.filter, map.wrap)),
        wrap_(map.wrap),
        type_(type),
        run_(ChooseResample()) {}

  Roi InputRoi(int, const Roi& out) const override {
    Roi in;
    x_.Range(out.x0, out.x1, &in.x0, &in.x1);
    y_.Range(out.y0, out.y1, &in.y0, &in.y1);
    return in.empty() ? Roi{} : in;
  }
  Wrap InputBorder(int) const override { return wrap_; }
  // Wide enough that rows prefetch, small enough that the rows of a wide filter stay in L2, also where a
  // result takes many of them; halving reads every row once.
  graph::TileSize Preferred() const override {
    if (x_.halves && y_.halves) return {4096, 32};
    const auto side = [](const AxisTaps& taps, int full, int least) {
      const int results = static_cast<int>(taps.first.size());
      int s0, s1;
      taps.Range(taps.begin, taps.begin + results, &s0, &s1);
      const int64_t sources = std::max(1, s1 - s0);
      return static_cast<int>(
          std::clamp<int64_t>(2 * int64_t{full} * results / sources / 16 * 16, least, full));
    };
    return {side(x_, 512, 64), side(y_, 128, 16)};
  }
  bool Accepts(PixelType type) const override {
    return type == PixelType::kFloat || (type == type_ && LargestCode(type) != 0 && x_.halves && y_.halves);
  }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = args.out.type == PixelType::kFloat ? InputChannels(args, 0) : args.in[0];
    run_({in, args.out, x_, y_, args.stream, args.scratch, LargestCode(type_)});
  }

 private:
  AxisTaps x_, y_;
  Wrap wrap_;
  PixelType type_;
  ResampleFunction run_;
};

// A filter of the radius: every pixel within reach, one at a time, sums in double.
class RadialStage final : public graph::TileStage {
 public:
  explicit RadialStage(const SeparableMap& map) : map_(map) {}

  Roi InputRoi(int, const Roi& out) const override {
    const auto reach = [&](const AxisMap& m, int i0, int i1, int* s0, int* s1) {
      const double radius = map_.filter->width / 2 / m.scale;
      *s0 = std::clamp(static_cast<int>(std::floor(Centre(m, i0) - radius)), m.source0, m.source1 - 1);
      *s1 = std::clamp(static_cast<int>(std::ceil(Centre(m, i1 - 1) + radius)), m.source0, m.source1 - 1) + 1;
    };
    Roi in;
    reach(map_.x, out.x0, out.x1, &in.x0, &in.x1);
    reach(map_.y, out.y0, out.y1, &in.y0, &in.y1);
    return in.empty() ? Roi{} : in;
  }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = InputChannels(args, 0);
    const int channels = args.out.channels;
    const std::span<double> sum(args.scratch.Allocate<double>(static_cast<size_t>(channels)),
                                static_cast<size_t>(channels));
    for (int y = args.out.roi.y0; y < args.out.roi.y1; ++y) {
      for (int x = args.out.roi.x0; x < args.out.roi.x1; ++x) {
        Pixel(in, x, y, sum);
        auto* const out = reinterpret_cast<float*>(args.out.At(x, y));
        for (int c = 0; c < channels; ++c) out[c] = static_cast<float>(sum[static_cast<size_t>(c)]);
      }
    }
  }

 private:
  static double Centre(const AxisMap& m, int i) { return m.origin + (i + 0.5) * m.step - 0.5; }

  void Pixel(const ConstImageView& in, int x, int y, std::span<double> sum) const {
    const double cx = Centre(map_.x, x), cy = Centre(map_.y, y);
    const double rx = map_.filter->width / 2 / map_.x.scale, ry = map_.filter->width / 2 / map_.y.scale;
    std::fill(sum.begin(), sum.end(), 0.0);
    double total = 0;
    for (int64_t j = std::llround(std::ceil(cy - ry)); j <= std::floor(cy + ry); ++j) {
      for (int64_t i = std::llround(std::ceil(cx - rx)); i <= std::floor(cx + rx); ++i) {
        const double w = map_.filter->value(std::hypot((static_cast<double>(i) - cx) * map_.x.scale,
                                                       (static_cast<double>(j) - cy) * map_.y.scale));
        if (w == 0) continue;
        total += w;
        const auto at = [](int64_t v, const AxisMap& m) {
          return static_cast<int>(std::clamp<int64_t>(v, m.source0, m.source1 - 1));
        };
        const auto* const pixel = reinterpret_cast<const float*>(in.At(at(i, map_.x), at(j, map_.y)));
        for (size_t c = 0; c < sum.size(); ++c) sum[c] += w * pixel[c];
      }
    }
    for (double& v : sum) v = total == 0 ? 0 : v / total;
  }

  SeparableMap map_;
};

}  // namespace

std::unique_ptr<graph::TileStage> MakeSeparableStage(const SeparableMap& map, PixelType codes) {
  if (!map.filter->separable) return std::make_unique<RadialStage>(map);
  return std::make_unique<SeparableStage>(map, codes);
}

ConstImageView InputChannels(const graph::TileArgs& args, size_t k) {
  const ConstImageView& in = args.in[k];
  const std::span<const int> wanted = args.channels, present = args.in_channels[k];
  if (std::equal(wanted.begin(), wanted.end(), present.begin(), present.end())) return in;
  const ImageView picked = base::NewTile(args.scratch, in.roi, static_cast<int>(wanted.size()));
  base::ArenaVector<ptrdiff_t> from(args.scratch);
  for (const int c : wanted) from.push_back(std::find(present.begin(), present.end(), c) - present.begin());
  for (int y = in.roi.y0; y < in.roi.y1; ++y) {
    for (int x = in.roi.x0; x < in.roi.x1; ++x) {
      const auto* const source = reinterpret_cast<const float*>(in.At(x, y));
      auto* const to = reinterpret_cast<float*>(picked.At(x, y));
      for (size_t c = 0; c < from.size(); ++c) to[c] = source[from[c]];
    }
  }
  return picked;
}

}  // namespace tessera::ops
