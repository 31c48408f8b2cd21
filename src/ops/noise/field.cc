// Rows of noise on a grid: the collapse where it serves, batches of positions elsewhere.
#include "ops/noise/field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "simd/lattice.h"

namespace tessera::ops {
namespace {

using simd::kAxis;

// Hash noise is of the position's float: no cell, and all of it as fraction.
LatticePlace Whole(const NoisePlan& plan, const LatticePlace& place) {
  if (plan.params.kind != NoiseKind::kHash) return place;
  return {0, static_cast<int32_t>(place.cell) + place.fraction};
}

uint32_t NextCell(uint32_t cell, uint32_t period) { return cell + 1 == period ? 0 : cell + 1; }

}  // namespace

float ShapeSlope(NoiseSum sum, float n) {
  const float sign = n > 0 ? 1.0f : n < 0 ? -1.0f : 0.0f;
  switch (sum) {
    case NoiseSum::kFbm:
      return 1;
    case NoiseSum::kTurbulence:
      return sign;
    case NoiseSum::kBillow:
      return 2 * sign;
    default:
      return -2 * sign * (1 - std::fabs(n));
  }
}

float BentValue(const NoiseParams& p, float v) {
  return p.is_signed ? 2 * BiasAndGain(p.bias, p.contrast, 0.5f + 0.5f * v) - 1
                     : BiasAndGain(p.bias, p.contrast, v);
}

NoiseParams WarpParams(const NoiseParams& params, int axis) {
  NoiseParams inner = params;
  inner.warp = 0;
  inner.octaves = 1;
  inner.weights.clear();
  inner.kind = NoiseKind::kGradient;
  inner.lattice = NoiseLattice::kTessera;
  inner.fade = NoiseFade::kQuintic;
  inner.output = NoiseOutput::kValue;
  inner.sum = NoiseSum::kFbm;
  inner.is_signed = true;
  inner.antialias = false;
  inner.bias = inner.contrast = 0.5;
  inner.seed = OctaveSeed(params.seed, 1000 + axis, 0);
  return inner;
}

float BiasAndGain(double bias, double contrast, float t) {
  double v = std::clamp<double>(t, 0, 1);
  if (bias != 0.5) v = std::pow(v, std::log(bias) / std::log(0.5));
  if (contrast != 0.5) {
    const double exponent = std::log(1 - contrast) / std::log(0.5);
    v = v < 0.5 ? 0.5 * std::pow(2 * v, exponent) : 1 - 0.5 * std::pow(2 - 2 * v, exponent);
  }
  return static_cast<float>(v);
}

GridColumns TileColumns(const GridKernels& grid, const std::vector<int32_t>& left,
                        const std::vector<float>& fraction, const std::vector<float>& fade, size_t from,
                        size_t width, base::Arena& arena) {
  GridColumns columns;
  columns.first = left[from];
  // The last vector's pixels beyond the row look columns up too.
  const size_t whole = (width + kNoisePadding - 1) / kNoisePadding * kNoisePadding;
  columns.count = left[from + whole - 1] + 2 - columns.first;
  columns.fraction = fraction.data() + from;
  columns.fade = fade.data() + from;
  columns.layout.base = arena.Allocate<int32_t>(width + kNoisePadding);
  columns.layout.index = arena.Allocate<int32_t>(width + kNoisePadding);
  columns.layout.runs = arena.Allocate<GridRun>(width + kNoisePadding);
  grid.arrange(left.data() + from, static_cast<int>(width), columns.layout);
  return columns;
}

GridField::GridField(const NoiseParams& params, const Roi& data, int channel, bool moved)
    : plan_(MakeNoisePlan(params, true, channel)),
      kernels_(FindNoiseKernels()),
      grid_(FindGridKernels()),
      x0_(data.x0),
      x1_(data.x1) {
  slopes_ = HasSlopes(params);
  collapses_ = params.lattice == NoiseLattice::kTessera && params.dims >= 2 && !slopes_ && params.warp == 0 &&
               !moved && (params.kind == NoiseKind::kGradient || params.kind == NoiseKind::kValue);
  if (params.lattice != NoiseLattice::kPerlin) {
    evaluate_ = FindNoise(params.kind, params.lattice, params.dims, slopes_);
  }
  if (params.warp != 0) {
    for (int a = 0; a < params.dims; ++a) {
      warp_.push_back(std::make_unique<GridField>(WarpParams(params, a), data, 0));
    }
  }
  columns_.resize(plan_.octaves.size());
  for (size_t k = 0; k < columns_.size(); ++k) Prepare(plan_.octaves[k], columns_[k]);
  PrepareRows(data);
}

// Rows of slices repeat: their places are worked out once.
void GridField::PrepareRows(const Roi& data) {
  const NoiseParams& p = plan_.params;
  const bool stacked = p.slices > 1;
  first_row_ = stacked ? 0 : data.y0 - p.frame.y0;
  const int count = stacked ? std::max(p.frame.height() / p.slices, 1) : data.height();
  rows_.resize(plan_.octaves.size());
  for (size_t k = 0; k < rows_.size(); ++k) {
    Rows& rows = rows_[k];
    std::vector<float> fraction;
    for (int row = first_row_; row < first_row_ + count; ++row) {
      rows.place.push_back(PlaceOf(plan_, plan_.octaves[k], 1, row + 0.5));
      fraction.push_back(static_cast<float>(rows.place.back().fraction));
    }
    fraction.resize(fraction.size() + kNoisePadding, 0);
    std::vector<float> fade(fraction.size());
    kernels_.fade(fraction.data(), count, plan_.shape.fade, fade.data());
    for (size_t i = 0; i < rows.place.size(); ++i) {
      rows.between.push_back(Between(plan_.octaves[k], rows.place[i], fade[i]));
    }
  }
}

GridField::RowPlace GridField::Between(const NoiseOctave& octave, const LatticePlace& place,
                                       float fade) const {
  return {{(place.cell * kAxis[1]) ^ octave.seed,
           (NextCell(place.cell, octave.period[1]) * kAxis[1]) ^ octave.seed},
          static_cast<float>(place.fraction),
          fade};
}

void GridField::Prepare(const NoiseOctave& octave, Columns& columns) const {
  const int origin = plan_.params.frame.x0;
  // Whole batches, so that kernels may read and write whole vectors.
  const size_t padded = static_cast<size_t>(std::max(x1_ - x0_, 0) / kNoiseBatch + 2) * kNoiseBatch;
  const bool perlin = plan_.params.lattice == NoiseLattice::kPerlin;
  columns.fraction.reserve(padded);
  uint32_t right = 0;
  for (int x = x0_; x < x1_; ++x) {
    const LatticePlace place = Whole(plan_, PlaceOf(plan_, octave, 0, x - origin + 0.5));
    columns.fraction.push_back(static_cast<float>(place.fraction));
    if (perlin) columns.position.push_back((place.cell & 255) + place.fraction);
    if (!collapses_) {
      columns.cell.push_back(place.cell);
      continue;
    }
    // Lattice columns as they are met; neighbours share one.
    const size_t n = columns.hash.size();
    const uint32_t hash = place.cell * kAxis[0];
    if (n == 0 || columns.hash[n - 2] != hash) {
      if (n == 0 || place.cell != right) columns.hash.push_back(hash);
      right = NextCell(place.cell, octave.period[0]);
      columns.hash.push_back(right * kAxis[0]);
    }
    columns.left.push_back(static_cast<int32_t>(columns.hash.size()) - 2);
  }
  if (x1_ <= x0_) return;
  columns.fraction.resize(padded, columns.fraction.back());
  if (perlin) columns.position.resize(padded, 0);
  if (!collapses_) {
    columns.cell.resize(padded, 0);
    return;
  }
  columns.left.resize(padded, columns.left.back());
  columns.hash.resize(columns.hash.size() + 2 * kNoisePadding, 0);
  columns.fade.resize(padded);
  kernels_.fade(columns.fraction.data(), static_cast<int>(padded), plan_.shape.fade, columns.fade.data());
  if (plan_.params.method == NoiseMethod::kAccumulate) {
    columns.stencil.pixels = PixelsPerCell(plan_, octave);
    PrepareStencil(columns);
  }
}

GridCursor::GridCursor(const GridField& field, int x0, int x1, base::Arena& arena)
    : field_(field),
      x0_(x0),
      x1_(x1),
      rows_(arena),
      place_{base::ArenaVector<LatticePlace>(arena), base::ArenaVector<LatticePlace>(arena),
             base::ArenaVector<LatticePlace>(arena)},
      warp_(arena),
      warp_row_(arena) {
  const NoisePlan& plan = field.plan_;
  const size_t octaves = plan.octaves.size();
  for (auto& place : place_) place.resize(octaves);
  bent_ = plan.params.bias != 0.5 || plan.params.contrast != 0.5;
  if (field.collapses_) {
    Collapse(arena);
    return;
  }
  value_ = arena.Allocate<float>(kNoiseBatch);
  for (int a = 0; a < 4; ++a) {
    cell_[a] = arena.Allocate<uint32_t>(kNoiseBatch);
    fraction_[a] = arena.Allocate<float>(kNoiseBatch);
    std::fill_n(cell_[a], kNoiseBatch, 0u);
    std::fill_n(fraction_[a], kNoiseBatch, 0.0f);
    if (field.slopes_) slope_[a] = arena.Allocate<float>(kNoiseBatch);
  }
  for (const auto& warp : field.warp_) {
    warp_.emplace_back(*warp, x0, x1, arena);
    float* const row = arena.Allocate<float>(static_cast<size_t>(x1 - x0) + kNoiseBatch);
    std::fill_n(row, static_cast<size_t>(x1 - x0) + kNoiseBatch, 0.0f);
    warp_row_.push_back(row);
  }
}

// Prepares what all rows of the tile share.
void GridCursor::Collapse(base::Arena& arena) {
  const NoisePlan& plan = field_.plan_;
  rows_.resize(plan.octaves.size());
  const auto from = static_cast<size_t>(x0_ - field_.x0_), width = static_cast<size_t>(x1_ - x0_);
  const bool gradient = plan.params.kind == NoiseKind::kGradient;
  size_t most = 0;
  for (size_t k = 0; k < rows_.size(); ++k) {
    const GridField::Columns& columns = field_.columns_[k];
    GridRow& row = rows_[k].row;
    row.columns = TileColumns(field_.grid_, columns.left, columns.fraction, columns.fade, from, width, arena);
    const size_t padded = static_cast<size_t>(row.columns.count) + 2 * kNoisePadding;
    most = std::max(most, padded);
    for (GridLatticeRow* lattice : {&row.lower, &row.upper}) {
      lattice->gx = arena.Allocate<float>(padded);
      lattice->gy = arena.Allocate<float>(padded);
      lattice->rest = arena.Allocate<float>(padded);
    }
    row.count = x1_ - x0_;
    row.scale = plan.shape.scale / field_.grid_.fill_unit(plan.params.dims, gradient);
    row.sum = plan.params.sum;
    row.weight = plan.octaves[k].weight;
    row.bias = plan.bias;
    row.add = k > 0;
    GridFill& fill = rows_[k].fill;
    fill.column_hash = columns.hash.data() + row.columns.first;
    fill.count = row.columns.count;
    fill.dims = plan.params.dims;
    fill.gradient = gradient;
  }
  float* const scratch = arena.Allocate<float>(4 * most);
  for (Rows& rows : rows_) rows.row.scratch = scratch;
  if (plan.params.method == NoiseMethod::kAccumulate) {
    for (const auto& columns : field_.columns_) margin_ = std::max(margin_, 2 * columns.stencil.pixels);
    margin_ += kNoisePadding;
    stamped_ = arena.Allocate<float>(width + static_cast<size_t>(2 * margin_ + kNoiseBatch));
  }
}

void GridCursor::EnterSlice(int y) {
  const NoiseParams& p = field_.plan_.params;
  const int height = std::max(p.frame.height() / p.slices, 1), row = y - p.frame.y0;
  const int slice = std::clamp(row / height - (row % height < 0 ? 1 : 0), 0, p.slices - 1);
  slice_top_ = p.frame.y0 + slice * height;
  slice_begin_ = slice > 0 ? slice_top_ : std::numeric_limits<int>::min();
  slice_end_ = slice < p.slices - 1 ? slice_top_ + height : std::numeric_limits<int>::max();
  for (size_t k = 0; k < field_.plan_.octaves.size(); ++k) PlaceSlice(k, slice);
}

LatticePlace GridCursor::RowPlaceOf(size_t k) const {
  const std::vector<LatticePlace>& places = field_.rows_[k].place;
  const auto known = static_cast<size_t>(row_ - field_.first_row_);
  return known < places.size() ? places[known]
                               : PlaceOf(field_.plan_, field_.plan_.octaves[k], 1, row_ + 0.5);
}

// The third and fourth coordinate of an octave.
void GridCursor::PlaceSlice(size_t k, int slice) {
  const NoiseOctave& octave = field_.plan_.octaves[k];
  const int dims = field_.plan_.params.dims;
  if (dims > 2) place_[1][k] = PlaceOf(field_.plan_, octave, 2, slice);
  if (dims > 3) place_[2][k] = PlaceOf(field_.plan_, octave, 3, 0);
  if (!field_.collapses_) return;
  const auto place = [&](int axis) {
    const LatticePlace& at = place_[axis - 1][k];
    GridPlace g;
    g.hash[0] = at.cell * kAxis[axis];
    g.hash[1] = NextCell(at.cell, octave.period[axis]) * kAxis[axis];
    g.fraction = static_cast<float>(at.fraction);
    g.fade = FadeOf(g.fraction);
    return g;
  };
  if (dims > 2) rows_[k].fill.z = place(2);
  if (dims > 3) rows_[k].fill.w = place(3);
  rows_[k].valid = false;
}

float GridCursor::FadeOf(float fraction) const {
  float in[kNoisePadding] = {fraction}, out[kNoisePadding];
  field_.kernels_.fade(in, 1, field_.plan_.shape.fade, out);
  return out[0];
}

void GridCursor::Row(int y, float* out, float* const* slopes, bool stream, const float* const* moved) {
  if (y < slice_begin_ || y >= slice_end_) EnterSlice(y);
  row_ = y - slice_top_;
  const NoisePlan& plan = field_.plan_;
  const size_t octaves = plan.octaves.size();
  const int width = x1_ - x0_;
  if (slopes != nullptr) {
    for (int a = 0; a < plan.params.dims; ++a) std::fill_n(slopes[a], width, 0.0f);
  }
  if (field_.collapses_ && octaves > 0) {
    for (size_t k = 0; k < octaves; ++k) CollapsedRow(k, out, stream && octaves == 1);
  } else {
    std::fill_n(out, width, plan.bias);
    for (size_t k = 0; k < octaves; ++k) place_[0][k] = RowPlaceOf(k);
    if (plan.params.lattice == NoiseLattice::kPerlin && plan.params.warp == 0 && moved == nullptr) {
      PerlinRow(out, slopes);
    } else {
      BatchRow(y, out, slopes, moved);
    }
  }
  if (bent_ && slopes == nullptr) Finish(out);
}

// The lattice rows on both sides of an octave's row.
void GridCursor::FillLattice(Rows& rows, const uint32_t* hash) {
  GridRow& row = rows.row;
  const auto make = [&](uint32_t of, const GridLatticeRow& lattice) {
    rows.fill.row_hash = of;
    rows.fill.out = lattice;
    field_.grid_.fill(rows.fill);
  };
  if (rows.valid && hash[0] == rows.upper_hash) {
    std::swap(row.lower, row.upper);
  } else {
    make(hash[0], row.lower);
  }
  make(hash[1], row.upper);
  rows.lower_hash = hash[0];
  rows.upper_hash = hash[1];
  rows.valid = true;
}

// A row at a place between lattice rows, but for its pixels.
inline void GridCursor::Place(Rows& rows, const GridField::RowPlace& y, float* out, bool stream) {
  GridRow& row = rows.row;
  if (!rows.valid || y.hash[0] != rows.lower_hash || y.hash[1] != rows.upper_hash) {
    FillLattice(rows, y.hash);
  }
  row.fraction = y.fraction;
  row.fade = y.fade;
  row.out = out;
  row.stream = stream && reinterpret_cast<uintptr_t>(out) % 64 == 0;
}

void GridCursor::CollapsedRow(size_t k, float* out, bool stream) {
  Rows& rows = rows_[k];
  const std::vector<GridField::RowPlace>& known = field_.rows_[k].between;
  const auto index = static_cast<size_t>(row_ - field_.first_row_);
  GridField::RowPlace unknown;
  const GridField::RowPlace* y = &unknown;
  if (index < known.size()) {
    y = &known[index];
  } else {
    const LatticePlace place = RowPlaceOf(k);
    unknown = field_.Between(field_.plan_.octaves[k], place, FadeOf(static_cast<float>(place.fraction)));
  }
  Place(rows, *y, out, stream);
  if (field_.plan_.params.method == NoiseMethod::kAccumulate) {
    if (k == 0) std::fill_n(out, rows.row.count, rows.row.bias);
    return AccumulatedRow(rows.row, field_.columns_[k], out);
  }
  field_.grid_.row(rows.row);
}

void GridCursor::Run(int y0, int y1, float* out, ptrdiff_t stride, bool stream) {
  const NoisePlan& plan = field_.plan_;
  const bool collapsed = field_.collapses_ && plan.octaves.size() == 1 && !bent_ &&
                         plan.params.method != NoiseMethod::kAccumulate;
  for (int y = y0; y < y1; ++y, out += stride) {
    // Rows of one octave whose places are known: narrow ones take no longer than what Row() looks at.
    const int top = slice_top_ + field_.first_row_;
    if (collapsed && y >= std::max(slice_begin_, top) && y < slice_end_) {
      const std::vector<GridField::RowPlace>& known = field_.rows_[0].between;
      const int last = std::min({y1, slice_end_, top + static_cast<int>(known.size())});
      for (; y < last; ++y, out += stride) {
        Place(rows_[0], known[static_cast<size_t>(y - top)], out, stream);
        field_.grid_.row(rows_[0].row);
      }
      if (y == y1) return;
    }
    Row(y, out, nullptr, stream);
  }
}

// Adds a batch of an octave, in value_ and slope_, to a row's pixels from `at`.
void GridCursor::AddBatch(const NoiseOctave& octave, int at, int count, float* out, float* const* slopes) {
  const NoiseParams& p = field_.plan_.params;
  float padded[kNoiseBatch];
  std::copy_n(out + at, count, padded);
  field_.kernels_.accumulate({count, value_, p.sum, octave.weight, padded});
  std::copy_n(padded, count, out + at);
  const float weight = octave.weight * static_cast<float>(octave.scale);
  for (int a = 0; a < p.dims && slopes != nullptr; ++a) {
    float* const to = slopes[a] + at;
    for (int i = 0; i < count; ++i) to[i] += weight * (ShapeSlope(p.sum, value_[i]) * slope_[a][i]);
  }
}

// Moves the pixels of a batch, the first of which is the row's pixel `from`.
void GridCursor::Displace(const NoiseOctave& octave, int from, const float* const* moved, NoiseBatch& batch) {
  const NoisePlan& plan = field_.plan_;
  const NoiseParams& p = plan.params;
  std::copy_n(batch.cell[0], batch.count, cell_[0]);
  std::copy_n(batch.fraction[0], batch.count, fraction_[0]);
  batch.cell[0] = cell_[0];
  batch.fraction[0] = fraction_[0];
  const double width = std::max(p.frame.width(), 1);
  for (int a = 0; a < (moved != nullptr ? 2 : p.dims); ++a) {
    const float* const by = moved != nullptr ? moved[a] : warp_row_[static_cast<size_t>(a)];
    const double cells = moved != nullptr ? plan.step[a] * width : p.warp;
    field_.kernels_.displace({batch.count, by + from, static_cast<float>(cells * octave.lattice[a]),
                              octave.period[a], cell_[a], fraction_[a]});
  }
}

void GridCursor::BatchRow(int y, float* out, float* const* slopes, const float* const* moved) {
  const NoisePlan& plan = field_.plan_;
  const NoiseParams& p = plan.params;
  for (size_t a = 0; a < warp_.size(); ++a) warp_[a].Row(y, warp_row_[a]);
  NoiseBatch batch;
  batch.shape = &plan.shape;
  batch.value = value_;
  const bool with_slopes = slopes != nullptr && field_.slopes_;
  const bool displaced = moved != nullptr || !warp_.empty();
  for (int a = 0; a < p.dims && with_slopes; ++a) batch.slope[a] = slope_[a];
  for (size_t k = 0; k < plan.octaves.size(); ++k) {
    const NoiseOctave& octave = plan.octaves[k];
    const GridField::Columns& columns = field_.columns_[k];
    batch.seed = octave.seed;
    std::copy_n(octave.period, 4, batch.period);
    for (int x = x0_; x < x1_; x += kNoiseBatch) {
      const int count = std::min(kNoiseBatch, x1_ - x);
      const size_t from = static_cast<size_t>(x - field_.x0_);
      batch.count = count;
      batch.cell[0] = columns.cell.data() + from;
      batch.fraction[0] = columns.fraction.data() + from;
      for (int a = 1; a < p.dims; ++a) {
        if (x == x0_ || displaced) {
          const LatticePlace place = Whole(plan, place_[a - 1][k]);
          std::fill_n(cell_[a], kNoiseBatch, place.cell);
          std::fill_n(fraction_[a], kNoiseBatch, static_cast<float>(place.fraction));
        }
        batch.cell[a] = cell_[a];
        batch.fraction[a] = fraction_[a];
      }
      if (displaced) Displace(octave, x - x0_, moved, batch);
      if (field_.evaluate_ != nullptr) {
        field_.evaluate_(batch);
      } else {
        PerlinBatch(batch, p.dims);
      }
      AddBatch(octave, x - x0_, count, out, with_slopes ? slopes : nullptr);
    }
  }
}

void GridCursor::PerlinRow(float* out, float* const* slopes) {
  const NoisePlan& plan = field_.plan_;
  const NoiseParams& p = plan.params;
  double y[kNoiseBatch], z[kNoiseBatch];
  const bool with_slopes = slopes != nullptr && field_.slopes_;
  for (size_t k = 0; k < plan.octaves.size(); ++k) {
    const NoiseOctave& octave = plan.octaves[k];
    const auto coordinate = [&](int axis) {
      const LatticePlace& place = place_[axis - 1][k];
      return p.dims > axis ? (place.cell & 255) + place.fraction : 0.0;
    };
    std::fill_n(y, kNoiseBatch, coordinate(1));
    std::fill_n(z, kNoiseBatch, coordinate(2));
    for (int x = x0_; x < x1_; x += kNoiseBatch) {
      const int count = std::min(kNoiseBatch, x1_ - x);
      const double* const position = field_.columns_[k].position.data() + (x - field_.x0_);
      PerlinNoise(position, y, z, count, value_, with_slopes ? slope_ : nullptr);
      AddBatch(octave, x - x0_, count, out, with_slopes ? slopes : nullptr);
    }
  }
}

void GridCursor::Finish(float* out) const {
  for (int i = 0; i < x1_ - x0_; ++i) out[i] = BentValue(field_.plan_.params, out[i]);
}

}  // namespace tessera::ops
