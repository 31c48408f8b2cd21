// Noise at the positions that an image holds (a G-buffer's P): every kind and lattice, with slopes and domain
// warp, and with periods of each position's own.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/field.h"
#include "ops/noise/noise_ops.h"
#include "ops/noise/point_field.h"
#include "tessera/error_kind.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {
namespace {

// Channels of a position: with low parts coordinates are sums of two.
int Coordinates(const NoiseParams& p) { return p.low_parts ? 2 * p.dims : p.dims; }

class NoiseAtStage final : public graph::TileStage {
 public:
  NoiseAtStage(const NoiseParams& params, const ImageSpec& in, const ImageSpec& out, bool own_periods)
      : params_(params),
        kernels_(FindNoiseKernels()),
        alpha_(out.alpha),
        width_(out.width()),
        low_(params.low_parts),
        own_periods_(own_periods) {
    if (params.kind == NoiseKind::kSimplex)
      longest_ = static_cast<float>(kLongestSimplexPeriod /
                                    std::pow(params.lacunarity, std::max(params.octaves - 1, 0)));
    const int fields = HasFieldPerChannel(params) ? out.channel_count() : 1;
    for (int c = 0; c < fields; ++c) {
      fields_.emplace_back(FieldParams(params, c), params.output == NoiseOutput::kColor ? c : 0);
    }
    for (int a = 0; a < params.dims && params.warp != 0; ++a) warp_.emplace_back(WarpParams(params, a), 0);
    if (!low_ && !own_periods_ && fields_[0].HasPoints(std::min(in.channel_count(), 64)))
      points_ = FindNoisePoints(params.dims);
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  // Positions are read once, in the order of memory.
  graph::TileSize Preferred() const override { return {width_, std::max(16, 65536 / std::max(width_, 1))}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    Work w(*this, args);
    for (int y = r.y0; y < r.y1; ++y) {
      const bool complete = w.straight && Straight(args, y, w);
      if (w.alone && complete) continue;
      for (int x = r.x0; x < r.x1; x += kNoiseBatch) {
        const int count = std::min(kNoiseBatch, r.x1 - x);
        if (complete) {
          for (size_t c = 0; c < fields_.size(); ++c) std::copy_n(w.rows[c] + (x - r.x0), count, w.values[c]);
        } else {
          Batch(args, x, y, count, w);
        }
        kernels_.interleave(w.planes.data(), static_cast<int>(args.channels.size()), count,
                            reinterpret_cast<float*>(args.out.At(x, y)));
      }
      if (w.straight) std::fill_n(w.wrong, r.width(), 0u);
    }
  }

 private:
  static constexpr int kDone = -1;  // in place of a period
  // Of a batch whose positions have periods of their own.
  struct Groups {
    explicit Groups(base::Arena& arena) : coordinates(arena), values(arena) {}
    NoisePeriods* periods = nullptr;
    int* member = nullptr;                  // positions with the same periods
    base::ArenaVector<float*> coordinates;  // theirs
    base::ArenaVector<float*> values;       // of all positions, of every field
    float* slopes[4] = {};
  };
  // A tile's scratch memory.
  struct Work {
    Work(const NoiseAtStage& stage, const graph::TileArgs& args)
        : arena(args.scratch),
          scratch(arena),
          ones(Floats(1)),
          zeros(Floats()),
          values(arena),
          planes(arena),
          coordinates(arena),
          rows(arena),
          point_rows(arena) {
      for (int a = 0; a < 4; ++a)
        cell[a] = Floats(), fraction[a] = Floats(), warp[a] = Floats(), slopes[a] = Floats();
      invalid = arena.Allocate<uint32_t>(kNoiseBatch);
      for (size_t c = 0; c < stage.fields_.size(); ++c) values.push_back(Floats());
      for (int c : args.channels) planes.push_back(PlaneOf(stage, c));
      const ConstImageView& in = args.in[0];
      for (int c = 0; c < in.channels; ++c) coordinates.push_back(Floats());
      if (stage.own_periods_) groups = MakeGroups();
      straight = stage.points_ != nullptr && in.channels >= stage.params_.dims && in.channels <= 4;
      if (!straight) return;
      const size_t width = static_cast<size_t>(args.out.roi.width()) + kNoiseBatch;
      wrong = arena.Allocate<uint32_t>(width);
      std::fill_n(wrong, width, 0u);
      for (const PointField& field : stage.fields_) {
        rows.push_back(arena.Allocate<float>(width));
        point_rows.push_back(field.Points(in.channels, arena));
      }
      alone = planes.size() == 1 && planes[0] == values[0];
    }
    float* Floats(float value = 0) {
      float* const p = arena.Allocate<float>(kNoiseBatch);
      std::fill_n(p, kNoiseBatch, value);
      return p;
    }
    Groups* MakeGroups() {
      Groups* const g = new (arena.Allocate<Groups>(1)) Groups(arena);
      g->periods = arena.Allocate<NoisePeriods>(kNoiseBatch);
      std::fill_n(g->periods, kNoiseBatch, NoisePeriods{});
      g->member = arena.Allocate<int>(kNoiseBatch);
      for (size_t c = 0; c < coordinates.size(); ++c) g->coordinates.push_back(Floats());
      for (size_t c = 0; c < values.size(); ++c) g->values.push_back(Floats());
      for (float*& slope : g->slopes) slope = Floats();
      return g;
    }
    // What channel `c` of the result shows.
    const float* PlaneOf(const NoiseAtStage& stage, int c) const {
      const NoiseOutput output = stage.params_.output;
      if (output == NoiseOutput::kNormal) return c < 3 ? slopes[c] : c == 3 ? values[0] : zeros;
      if (HasSlopes(stage.params_))
        return c == 0 ? values[0] : c <= stage.params_.dims ? slopes[c - 1] : zeros;
      if (c == stage.alpha_ && output != NoiseOutput::kOctaves) return ones;
      return values[values.size() > 1 ? static_cast<size_t>(c) : 0];
    }
    bool Wants(const float* plane) const {
      return std::find(planes.begin(), planes.end(), plane) != planes.end();
    }

    base::Arena& arena;
    const PointField::Scratch scratch;
    float *cell[4], *fraction[4], *warp[4], *slopes[4];
    uint32_t* invalid = nullptr;
    float *const ones, *const zeros;
    base::ArenaVector<float*> values;        // of every field
    base::ArenaVector<const float*> planes;  // of the result
    base::ArenaVector<float*> coordinates;   // of the input
    // Straight from the positions, where the kernel serves; where positions are far away, by batches.
    // `alone`: it writes the result.
    bool straight = false, alone = false;
    uint32_t* wrong = nullptr;
    base::ArenaVector<float*> rows;
    base::ArenaVector<PointRow> point_rows;
    Groups* groups = nullptr;  // where positions have periods of their own
  };

  // Whether all of a row was within the kernel's reach.
  bool Straight(const graph::TileArgs& args, int y, Work& w) const {
    const Roi& r = args.out.roi;
    bool complete = true;
    for (size_t c = 0; c < fields_.size(); ++c) {
      if (!w.Wants(w.values[c])) continue;
      PointRow& row = w.point_rows[c];
      row.in = reinterpret_cast<const float*>(args.in[0].At(r.x0, y));
      row.count = r.width();
      row.out = w.alone ? reinterpret_cast<float*>(args.out.At(r.x0, y)) : w.rows[c];
      row.wrong = w.wrong;
      complete = points_(row) && complete;
    }
    return complete;
  }

  // Noise at coordinates, by channels of the input as they are there.
  void Evaluate(const graph::TileArgs& args, int count, float* const* coordinates,
                const NoisePeriods& periods, Work& w) const {
    const bool gradient = HasSlopes(params_);
    const auto plane_of = [&](int channel) {
      const auto present = std::find(args.in_channels[0].begin(), args.in_channels[0].end(), channel);
      return coordinates[present - args.in_channels[0].begin()];
    };
    std::fill_n(w.invalid, kNoiseBatch, 0u);
    for (int a = 0; a < params_.dims; ++a) {
      PositionBatch b;
      b.count = count;
      b.high = plane_of(a);
      b.low = low_ ? plane_of(params_.dims + a) : nullptr;
      b.scale = fields_[0].ScaleOf(a, periods[static_cast<size_t>(a)]);
      b.cell = w.cell[a];
      b.fraction = w.fraction[a];
      b.invalid = w.invalid;
      kernels_.position(b);
    }
    PointField::Batch batch;
    batch.count = count;
    batch.base_cell = w.cell;
    batch.base_fraction = w.fraction;
    batch.invalid = w.invalid;
    batch.periods = periods;
    for (size_t a = 0; a < warp_.size(); ++a) warp_[a].Run(batch, w.scratch, w.warp[a], nullptr);
    if (!warp_.empty()) batch.warp = w.warp;
    for (size_t c = 0; c < fields_.size(); ++c) {
      if (!gradient && !w.Wants(w.values[c])) continue;
      fields_[c].Run(batch, w.scratch, w.values[c], gradient ? w.slopes : nullptr);
    }
  }

  // Positions with the same periods are brought together: periods are whole and change along edges.
  void EvaluateInGroups(const graph::TileArgs& args, int x, int y, int count, Work& w) const {
    Groups& g = *w.groups;
    const auto* const own = reinterpret_cast<const float*>(args.in[1].At(x, y));
    const int channels = args.in[1].channels;
    for (int i = 0; i < count; ++i) {
      for (int a = 0; a < params_.dims; ++a)
        g.periods[i][static_cast<size_t>(a)] = WholePeriod(own[i * channels + (channels > 1 ? a : 0)]);
    }
    const bool gradient = HasSlopes(params_);
    for (int done = 0, first = 0; done < count; ++first) {
      if (g.periods[first][0] == kDone) continue;
      const NoisePeriods periods = g.periods[first];
      int members = 0;
      for (int i = first; i < count; ++i) {
        if (g.periods[i] != periods) continue;
        g.member[members++] = i;
        g.periods[i][0] = kDone;
      }
      done += members;
      for (size_t c = 0; c < w.coordinates.size(); ++c)
        for (int k = 0; k < members; ++k) g.coordinates[c][k] = w.coordinates[c][g.member[k]];
      Evaluate(args, members, g.coordinates.data(), periods, w);
      const auto scatter = [&](const float* from, float* to) {
        for (int k = 0; k < members; ++k) to[g.member[k]] = from[k];
      };
      for (size_t c = 0; c < fields_.size(); ++c) scatter(w.values[c], g.values[c]);
      for (int a = 0; a < params_.dims && gradient; ++a) scatter(w.slopes[a], g.slopes[a]);
    }
    for (size_t c = 0; c < fields_.size(); ++c) std::copy_n(g.values[c], count, w.values[c]);
    for (int a = 0; a < params_.dims && gradient; ++a) std::copy_n(g.slopes[a], count, w.slopes[a]);
  }
  int WholePeriod(float v) const {
    const float whole = std::floor(v);
    return whole >= 1 && whole <= longest_ ? static_cast<int>(whole) : 0;
  }

  void Batch(const graph::TileArgs& args, int x, int y, int count, Work& w) const {
    kernels_.separate(reinterpret_cast<const float*>(args.in[0].At(x, y)), args.in[0].channels, count,
                      w.coordinates.data());
    if (own_periods_) {
      EvaluateInGroups(args, x, y, count, w);
    } else {
      Evaluate(args, count, w.coordinates.data(), params_.period, w);
    }
    if (w.straight) {  // each pixel by its own position, whatever its neighbours are
      const int first = x - args.out.roi.x0;
      const float* const made = reinterpret_cast<const float*>(args.out.At(x, y));
      for (size_t c = 0; c < fields_.size(); ++c) {
        const float* const row = w.alone ? made : w.rows[c] + first;
        float* const value = w.values[c];
        for (int i = 0; i < count; ++i) value[i] = w.wrong[first + i] != 0 ? value[i] : row[i];
      }
    }
    if (params_.output == NoiseOutput::kNormal)
      kernels_.normal(w.slopes, params_.dims, count, params_.is_signed);
  }

  NoiseParams params_;
  NoiseKernels kernels_;
  int alpha_ = -1, width_ = 0;
  bool low_ = false, own_periods_ = false;
  float longest_ = 1 << 24;  // of a position's own periods
  std::vector<PointField> fields_, warp_;
  NoisePoints points_ = nullptr;
};

class NoiseAtOp final : public graph::OpWith<NoiseParams> {
 public:
  NoiseAtOp(NoiseParams params, int channels) : OpWith(std::move(params)), channels_(channels) {}
  std::string Name() const override { return "noiseat"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const int found = inputs[0].channel_count(), needed = Coordinates(params());
    if (found < needed) {
      throw DataError("noiseat", "found " + std::to_string(found) + " channels, expected at least " +
                                     std::to_string(needed) + ", dims=" + std::to_string(params().dims) +
                                     " coordinates" + (params().low_parts ? " and their low parts" : ""));
    }
    if (inputs.size() > 1) {
      graph::RequireSameWindow("noiseat", inputs);
      const int periods = inputs[1].channel_count();
      if (periods != 1 && periods < params().dims) {
        throw DataError("noiseat", "found " + std::to_string(periods) +
                                       " channels of periods, expected one or " +
                                       std::to_string(params().dims));
      }
    }
    ImageSpec spec = inputs[0];
    spec.channels = DefaultChannelNames(channels_);
    spec.alpha = spec.ChannelIndex("A");
    spec.type = PixelType::kFloat;
    return spec;
  }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::fill_n(needed.begin(), k == 0 ? Coordinates(params()) : std::min(in.channel_count(), params().dims),
                true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<NoiseAtStage>(params(), context.inputs[0], context.output,
                                          context.inputs.size() > 1);
  }

 private:
  int channels_;
};

void CheckNoiseAt(const NoiseParams& params, int channels) {
  CheckNoise("noiseat", params);
  CheckPacking("noiseat", params, channels);
  if (channels < 1)
    throw Error("noiseat:channels", "found " + std::to_string(channels) + ", expected at least 1");
  if (params.slices != 1) throw Error("noiseat:slices", "found slices, which only grids have");
  if (params.method != NoiseMethod::kAuto)
    throw Error("noiseat:method", "found accumulation, which only grids have");
}

void CheckOwnPeriods(const NoiseParams& p) {
  const auto refuse = [](const std::string& why) { throw Error("noiseat:periods", "found " + why); };
  if (std::any_of(p.period.begin(), p.period.end(), [](int n) { return n != 0; }))
    refuse("period= too, expected one of them");
  if (p.kind == NoiseKind::kGabor)
    refuse("gabor noise, whose impulses are laid out for one period: expected period=, or another type");
  if (p.lattice == NoiseLattice::kPerlin ||
      (p.lattice == NoiseLattice::kOsl && p.kind == NoiseKind::kSimplex))
    refuse("a noise that has none as it is published, expected another type or lattice");
  if (p.octaves > 1 && p.lacunarity != std::floor(p.lacunarity))
    refuse("lacunarity=" + base::NumberText(p.lacunarity) +
           ", expected a whole number, or octaves would not repeat with the first");
}

}  // namespace

OpInfo NoiseAtInfo() {
  OpInfo info;
  info.name = "noiseat";
  info.family = "noise";
  info.operands = [](const Arguments& a) { return a.Flag("periods") ? 2 : 1; };
  info.summary = "Noise at the positions held in an image";
  info.help =
      "The positions of an AOV file, found by their names, else the first dims= channels, are coordinates, "
      "times freq= (cells per unit) plus offset=. low=1 adds channel dims + i to channel i, of the first 2 "
      "dims channels, for positions of 48 bits. type= is one of the noise generators, whose modifiers "
      "apply. The result has channels= channels. A position that is NaN or infinite gives noise 0.\n"
      "POSITION PERIODS --noiseat:periods=1 takes from the second image what period= says once for all: "
      "cells, one channel or one per coordinate, rounded down; below 1, NaN, and above 2^24 is none. Open "
      "Shading Language's pnoise has its period so, and takes what is below 1 as 1.\n"
      "Source: van Wijk 1991, 4 (spots on surfaces); Perlin 1985.";
  info.bound = "3e-6 times the sum of the octaves' weights, for positions whose product with freq is exact";
  info.bound_u = 20;
  ParamInfo type = ChoiceModifier(
      "type", {"perlin", "white", "value", "simplex", "cell", "sparse", "spot", "hash", "gabor"},
      "kind of noise");
  info.modifiers = {type, IntegerModifier("channels", "1", 1, 64, "channels of the result"),
                    FlagModifier("periods", "periods are given, above the positions"),
                    FlagModifier("low", "channels dims + i are low parts, added to channels i")};
  constexpr std::pair<const char*, const char*> kTypesOf[] = {
      {"fade", "perlin|value"},   {"distance", "cell"}, {"jitter", "cell"},
      {"density", "sparse|spot"}, {"stretch", "spot"},  {"angle", "spot|gabor"}};
  for (NoiseKind kind :
       {NoiseKind::kGradient, NoiseKind::kWhite, NoiseKind::kCell, NoiseKind::kSpot, NoiseKind::kGabor}) {
    for (ParamInfo& param : NoiseModifiers(kind)) {
      if (param.name == "freq") param.default_value = "1", param.help = "cells per unit of position";
      if (param.name == "dims") param.default_value = "3", param.min = 1;
      for (const auto& [name, types] : kTypesOf) {
        if (param.name == name) param.only_with = std::string("type=") + types;
      }
      if (param.name == "slices" || param.name == "antialias" || param.name == "method") continue;
      const bool known = std::any_of(info.modifiers.begin(), info.modifiers.end(),
                                     [&](const ParamInfo& other) { return other.name == param.name; });
      if (!known) info.modifiers.push_back(std::move(param));
    }
  }
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    NoiseKind kind = NoiseKind::kGradient;
    for (int k = 0; k <= static_cast<int>(NoiseKind::kGabor); ++k) {
      if (a.Text("type") == NoiseName(static_cast<NoiseKind>(k))) kind = static_cast<NoiseKind>(k);
    }
    NoiseParams p = NoiseArguments(kind, a);
    p.low_parts = a.Flag("low");
    const bool named = !p.low_parts && p.dims <= 3 && !FindAov(in[0].spec(), Aov::kPosition).empty();
    const Node position = named ? PositionsOf(in[0]) : in[0];
    return in.size() > 1 ? NoiseAt(position, in[1], p, a.Integer("channels"))
                         : NoiseAt(position, p, a.Integer("channels"));
  };
  info.examples = {"", "freq=3.7 octaves=4 channels=4", "dims=1 low=1", "type=gabor dims=2 freq=3",
                   "periods=1 freq=9 octaves=2"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node NoiseAt(const Node& position, const NoiseParams& params, int channels) {
  ops::CheckNoiseAt(params, channels);
  return graph::MakeNode(std::make_shared<const ops::NoiseAtOp>(params, channels), {position});
}

Node NoiseAt(const Node& position, const Node& periods, const NoiseParams& params, int channels) {
  ops::CheckNoiseAt(params, channels);
  ops::CheckOwnPeriods(params);
  return graph::MakeNode(std::make_shared<const ops::NoiseAtOp>(params, channels), {position, periods});
}

}  // namespace tessera
