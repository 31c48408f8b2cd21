// Noise at the positions that an image holds (a G-buffer's P): every kind and lattice, with slopes and domain
// warp.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/field.h"
#include "ops/noise/noise_ops.h"
#include "tessera/error_kind.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {
namespace {

// A float and what is left of the double.
void Split(double value, float parts[2]) {
  parts[0] = static_cast<float>(value);
  parts[1] = static_cast<float>(value - parts[0]);
}

// A double of any size as whole number modulo 2^32 and fraction.
std::pair<uint32_t, double> WholeAndFraction(double value) {
  const double whole = std::floor(value);
  double cell = std::fmod(whole, 4294967296.0);
  if (cell < 0) cell += 4294967296.0;
  return {static_cast<uint32_t>(cell), value - whole};
}

// One noise at batches of positions.
class PointField {
 public:
  PointField(const NoiseParams& params, int channel)
      : plan_(MakeNoisePlan(params, false, channel)), kernels_(FindNoiseKernels()) {
    slopes_ = HasSlopes(params);
    if (params.lattice != NoiseLattice::kPerlin) {
      evaluate_ = FindNoise(params.kind, params.lattice, params.dims, slopes_);
    }
  }
  const NoisePlan& plan() const { return plan_; }

  // Position of the first octave, shared by fields of the same frequency, offset and period.
  PositionScale ScaleOf(int axis) const {
    PositionScale scale;
    Split(plan_.step[axis], scale.frequency);
    const int period = plan_.params.period[static_cast<size_t>(axis)];
    double offset = plan_.shift[axis];
    if (period > 0) offset -= period * std::floor(offset / period);
    const double whole = std::floor(offset);
    scale.offset = static_cast<float>(offset - whole);
    // Without a period the whole part is added to the cells of octaves, where it is exact.
    scale.offset_whole = period > 0 ? static_cast<float>(whole) : 0.0f;
    scale.period = static_cast<float>(period);
    scale.nearest = plan_.params.kind == NoiseKind::kHash;
    return scale;
  }

  // What is added to an octave's cells and fractions.
  std::pair<uint32_t, float> ShiftOf(const NoiseOctave& octave, int axis) const {
    const bool periodic = plan_.params.period[static_cast<size_t>(axis)] > 0;
    const double moved = periodic ? 0.0 : std::floor(plan_.shift[axis]);
    const auto [cell, fraction] = WholeAndFraction(moved * octave.scale);
    // The product's rounding, and the octave's own shift.
    const double rounding = std::fma(moved, octave.scale, -(moved * octave.scale));
    return {cell, static_cast<float>(fraction + rounding + octave.shift[axis])};
  }

  // Whether Points() serves positions of so many channels.
  bool HasPoints(int channels) const {
    const NoiseParams& p = plan_.params;
    const bool period = std::any_of(p.period.begin(), p.period.end(), [](int n) { return n != 0; });
    return p.kind == NoiseKind::kGradient && p.lattice == NoiseLattice::kTessera &&
           (p.dims == 2 || p.dims == 3) && !slopes_ && !period && p.warp == 0 && p.bias == 0.5 &&
           p.contrast == 0.5 && channels >= p.dims && channels <= 4;
  }
  // The kernel's parameters, but for a row's; octaves lie in the arena.
  PointRow Points(int channels, base::Arena& arena) const {
    const NoiseParams& p = plan_.params;
    PointRow row;
    row.channels = channels;
    row.plain = true;
    for (int a = 0; a < p.dims; ++a) {
      const PositionScale scale = ScaleOf(a);
      std::copy_n(scale.frequency, 2, row.frequency[a]);
      row.offset[a] = scale.offset;
      row.plain = row.plain && scale.frequency[1] == 0 && scale.offset == 0;
    }
    PointOctave* const octaves = arena.Allocate<PointOctave>(plan_.octaves.size());
    for (const NoiseOctave& octave : plan_.octaves) {
      PointOctave o;
      Split(octave.scale, o.scale);
      for (int a = 0; a < p.dims; ++a) {
        const auto [cell, shift] = ShiftOf(octave, a);
        o.cell[a] = cell;
        o.shift[a] = shift;
        o.scaled = o.scaled || shift != 0;
      }
      o.scaled = o.scaled || octave.scale != 1;
      o.seed = octave.seed;
      o.weight = octave.weight;
      octaves[row.octave_count++] = o;
    }
    row.octaves = octaves;
    row.fade = plan_.shape.fade;
    row.scale = plan_.shape.scale;
    row.sum = p.sum;
    row.bias = plan_.bias;
    return row;
  }

  struct Scratch {
    uint32_t* cell[4];
    float* fraction[4];
    float* value;
    float* slope[4];
    explicit Scratch(base::Arena& arena) {
      for (int a = 0; a < 4; ++a) {
        cell[a] = arena.Allocate<uint32_t>(kNoiseBatch);
        fraction[a] = arena.Allocate<float>(kNoiseBatch);
        slope[a] = arena.Allocate<float>(kNoiseBatch);
        std::fill_n(cell[a], kNoiseBatch, 0u);
        std::fill_n(fraction[a], kNoiseBatch, 0.0f);
      }
      value = arena.Allocate<float>(kNoiseBatch);
    }
  };

  // `base_cell`, `base_fraction`: positions in cells; `warp`: displacements per axis or null; `out` and
  // `slopes` are set.
  void Run(int count, float* const* base_cell, float* const* base_fraction, const uint32_t* invalid,
           float* const* warp, const Scratch& s, float* out, float* const* slopes) const {
    const NoiseParams& p = plan_.params;
    std::fill_n(out, kNoiseBatch, plan_.bias);
    for (int a = 0; a < p.dims && slopes != nullptr; ++a) std::fill_n(slopes[a], kNoiseBatch, 0.0f);
    for (const NoiseOctave& octave : plan_.octaves) {
      for (int a = 0; a < p.dims; ++a) {
        OctaveBatch b;
        b.count = count;
        b.cell = base_cell[a];
        b.fraction = base_fraction[a];
        Split(octave.scale, b.scale);
        const auto [cell, shift] = ShiftOf(octave, a);
        b.shift = shift;
        b.shift_cell = cell;
        b.period = octave.period[a];
        b.nearest = p.kind == NoiseKind::kHash && octave.period[a] == 0;
        b.out_cell = s.cell[a];
        b.out_fraction = s.fraction[a];
        kernels_.octave(b);
        if (warp != nullptr) {
          kernels_.displace({count, warp[a], static_cast<float>(p.warp * octave.scale), octave.period[a],
                             s.cell[a], s.fraction[a]});
        }
      }
      NoiseBatch batch;
      batch.count = count;
      batch.seed = octave.seed;
      batch.shape = &plan_.shape;
      batch.value = s.value;
      for (int a = 0; a < 4; ++a) {
        batch.cell[a] = s.cell[a];
        batch.fraction[a] = s.fraction[a];
        batch.period[a] = octave.period[a];
        if (slopes != nullptr) batch.slope[a] = s.slope[a];
      }
      Evaluate(batch);
      kernels_.clear(invalid, count, s.value);
      kernels_.accumulate({count, s.value, p.sum, octave.weight, out});
      for (int a = 0; a < p.dims && slopes != nullptr; ++a) {
        kernels_.clear(invalid, count, s.slope[a]);
        const float weight = octave.weight * static_cast<float>(octave.scale);
        for (int i = 0; i < count; ++i)
          slopes[a][i] += weight * (ShapeSlope(p.sum, s.value[i]) * s.slope[a][i]);
      }
    }
    if (slopes == nullptr && (p.bias != 0.5 || p.contrast != 0.5)) {
      for (int i = 0; i < count; ++i) out[i] = BentValue(p, out[i]);
    }
  }

 private:
  void Evaluate(const NoiseBatch& b) const {
    if (evaluate_ != nullptr) return evaluate_(b);
    PerlinBatch(b, plan_.params.dims);
  }

  NoisePlan plan_;
  NoiseKernels kernels_;
  NoiseEvaluate evaluate_ = nullptr;
  bool slopes_ = false;
};

// Channels of a position: with low parts coordinates are sums of two.
int Coordinates(const NoiseParams& p) { return p.low_parts ? 2 * p.dims : p.dims; }

class NoiseAtStage final : public graph::TileStage {
 public:
  NoiseAtStage(const NoiseParams& params, const ImageSpec& in, const ImageSpec& out)
      : params_(params),
        kernels_(FindNoiseKernels()),
        alpha_(out.alpha),
        width_(out.width()),
        low_(params.low_parts) {
    const int fields = HasFieldPerChannel(params) ? out.channel_count() : 1;
    for (int c = 0; c < fields; ++c) {
      fields_.emplace_back(FieldParams(params, c), params.output == NoiseOutput::kColor ? c : 0);
    }
    for (int a = 0; a < params.dims; ++a) scale_[a] = fields_[0].ScaleOf(a);
    for (int a = 0; a < params.dims && params.warp != 0; ++a) warp_.emplace_back(WarpParams(params, a), 0);
    if (!low_ && fields_[0].HasPoints(std::min(in.channel_count(), 64)))
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

  void Batch(const graph::TileArgs& args, int x, int y, int count, Work& w) const {
    const bool gradient = HasSlopes(params_);
    const auto plane_of = [&](int channel) {
      const auto present = std::find(args.in_channels[0].begin(), args.in_channels[0].end(), channel);
      return w.coordinates[static_cast<size_t>(present - args.in_channels[0].begin())];
    };
    std::fill_n(w.invalid, kNoiseBatch, 0u);
    kernels_.separate(reinterpret_cast<const float*>(args.in[0].At(x, y)), args.in[0].channels, count,
                      w.coordinates.data());
    for (int a = 0; a < params_.dims; ++a) {
      PositionBatch b;
      b.count = count;
      b.high = plane_of(a);
      b.low = low_ ? plane_of(params_.dims + a) : nullptr;
      b.scale = scale_[a];
      b.cell = w.cell[a];
      b.fraction = w.fraction[a];
      b.invalid = w.invalid;
      kernels_.position(b);
    }
    for (size_t a = 0; a < warp_.size(); ++a) {
      warp_[a].Run(count, w.cell, w.fraction, w.invalid, nullptr, w.scratch, w.warp[a], nullptr);
    }
    for (size_t c = 0; c < fields_.size(); ++c) {
      if (!gradient && !w.Wants(w.values[c])) continue;
      fields_[c].Run(count, w.cell, w.fraction, w.invalid, warp_.empty() ? nullptr : w.warp, w.scratch,
                     w.values[c], gradient ? w.slopes : nullptr);
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
  bool low_ = false;
  std::vector<PointField> fields_, warp_;
  NoisePoints points_ = nullptr;
  PositionScale scale_[4];
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
    ImageSpec spec = inputs[0];
    spec.channels = DefaultChannelNames(channels_);
    spec.alpha = spec.ChannelIndex("A");
    spec.type = PixelType::kFloat;
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::fill_n(needed.begin(), Coordinates(params()), true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<NoiseAtStage>(params(), context.inputs[0], context.output);
  }

 private:
  int channels_;
};

}  // namespace

OpInfo NoiseAtInfo() {
  OpInfo info;
  info.name = "noiseat";
  info.family = "noise";
  info.summary = "Noise at the positions held in an image";
  info.help =
      "The positions of an AOV file, found by their names, else the first dims= channels, are coordinates, "
      "times freq= (cells per unit) plus offset=. low=1 adds channel dims + i to channel i, of the first "
      "2 dims channels, for positions of 48 bits. type= is one of the noise generators, whose modifiers "
      "apply. The result "
      "has channels= channels. A position that is NaN or infinite gives noise 0.\n"
      "Source: van Wijk 1991, 4 (spots on surfaces); Perlin 1985.";
  info.bound = "3e-6 times the sum of the octaves' weights, for positions whose product with freq is exact";
  info.bound_u = 20;
  ParamInfo type = ChoiceModifier(
      "type", {"perlin", "white", "value", "simplex", "cell", "sparse", "spot", "hash"}, "kind of noise");
  info.modifiers = {type, IntegerModifier("channels", "1", 1, 64, "channels of the result"),
                    FlagModifier("low", "channels dims + i are low parts, added to channels i")};
  constexpr std::pair<const char*, const char*> kTypesOf[] = {
      {"fade", "perlin|value"},   {"distance", "cell"}, {"jitter", "cell"},
      {"density", "sparse|spot"}, {"stretch", "spot"},  {"angle", "spot"}};
  for (NoiseKind kind : {NoiseKind::kGradient, NoiseKind::kWhite, NoiseKind::kCell, NoiseKind::kSpot}) {
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
    for (int k = 0; k <= static_cast<int>(NoiseKind::kHash); ++k) {
      if (a.Text("type") == NoiseName(static_cast<NoiseKind>(k))) kind = static_cast<NoiseKind>(k);
    }
    NoiseParams p = NoiseArguments(kind, a);
    p.low_parts = a.Flag("low");
    const bool named = !p.low_parts && p.dims <= 3 && !FindAov(in[0].spec(), Aov::kPosition).empty();
    return NoiseAt(named ? PositionsOf(in[0]) : in[0], p, a.Integer("channels"));
  };
  info.examples = {"", "freq=3.7 octaves=4 channels=4", "dims=1 low=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node NoiseAt(const Node& position, const NoiseParams& params, int channels) {
  ops::CheckNoise("noiseat", params);
  ops::CheckPacking("noiseat", params, channels);
  if (channels < 1)
    throw Error("noiseat:channels", "found " + std::to_string(channels) + ", expected at least 1");
  if (params.slices != 1) throw Error("noiseat:slices", "found slices, which only grids have");
  if (params.method != NoiseMethod::kAuto)
    throw Error("noiseat:method", "found accumulation, which only grids have");
  return graph::MakeNode(std::make_shared<const ops::NoiseAtOp>(params, channels), {position});
}

}  // namespace tessera
