// One noise at batches of positions.
#include "ops/noise/point_field.h"

#include <algorithm>
#include <cmath>

#include "ops/noise/field.h"

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

}  // namespace

PointField::PointField(const NoiseParams& params, int channel)
    : plan_(MakeNoisePlan(params, false, channel)), kernels_(FindNoiseKernels()) {
  slopes_ = HasSlopes(params);
  if (params.lattice != NoiseLattice::kPerlin) {
    evaluate_ = FindNoise(params.kind, params.lattice, params.dims, slopes_);
  }
}

PositionScale PointField::ScaleOf(int axis, int period) const {
  PositionScale scale;
  Split(plan_.step[axis], scale.frequency);
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
std::pair<uint32_t, float> PointField::ShiftOf(const NoiseOctave& octave, int axis, int period) const {
  const double moved = period > 0 ? 0.0 : std::floor(plan_.shift[axis]);
  const double scale = octave.lattice[axis];
  const auto [cell, fraction] = WholeAndFraction(moved * scale);
  // The product's rounding, and the octave's own shift.
  const double rounding = std::fma(moved, scale, -(moved * scale));
  return {cell, static_cast<float>(fraction + rounding + octave.shift[axis])};
}

uint32_t PointField::PeriodOf(const NoiseOctave& octave, int axis, int period) const {
  if (period == plan_.params.period[static_cast<size_t>(axis)]) return octave.period[axis];
  const double cells = period * octave.scale;
  return cells < 4294967296.0 ? static_cast<uint32_t>(cells) : 0;
}

bool PointField::HasPoints(int channels) const {
  const NoiseParams& p = plan_.params;
  const bool period = std::any_of(p.period.begin(), p.period.end(), [](int n) { return n != 0; });
  return p.kind == NoiseKind::kGradient && p.lattice == NoiseLattice::kTessera &&
         (p.dims == 2 || p.dims == 3) && !slopes_ && !period && p.warp == 0 && p.bias == 0.5 &&
         p.contrast == 0.5 && channels >= p.dims && channels <= 4;
}

PointRow PointField::Points(int channels, base::Arena& arena) const {
  const NoiseParams& p = plan_.params;
  PointRow row;
  row.channels = channels;
  row.plain = true;
  for (int a = 0; a < p.dims; ++a) {
    const PositionScale scale = ScaleOf(a, p.period[static_cast<size_t>(a)]);
    std::copy_n(scale.frequency, 2, row.frequency[a]);
    row.offset[a] = scale.offset;
    row.plain = row.plain && scale.frequency[1] == 0 && scale.offset == 0;
  }
  PointOctave* const octaves = arena.Allocate<PointOctave>(plan_.octaves.size());
  for (const NoiseOctave& octave : plan_.octaves) {
    PointOctave o;
    Split(octave.scale, o.scale);
    for (int a = 0; a < p.dims; ++a) {
      const auto [cell, shift] = ShiftOf(octave, a, p.period[static_cast<size_t>(a)]);
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

PointField::Scratch::Scratch(base::Arena& arena) {
  for (int a = 0; a < 4; ++a) {
    cell[a] = arena.Allocate<uint32_t>(kNoiseBatch);
    fraction[a] = arena.Allocate<float>(kNoiseBatch);
    slope[a] = arena.Allocate<float>(kNoiseBatch);
    std::fill_n(cell[a], kNoiseBatch, 0u);
    std::fill_n(fraction[a], kNoiseBatch, 0.0f);
  }
  value = arena.Allocate<float>(kNoiseBatch);
}

void PointField::Run(const Batch& in, const Scratch& s, float* out, float* const* slopes) const {
  const int count = in.count;
  const NoiseParams& p = plan_.params;
  std::fill_n(out, kNoiseBatch, plan_.bias);
  for (int a = 0; a < p.dims && slopes != nullptr; ++a) std::fill_n(slopes[a], kNoiseBatch, 0.0f);
  for (const NoiseOctave& octave : plan_.octaves) {
    uint32_t period[4] = {};
    for (int a = 0; a < p.dims; ++a) {
      OctaveBatch b;
      b.count = count;
      b.cell = in.base_cell[a];
      b.fraction = in.base_fraction[a];
      Split(octave.lattice[a], b.scale);
      const int whole = in.periods[static_cast<size_t>(a)];
      const auto [cell, shift] = ShiftOf(octave, a, whole);
      period[a] = PeriodOf(octave, a, whole);
      b.shift = shift;
      b.shift_cell = cell;
      b.period = period[a];
      b.nearest = p.kind == NoiseKind::kHash && period[a] == 0;
      b.out_cell = s.cell[a];
      b.out_fraction = s.fraction[a];
      kernels_.octave(b);
      if (in.warp != nullptr) {
        kernels_.displace({count, in.warp[a], static_cast<float>(p.warp * octave.lattice[a]), period[a],
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
      batch.period[a] = period[a];
      if (slopes != nullptr) batch.slope[a] = s.slope[a];
    }
    Evaluate(batch);
    kernels_.clear(in.invalid, count, s.value);
    kernels_.accumulate({count, s.value, p.sum, octave.weight, out});
    for (int a = 0; a < p.dims && slopes != nullptr; ++a) {
      kernels_.clear(in.invalid, count, s.slope[a]);
      const float weight = octave.weight * static_cast<float>(octave.scale);
      for (int i = 0; i < count; ++i)
        slopes[a][i] += weight * (ShapeSlope(p.sum, s.value[i]) * s.slope[a][i]);
    }
  }
  if (slopes == nullptr && (p.bias != 0.5 || p.contrast != 0.5)) {
    for (int i = 0; i < count; ++i) out[i] = BentValue(p, out[i]);
  }
}

void PointField::Evaluate(const NoiseBatch& b) const {
  if (evaluate_ != nullptr) return evaluate_(b);
  PerlinBatch(b, plan_.params.dims);
}

}  // namespace tessera::ops
