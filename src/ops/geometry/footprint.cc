// Levels of a picture for look-ups over footprints, and their stage.
#include "ops/geometry/footprint.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace tessera::ops {
namespace {

struct Tap {
  int at;
  float weight;
};

// One axis of a level from the level before. Where a picture ends, pixels are two of the level before, and
// the last one is made of what lies beyond as well: so black dims it by its share. Where it repeats there is
// nothing beyond, and a whole number of pixels fills it.
struct Halving {
  int count;
  double cell;  // a pixel of it, in pixels of the picture
  std::vector<std::vector<Tap>> taps;

  Halving(int before, int picture, int level, Wrap wrap) {
    const bool repeats = wrap == Wrap::kRepeat || wrap == Wrap::kMirror;
    const double twice = std::ldexp(1.0, level);
    count = repeats ? std::max(1, before / 2) : (before + 1) / 2;
    cell = !repeats    ? twice
           : count > 1 ? static_cast<double>(picture) / count
                       : std::max<double>(picture, twice);
    taps.resize(static_cast<size_t>(count));
    for (int64_t i = 0; i < count; ++i) {
      // In units of 1 / count of a pixel of the level before.
      const int64_t size = repeats ? before : int64_t{2} * count, from = i * size, to = from + size;
      for (int64_t j = from / count; j * count < to; ++j) {
        const int64_t part = std::min(to, (j + 1) * count) - std::max(from, j * count);
        if (j >= before && wrap == Wrap::kBlack) continue;
        taps[static_cast<size_t>(i)].push_back(
            {static_cast<int>(std::min<int64_t>(j, before - 1)),
             static_cast<float>(static_cast<double>(part) / static_cast<double>(size))});
      }
    }
  }
};

void ReduceRow(const ConstImageView& from, const Halving& x, const std::vector<Tap>& rows, float* to) {
  for (const std::vector<Tap>& columns : x.taps) {
    float sum[4] = {};
    for (const Tap& row : rows) {
      const auto* const pixels = reinterpret_cast<const float*>(from.data + from.row_stride * row.at);
      float line[4] = {};
      for (const Tap& column : columns) {
        for (int c = 0; c < 4; ++c) line[c] += column.weight * pixels[ptrdiff_t{4} * column.at + c];
      }
      for (int c = 0; c < 4; ++c) sum[c] += row.weight * line[c];
    }
    to = std::copy_n(sum, 4, to);
  }
}

class FootprintStage final : public graph::TileStage {
 public:
  FootprintStage(const GatherMap& map, FootprintFilter filter, int anisotropy, Wrap wrap,
                 const graph::StageContext& context)
      : source_(context.whole[0], wrap, context.workers), filter_(filter), anisotropy_(anisotropy) {
    const Roi& window = source_.picture.window;
    std::copy(map.m, map.m + 9, map_);
    for (int row = 0; row < 9; row += 3) {
      map_[row] -= (window.x0 + 0.5) * map_[row + 2];
      map_[row + 1] -= (window.y0 + 0.5) * map_[row + 2];
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {256, 64}; }
  void Run(const graph::TileArgs& args) const override {
    run_({source_, map_, filter_, anisotropy_, args.out, args.channels});
  }

 private:
  FootprintSource source_;
  double map_[9];
  FootprintFilter filter_;
  int anisotropy_;
  FootprintFunction run_ = ChooseFootprint();
};

}  // namespace

FootprintSource::FootprintSource(const ConstImageView& whole, Wrap w, const graph::Workers& workers)
    : picture(whole, FindFilter("warp", "triangle"), w, w, false, workers), wrap(w) {
  const int width = picture.window.width(), height = picture.window.height();
  levels.push_back({picture.groups, width, height, 1, 1});
  while (!picture.window.empty() && (levels.back().width > 1 || levels.back().height > 1)) {
    const FootprintLevel& before = levels.back();
    const int number = static_cast<int>(levels.size());
    const Halving x(before.width, width, number, wrap), y(before.height, height, number, wrap);
    FootprintLevel level{{}, x.count, y.count, x.cell, y.cell};
    for (const ConstImageView& group : before.groups) {
      kept_.push_back(
          Image::Uninitialized(ImageSpec(x.count, y.count, 4, PixelType::kFloat), workers.context()));
      const ImageView to = kept_.back().view();
      workers.For(y.count, [&](int64_t row, int) {
        ReduceRow(group, x, y.taps[static_cast<size_t>(row)],
                  reinterpret_cast<float*>(to.At(0, static_cast<int>(row))));
      });
      level.groups.emplace_back(to);
    }
    levels.push_back(std::move(level));
  }
}

bool IsFootprintFilter(const std::string& name) { return name == "trilinear" || name == "ewa"; }

std::unique_ptr<graph::TileStage> MakeFootprintStage(const GatherMap& map, const std::string& filter,
                                                     int anisotropy, Wrap wrap,
                                                     const graph::StageContext& context) {
  return std::make_unique<FootprintStage>(
      map, filter == "ewa" ? FootprintFilter::kEwa : FootprintFilter::kTrilinear, anisotropy, wrap, context);
}

}  // namespace tessera::ops
