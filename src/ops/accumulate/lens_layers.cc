// Depth of field by layers: pixels are spread row by row, each depth apart, and rows composited from near to
// far.
#include "ops/accumulate/lens_layers.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/arena_vector.h"
#include "model/defocus.h"
#include "ops/accumulate/aperture.h"
#include "ops/accumulate/hidden.h"
#include "ops/accumulate/scatter_kernel.h"
#include "ops/geometry/separable.h"

namespace tessera::ops {
namespace {

// Less coverage than this is what rounding has left of sums that cancel.
constexpr double kNoCoverage = 1e-9;

int BlockBegin(int x) { return x & ~(kScatterBlock - 1); }

// Neighbours within a block that are spread alike.
struct PixelRun {
  int x0 = 0, x1 = 0;
  int16_t level = 0, layer = 0;
  const float* values = nullptr;
};

// A pixel with a value that is not finite, which must not get into sums that are taken apart again.
struct Spike {
  int x = 0, y = 0;
  int16_t level = 0, layer = 0;
  const float* values = nullptr;  // with 0 where they are finite, weight included
};

// The sums of one layer along a row.
struct Layer {
  int layer = 0;
  double* cells = nullptr;
  int begin = 0, end = 0;  // columns that have been added to
};

// Pixels of one kind, those seen or those hidden beneath, of the sources' region.
struct Pixels {
  DefocusPlanes planes;
  float* values = nullptr;  // channels and the weight, which is 1
};

class LensLayersStage final : public graph::TileStage {
 public:
  LensLayersStage(const DepthOfFieldParams& p, const Roi& window, const ConstImageView* picture)
      : params_(p),
        reach_(LensReach(p.max_radius)),
        window_(window),
        aperture_(p, picture),
        scatter_(ChooseScatter()) {}

  // What is spread from `reach_` pixels away may have been found as far away again.
  Roi InputRoi(int, const Roi& out) const override {
    return Inflate({BlockBegin(out.x0), out.y0, out.x1, out.y1}, 2 * reach_, 2 * reach_);
  }
  graph::TileSize Preferred() const override { return {256, std::max(64, 2 * reach_)}; }
  void Run(const graph::TileArgs& args) const override;

  const Aperture& aperture() const { return aperture_; }
  int reach() const { return reach_; }
  ScatterFunction scatter() const { return scatter_; }

 private:
  DefocusPlanes Measure(const graph::TileArgs& args) const;

  DepthOfFieldParams params_;
  int reach_;
  Roi window_;
  Aperture aperture_;
  ScatterFunction scatter_;
};

// One tile.
class Scene {
 public:
  Scene(const LensLayersStage& stage, const DefocusPlanes& all, const ConstImageView& color, const Roi& out,
        base::Arena& scratch)
      : stage_(stage),
        color_(color),
        out_(out),
        channels_(color.channels),
        samples_(color.channels + 1),
        begin_(BlockBegin(out.x0)),
        sources_(
            Intersection(Inflate({begin_, out.y0, out.x1, out.y1}, stage.reach(), stage.reach()), all.roi)),
        scratch_(scratch),
        runs_(scratch),
        row_begins_(scratch),
        spikes_(scratch),
        layers_(scratch),
        running_(static_cast<size_t>(samples_), 0.0, scratch) {
    Prepare(all);
  }

  // One row of the result.
  void Row(int y, float* out);

 private:
  void Prepare(const DefocusPlanes& all);
  void AddRuns(const Pixels& pixels, int y);
  void MakeLayers();
  void Spread(int y);
  void AddSpikes(int y, const Layer& layer);
  void CompositeSharp(int y);
  void CompositeLayer(const Layer& layer);
  // `share` of the light that is left, at most all of it.
  void Take(int x, double coverage, const double* values);

  const LensLayersStage& stage_;
  const ConstImageView color_;
  const Roi out_;
  const int channels_, samples_;  // of a pixel; with the weight
  const int begin_;               // of the cells
  const Roi sources_;
  base::Arena& scratch_;
  Pixels seen_, hidden_;
  base::ArenaVector<PixelRun> runs_;  // by source row
  base::ArenaVector<size_t> row_begins_;
  base::ArenaVector<Spike> spikes_;
  base::ArenaVector<Layer> layers_;  // from near to far
  base::ArenaVector<double> running_;
  double* left_ = nullptr;        // per column: light that nothing has taken yet
  double* taken_ = nullptr;       // what has been
  double* results_ = nullptr;     // its colours
  uint8_t* untouched_ = nullptr;  // a sharp pixel with nothing before it
};

void Scene::Prepare(const DefocusPlanes& all) {
  const auto pixels = [&](Pixels& p) {
    p.planes = DefocusPlanes::Make(sources_, scratch_);
    p.values = scratch_.Allocate<float>(static_cast<size_t>(sources_.pixels() * samples_) + 16);
  };
  pixels(seen_), pixels(hidden_);
  FindHidden(all, color_, stage_.reach(), samples_, hidden_.planes, hidden_.values, scratch_);
  float* values = seen_.values;
  for (int y = sources_.y0; y < sources_.y1; ++y) {
    for (int x = sources_.x0; x < sources_.x1; ++x, values += samples_) {
      const ptrdiff_t i = all.Index(x, y), k = seen_.planes.Index(x, y);
      seen_.planes.level[k] = all.level[i], seen_.planes.layer[k] = all.layer[i];
      std::memcpy(values, color_.At(x, y), static_cast<size_t>(channels_) * sizeof(float));
    }
  }
  for (int y = sources_.y0; y < sources_.y1; ++y) {
    row_begins_.push_back(runs_.size());
    AddRuns(seen_, y), AddRuns(hidden_, y);
  }
  row_begins_.push_back(runs_.size());
  MakeLayers();
  const auto width = static_cast<size_t>(out_.width());
  left_ = scratch_.Allocate<double>(width), taken_ = scratch_.Allocate<double>(width);
  results_ = scratch_.Allocate<double>(width * static_cast<size_t>(channels_));
  untouched_ = scratch_.Allocate<uint8_t>(width);
}

void Scene::AddRuns(const Pixels& pixels, int y) {
  for (int x = sources_.x0; x < sources_.x1; ++x) {
    const ptrdiff_t i = pixels.planes.Index(x, y);
    const int16_t level = pixels.planes.level[i], layer = pixels.planes.layer[i];
    if (level <= kSharpLevel) continue;
    float* const values = pixels.values + i * samples_;
    values[channels_] = 1;
    if (!std::all_of(values, values + channels_, [](float v) { return std::isfinite(v); })) {
      auto* const spike = scratch_.Allocate<float>(static_cast<size_t>(channels_));
      for (int c = 0; c < channels_; ++c) {
        spike[c] = std::isfinite(values[c]) ? 0 : values[c];
        if (spike[c] != 0) values[c] = 0;
      }
      spikes_.push_back({x, y, level, layer, spike});
    }
    const bool goes_on = runs_.size() > row_begins_.back() && runs_.back().x1 == x &&
                         runs_.back().level == level && runs_.back().layer == layer &&
                         x % kScatterBlock != 0 &&
                         runs_.back().values + (x - runs_.back().x0) * samples_ == values;
    if (goes_on) {
      runs_.back().x1 = x + 1;
    } else {
      runs_.push_back({x, x + 1, level, layer, values});
    }
  }
}

void Scene::MakeLayers() {
  base::ArenaVector<int> present(scratch_);
  int last = 0;
  for (const PixelRun& run : runs_) {
    if (run.layer != last && std::find(present.begin(), present.end(), run.layer) == present.end())
      present.push_back(run.layer);
    last = run.layer;
  }
  std::sort(present.begin(), present.end());
  const auto cells = static_cast<size_t>(out_.x1 - begin_) * static_cast<size_t>(samples_);
  for (const int layer : present) {
    double* const sums = scratch_.Allocate<double>(cells);
    std::fill_n(sums, cells, 0.0);
    layers_.push_back({layer, sums, out_.x1, begin_});
  }
}

void Scene::Spread(int y) {
  Layer* layer = nullptr;
  const int reach = stage_.reach();
  for (int v = std::max(sources_.y0, y - reach); v <= std::min(sources_.y1 - 1, y + reach); ++v) {
    const auto row = static_cast<size_t>(v - sources_.y0);
    for (size_t i = row_begins_[row]; i < row_begins_[row + 1]; ++i) {
      const PixelRun& run = runs_[i];
      const ApertureRow weights = stage_.aperture().Row(run.level, run.layer < 0, y - v);
      if (weights.count == 0) continue;
      const int begin = std::max(begin_, run.x0 + weights.column[0]);
      const int end = std::min(out_.x1, run.x1 + weights.column[weights.count - 1]);
      if (begin >= end) continue;
      if (layer == nullptr || layer->layer != run.layer) {
        layer = &*std::lower_bound(layers_.begin(), layers_.end(), run.layer,
                                   [](const Layer& l, int wanted) { return l.layer < wanted; });
      }
      layer->begin = std::min(layer->begin, begin), layer->end = std::max(layer->end, end);
      stage_.scatter()({layer->cells, begin_, out_.x1, samples_}, {run.values, run.x0, run.x1, weights});
    }
  }
}

void Scene::Take(int x, double coverage, const double* values) {
  const ptrdiff_t i = x - out_.x0;
  if (!(coverage > kNoCoverage) || left_[i] == 0) return;
  const double share = coverage > left_[i] ? left_[i] / coverage : 1;
  left_[i] = coverage >= left_[i] ? 0 : left_[i] - coverage;
  taken_[i] += share * coverage;
  for (int c = 0; c < channels_; ++c) results_[i * channels_ + c] += share * values[c];
}

void Scene::AddSpikes(int y, const Layer& layer) {
  for (const Spike& spike : spikes_) {
    if (spike.layer != layer.layer) continue;
    const ApertureRow weights = stage_.aperture().Row(spike.level, spike.layer < 0, y - spike.y);
    if (weights.count == 0) continue;
    const int begin = std::max(out_.x0, spike.x + weights.column[0]);
    const int end = std::min(out_.x1, spike.x + weights.column[weights.count - 1]);
    for (int x = begin; x < end; ++x) {
      const ptrdiff_t i = x - out_.x0;
      if (left_[i] == 0 || weights.At(x - spike.x) == 0) continue;
      for (int c = 0; c < channels_; ++c) results_[i * channels_ + c] += spike.values[c];
    }
  }
}

void Scene::CompositeLayer(const Layer& layer) {
  for (int x = BlockBegin(layer.begin); x < layer.end; ++x) {
    if (x % kScatterBlock == 0) std::fill(running_.begin(), running_.end(), 0.0);
    const double* const cell = layer.cells + static_cast<ptrdiff_t>(x - begin_) * samples_;
    for (int c = 0; c < samples_; ++c) running_[static_cast<size_t>(c)] += cell[c];
    if (x >= out_.x0) Take(x, running_[static_cast<size_t>(channels_)], running_.data());
  }
}

void Scene::CompositeSharp(int y) {
  for (int x = out_.x0; x < out_.x1; ++x) {
    const ptrdiff_t i = seen_.planes.Index(x, y);
    const auto is_sharp = [&](const Pixels& p) {
      return p.planes.level[i] >= 0 && p.planes.level[i] <= kSharpLevel;
    };
    if (!is_sharp(seen_) && !is_sharp(hidden_)) continue;
    untouched_[x - out_.x0] = is_sharp(seen_) && left_[x - out_.x0] == 1;
    const float* const values = (is_sharp(seen_) ? seen_ : hidden_).values + i * samples_;
    for (int c = 0; c < channels_; ++c) running_[static_cast<size_t>(c)] = values[c];
    Take(x, 1, running_.data());
  }
}

void Scene::Row(int y, float* out) {
  const int width = out_.width();
  std::fill_n(left_, width, 1.0);
  std::fill_n(taken_, width, 0.0);
  std::fill_n(results_, ptrdiff_t{width} * channels_, 0.0);
  std::fill_n(untouched_, width, uint8_t{0});
  Spread(y);
  bool sharp_done = false;
  for (Layer& layer : layers_) {
    if (layer.layer > 0 && !sharp_done) CompositeSharp(y), sharp_done = true;
    if (layer.begin >= layer.end) continue;
    AddSpikes(y, layer);
    CompositeLayer(layer);
    std::fill(layer.cells + ptrdiff_t{layer.begin - begin_} * samples_,
              layer.cells + ptrdiff_t{layer.end - begin_} * samples_, 0.0);
    layer.begin = out_.x1, layer.end = begin_;
  }
  if (!sharp_done) CompositeSharp(y);
  for (int x = 0; x < width; ++x, out += channels_) {
    const bool no_depth = seen_.planes.level[seen_.planes.Index(out_.x0 + x, y)] < 0;
    if (no_depth || untouched_[x] != 0 || !(taken_[x] > kNoCoverage)) {
      std::memcpy(out, color_.At(out_.x0 + x, y), static_cast<size_t>(channels_) * sizeof(float));
      continue;
    }
    for (int c = 0; c < channels_; ++c)
      out[c] = static_cast<float>(results_[ptrdiff_t{x} * channels_ + c] / taken_[x]);
  }
}

DefocusPlanes LensLayersStage::Measure(const graph::TileArgs& args) const {
  const std::span<const int> present = args.in_channels[1];
  const auto channel = std::find(present.begin(), present.end(), params_.depth_channel) - present.begin();
  const Roi inputs = InputRoi(1, args.out.roi);
  const DefocusPlanes all = DefocusPlanes::Make(Intersection(inputs, window_), args.scratch);
  ptrdiff_t i = 0;
  float last = 0;  // neighbours often share a depth, and a logarithm is dear
  Defocus defocus;
  for (int y = all.roi.y0; y < all.roi.y1; ++y) {
    for (int x = all.roi.x0; x < all.roi.x1; ++x, ++i) {
      const float depth = reinterpret_cast<const float*>(args.in[1].At(x, y))[channel];
      if (depth != last) defocus = DefocusOf(params_, depth);
      last = depth;
      all.shift[i] = defocus.shift;
      all.level[i] = static_cast<int16_t>(defocus.level);
      all.layer[i] = static_cast<int16_t>(defocus.layer);
    }
  }
  return all;
}

void LensLayersStage::Run(const graph::TileArgs& args) const {
  const Roi& out = args.out.roi;
  const ConstImageView color = InputChannels(args, 0);
  const DefocusPlanes all = Measure(args);
  const bool sharp = std::all_of(all.level, all.level + all.roi.pixels(),
                                 [](int16_t level) { return level <= kSharpLevel; });
  if (sharp) {
    for (int y = out.y0; y < out.y1; ++y) {
      std::memcpy(args.out.At(out.x0, y), color.At(out.x0, y),
                  static_cast<size_t>(out.width() * args.out.channels) * sizeof(float));
    }
    return;
  }
  Scene scene(*this, all, color, out, args.scratch);
  for (int y = out.y0; y < out.y1; ++y) scene.Row(y, reinterpret_cast<float*>(args.out.At(out.x0, y)));
}

}  // namespace

std::unique_ptr<graph::TileStage> MakeLensLayersStage(const DepthOfFieldParams& params, const Roi& window,
                                                      const ConstImageView* picture) {
  return std::make_unique<LensLayersStage>(params, window, picture);
}

}  // namespace tessera::ops
